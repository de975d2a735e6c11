// Triangles of a polygon with holes, by ear clipping on the 1 mm grid: every decision is exact.
// Header only, so that its test needs nothing but this file.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include "nav/geometry.hpp"

namespace sites {

// Indices into the vertices in this order: outer ring, then the holes one after the other.
using Triangle = std::array<int, 3>;

inline std::int64_t twice_area_mm2(const nav::Ring& ring) {
  std::int64_t sum = 0;
  for (std::size_t i = 0; i < ring.size(); ++i) {
    sum += nav::cross(ring[i], ring[(i + 1) % ring.size()]);
  }
  return sum;
}

// One polygon being cut up: a loop of vertex indices, in which bridges to holes appear twice.
class EarClipper {
 public:
  explicit EarClipper(const nav::Polygon& polygon) {
    twice_area_ = twice_area_mm2(polygon.outer);
    add_ring(polygon.outer, loop_);
    for (const nav::Ring& hole : polygon.holes) {
      twice_area_ += twice_area_mm2(hole);
      add_ring(hole, holes_.emplace_back());
    }
    if (twice_area_ <= 0) throw std::logic_error("triangulate: outer ring is not ccw");
  }

  std::vector<Triangle> run() {
    join_holes();
    std::vector<Triangle> triangles;
    while (loop_.size() > 2) triangles.push_back(clip_best_ear());
    std::int64_t sum = 0;
    for (const Triangle& t : triangles) sum += nav::side(at(t[0]), at(t[1]), at(t[2]));
    if (sum != twice_area_) throw std::logic_error("triangulate: areas differ");
    return triangles;
  }

 private:
  using Loop = std::vector<int>;

  void add_ring(const nav::Ring& ring, Loop& loop) {
    for (const nav::PointMm& point : ring) {
      loop.push_back(static_cast<int>(points_.size()));
      points_.push_back(point);
    }
  }

  const nav::PointMm& at(int index) const { return points_[static_cast<std::size_t>(index)]; }
  static std::size_t next(const Loop& loop, std::size_t i) { return (i + 1) % loop.size(); }
  static std::size_t previous(const Loop& loop, std::size_t i) {
    return (i + loop.size() - 1) % loop.size();
  }

  // Does the direction from the loop's corner i to b point into the polygon (O'Rourke's InCone)?
  bool opens_towards(const Loop& loop, std::size_t i, nav::PointMm b) const {
    const nav::PointMm a = at(loop[i]);
    const nav::PointMm before = at(loop[previous(loop, i)]);
    const nav::PointMm after = at(loop[next(loop, i)]);
    if (nav::side(before, a, after) >= 0) {
      return nav::side(a, b, before) > 0 && nav::side(b, a, after) > 0;
    }
    return !(nav::side(a, b, after) >= 0 && nav::side(b, a, before) >= 0);
  }

  static bool on_segment(nav::PointMm a, nav::PointMm b, nav::PointMm p) {
    return nav::side(a, b, p) == 0 && nav::dot(a - p, b - p) <= 0;
  }

  // Edges that start or end in a or b are left to opens_towards().
  bool crosses(const Loop& loop, nav::PointMm a, nav::PointMm b) const {
    for (std::size_t i = 0; i < loop.size(); ++i) {
      const nav::PointMm c = at(loop[i]);
      const nav::PointMm d = at(loop[next(loop, i)]);
      if (c != a && c != b && on_segment(a, b, c)) return true;
      if (c == a || c == b || d == a || d == b) continue;
      if (on_segment(c, d, a) || on_segment(c, d, b)) return true;
      const bool split_ab = (nav::side(a, b, c) > 0) != (nav::side(a, b, d) > 0);
      const bool split_cd = (nav::side(c, d, a) > 0) != (nav::side(c, d, b) > 0);
      if (split_ab && split_cd) return true;
    }
    return false;
  }

