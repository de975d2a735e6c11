#include "nav/shortcuts.hpp"

#include <algorithm>
#include <cmath>

namespace nav {
namespace {

using Corners = std::vector<Eigen::Vector2d>;

constexpr int kPassesMax = 8;
constexpr double kStepMinM = 0.25;
constexpr double kPointsMax = 2000;
constexpr double kShortcutRoundingM = 1e-9;

// The same line with a point at least every step_m.
Corners resample(const Corners& points_m, double step_m) {
  Corners dense{points_m.front()};
  for (std::size_t i = 1; i < points_m.size(); ++i) {
    const Eigen::Vector2d a = points_m[i - 1];
    const Eigen::Vector2d b = points_m[i];
    const int pieces = std::max(1, static_cast<int>(std::ceil((b - a).norm() / step_m)));
    for (int k = 1; k < pieces; ++k) dense.push_back(a + (b - a) * k / pieces);
    dense.push_back(b);
  }
  return dense;
}

class Pass {
 public:
  Pass(const Corners& points_m, double comfort_m, const ClearanceOf& clearance_of)
      : points_m_(points_m), clearance_of_(clearance_of) {
    pieces_m_.reserve(points_m.size());
    for (std::size_t i = 0; i + 1 < points_m.size(); ++i)
      pieces_m_.push_back(clearance_of({points_m[i], points_m[i + 1]}, comfort_m));
  }

  Corners run() const {
    Corners kept{points_m_.front()};
    for (std::size_t i = 0; i + 1 < points_m_.size();) {
      i = reach(i);
      kept.push_back(points_m_[i]);
    }
    return kept;
  }

 private:
  // A late point that can be driven to straight from point i: strides that double, then halve.
  std::size_t reach(std::size_t i) const {
    const std::size_t last = points_m_.size() - 1;
    std::size_t good = i + 1;
    std::size_t stride = 1;
    while (good < last) {
      const std::size_t next = std::min(last, good + stride);
      if (!may_replace(i, next)) break;
      good = next;
      stride *= 2;
    }
    for (; stride > 0; stride /= 2)
      if (good + stride <= last && may_replace(i, good + stride)) good += stride;
    return good;
  }

  bool may_replace(std::size_t from, std::size_t to) const {
    const auto begin = pieces_m_.begin();
    const double keep_m = *std::min_element(begin + static_cast<std::ptrdiff_t>(from),
                                            begin + static_cast<std::ptrdiff_t>(to));
    return clearance_of_({points_m_[from], points_m_[to]}, keep_m) >= keep_m - kShortcutRoundingM;
  }

  const Corners& points_m_;
  const ClearanceOf& clearance_of_;
  std::vector<double> pieces_m_;
};

Corners shortened(Corners points_m, double comfort_m, const ClearanceOf& clearance_of) {
  double length_m = polyline_length_m(points_m);
  for (int pass = 0; pass < kPassesMax; ++pass) {
    const Corners dense = resample(points_m, std::max(kStepMinM, length_m / kPointsMax));
    Corners shorter = Pass(dense, comfort_m, clearance_of).run();
    std::reverse(shorter.begin(), shorter.end());  // The next pass starts from the other end.
    const double shorter_m = polyline_length_m(shorter);
    const bool settled = pass % 2 == 1 && shorter_m > length_m * 0.9995;
    if (shorter_m <= length_m) {
      points_m = std::move(shorter);
      length_m = shorter_m;
    } else {
      std::reverse(points_m.begin(), points_m.end());
    }
    if (settled) break;
  }
  return points_m;
}

}  // namespace

double polyline_length_m(const Corners& points_m) {
  double length_m = 0;
  for (std::size_t i = 1; i < points_m.size(); ++i)
    length_m += (points_m[i] - points_m[i - 1]).norm();
  return length_m;
}

// Both ways round, so that the way back is as long as the way there.
Corners take_shortcuts(const Corners& points_m, double comfort_m, const ClearanceOf& clearance_of) {
  if (points_m.size() < 3) return points_m;
  Corners forth = shortened(points_m, comfort_m, clearance_of);
  Corners back = shortened({points_m.rbegin(), points_m.rend()}, comfort_m, clearance_of);
  if (polyline_length_m(forth) <= polyline_length_m(back)) return forth;
  std::reverse(back.begin(), back.end());
  return back;
}

}  // namespace nav
