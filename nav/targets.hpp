// Which walls count: where to cut obstacle edges so that each counts as a whole or not at all.
#pragma once

#include <vector>

#include "nav/geometry.hpp"
#include "nav/site_map.hpp"

namespace nav {

// Whether the whole edge runs within kTargetReachM of the target line, at an angle below 30 deg.
bool runs_along(const SegmentMm& edge, const SegmentMm& target);

// Where obstacle edges begin or cease to run along a target line; to the grid.
std::vector<PointMm> cuts_at_targets(const Polygons& obstacles,
                                     const std::vector<SegmentMm>& targets);

// Where obstacle edges meet the boundary.
std::vector<PointMm> cuts_at_boundary(const Polygons& obstacles, const Polygons& boundary);

// Length of the obstacle edges that run along any of the targets.
double length_along_m(const Polygons& obstacles, const std::vector<SegmentMm>& targets);

}  // namespace nav
