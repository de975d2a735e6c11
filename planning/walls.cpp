// Which obstacle edges count for an area, and where to cut them.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "nav/polygons.hpp"
#include "planning/cover.hpp"

namespace planning {
namespace {

using Eigen::Vector2d;
using nav::PointMm;
using nav::SegmentMm;

// What noding to the grid, twice, may have moved the area's border away from the wall by.
constexpr double kRoundingM = 0.002;

// A stretch of an edge, in metres from its end a.
struct Stretch {
  double from_m, to_m;
};

Vector2d direction(const SegmentMm& s) {
  return (nav::to_m(s.b) - nav::to_m(s.a)).normalized();
}

// The stretch of the edge that the border of an area, its ground on the left, runs along.
Stretch shared(const SegmentMm& edge, const SegmentMm& border) {
  constexpr Stretch kNowhere{0, 0};
  const Vector2d along = direction(edge);
  const Vector2d right(along.y(), -along.x());
  const Vector2d first = nav::to_m(border.b) - nav::to_m(edge.a);  // Where it is first met.
  const Vector2d step = nav::to_m(border.a) - nav::to_m(border.b);
  const double start_m = first.dot(along), step_m = step.dot(along);
  if (step_m <= 0) return kNowhere;  // The ground lies on the obstacle's side.
  Stretch s{std::max(0.0, start_m), std::min(nav::length_m(edge.a, edge.b), start_m + step_m)};

  const double slope = step.dot(right) / step_m;
  const auto off_m = [&](double at_m) { return first.dot(right) + slope * (at_m - start_m); };
  const bool parallel = std::abs(slope) < std::tan(3 * std::numbers::pi / 180);
  const double reach_m = parallel ? nav::kTargetReachM : kRoundingM;
  if (parallel && slope != 0) {  // Ground drawn askew borders the wall as far as it is near.
    const double near_m = start_m + (-kRoundingM - first.dot(right)) / slope;
    const double far_m = start_m + (reach_m - first.dot(right)) / slope;
    s = {std::max(s.from_m, std::min(near_m, far_m)), std::min(s.to_m, std::max(near_m, far_m))};
  }
  if (!(s.from_m < s.to_m)) return kNowhere;
  constexpr double kHair = 1e-6;
  for (const double at_m : {s.from_m, s.to_m})
    if (off_m(at_m) < -kRoundingM - kHair || off_m(at_m) > reach_m + kHair) return kNowhere;
  return s;
}

class Borders {
 public:
  explicit Borders(const nav::Polygons& ground) : edges_(nav::edges(ground)) {
    std::vector<nav::Box2> boxes;
    for (const SegmentMm& e : edges_)
      boxes.push_back(nav::box_of({nav::to_m(e.a), nav::to_m(e.b)}));
    tree_ = nav::BoxTree(boxes);
  }

  // Where the ground borders the edge, in order; what is nearly the whole edge or nearly touches is
  // made so.
  std::vector<Stretch> along(const SegmentMm& edge) const {
    const double length_m = nav::length_m(edge.a, edge.b);
    std::vector<Stretch> found;
    tree_.near({nav::to_m(edge.a), nav::to_m(edge.b)}, nav::kTargetReachM, [&](int i) {
      const Stretch s = shared(edge, edges_[static_cast<std::size_t>(i)]);
      if (s.from_m < s.to_m) found.push_back(s);
      return nav::kTargetReachM;
    });
    std::ranges::sort(found, {}, &Stretch::from_m);
    std::vector<Stretch> merged;
    for (const Stretch& s : found) {
      if (merged.empty() || s.from_m > merged.back().to_m + kRoundingM) {
        merged.push_back(s);
      } else {
        merged.back().to_m = std::max(merged.back().to_m, s.to_m);
      }
    }
    std::erase_if(merged, [](const Stretch& s) { return s.to_m - s.from_m < kRoundingM; });
    if (merged.empty()) return merged;
    if (merged.front().from_m < kRoundingM) merged.front().from_m = 0;
    if (merged.back().to_m > length_m - kRoundingM) merged.back().to_m = length_m;
    return merged;
  }

 private:
  std::vector<SegmentMm> edges_;
  nav::BoxTree tree_;
};

PointMm point_at(const SegmentMm& edge, double at_m) {
  if (at_m <= 0) return edge.a;
  if (at_m >= nav::length_m(edge.a, edge.b)) return edge.b;
  return nav::to_mm(nav::to_m(edge.a) + at_m * direction(edge));
}

}  // namespace

std::vector<Wall> walls_of(const nav::SiteMap& map, const nav::FreeArea& area) {
  const Borders borders(area.drivable);
  std::vector<Wall> walls;
  for (const SegmentMm& edge : nav::edges(map.obstacles)) {
    PointMm at = edge.a;
    const auto append = [&](double to_m, bool borders_area) {
      const PointMm to = point_at(edge, to_m);
      if (to == at) return;
      walls.push_back({at, to, borders_area && nav::on_target(map, {at, to})});
      at = to;
    };
    for (const Stretch& s : borders.along(edge)) {
      append(s.from_m, false);
      append(s.to_m, true);
    }
    append(nav::length_m(edge.a, edge.b), false);
  }
  return walls;
}

}  // namespace planning