  bool sees(std::size_t i, const Loop& hole, std::size_t j) const {
    const nav::PointMm a = at(loop_[i]);
    const nav::PointMm b = at(hole[j]);
    if (a == b || !opens_towards(loop_, i, b) || !opens_towards(hole, j, a)) return false;
    return !crosses(loop_, a, b) &&
           std::none_of(holes_.begin(), holes_.end(),
                        [&](const Loop& other) { return crosses(other, a, b); });
  }

  // Cuts the loop open at i and the hole at j, and runs one into the other.
  void bridge(std::size_t i, const Loop& hole, std::size_t j) {
    Loop inserted;
    for (std::size_t k = 0; k <= hole.size(); ++k) inserted.push_back(hole[(j + k) % hole.size()]);
    inserted.push_back(loop_[i]);
    loop_.insert(loop_.begin() + static_cast<std::ptrdiff_t>(i) + 1, inserted.begin(),
                 inserted.end());
  }

  // Nearest pair of corners that see each other; ties go to the lowest index.
  void join_holes() {
    while (!holes_.empty()) {
      struct Pair {
        std::int64_t distance{};
        std::size_t i{}, hole{}, j{};
        auto operator<=>(const Pair&) const = default;
      };
      std::vector<Pair> pairs;
      for (std::size_t i = 0; i < loop_.size(); ++i) {
        for (std::size_t h = 0; h < holes_.size(); ++h) {
          for (std::size_t j = 0; j < holes_[h].size(); ++j) {
            const nav::PointMm d = at(loop_[i]) - at(holes_[h][j]);
            pairs.push_back({nav::dot(d, d), i, h, j});
          }
        }
      }
      std::sort(pairs.begin(), pairs.end());
      const auto found = std::find_if(pairs.begin(), pairs.end(), [&](const Pair& p) {
        return sees(p.i, holes_[p.hole], p.j);
      });
      if (found == pairs.end()) throw std::logic_error("triangulate: a hole touches the outline");
      const Loop hole = holes_[found->hole];
      holes_.erase(holes_.begin() + static_cast<std::ptrdiff_t>(found->hole));
      bridge(found->i, hole, found->j);
    }
  }

  bool is_ear(std::size_t i) const {
    const nav::PointMm a = at(loop_[previous(loop_, i)]);
    const nav::PointMm b = at(loop_[i]);
    const nav::PointMm c = at(loop_[next(loop_, i)]);
    if (nav::side(a, b, c) <= 0) return false;
    return std::none_of(loop_.begin(), loop_.end(), [&](int index) {
      const nav::PointMm p = at(index);
      return p != a && p != b && p != c && nav::side(a, b, p) >= 0 && nav::side(b, c, p) >= 0 &&
             nav::side(c, a, p) >= 0;
    });
  }

  // The ear with the shortest cut keeps the triangles plump.
  Triangle clip_best_ear() {
    std::size_t best = loop_.size();
    std::int64_t best_cut = 0;
    for (std::size_t i = 0; i < loop_.size(); ++i) {
      const nav::PointMm cut = at(loop_[next(loop_, i)]) - at(loop_[previous(loop_, i)]);
      const std::int64_t length = nav::dot(cut, cut);
      if ((best == loop_.size() || length < best_cut) && is_ear(i)) {
        best = i;
        best_cut = length;
      }
    }
    if (best == loop_.size()) throw std::logic_error("triangulate: the outline crosses itself");
    const Triangle ear{loop_[previous(loop_, best)], loop_[best], loop_[next(loop_, best)]};
    loop_.erase(loop_.begin() + static_cast<std::ptrdiff_t>(best));
    return ear;
  }

  std::vector<nav::PointMm> points_;
  Loop loop_;
  std::vector<Loop> holes_;
  std::int64_t twice_area_{};
};

// Counter-clockwise triangles that cover the polygon and use every edge of it once. The outer ring
// is counter-clockwise, holes clockwise, nothing touches. Throws std::logic_error otherwise.
inline std::vector<Triangle> triangulate(const nav::Polygon& polygon) {
  return EarClipper(polygon).run();
}

}  // namespace sites
