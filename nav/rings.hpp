// Clean polygons out of any rings: the overlay that every set operation is made of.
#pragma once

#include <vector>

#include "nav/geometry.hpp"

namespace nav {

// Where two edges meet other than end to end.
struct Contact {
  int first{}, second{};  // Indices of the two edges, first < second.
  PointMm point;          // On both edges; rounded to the grid where they cross.
  bool crossing{};        // Interiors cross at one point; otherwise an end lies inside an edge.
};

// Every contact between two of the edges (a collinear overlap yields its ends). Edges without
// length have none. Exact. O(n^2) at worst, near n log n for edges that are short against the site.
std::vector<Contact> contacts(const std::vector<SegmentMm>& edges);

// Twice the signed area in mm^2, exact; > 0 counter-clockwise.
std::int64_t twice_area_mm2(const Ring& ring);

// -1 outside, 0 on the ring, 1 inside. Exact.
int locate(const Ring& ring, PointMm point);

// Rings thinner than this on average (2 x area / perimeter) are noise of the grid and dropped.
inline constexpr double kSliverWidthMm = 2.0;

// Which points belong to the result, by how often ring sets a and b wind round them
// (counter-clockwise positive). inside(0, 0) must be false.
using Inside = bool (*)(int winding_a, int winding_b);

// Whether a vertex inside a straight line is dropped from the result, unless rings touch there.
enum class Straight { drop, keep };

// The points of the plane where inside() holds, as polygons. Takes any rings: crossing, touching,
// doubled, of any orientation. Crossings become vertices, rounded to the grid, which moves edges by
// up to 1 mm; everything after that is exact. In the result edges meet only in their end points, no
// ring visits a vertex twice, slivers are dropped, and the same set comes out in the same order.
Polygons overlay(const std::vector<Ring>& a, const std::vector<Ring>& b, Inside inside,
                 Straight straight = Straight::drop);

}  // namespace nav
