// Where there is most room.
#pragma once

#include "nav/geometry.hpp"

namespace nav {

// A point whose distance to the nearest border is within precision_m of the largest that any point
// inside has (the pole of inaccessibility), found by halving squares, the most promising first.
// The same polygons give the same point. At least one polygon of some width; precision_m > 0.
PointMm innermost(const Polygons& polygons, double precision_m);

}  // namespace nav
