// Reads TSPLIB95 instances: EUC_2D, CEIL_2D, ATT, GEO and EXPLICIT.
#pragma once

#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "planning/tour.hpp"

namespace support {

struct TspFile {
  std::map<std::string, std::string> header;
  std::vector<std::pair<double, double>> points;
  std::vector<double> weights;
};

inline TspFile read_tsp(const std::filesystem::path& file) {
  std::ifstream in(file);
  if (!in) throw std::runtime_error("cannot read " + file.string());
  TspFile tsp;
  std::string section;
  for (std::string line; std::getline(in, line);) {
    const auto colon = line.find(':');
    std::istringstream words(line);
    double number = 0, x = 0, y = 0;
    if (colon != std::string::npos) {
      const auto trim = [](std::string s) {
        s.erase(0, s.find_first_not_of(" \t"));
        s.erase(s.find_last_not_of(" \t\r") + 1);
        return s;
      };
      tsp.header[trim(line.substr(0, colon))] = trim(line.substr(colon + 1));
    } else if (std::isalpha(static_cast<unsigned char>(line.empty() ? ' ' : line[0]))) {
      words >> section;
    } else if (section == "NODE_COORD_SECTION") {
      if (words >> number >> x >> y) tsp.points.emplace_back(x, y);
    } else if (section == "EDGE_WEIGHT_SECTION") {
      while (words >> number) tsp.weights.push_back(number);
    }
  }
  return tsp;
}

inline double geo_radians(double degrees_minutes) {
  const double pi = 3.141592;  // As TSPLIB defines it.
  const double degrees = std::trunc(degrees_minutes);
  return pi * (degrees + 5.0 * (degrees_minutes - degrees) / 3.0) / 180.0;
}

inline double tsp_distance(const std::string& type, std::pair<double, double> a,
                           std::pair<double, double> b) {
  const double d = std::hypot(a.first - b.first, a.second - b.second);
  if (type == "EUC_2D") return std::floor(d + 0.5);
  if (type == "CEIL_2D") return std::ceil(d);
  if (type == "ATT") return std::ceil(d / std::sqrt(10.0));
  if (type != "GEO") throw std::runtime_error("unknown EDGE_WEIGHT_TYPE " + type);
  const double q1 = std::cos(geo_radians(a.second) - geo_radians(b.second));
  const double q2 = std::cos(geo_radians(a.first) - geo_radians(b.first));
  const double q3 = std::cos(geo_radians(a.first) + geo_radians(b.first));
  return std::floor(6378.388 * std::acos(0.5 * ((1 + q1) * q2 - (1 - q1) * q3)) + 1);
}

inline void fill_explicit(const TspFile& tsp, std::vector<std::vector<double>>& cost) {
  const std::string format = tsp.header.at("EDGE_WEIGHT_FORMAT");
  const std::size_t n = cost.size();
  std::size_t next = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const bool upper = format.starts_with("UPPER");
    const bool diagonal = format.find("DIAG") != std::string::npos;
    std::size_t from = 0, to = n;
    if (upper) from = diagonal ? i : i + 1;
    if (format.starts_with("LOWER")) to = diagonal ? i + 1 : i;
    for (std::size_t j = from; j < to; ++j) {
      const double w = tsp.weights.at(next++);
      cost[i][j] = w;
      if (format != "FULL_MATRIX") cost[j][i] = w;
    }
  }
}

inline planning::TourProblem tsp_problem(const std::filesystem::path& file) {
  const TspFile tsp = read_tsp(file);
  const auto n = static_cast<std::size_t>(std::stoi(tsp.header.at("DIMENSION")));
  planning::TourProblem problem;
  problem.cost.assign(n, std::vector<double>(n, 0));
  const std::string type = tsp.header.at("EDGE_WEIGHT_TYPE");
  if (type == "EXPLICIT") {
    fill_explicit(tsp, problem.cost);
    return problem;
  }
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j < n; ++j)
      if (i != j) problem.cost[i][j] = tsp_distance(type, tsp.points.at(i), tsp.points.at(j));
  return problem;
}

// Name -> length of the shortest tour, from optima.csv.
inline std::map<std::string, double> tsp_optima(const std::filesystem::path& file) {
  std::map<std::string, double> optima;
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    std::istringstream fields(line);
    std::string name, field;
    std::getline(fields, name, ',');
    for (; std::getline(fields, field, ',');)
      if (!field.empty() && std::isdigit(static_cast<unsigned char>(field[0])))
        optima[name] = std::stod(field);
  }
  return optima;
}

}  // namespace support
