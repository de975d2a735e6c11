// Distances between straight segments, in double precision. Any one unit of length.
#pragma once

#include <Eigen/Core>

namespace nav {

struct Segment2 {
  Eigen::Vector2d a{0, 0};
  Eigen::Vector2d b{0, 0};
};

inline double cross2(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

// The share of the way from a to b (0 to 1) where the segment is closest to the point.
double closest_share(const Segment2& segment, const Eigen::Vector2d& point);
Eigen::Vector2d closest_point(const Segment2& segment, const Eigen::Vector2d& point);
double distance(const Segment2& segment, const Eigen::Vector2d& point);
// 0 where they cross or touch.
double distance(const Segment2& s, const Segment2& t);
// 0 where the segment meets the axis-aligned box [min, max].
double distance_to_box(const Segment2& s, const Eigen::Vector2d& min, const Eigen::Vector2d& max);

}  // namespace nav
