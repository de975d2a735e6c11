// TSPLIB instances with known optima, for tests and benchmarks; kept beside the project.
#pragma once

#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>

#include "tools/tsplib.hpp"

namespace support {

inline planning::TourProblem tsp_problem(const std::filesystem::path& file) {
  const tools::LoadedTsp loaded = tools::load_tsp(file);
  if (!loaded.errors.empty()) throw std::runtime_error(loaded.errors.front().text());
  return loaded.tsp.problem;
}

// Name -> length of the shortest tour, from optima.csv.
inline std::map<std::string, double> tsp_optima(const std::filesystem::path& file) {
  std::map<std::string, double> optima;
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);  // The columns' names.
  while (std::getline(in, line))
    optima[line.substr(0, line.find(','))] = std::stod(line.substr(line.rfind(',') + 1));
  return optima;
}

}  // namespace support
