// Real outlines: one ring, one feature.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "nav/geometry.hpp"

namespace nav {

// What the rings drawn became. Repairs and errors name the ring, not the feature.
struct RepairedOutline {
  Polygons area;
  std::vector<std::string> repairs;
  std::vector<std::string> reversals;  // Rings that ran the wrong way round: harmless and frequent.
  std::vector<std::string> errors;     // Not empty: `area` means nothing.
};

// polygon -> ring -> vertex in metres; the first ring of a polygon is its outline, the others are
// holes. Parts that overlap are united.
RepairedOutline repair_outline(
    const std::vector<std::vector<std::vector<Eigen::Vector2d>>>& polygons_m);

// An open line on the grid, without repeated vertices; empty when it has no length or an error.
struct RepairedLine {
  Ring line;
  std::string error;
};
RepairedLine repair_line(const std::vector<Eigen::Vector2d>& line_m);

// Drawn coordinates reach this far, so that what is built around them stays below kCoordinateMax.
inline constexpr double kDrawnMaxM = 200e3;

// "" for a point that may be drawn, otherwise what is wrong with it and the remedy.
std::string range_error(const Eigen::Vector2d& point_m);

}  // namespace nav
