// Set operations on polygons, exact to the 1 mm grid.
//
// Every Polygons returned here is clean: outer rings counter-clockwise, holes clockwise; edges meet
// only in their end points; no ring visits a vertex twice; rings thinner than kSliverWidthMm on
// average are dropped; the same set gives the same order of polygons, rings and vertices. New
// vertices are rounded to the grid, which moves borders by up to 1 mm.
//
// Arguments have outer rings and holes that do not overlap (their orientation does not matter).
// A coordinate beyond kCoordinateMax throws std::out_of_range.
#pragma once

#include "nav/geometry.hpp"

namespace nav {

Polygons unite(const Polygons& a, const Polygons& b);
// The union of all, in one go; unlike elsewhere the polygons may overlap.
Polygons unite(const std::vector<Polygons>& all);
Polygons intersect(const Polygons& a, const Polygons& b);
Polygons subtract(const Polygons& a, const Polygons& b);
// Grows (> 0) or shrinks (< 0) by distance_mm with round corners. Arcs are drawn as tangents, so
// that corners keep their distance, and up to 10 mm more.
Polygons offset(const Polygons& polygons, std::int64_t distance_mm);
// A wall along each line, half_width_mm to either side of it and beyond its ends.
Polygons thicken(const std::vector<Ring>& lines, std::int64_t half_width_mm);

// Which points a ring that crosses itself encloses: those it winds round (non_zero: loops are
// filled, both wings of a bow-tie count) or winds round an odd number of times (even_odd).
enum class FillRule { non_zero, even_odd };
Polygons fill(const Ring& ring, FillRule rule);
// The repair of raw outlines in any orientation: each ring encloses what it winds round (non-zero),
// then a ring inside another is a hole in it (even-odd).
Polygons normalise(const std::vector<Ring>& rings);
// Makes every given point that lies within 1 mm of an edge a vertex there (bending the edge to it).
Polygons with_vertices(const Polygons& polygons, const std::vector<PointMm>& points);

double area_m2(const Polygons& polygons);
double perimeter_m(const Polygons& polygons);
// On the border counts as inside.
bool contains(const Polygons& polygons, PointMm point);
// Distance from the point to the nearest border, inside or outside; infinite without any edge.
double border_distance_m(const Polygons& polygons, PointMm point);
double distance_m(const SegmentMm& segment, PointMm point);
// Every edge, inside on the left.
std::vector<SegmentMm> edges(const Polygons& polygons);

}  // namespace nav
