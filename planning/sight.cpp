#include "planning/sight.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <numeric>

#include "planning/sight_horizon.hpp"
#include "planning/sight_sweep.hpp"

namespace planning {
namespace {

using nav::PointMm;

__extension__ using Int128 = __int128;
__extension__ using UInt128 = unsigned __int128;

bool cross_properly(const Wall& u, const Wall& w) {
  return nav::sign(nav::side(u.a, u.b, w.a)) * nav::sign(nav::side(u.a, u.b, w.b)) < 0 &&
         nav::sign(nav::side(w.a, w.b, u.a)) * nav::sign(nav::side(w.a, w.b, u.b)) < 0;
}

// On one line, with more than a point in common.
bool overlap(const Wall& u, const Wall& w) {
  const PointMm d = u.b - u.a;
  if (nav::cross(d, w.a - u.a) != 0 || nav::cross(d, w.b - u.a) != 0) return false;
  const std::int64_t at_a = nav::dot(d, w.a - u.a), at_b = nav::dot(d, w.b - u.a);
  return std::min(at_a, at_b) < nav::dot(d, d) && std::max(at_a, at_b) > 0;
}

// One wall of every pair that crosses or overlaps.
std::vector<char> tangled_walls(const std::vector<Wall>& walls) {
  std::vector<int> order;
  for (std::size_t i = 0; i < walls.size(); ++i)
    if (walls[i].a != walls[i].b) order.push_back(static_cast<int>(i));
  const auto x_min = [&](int i) { return std::min(walls[i].a.x, walls[i].b.x); };
  std::ranges::sort(order,
                    [&](int i, int j) { return std::pair(x_min(i), i) < std::pair(x_min(j), j); });
  std::vector<char> tangled(walls.size());
  for (std::size_t k = 0; k < order.size(); ++k) {
    const Wall& u = walls[order[k]];
    const std::int64_t x_max = std::max(u.a.x, u.b.x);
    const auto [y_min, y_max] = std::minmax(u.a.y, u.b.y);
    for (std::size_t l = k + 1; l < order.size() && x_min(order[l]) <= x_max; ++l) {
      const Wall& w = walls[order[l]];
      if (std::max(w.a.y, w.b.y) < y_min || std::min(w.a.y, w.b.y) > y_max) continue;
      if (tangled[order[k]] || tangled[order[l]]) continue;
      if (cross_properly(u, w) || overlap(u, w)) tangled[order[l]] = true;
    }
  }
  return tangled;
}

// Where u hides the wall (both as seen from the viewpoint): within u's wedge and beyond its line.
ShareRange shadow(const SightEdge& u, const SightEdge& wall) {
  const PointMm a = wall.q;
  const PointMm along = wall.p - wall.q;
  const PointMm line = u.q - u.p;
  ShareRange range;
  range.restrict(nav::cross(u.p, a), nav::cross(u.p, along));
  range.restrict(-nav::cross(u.q, a), -nav::cross(u.q, along));
  range.restrict(-nav::cross(line, a - u.p), -nav::cross(line, along));
  return range;
}

void subtract(const ShareRange& hidden, std::vector<SharePiece>& pieces, std::size_t first) {
  if (hidden.empty()) return;
  const std::size_t last = pieces.size();
  for (std::size_t i = first; i < last; ++i) {
    const SharePiece piece = pieces[i];
    if (!(piece.from < hidden.to) || !(hidden.from < piece.to)) continue;
    pieces[i].to = piece.from < hidden.from ? hidden.from : piece.from;
    if (hidden.to < piece.to) pieces.push_back({piece.wall, hidden.to, piece.to});
  }
  const auto begin = pieces.begin() + static_cast<std::ptrdiff_t>(first);
  pieces.erase(
      std::remove_if(begin, pieces.end(), [](const SharePiece& p) { return !(p.from < p.to); }),
      pieces.end());
}

// From the origin.
double distance_squared(const nav::Box2& box) {
  return box.min.cwiseMax(-box.max).cwiseMax(0.0).squaredNorm();
}

}  // namespace

bool operator<(Share s, Share t) {
  return Int128{s.num} * t.den < Int128{t.num} * s.den;
}

double value(Share share) {
  constexpr std::int64_t kExactInDouble = std::int64_t{1} << 53;
  if (share.num == 0) return 0;
  if (share.den <= kExactInDouble)
    return static_cast<double>(share.num) / static_cast<double>(share.den);
  // 61 bits of the quotient or more, the lowest set if anything follows: rounds as the whole does.
  const auto num = static_cast<std::uint64_t>(share.num);
  const auto den = static_cast<std::uint64_t>(share.den);
  const int shift = 61 + std::bit_width(den) - std::bit_width(num);
  const UInt128 scaled = UInt128{num} << shift;
  const auto quotient = static_cast<std::uint64_t>(scaled / den);
  return std::ldexp(static_cast<double>(quotient | (scaled % den != 0 ? 1U : 0U)), -shift);
}

void ShareRange::restrict(std::int64_t at_a, std::int64_t slope) {
  if (slope == 0) {
    if (at_a <= 0) to = from;
  } else if (slope > 0) {
    if (at_a >= 0) return;
    const Share start = -at_a < slope ? Share{-at_a, slope} : Share{1, 1};
    if (from < start) from = start;
  } else {
    if (at_a + slope >= 0) return;
    const Share end = at_a > 0 ? Share{at_a, -slope} : Share{0, 1};
    if (end < to) to = end;
  }
}

Sight::Sight(const std::vector<Wall>& walls) : walls_(walls), is_tangled_(tangled_walls(walls)) {
  std::vector<nav::Box2> boxes;
  for (std::size_t i = 0; i < walls.size(); ++i) {
    const Eigen::Vector2d a(static_cast<double>(walls[i].a.x), static_cast<double>(walls[i].a.y));
    const Eigen::Vector2d b(static_cast<double>(walls[i].b.x), static_cast<double>(walls[i].b.y));
    boxes.push_back(nav::box_of({a, b}));
    if (is_tangled_[i]) tangled_.push_back(static_cast<int>(i));
  }
  tree_ = nav::BoxTree(boxes);
}

bool Sight::gather(PointMm v, double reach_mm, std::vector<SightEdge>& clear,
                   std::vector<SightEdge>& tangled) const {
  const Eigen::Vector2d at(static_cast<double>(v.x), static_cast<double>(v.y));
  Horizon horizon;
  bool on_wall = false;
  const auto hidden = [&](const nav::Box2& box) {
    const nav::Box2 relative{box.min - at, box.max - at};
    return distance_squared(relative) > reach_mm * reach_mm || horizon.hides(relative);
  };
  tree_.from_near(at, hidden, [&](int i) {
    const Wall& wall = walls_[static_cast<std::size_t>(i)];
    const PointMm a = wall.a - v, b = wall.b - v;
    const std::int64_t turn = nav::cross(a, b);
    if (turn == 0) {
      if (wall.a != wall.b && nav::dot(a, b) <= 0) on_wall = true;
      return;
    }
    const SightEdge edge{turn < 0 ? b : a, turn < 0 ? a : b, i, turn < 0 && wall.target};
    if (!horizon.hides_or_adds(edge))
      (is_tangled_[static_cast<std::size_t>(i)] ? tangled : clear).push_back(edge);
  });
  return !on_wall;
}

std::vector<SharePiece> Sight::from(PointMm v, double reach_mm) const {
  std::vector<SightEdge> clear, tangled;
  if (!gather(v, reach_mm, clear, tangled)) return {};

  std::vector<SharePiece> pieces;
  sweep(clear, [&](const SightEdge& edge, PointMm begin, PointMm end) {
    if (!edge.imaged) return;
    const std::size_t first = pieces.size();
    pieces.push_back({edge.wall, edge.share_at(end), edge.share_at(begin)});
    for (const SightEdge& u : tangled) subtract(shadow(u, edge), pieces, first);
  });
  for (const SightEdge& edge : tangled) {
    if (!edge.imaged) continue;
    const std::size_t first = pieces.size();
    pieces.push_back({edge.wall, {0, 1}, {1, 1}});
    for (const SightEdge& u : clear) subtract(shadow(u, edge), pieces, first);
    for (const SightEdge& u : tangled) subtract(shadow(u, edge), pieces, first);
  }
  std::ranges::sort(pieces, [](const SharePiece& p, const SharePiece& q) {
    return p.wall != q.wall ? p.wall < q.wall : p.from < q.from;
  });
  return pieces;
}

}  // namespace planning
