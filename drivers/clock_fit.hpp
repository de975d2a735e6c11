// A device's clock in ours, from messages that say when they were sent and when they came.
//
// A message arrives its latency late, never early: the offset is the lower envelope of (arrival -
// sent), a line whose slope is the difference of the crystals. Transport hiccups only lie above it.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "hal/values.hpp"

namespace drivers {

// A counter of `bits` that wraps, as one that does not. Steps back by less than half a turn are
// taken for what they are.
class Unwrap {
 public:
  explicit Unwrap(int bits = 32) : bits_(bits) {}
  std::int64_t operator()(std::uint64_t raw);

 private:
  int bits_;
  std::optional<std::int64_t> last_;
};

struct ClockFitLimits {
  double window_s = 120;       // Messages older than this are forgotten.
  double slice_s = 1;          // The least latency of each slice counts.
  double skew_max = 200e-6;    // Crystals do not differ by more.
  double restart_back_s = 1;   // Device time going back further is a restart,
  double restart_ahead_s = 5;  // as is running away from ours by more.
};

class ClockFit {
 public:
  explicit ClockFit(ClockFitLimits limits = {}) : limits_(limits) {}

  enum class Seen { kept, restarted };
  // The device's unwrapped time of sending, and arrival by our clock. A restart drops the fit.
  Seen add(std::int64_t device_ns, hal::Time arrival);

  // Our time of a device time, without the least latency of the transport (which no one-way message
  // can tell). Nothing before there is a message.
  std::optional<hal::Time> to_ours(std::int64_t device_ns) const;

  bool ready() const { return slices_.size() >= 3; }
  double skew() const { return skew_; }  // Ours per device's second, less one.
  // Of the last message above the envelope: the transport's jitter.
  double last_excess_s() const { return last_excess_s_; }
  std::uint64_t restarts() const { return restarts_; }

 private:
  struct Point {
    std::int64_t device_ns{}, late_ns{};  // late = arrival - device - base
  };
  void clear();
  bool take(const Point& point);
  void count(const Point& slice);
  void extend_hull(const Point& slice);
  void fit_line();
  double line_ns(std::int64_t device_ns) const;

  ClockFitLimits limits_;
  std::deque<Point> slices_;  // The least late of each slice, in order of device time.
  std::vector<Point> hull_;   // Of the slices, the lower convex one: ends with the last.
  double since_first_ns_{};   // Of all slices' times, the sum of what they are after the first's.
  std::int64_t base_ns_{};    // Keeps the differences small.
  std::optional<std::int64_t> last_device_ns_;
  std::int64_t last_arrival_ns_{};
  // The line: late = offset + skew * (device - origin).
  std::int64_t origin_ns_{};
  double offset_ns_{}, skew_{};
  double last_excess_s_{};
  std::uint64_t restarts_{};
};

}  // namespace drivers
