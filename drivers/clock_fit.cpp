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
  hull_.clear();
  since_first_ns_ = 0;
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
  if (take(point)) fit_line();
  last_excess_s_ = (static_cast<double>(point.late_ns) - line_ns(device_ns)) / 1e9;
  return seen;
}

double ClockFit::line_ns(std::int64_t device_ns) const {
  return offset_ns_ + skew_ * static_cast<double>(device_ns - origin_ns_);
}

// Whether the slices changed. Most messages are neither the first nor the least late of a slice.
bool ClockFit::take(const Point& point) {
  if (slices_.empty() || point.device_ns - slices_.back().device_ns >= ns(limits_.slice_s)) {
    slices_.push_back(point);
    const std::size_t before = slices_.size();
    while (slices_.back().device_ns - slices_.front().device_ns > ns(limits_.window_s))
      slices_.pop_front();
    if (slices_.size() == before) return count(point), true;
    hull_.clear();
    since_first_ns_ = 0;
    for (const Point& slice : slices_) count(slice);
    return true;
  }
  Point& last = slices_.back();
  if (point.late_ns >= last.late_ns) return false;
  last.late_ns = point.late_ns;  // The slice keeps its beginning: it does not grow.
  hull_.pop_back();              // What lay above this slice's point does so all the more.
  extend_hull(last);
  return true;
}

void ClockFit::count(const Point& slice) {
  since_first_ns_ += static_cast<double>(slice.device_ns - slices_.front().device_ns);
  extend_hull(slice);
}

void ClockFit::extend_hull(const Point& slice) {
  const auto above = [&] {
    const Point &a = hull_[hull_.size() - 2], &b = hull_.back();
    const double ab = static_cast<double>(b.late_ns - a.late_ns) *
                      static_cast<double>(slice.device_ns - a.device_ns);
    const double as = static_cast<double>(slice.late_ns - a.late_ns) *
                      static_cast<double>(b.device_ns - a.device_ns);
    return ab >= as;
  };
  while (hull_.size() >= 2 && above()) hull_.pop_back();
  hull_.push_back(slice);
}

// The line under all points that is nearest to them: of the lower convex hull the edge over their
// middle, within the slopes that crystals have.
void ClockFit::fit_line() {
  const double middle = since_first_ns_ / static_cast<double>(slices_.size());
  std::size_t edge = 0;
  while (edge + 2 < hull_.size() &&
         static_cast<double>(hull_[edge + 1].device_ns - slices_.front().device_ns) < middle)
    ++edge;
  skew_ = 0;
  if (ready() && edge + 1 < hull_.size())
    skew_ = static_cast<double>(hull_[edge + 1].late_ns - hull_[edge].late_ns) /
            static_cast<double>(hull_[edge + 1].device_ns - hull_[edge].device_ns);
  skew_ = std::clamp(skew_, -limits_.skew_max, limits_.skew_max);
  origin_ns_ = hull_[edge].device_ns;
  offset_ns_ = static_cast<double>(hull_[edge].late_ns);
  // A slope that was clamped, or none yet: under all points still.
  for (const Point& point : hull_)
    offset_ns_ += std::min(0.0, static_cast<double>(point.late_ns) - line_ns(point.device_ns));
}

std::optional<hal::Time> ClockFit::to_ours(std::int64_t device_ns) const {
  if (slices_.empty()) return std::nullopt;
  return hal::Time(hal::Duration(device_ns + base_ns_ + std::llround(line_ns(device_ns))));
}

}  // namespace drivers
