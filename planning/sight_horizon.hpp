// Which walls cannot be in sight because nearer ones hide them wholly: a rough answer, quickly
// given, that never calls a wall hidden which is not. What it lets through, the sweep decides.
//
// All directions are cut into sectors. Along the directions of a sector, taken of length 1 in the
// norm |x| + |y|, the nearness of a wall (1 / distance in that norm) is linear, so that it lies
// between its values at the sector's two borders. A wall that spans a sector hides there all that
// is less near than its lesser value. Margins account for rounding.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "nav/box_tree.hpp"
#include "planning/sight_sweep.hpp"

namespace planning {

class Horizon {
 public:
  // Whether walls added before hide all of this one; if not, it is added.
  bool hides_or_adds(const SightEdge& edge) {
    const Line line(edge);
    const double from = kPerKey * angle_key(edge.p);
    double to = kPerKey * angle_key(edge.q);
    if (to < from) to += kSectors;
    const int first = sector_of(from - kKeyMargin), last = sector_of(to + kKeyMargin);
    double at_border = line.nearness(border(first));
    bool hidden = true;
    for (int s = first; hidden && s <= last; ++s) {
      const double at_next = line.nearness(border(s + 1));
      hidden = nearness_[index(s)] > std::max(at_border, at_next) + line.margin;
      at_border = at_next;
    }
    if (!hidden) add(edge, line, sector_of(from + kKeyMargin) + 1, sector_of(to - kKeyMargin));
    return hidden;
  }

  // Whether walls added hide all of the box, given relative to the viewpoint.
  bool hides(const nav::Box2& box) const {
    const double x0 = box.min.x(), y0 = box.min.y(), x1 = box.max.x(), y1 = box.max.y();
    const double distance = std::max({0.0, x0, -x1}) + std::max({0.0, y0, -y1});
    if (distance <= 0) return false;
    const double nearness = (1 + kRounding) / distance;
    // The corners that bound it, the clockwise one first.
    const Eigen::Vector2d p(y0 > 0             ? x1
                            : y1 < 0 || x0 > 0 ? x0
                                               : x1,
                            x0 > 0 || (x1 >= 0 && y0 > 0) ? y0 : y1);
    const Eigen::Vector2d q(y1 < 0             ? x1
                            : y0 > 0 || x0 > 0 ? x0
                                               : x1,
                            x1 < 0 || (x0 <= 0 && y0 > 0) ? y0 : y1);
    const double from = kPerKey * angle_key(p.x(), p.y());
    double to = kPerKey * angle_key(q.x(), q.y());
    if (to < from) to += kSectors;
    for (int s = sector_of(from - kKeyMargin); s <= sector_of(to + kKeyMargin); ++s)
      if (nearness_[index(s)] <= nearness) return false;
    return true;
  }

 private:
  static constexpr int kSectors = 1024;
  static constexpr double kPerKey = kSectors / 4;
  static constexpr double kKeyMargin = 1e-9;  // Of angle_key, in sectors.
  static constexpr double kRounding = 2e-15;

  // Of length 1 in the norm; exact.
  struct Direction {
    double x, y;
  };

  struct Line {
    double x, y;    // Nearness is linear in the direction.
    double margin;  // More than it may be wrong by.

    explicit Line(const SightEdge& edge) {
      const auto turn = static_cast<double>(nav::cross(edge.p, edge.q));
      const nav::PointMm along = edge.p - edge.q;
      x = -static_cast<double>(along.y) / turn;
      y = static_cast<double>(along.x) / turn;
      margin = kRounding * (std::abs(x) + std::abs(y));
    }
    double nearness(Direction d) const { return x * d.x + y * d.y; }
  };

  static int sector_of(double place) { return static_cast<int>(std::floor(place)); }
  static std::size_t index(int sector) { return static_cast<std::size_t>(sector) & (kSectors - 1); }
  // Where a sector begins: angle_key there is sector / kPerKey.
  static Direction border(int sector) {
    const double key = static_cast<double>(index(sector)) / kPerKey;
    const double x = key < 2 ? 1 - key : key - 3;
    return {x, key < 2 ? 1 - std::abs(x) : std::abs(x) - 1};
  }

  // A wall that covers a sector from one of its borders to `end`.
  struct Part {
    double nearness = 0;  // At least; 0: there is none.
    nav::PointMm end;
  };

  // The wall spans the sectors from first to before last, and parts of those beside them.
  void add(const SightEdge& edge, const Line& line, int first, int last) {
    if (first > last) return;
    double at_border = line.nearness(border(first));
    add_part(upper_[index(first - 1)],
             {std::min(at_border, nearness(edge.p)) - line.margin, edge.p}, first - 1);
    for (int s = first; s < last; ++s) {
      const double at_next = line.nearness(border(s + 1));
      raise(s, std::min(at_border, at_next) - line.margin);
      at_border = at_next;
    }
    add_part(lower_[index(last)], {std::min(at_border, nearness(edge.q)) - line.margin, edge.q},
             last);
  }

  static double nearness(nav::PointMm p) {
    return 1 / (std::abs(static_cast<double>(p.x)) + std::abs(static_cast<double>(p.y)));
  }

  void raise(int sector, double nearness) {
    double& known = nearness_[index(sector)];
    known = std::max(known, nearness);
  }

  // Two parts that meet, as walls do in a corner, hide as one wall does.
  void add_part(Part& known, const Part& part, int sector) {
    if (part.nearness <= known.nearness) return;
    known = part;
    const Part &lower = lower_[index(sector)], &upper = upper_[index(sector)];
    if (lower.nearness > 0 && upper.nearness > 0 && nav::cross(upper.end, lower.end) >= 0)
      raise(sector, std::min(lower.nearness, upper.nearness));
  }

  std::array<double, kSectors> nearness_{};  // Of what hides all behind it in a sector; 0: nothing.
  std::array<Part, kSectors> lower_{};       // From the sector's first border on.
  std::array<Part, kSectors> upper_{};       // Up to its last border.
};

}  // namespace planning
