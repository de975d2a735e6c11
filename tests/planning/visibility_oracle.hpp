// Line of sight worked out slowly, twice, by methods that have nothing in common with the sweep.
#pragma once

#include <algorithm>
#include <boost/multiprecision/cpp_int.hpp>
#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include "nav/geometry.hpp"
#include "planning/visibility.hpp"

namespace oracle {

using nav::PointMm;
using planning::Wall;
using planning::WallPiece;
using Big = boost::multiprecision::int512_t;
__extension__ using Int128 = __int128;

// num / den, den > 0.
struct Ratio {
  std::int64_t num{}, den{1};

  friend bool operator<(const Ratio& a, const Ratio& b) {
    return Int128{a.num} * b.den < Int128{b.num} * a.den;
  }
  friend bool operator==(const Ratio& a, const Ratio& b) { return !(a < b) && !(b < a); }
};

inline Ratio ratio(std::int64_t num, std::int64_t den) {
  return den < 0 ? Ratio{-num, -den} : Ratio{num, den};
}

// Long division, bit by bit; rounds half to even. 0 <= num <= den.
inline double nearest_double(const Ratio& r) {
  if (r.num == 0) return 0;
  Big rest = r.num;
  int exponent = 0;
  for (; rest < r.den; --exponent) rest *= 2;
  std::uint64_t bits = 0;
  for (int i = 0; i < 53; ++i) {
    bits = 2 * bits + (rest >= r.den ? 1 : 0);
    if (rest >= r.den) rest -= r.den;
    rest *= 2;
  }
  if (rest > r.den || (rest == r.den && bits % 2 == 1)) ++bits;
  return std::ldexp(static_cast<double>(bits), exponent - 52);
}

inline bool faces(const Wall& wall, PointMm v) {
  return nav::side(wall.a, wall.b, v) < 0;
}

inline bool on_any_wall(PointMm v, const std::vector<Wall>& walls) {
  return std::any_of(walls.begin(), walls.end(), [&](const Wall& w) {
    return w.a != w.b && nav::side(w.a, w.b, v) == 0 && nav::dot(w.a - v, w.b - v) <= 0;
  });
}

struct Stretch {
  Ratio from, to;
};

inline void append(const std::vector<Stretch>& parts, int wall, const std::vector<Wall>& walls,
                   std::vector<WallPiece>& pieces) {
  const double length_m = walls[static_cast<std::size_t>(wall)].length_m();
  for (const Stretch& part : parts) {
    const double from_m = nearest_double(part.from) * length_m;
    const double to_m = nearest_double(part.to) * length_m;
    if (from_m < to_m) pieces.push_back({wall, from_m, to_m});
  }
}

// The open stretch of w that u hides from v: where the point lies in u's wedge and beyond u's line.
inline std::optional<Stretch> shadow(PointMm v, const Wall& u, const Wall& w) {
  const std::int64_t turn = nav::side(v, u.a, u.b);
  if (turn == 0) return std::nullopt;
  const std::int64_t s = turn > 0 ? 1 : -1;
  Stretch in{{0, 1}, {1, 1}};
  // Each needs f > 0 with f linear along w, from f(w.a) to f(w.b).
  const std::int64_t limits[3][2] = {
      {s * nav::side(v, u.a, w.a), s * nav::side(v, u.a, w.b)},
      {s * nav::side(u.b, v, w.a), s * nav::side(u.b, v, w.b)},
      {-s * nav::side(u.a, u.b, w.a), -s * nav::side(u.a, u.b, w.b)},
  };
  for (const auto& [at_a, at_b] : limits) {
    if (at_a <= 0 && at_b <= 0) return std::nullopt;
    if (at_a < 0) in.from = std::max(in.from, ratio(at_a, at_a - at_b));
    if (at_b < 0) in.to = std::min(in.to, ratio(at_a, at_a - at_b));
  }
  if (!(in.from < in.to)) return std::nullopt;
  return in;
}

// Every wall's shadow on every other: what they leave.
inline std::vector<WallPiece> sight_by_shadows(PointMm v, const std::vector<Wall>& walls) {
  std::vector<WallPiece> pieces;
  if (on_any_wall(v, walls)) return pieces;
  for (std::size_t i = 0; i < walls.size(); ++i) {
    if (!walls[i].target || !faces(walls[i], v)) continue;
    std::vector<Stretch> hidden;
    for (const Wall& u : walls)
      if (const auto stretch = shadow(v, u, walls[i])) hidden.push_back(*stretch);
    std::sort(hidden.begin(), hidden.end(),
              [](const Stretch& s, const Stretch& t) { return s.from < t.from; });
    std::vector<Stretch> left;
    Ratio at{0, 1};
    for (const Stretch& h : hidden) {
      if (at < h.from) left.push_back({at, h.from});
      at = std::max(at, h.to);
    }
    if (at < Ratio{1, 1}) left.push_back({at, {1, 1}});
    append(left, static_cast<int>(i), walls, pieces);
  }
  return pieces;
}

// Whether a wall meets the open segment from v to p = (x, y) / scale (all relative to v), p aside.
inline bool blocks(const Wall& u, PointMm v, const Big& x, const Big& y, const Big& scale) {
  const Big ax = u.a.x - v.x, ay = u.a.y - v.y, bx = u.b.x - v.x, by = u.b.y - v.y;
  const Big a_of_ray = x * ay - y * ax, b_of_ray = x * by - y * bx;
  if ((a_of_ray > 0) == (b_of_ray > 0) || a_of_ray == 0 || b_of_ray == 0) return false;
  const Big origin = (bx - ax) * -ay - (by - ay) * -ax;  // Side of v, times 1.
  const Big point = (bx - ax) * (y - ay * scale) - (by - ay) * (x - ax * scale);
  return (origin > 0 && point < 0) || (origin < 0 && point > 0);
}

// Cuts every wall wherever anything could change and asks in the middle of every part, ray by ray.
// O(n^3).
inline std::vector<WallPiece> sight_by_cells(PointMm v, const std::vector<Wall>& walls) {
  std::vector<WallPiece> pieces;
  if (on_any_wall(v, walls)) return pieces;
  for (std::size_t i = 0; i < walls.size(); ++i) {
    const Wall& w = walls[i];
    if (!w.target || !faces(w, v)) continue;
    std::vector<Ratio> cuts{{0, 1}, {1, 1}};
    const auto cut = [&](std::int64_t at_a, std::int64_t at_b) {
      if ((at_a < 0 && at_b > 0) || (at_a > 0 && at_b < 0))
        cuts.push_back(ratio(at_a, at_a - at_b));
    };
    for (const Wall& u : walls) {
      cut(nav::side(v, u.a, w.a), nav::side(v, u.a, w.b));
      cut(nav::side(v, u.b, w.a), nav::side(v, u.b, w.b));
      cut(nav::side(u.a, u.b, w.a), nav::side(u.a, u.b, w.b));
    }
    std::sort(cuts.begin(), cuts.end());
    cuts.erase(std::unique(cuts.begin(), cuts.end()), cuts.end());
    std::vector<Stretch> seen;
    for (std::size_t k = 0; k + 1 < cuts.size(); ++k) {
      const Big num = Big(cuts[k].num) * cuts[k + 1].den + Big(cuts[k + 1].num) * cuts[k].den;
      const Big scale = Big(2) * cuts[k].den * cuts[k + 1].den;
      const Big x = scale * (w.a.x - v.x) + num * (w.b.x - w.a.x);
      const Big y = scale * (w.a.y - v.y) + num * (w.b.y - w.a.y);
      const bool hidden = std::any_of(walls.begin(), walls.end(),
                                      [&](const Wall& u) { return blocks(u, v, x, y, scale); });
      if (hidden) continue;
      if (!seen.empty() && seen.back().to == cuts[k]) {
        seen.back().to = cuts[k + 1];
      } else {
        seen.push_back({cuts[k], cuts[k + 1]});
      }
    }
    append(seen, static_cast<int>(i), walls, pieces);
  }
  return pieces;
}

// Which constraint keeps a scanner from imaging the point, if any: literally what paper 3.1.1 asks,
// in floating point. For points on `wall` that are not within a hair of any limit.
inline std::optional<planning::Excluded> excluded_by(const planning::Candidate& from, int wall,
                                                     const Eigen::Vector2d& point_m,
                                                     const std::vector<Wall>& walls,
                                                     const planning::SensorLimits& limits) {
  using planning::Excluded;
  const auto degrees = [](double rad) { return rad * 180 / M_PI; };
  const auto cross = [](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    return a.x() * b.y() - a.y() * b.x();
  };
  const Eigen::Vector2d v_m = nav::to_m(from.position);
  const Wall& own = walls[static_cast<std::size_t>(wall)];
  const Eigen::Vector2d along = (nav::to_m(own.b) - nav::to_m(own.a)).normalized();
  const Eigen::Vector2d normal(along.y(), -along.x());  // To the free side.
  const Eigen::Vector2d beam = point_m - v_m;
  if (-beam.dot(normal) <= 0) return Excluded::occluded;
  for (std::size_t i = 0; i < walls.size(); ++i) {
    if (static_cast<int>(i) == wall) continue;
    const Eigen::Vector2d a = nav::to_m(walls[i].a) - v_m, b = nav::to_m(walls[i].b) - v_m;
    const bool astride = (cross(beam, a) > 0) != (cross(beam, b) > 0);
    const bool beyond = (cross(b - a, -a) > 0) != (cross(b - a, beam - a) > 0);
    if (astride && beyond) return Excluded::occluded;
  }
  const double range_m = beam.norm();
  if (range_m > limits.range_max_m) return Excluded::range_max;
  if (range_m < limits.range_min_m) return Excluded::range_min;
  if (degrees(std::acos(-beam.dot(normal) / range_m)) > limits.grazing_max_deg)
    return Excluded::grazing;
  const double off = std::remainder(std::atan2(beam.y(), beam.x()) - from.heading_rad, 2 * M_PI);
  if (std::abs(degrees(off)) > limits.fov_deg / 2) return Excluded::field_of_view;
  return std::nullopt;
}

}  // namespace oracle
