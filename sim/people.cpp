#include "sim/people.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace sim {

void Walker::turn_round() {
  step_ = -step_;
  next_ += step_;
  waited_s_ = 0;
}

void Walker::walk(double span_s, const Eigen::Vector2d& robot_m, double robot_radius_m,
                  bool robot_moves) {
  const int last = static_cast<int>(person_.way_m.size()) - 1;
  walked_s_ += span_s;
  if (last == 0 || walked_s_ < person_.start_s) return;
  if (next_ < 0 || next_ > last) turn_round();
  const Eigen::Vector2d& goal_m = person_.way_m[static_cast<std::size_t>(next_)];
  const Eigen::Vector2d rest_m = goal_m - at_m_;
  const double step_m = std::min(person_.speed_mps * span_s, rest_m.norm());
  const Eigen::Vector2d to_m = step_m > 0 ? at_m_ + step_m * rest_m.normalized() : at_m_;
  const double keep_m = robot_radius_m + person_.radius_m + (robot_moves ? kStepsAsideM : kPassesM);
  const double there_m = (to_m - robot_m).norm();
  if (there_m < keep_m && there_m < (at_m_ - robot_m).norm()) {
    waited_s_ += span_s;
    if (waited_s_ > kPatienceS) turn_round();
    return;
  }
  waited_s_ = 0;
  at_m_ = to_m;
  if ((goal_m - at_m_).norm() < 1e-9) next_ += step_;
}

// Whose way is one point stays. Bounded.
void Walker::make_room(const Eigen::Vector2d& robot_m, double robot_radius_m) {
  constexpr int kStepsMax = 10000;
  constexpr double kStepS = 0.05;
  const Eigen::Vector2d nowhere = Eigen::Vector2d::Constant(1e9);
  const double keep_m = robot_radius_m + person_.radius_m + kPassesM;
  const double walked_s = std::exchange(walked_s_, person_.start_s);
  for (int i = 0; i < kStepsMax && (at_m_ - robot_m).norm() < keep_m; ++i)
    walk(kStepS, nowhere, 0, false);
  walked_s_ = walked_s;
}

double Walker::range_m(const Eigen::Vector3d& from, const Eigen::Vector3d& direction) const {
  double range_m = std::numeric_limits<double>::infinity();
  shorten(from, {&direction, 1}, {&range_m, 1});
  return range_m;
}

void Walker::shorten(const Eigen::Vector3d& from, std::span<const Eigen::Vector3d> directions,
                     std::span<double> ranges_m) const {
  const Eigen::Vector2d to_axis = at_m_ - from.head<2>();
  const double c = to_axis.squaredNorm() - person_.radius_m * person_.radius_m;
  for (std::size_t i = 0; i < directions.size(); ++i) {
    const Eigen::Vector2d way = directions[i].head<2>();
    const double a = way.squaredNorm();
    const double b = way.dot(to_axis);
    const double root = b * b - a * c;
    if (a < 1e-12 || root < 0) continue;
    const double range_m = (b - std::sqrt(root)) / a;
    const double z_m = from.z() + range_m * directions[i].z();
    if (range_m > 0 && z_m >= 0 && z_m <= person_.height_m)
      ranges_m[i] = std::min(ranges_m[i], range_m);
  }
}

}  // namespace sim
