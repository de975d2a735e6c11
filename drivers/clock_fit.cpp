#include "drivers/clock_fit.hpp"

#include <algorithm>
#include <cmath>

namespace drivers {
namespace {

std::int64_t ns(double span_s) {
  return std::llround(span_s * 1e9);
}

}  // namespace

std::int64_t Unwrap::operator()(std::uint64_t raw) {
  const std::uint64_t mask = bits_ >= 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << bits_) - 1;
  raw &= mask;
  if (!last_) {
    last_ = static_cast<std::int64_t>(raw);
    return *last_;
  }
  const std::uint64_t ahead = (raw - static_cast<std::uint64_t>(*last_)) & mask;
  const bool back = ahead > mask / 2;
  const auto step = static_cast<std::int64_t>(ahead) -
                    (back ? static_cast<std::int64_t>(mask) + 1 : std::int64_t{0});
  last_ = *last_ + step;
  return *last_;
}

void ClockFit::clear() {
  slices_.clear();
  last_device_ns_.reset();
  skew_ = offset_ns_ = 0;
}

ClockFit::Seen ClockFit::add(std::int64_t device_ns, hal::Time arrival) {
  const std::int64_t arrival_ns = arrival.time_since_epoch().count();
  Seen seen = Seen::kept;
  if (last_device_ns_) {
    const std::int64_t device_step = device_ns - *last_device_ns_;
    const std::int64_t ahead = device_step - (arrival_ns - last_arrival_ns_);
    if (device_step < -ns(limits_.restart_back_s) || ahead > ns(limits_.restart_ahead_s)) {
      clear();
      ++restarts_;
      seen = Seen::restarted;
    }
  }
  if (!last_device_ns_) base_ns_ = arrival_ns - device_ns;
  last_device_ns_ = device_ns;
  last_arrival_ns_ = arrival_ns;
  const Point point{device_ns, arrival_ns - device_ns - base_ns_};
  if (slices_.empty() || device_ns - slices_.back().device_ns >= ns(limits_.slice_s))
    slices_.push_back(point);
  else if (point.late_ns < slices_.back().late_ns)
    slices_.back().late_ns = point.late_ns;  // The slice keeps its beginning: it does not grow.
  while (slices_.back().device_ns - slices_.front().device_ns > ns(limits_.window_s))
    slices_.pop_front();
  refit();
  last_excess_s_ = (static_cast<double>(point.late_ns) - line_ns(device_ns)) / 1e9;
  return seen;
}

double ClockFit::line_ns(std::int64_t device_ns) const {
  return offset_ns_ + skew_ * static_cast<double>(device_ns - origin_ns_);
}

// The line under all points that is nearest to them: of the lower convex hull the edge over their
// middle, within the slopes that crystals have.
void ClockFit::refit() {
  std::vector<Point> hull;
  for (const Point& point : slices_) {
    const auto above = [&] {
      const Point &a = hull[hull.size() - 2], &b = hull.back();
      const double ab = static_cast<double>(b.late_ns - a.late_ns) *
                        static_cast<double>(point.device_ns - a.device_ns);
      const double ap = static_cast<double>(point.late_ns - a.late_ns) *
                        static_cast<double>(b.device_ns - a.device_ns);
      return ab >= ap;
    };
    while (hull.size() >= 2 && above()) hull.pop_back();
    hull.push_back(point);
  }
  double middle = 0;
  for (const Point& point : slices_)
    middle += static_cast<double>(point.device_ns - slices_.front().device_ns);
  middle /= static_cast<double>(slices_.size());
  std::size_t edge = 0;
  while (edge + 2 < hull.size() &&
         static_cast<double>(hull[edge + 1].device_ns - slices_.front().device_ns) < middle)
    ++edge;
  skew_ = 0;
  if (ready() && edge + 1 < hull.size())
    skew_ = static_cast<double>(hull[edge + 1].late_ns - hull[edge].late_ns) /
            static_cast<double>(hull[edge + 1].device_ns - hull[edge].device_ns);
  skew_ = std::clamp(skew_, -limits_.skew_max, limits_.skew_max);
  origin_ns_ = hull[edge].device_ns;
  offset_ns_ = static_cast<double>(hull[edge].late_ns);
  // A slope that was clamped, or none yet: under all points still.
  for (const Point& point : hull)
    offset_ns_ += std::min(0.0, static_cast<double>(point.late_ns) - line_ns(point.device_ns));
}

std::optional<hal::Time> ClockFit::to_ours(std::int64_t device_ns) const {
  if (slices_.empty()) return std::nullopt;
  return hal::Time(hal::Duration(device_ns + base_ns_ + std::llround(line_ns(device_ns))));
}

}  // namespace drivers
