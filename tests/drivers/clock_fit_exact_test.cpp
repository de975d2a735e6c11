// ClockFit keeps what it can from message to message; anew from all slices it must come to the very
// same numbers.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <deque>
#include <random>
#include <vector>

#include "drivers/clock_fit.hpp"

namespace drivers {
namespace {

std::int64_t whole_ns(double span_s) {
  return std::llround(span_s * 1e9);
}

// The hull and the line from all slices, for every message.
class FitAnew {
 public:
  explicit FitAnew(ClockFitLimits limits) : limits_(limits) {}

  ClockFit::Seen add(std::int64_t device_ns, hal::Time arrival) {
    const std::int64_t arrival_ns = arrival.time_since_epoch().count();
    ClockFit::Seen seen = ClockFit::Seen::kept;
    const std::int64_t step = device_ns - last_device_ns_;
    const bool back = step < -whole_ns(limits_.restart_back_s);
    const bool away = step - (arrival_ns - last_arrival_ns_) > whole_ns(limits_.restart_ahead_s);
    if (!slices_.empty() && (back || away)) {
      slices_.clear();
      seen = ClockFit::Seen::restarted;
    }
    if (slices_.empty()) base_ns_ = arrival_ns - device_ns;
    last_device_ns_ = device_ns;
    last_arrival_ns_ = arrival_ns;
    const Point point{device_ns, arrival_ns - device_ns - base_ns_};
    if (slices_.empty() || device_ns - slices_.back().device_ns >= whole_ns(limits_.slice_s))
      slices_.push_back(point);
    else
      slices_.back().late_ns = std::min(slices_.back().late_ns, point.late_ns);
    while (slices_.back().device_ns - slices_.front().device_ns > whole_ns(limits_.window_s))
      slices_.pop_front();
    fit();
    excess_s_ = (static_cast<double>(point.late_ns) - line_ns(device_ns)) / 1e9;
    return seen;
  }
  hal::Time to_ours(std::int64_t device_ns) const {
    return hal::Time(hal::Duration(device_ns + base_ns_ + std::llround(line_ns(device_ns))));
  }
  bool ready() const { return slices_.size() >= 3; }
  double skew() const { return skew_; }
  double last_excess_s() const { return excess_s_; }

 private:
  struct Point {
    std::int64_t device_ns{}, late_ns{};
  };
  double line_ns(std::int64_t device_ns) const {
    return offset_ns_ + skew_ * static_cast<double>(device_ns - origin_ns_);
  }
  std::vector<Point> hull() const {
    std::vector<Point> hull;
    for (const Point& p : slices_) {
      const auto above = [&] {
        const Point &a = hull[hull.size() - 2], &b = hull.back();
        return static_cast<double>(b.late_ns - a.late_ns) *
                   static_cast<double>(p.device_ns - a.device_ns) >=
               static_cast<double>(p.late_ns - a.late_ns) *
                   static_cast<double>(b.device_ns - a.device_ns);
      };
      while (hull.size() >= 2 && above()) hull.pop_back();
      hull.push_back(p);
    }
    return hull;
  }
  void fit() {
    const std::vector<Point> under = hull();
    double middle = 0;
    for (const Point& p : slices_)
      middle += static_cast<double>(p.device_ns - slices_.front().device_ns);
    middle /= static_cast<double>(slices_.size());
    std::size_t edge = 0;
    while (edge + 2 < under.size() &&
           static_cast<double>(under[edge + 1].device_ns - slices_.front().device_ns) < middle)
      ++edge;
    skew_ = 0;
    if (ready() && edge + 1 < under.size())
      skew_ = static_cast<double>(under[edge + 1].late_ns - under[edge].late_ns) /
              static_cast<double>(under[edge + 1].device_ns - under[edge].device_ns);
    skew_ = std::clamp(skew_, -limits_.skew_max, limits_.skew_max);
    origin_ns_ = under[edge].device_ns;
    offset_ns_ = static_cast<double>(under[edge].late_ns);
    for (const Point& p : under)
      offset_ns_ += std::min(0.0, static_cast<double>(p.late_ns) - line_ns(p.device_ns));
  }

