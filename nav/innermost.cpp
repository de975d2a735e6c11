#include "nav/innermost.hpp"

#include <algorithm>
#include <numbers>
#include <queue>
#include <tuple>

#include "nav/polygons.hpp"

namespace nav {
namespace {

struct Square {
  PointMm middle;
  std::int64_t half_mm{};
  double room_m{};      // Of the middle: its distance to the border, negative outside.
  double room_max_m{};  // That no point of the square exceeds.

  // std::priority_queue pops the greatest; among equals the order must not depend on the library.
  bool operator<(const Square& other) const {
    return std::tie(room_max_m, other.middle.x, other.middle.y) <
           std::tie(other.room_max_m, middle.x, middle.y);
  }
};

Square square_at(const Polygons& polygons, PointMm middle, std::int64_t half_mm) {
  const double border_m = border_distance_m(polygons, middle);
  const double room_m = contains(polygons, middle) ? border_m : -border_m;
  const double reach_m = static_cast<double>(half_mm) / 1000 * std::numbers::sqrt2;
  return {middle, half_mm, room_m, room_m + reach_m};
}

// One square round each polygon.
std::priority_queue<Square> squares_round(const Polygons& polygons) {
  std::priority_queue<Square> open;
  for (const Polygon& polygon : polygons) {
    const auto [left, right] = std::ranges::minmax(polygon.outer, {}, &PointMm::x);
    const auto [bottom, top] = std::ranges::minmax(polygon.outer, {}, &PointMm::y);
    const std::int64_t size_mm = std::max(right.x - left.x, top.y - bottom.y);
    open.push(
        square_at(polygons, {(left.x + right.x) / 2, (bottom.y + top.y) / 2}, size_mm / 2 + 1));
  }
  return open;
}

}  // namespace

PointMm innermost(const Polygons& polygons, double precision_m) {
  std::priority_queue<Square> open = squares_round(polygons);
  Square best{.middle = polygons.front().outer.front()};
  while (!open.empty() && open.top().room_max_m > best.room_m + precision_m) {
    const Square square = open.top();
    open.pop();
    if (square.room_m > best.room_m) best = square;
    const std::int64_t half_mm = (square.half_mm + 1) / 2;
    for (const std::int64_t dx : {-half_mm, half_mm})
      for (const std::int64_t dy : {-half_mm, half_mm})
        if (const Square part =
                square_at(polygons, {square.middle.x + dx, square.middle.y + dy}, half_mm);
            part.room_max_m > best.room_m + precision_m)
          open.push(part);
  }
  return best.middle;
}

}  // namespace nav
