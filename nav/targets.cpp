#include "nav/targets.hpp"

#include <algorithm>
#include <numbers>

#include "nav/polygons.hpp"
#include "nav/rings.hpp"

namespace nav {
namespace {

// The part of the line from edge.a to edge.b, as shares [from, to], that runs beside the target.
struct Beside {
  double from = 0;
  double to = 1;

  // Keeps the shares where start + share * slope lies in [low, high].
  void restrict(double start, double slope, double low, double high) {
    if (slope == 0) {
      if (start < low || start > high) to = from - 1;
      return;
    }
    const double one = (low - start) / slope;
    const double other = (high - start) / slope;
    from = std::max(from, std::min(one, other));
    to = std::min(to, std::max(one, other));
  }
};

Beside beside(const SegmentMm& edge, const SegmentMm& target, double reach_m) {
  const double cos_min = std::numbers::sqrt3 / 2;  // 30 deg
  const Eigen::Vector2d along = to_m(target.b) - to_m(target.a);
  const Eigen::Vector2d forward = along.normalized();
  const Eigen::Vector2d left(-forward.y(), forward.x());
  const Eigen::Vector2d from = to_m(edge.a) - to_m(target.a);
  const Eigen::Vector2d step = to_m(edge.b) - to_m(edge.a);
  Beside part;
  if (std::abs(step.normalized().dot(forward)) < cos_min) return {0, -1};
  part.restrict(from.dot(forward), step.dot(forward), -reach_m, along.norm() + reach_m);
  part.restrict(from.dot(left), step.dot(left), -reach_m, reach_m);
  return part;
}

// What rounding cut points to the grid may have moved them by.
constexpr double kCutRoundingM = 0.002;

}  // namespace

bool runs_along(const SegmentMm& edge, const SegmentMm& target) {
  const Beside part = beside(edge, target, kTargetReachM + kCutRoundingM);
  return part.from <= 0 && part.to >= 1;
}

std::vector<PointMm> cuts_at_targets(const Polygons& obstacles,
                                     const std::vector<SegmentMm>& targets) {
  std::vector<PointMm> cuts;
  for (const SegmentMm& edge : edges(obstacles)) {
    const Eigen::Vector2d step = to_m(edge.b) - to_m(edge.a);
    for (const SegmentMm& target : targets) {
      const Beside part = beside(edge, target, kTargetReachM);
      if (part.to <= part.from) continue;
      if (part.from > 0) cuts.push_back(to_mm(to_m(edge.a) + part.from * step));
      if (part.to < 1) cuts.push_back(to_mm(to_m(edge.a) + part.to * step));
    }
  }
  return cuts;
}

std::vector<PointMm> cuts_at_boundary(const Polygons& obstacles, const Polygons& boundary) {
  std::vector<SegmentMm> both = edges(obstacles);
  const std::vector<SegmentMm> border = edges(boundary);
  both.insert(both.end(), border.begin(), border.end());
  std::vector<PointMm> cuts;
  for (const Contact& c : contacts(both)) cuts.push_back(c.point);
  return cuts;
}

double length_along_m(const Polygons& obstacles, const std::vector<SegmentMm>& targets) {
  double sum_m = 0;
  for (const SegmentMm& edge : edges(obstacles)) {
    const bool along = std::any_of(targets.begin(), targets.end(), [&](const SegmentMm& target) {
      return runs_along(edge, target);
    });
    if (along) sum_m += length_m(edge.a, edge.b);
  }
  return sum_m;
}

bool on_target(const SiteMap& map, const SegmentMm& edge) {
  if (!map.targets.empty()) {
    return std::any_of(map.targets.begin(), map.targets.end(),
                       [&](const SegmentMm& target) { return runs_along(edge, target); });
  }
  const PointMm middle{(edge.a.x + edge.b.x) / 2, (edge.a.y + edge.b.y) / 2};
  return contains(map.boundary, middle) || border_distance_m(map.boundary, middle) <= kTargetReachM;
}

}  // namespace nav