  ClockFitLimits limits_;
  std::deque<Point> slices_;
  std::int64_t base_ns_{}, last_device_ns_{}, last_arrival_ns_{}, origin_ns_{};
  double offset_ns_{}, skew_{}, excess_s_{};
};

// A device with a counter of microseconds that wraps, on a transport that has its moods.
struct Stream {
  explicit Stream(std::uint32_t seed) : random(seed) {
    skew = uniform(-300e-6, 300e-6);  // More than crystals have, too.
    period_s = uniform(0.005, 0.5);
    jitter_s = one_in(4) ? 0 : std::pow(10, uniform(-6, -2));
    quantum_ns = one_in(3) ? 1'000'000 : 1;  // Equal latencies, and points in line.
    ours_ns = std::llround(uniform(-1e15, 1e15));
    raw_us = 0xFFFFFFFFU - static_cast<std::uint32_t>(uniform(0, 60e6));
    limits.window_s = one_in(2) ? 120 : uniform(2, 40);
    limits.slice_s = one_in(2) ? 1 : uniform(0.01, 3);
  }
  double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  }
  bool one_in(unsigned count) { return random() % count == 0; }

  // The time that passed, and what the counter shows now.
  void pass() {
    double span_s = period_s;
    if (one_in(700)) span_s = uniform(0, 1.5 * limits.window_s);  // Messages were lost.
    ours_ns += whole_ns(span_s);
    raw_us += static_cast<std::uint32_t>(std::llround(span_s * (1 - skew) * 1e6));
    if (one_in(50)) raw_us -= static_cast<std::uint32_t>(uniform(0, 0.5e6));  // Out of order.
    if (one_in(2000)) raw_us = static_cast<std::uint32_t>(uniform(0, 10e6));  // It restarted.
    if (one_in(3000)) raw_us += 6'000'000;                                    // It ran away.
  }
  hal::Time arrival() {
    const double late_s = jitter_s * -std::log(uniform(1e-9, 1)) + (one_in(50) ? 0.2 : 0);
    const std::int64_t at_ns = ours_ns + whole_ns(late_s);
    return hal::Time(hal::Duration(at_ns / quantum_ns * quantum_ns));
  }

  std::mt19937 random;
  ClockFitLimits limits;
  double skew{}, period_s{}, jitter_s{};
  std::int64_t quantum_ns{}, ours_ns{};
  std::uint32_t raw_us{};
};

std::uint64_t bits(double value) {
  return std::bit_cast<std::uint64_t>(value);
}

TEST(ClockFitExact, IsInEveryBitWhatAllSlicesGiveAfterEveryMessage) {
  std::uint64_t restarts = 0;
  for (std::uint32_t seed = 1; seed <= 60; ++seed) {
    SCOPED_TRACE(seed);
    Stream stream(seed);
    ClockFit fit(stream.limits);
    FitAnew anew(stream.limits);
    Unwrap unwrap;
    for (int i = 0; i < 4000; ++i) {
      stream.pass();
      const std::int64_t device_ns = unwrap(stream.raw_us) * 1000;
      const hal::Time arrival = stream.arrival();
      ASSERT_EQ(fit.add(device_ns, arrival), anew.add(device_ns, arrival)) << i;
      ASSERT_EQ(bits(fit.skew()), bits(anew.skew())) << i;
      ASSERT_EQ(bits(fit.last_excess_s()), bits(anew.last_excess_s())) << i;
      ASSERT_EQ(fit.ready(), anew.ready()) << i;
      for (const std::int64_t away_ns :
           {-1'000'000'000'000LL, -1'000'000LL, 0LL, 1'000'000'000'000LL})
        ASSERT_EQ(fit.to_ours(device_ns + away_ns), anew.to_ours(device_ns + away_ns)) << i;
    }
    restarts += fit.restarts();
  }
  EXPECT_GT(restarts, 50U);
}

}  // namespace
}  // namespace drivers
