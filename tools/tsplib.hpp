// TSPLIB95 instances: the travelling salesperson's problems that tours are measured by.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "mission/config.hpp"
#include "planning/tour.hpp"

namespace tools {

struct TspInstance {
  std::string name;
  planning::TourProblem problem;  // Closed; starts at node 1 of the file, index 0.
};

struct LoadedTsp {
  TspInstance tsp;
  std::vector<mission::ConfigError> errors;  // Not empty: the instance cannot be used.
};

// Costs are a matrix: 128 MB at this size.
inline constexpr int kTspNodesMax = 4000;
// Coordinates and weights beyond this (either sign) are refused.
inline constexpr double kTspNumberMax = 1e12;

// Reads TYPE TSP and ATSP with EDGE_WEIGHT_TYPE EUC_2D, MAN_2D, MAX_2D, CEIL_2D, ATT, GEO or
// EXPLICIT in any EDGE_WEIGHT_FORMAT but FUNCTION; sections for display are passed over. Never
// throws for what the text says: stops at the first error, which names line, field, value and
// remedy. `file` is for the errors.
LoadedTsp parse_tsp(std::string_view text, const std::string& file);
LoadedTsp load_tsp(const std::filesystem::path& file);

}  // namespace tools
