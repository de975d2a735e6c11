// Line of sight from a point to walls, exactly: integers decide, on every machine alike.
//
// A point of a wall is in sight of v if v lies strictly on the wall's free side and no other wall
// meets the open segment between them; isolated points aside (a segment that only touches a corner
// counts for neither side of the argument). Every wall hides what is behind it, from whichever side
// one looks; a wall seen edge-on hides nothing and is not in sight. A point on a wall sees nothing.
//
// Walls may share ends, touch, overlap or cross in any way. The angular sweep needs walls that
// neither cross nor overlap, so a few are set aside until none of the others do ("tangled";
// repaired maps have none but where rounding to the grid bent an edge); the shadows of these, and
// what hides them, are worked out pair by pair. The result is the same set, at a cost of
// O(tangled * n). Most walls that nearer ones hide wholly are left out before (sight_horizon.hpp),
// which changes no result.
#pragma once

#include <cstdint>
#include <vector>

#include "nav/box_tree.hpp"
#include "nav/geometry.hpp"

namespace planning {

// A straight piece of obstacle boundary, as nav::edges gives it: the obstacle on the left of
// a -> b, the free side, which can be imaged, on the right.
struct Wall {
  nav::PointMm a, b;
  bool target = true;  // Counts for coverage; occludes either way.

  double length_m() const { return nav::length_m(a, b); }
};

// A place on a wall: num / den of the way from a to b. 0 <= num <= den, 0 < den.
struct Share {
  std::int64_t num = 0;
  std::int64_t den = 1;
};
bool operator<(Share s, Share t);
// Correctly rounded, so that it depends on the value only and not on how it is written.
double value(Share share);

// The places t of a wall where some linear functions of t are all positive; an open interval.
struct ShareRange {
  Share from{0, 1};
  Share to{1, 1};

  bool empty() const { return !(from < to); }
  // Keeps the places with at_a + t * slope > 0.
  void restrict(std::int64_t at_a, std::int64_t slope);
};

struct SharePiece {
  int wall{};
  Share from, to;
};

struct SightEdge;

class Sight {
 public:
  // Walls without length are ignored.
  explicit Sight(const std::vector<Wall>& walls);

  // The parts of target walls in sight of v, in order of wall and place, as long as possible. Only
  // parts within reach_mm of v are sure to be right: walls farther away are left out.
  std::vector<SharePiece> from(nav::PointMm v, double reach_mm) const;

  // Walls that cross or overlap others; see above.
  const std::vector<int>& tangled() const { return tangled_; }

 private:
  // The walls within reach of v, nearly, that are not wholly hidden, nearly; false if v is on one.
  bool gather(nav::PointMm v, double reach_mm, std::vector<SightEdge>& clear,
              std::vector<SightEdge>& tangled) const;

  std::vector<Wall> walls_;
  nav::BoxTree tree_;
  std::vector<int> tangled_;
  std::vector<char> is_tangled_;
};

}  // namespace planning
