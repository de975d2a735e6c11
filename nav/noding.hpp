// Makes outlines fit for a segment Voronoi diagram: pieces that meet in common end points only.
#pragma once

#include <vector>

#include "nav/geometry.hpp"

namespace nav {

// A piece of an outline, the inside on its left, unless `doubtful`: where outlines crossed or ran
// over each other (rounding to the grid does that to thin wedges), left and right say nothing.
struct OutlinePiece {
  PointMm a, b;
  bool doubtful{};
};

// Splits the segments wherever two of them touch, cross or overlap; crossings are rounded to the
// grid, which moves a piece by less than 1 mm. The result has no piece of length zero and none
// twice, is sorted, and no two pieces meet but in end points that both have.
// Throws std::runtime_error when splitting does not settle (never seen).
std::vector<OutlinePiece> node_outlines(const std::vector<SegmentMm>& segments);

}  // namespace nav
