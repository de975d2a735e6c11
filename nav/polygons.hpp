// Set operations on polygons, exact to the 1 mm grid (Clipper underneath).
#pragma once

#include "nav/geometry.hpp"

namespace nav {

Polygons unite(const Polygons& a, const Polygons& b);
Polygons intersect(const Polygons& a, const Polygons& b);
Polygons subtract(const Polygons& a, const Polygons& b);
// Grows (> 0) or shrinks (< 0) by distance_mm with round corners (arc error <= 10 mm).
Polygons offset(const Polygons& polygons, std::int64_t distance_mm);
// Even-odd / non-zero union of raw rings, oriented: the repair of self-intersecting outlines.
Polygons normalise(const std::vector<Ring>& rings);

double area_m2(const Polygons& polygons);
// On the border counts as inside.
bool contains(const Polygons& polygons, PointMm point);
// Every edge, inside on the left.
std::vector<SegmentMm> edges(const Polygons& polygons);

}  // namespace nav
