// Plane geometry on an integer grid of 1 mm, so that every predicate is exact.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <compare>
#include <cstdint>
#include <vector>

namespace nav {

// Millimetres in W. |x|, |y| <= kCoordinateMax, so that cross products of differences fit 64 bits.
struct PointMm {
  std::int64_t x{};
  std::int64_t y{};

  auto operator<=>(const PointMm&) const = default;
};

inline constexpr std::int64_t kCoordinateMax = std::int64_t{1} << 28;  // 268 km

inline PointMm operator-(PointMm a, PointMm b) {
  return {a.x - b.x, a.y - b.y};
}
inline PointMm operator+(PointMm a, PointMm b) {
  return {a.x + b.x, a.y + b.y};
}
inline std::int64_t cross(PointMm a, PointMm b) {
  return a.x * b.y - a.y * b.x;
}
inline std::int64_t dot(PointMm a, PointMm b) {
  return a.x * b.x + a.y * b.y;
}
// -1, 0 or 1.
inline int sign(std::int64_t value) {
  return (value > 0) - (value < 0);
}
// > 0 where c lies left of the line from a to b.
inline std::int64_t side(PointMm a, PointMm b, PointMm c) {
  return cross(b - a, c - a);
}

inline PointMm to_mm(const Eigen::Vector2d& metres) {
  return {std::llround(metres.x() * 1000), std::llround(metres.y() * 1000)};
}
inline Eigen::Vector2d to_m(PointMm point) {
  return {static_cast<double>(point.x) / 1000, static_cast<double>(point.y) / 1000};
}
inline double length_m(PointMm a, PointMm b) {
  return (to_m(b) - to_m(a)).norm();
}

// values[i] where indices are int.
template <class T>
const T& item(const std::vector<T>& values, int i) {
  return values[static_cast<std::size_t>(i)];
}

struct SegmentMm {
  PointMm a, b;

  auto operator<=>(const SegmentMm&) const = default;
};

// Closed without repeating the first vertex. Outer rings counter-clockwise, holes clockwise: the
// inside is always on the left.
using Ring = std::vector<PointMm>;

struct Polygon {
  Ring outer;
  std::vector<Ring> holes;
};

// Disjoint inside; may touch in points.
using Polygons = std::vector<Polygon>;

}  // namespace nav
