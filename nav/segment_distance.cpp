#include "nav/segment_distance.hpp"

#include <algorithm>

namespace nav {
namespace {

bool cross_properly(const Segment2& s, const Segment2& t) {
  const Eigen::Vector2d u = s.b - s.a;
  const Eigen::Vector2d v = t.b - t.a;
  const double t_a = cross2(u, t.a - s.a);
  const double t_b = cross2(u, t.b - s.a);
  const double s_a = cross2(v, s.a - t.a);
  const double s_b = cross2(v, s.b - t.a);
  return ((t_a < 0) != (t_b < 0)) && ((s_a < 0) != (s_b < 0));
}

}  // namespace

double closest_share(const Segment2& segment, const Eigen::Vector2d& point) {
  const Eigen::Vector2d along = segment.b - segment.a;
  const double squared = along.squaredNorm();
  if (squared == 0) return 0;
  return std::clamp(along.dot(point - segment.a) / squared, 0.0, 1.0);
}

Eigen::Vector2d closest_point(const Segment2& segment, const Eigen::Vector2d& point) {
  return segment.a + closest_share(segment, point) * (segment.b - segment.a);
}

double distance(const Segment2& segment, const Eigen::Vector2d& point) {
  return (point - closest_point(segment, point)).norm();
}

// Segments that do not cross are closest at an end point of one of them. Collinear and touching
// ones need no special case: an end point then lies on the other.
double distance(const Segment2& s, const Segment2& t) {
  if (cross_properly(s, t)) return 0;
  return std::min(std::min(distance(s, t.a), distance(s, t.b)),
                  std::min(distance(t, s.a), distance(t, s.b)));
}

double distance_to_box(const Segment2& s, const Eigen::Vector2d& min, const Eigen::Vector2d& max) {
  const auto inside = [&](const Eigen::Vector2d& p) {
    return (p.array() >= min.array()).all() && (p.array() <= max.array()).all();
  };
  if (inside(s.a) || inside(s.b)) return 0;
  const Eigen::Vector2d corners[] = {min, {max.x(), min.y()}, max, {min.x(), max.y()}};
  double nearest = distance(s, Segment2{corners[3], corners[0]});
  for (int i = 0; i < 3; ++i)
    nearest = std::min(nearest, distance(s, Segment2{corners[i], corners[i + 1]}));
  return nearest;
}

}  // namespace nav
