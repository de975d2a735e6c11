// Takes the odd wiggles of a Voronoi road out of a route.
#pragma once

#include <functional>
#include <vector>

#include "nav/segment_distance.hpp"

namespace nav {

double polyline_length_m(const std::vector<Eigen::Vector2d>& points_m);

// Least distance along a piece to anything in the way, or cap_m if that is less.
using ClearanceOf = std::function<double(const Segment2& piece_m, double cap_m)>;

// Replaces parts of the polyline by straight lines. Such a line keeps comfort_m, or the clearance
// of the part it replaces if that is less. End points stay; the result is never longer.
std::vector<Eigen::Vector2d> take_shortcuts(const std::vector<Eigen::Vector2d>& points_m,
                                            double comfort_m, const ClearanceOf& clearance_of);

}  // namespace nav
