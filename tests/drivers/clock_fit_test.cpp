#include "drivers/clock_fit.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace drivers {
namespace {

hal::Time at_ns(std::int64_t ns) {
  return hal::Time(hal::Duration(ns));
}

// A device that sends 50 times a second, `skew` slower than ours, over a jittery transport.
struct Line {
  double skew{};
  std::int64_t offset_ns = 3'000'000'000'000;
  double least_s = 0.0003, jitter_s = 0.004, hiccup_s = 0.2;
  std::mt19937 random{3};

  std::int64_t ours_ns(std::int64_t device_ns) const {
    return offset_ns + device_ns + std::llround(skew * static_cast<double>(device_ns));
  }
  hal::Time arrival(std::int64_t device_ns) {
    std::exponential_distribution<double> late(1 / jitter_s);
    const double hiccup = random() % 50 == 0 ? hiccup_s : 0;
    return at_ns(ours_ns(device_ns) + std::llround((least_s + late(random) + hiccup) * 1e9));
  }
};

TEST(Unwrap, GoesOnOverTheWrapAndBackALittle) {
  Unwrap unwrap;
  EXPECT_EQ(unwrap(0xFFFFFFF0), 0xFFFFFFF0LL);
  EXPECT_EQ(unwrap(0x10), 0x100000010LL);
  EXPECT_EQ(unwrap(0xFFFFFFFF), 0xFFFFFFFFLL);
  EXPECT_EQ(unwrap(0x7FFFFFFE), 0x17FFFFFFELL);
  Unwrap day(24);
  EXPECT_EQ(day(0xFFFFFF), 0xFFFFFF);
  EXPECT_EQ(day(0), 0x1000000);
  Unwrap all(64);
  EXPECT_EQ(all(5), 5);
  EXPECT_EQ(all(3), 3);
}

TEST(ClockFit, FindsOffsetAndSkewUnderJitter) {
  for (const double skew : {-50e-6, 0.0, 20e-6, 50e-6}) {
    Line line;
    line.skew = skew;
    ClockFit fit;
    std::int64_t device_ns = 777'000'000;
    double worst_s = 0;
    for (int i = 0; i < 50 * 120; ++i, device_ns += 20'000'000) {
      EXPECT_EQ(fit.add(device_ns, line.arrival(device_ns)), ClockFit::Seen::kept);
      if (i < 50 * 30) continue;  // Half a minute to settle.
      const double error_s =
          static_cast<double>(fit.to_ours(device_ns)->time_since_epoch().count() -
                              line.ours_ns(device_ns)) /
              1e9 -
          line.least_s;
      worst_s = std::max(worst_s, std::abs(error_s));
    }
    EXPECT_LT(worst_s, 0.0005) << skew;  // The scans' limit is 2 ms.
    EXPECT_NEAR(fit.skew(), skew, 5e-6);
    EXPECT_TRUE(fit.ready());
    EXPECT_EQ(fit.restarts(), 0U);
  }
}

TEST(ClockFit, NeverPutsAMessageAfterItsArrival) {
  Line line;
  line.skew = 30e-6;
  ClockFit fit;
  for (std::int64_t device_ns = 0; device_ns < 60'000'000'000; device_ns += 20'000'000) {
    const hal::Time arrival = line.arrival(device_ns);
    fit.add(device_ns, arrival);
    EXPECT_LE(*fit.to_ours(device_ns), arrival + hal::Duration(1'000'000));
    EXPECT_GE(fit.last_excess_s(), -0.001);
  }
}

TEST(ClockFit, ARestartDropsTheFitAndAWrapDoesNot) {
  Line line;
  ClockFit fit;
  Unwrap unwrap;
  std::uint32_t raw_us = 0xFFFFFFFF - 5'000'000;  // Five seconds before the wrap.
  std::int64_t ours = 0;
  const auto step = [&] {
    raw_us += 20000;
    ours += 20'000'000;
    return fit.add(unwrap(raw_us) * 1000, at_ns(ours));
  };
  for (int i = 0; i < 500; ++i) EXPECT_EQ(step(), ClockFit::Seen::kept);
  EXPECT_NEAR(fit.skew(), 0, 1e-9);
  raw_us = 1000;  // It was switched off for 30 s.
  ours += 30'000'000'000;
  EXPECT_EQ(step(), ClockFit::Seen::restarted);
  EXPECT_FALSE(fit.ready());
  for (int i = 0; i < 500; ++i) EXPECT_EQ(step(), ClockFit::Seen::kept);
  EXPECT_EQ(fit.to_ours(unwrap(raw_us) * 1000), at_ns(ours));
  EXPECT_EQ(fit.restarts(), 1U);
}

TEST(ClockFit, LostMessagesKeepTheFitAndADeviceThatRunsAwayDoesNot) {
  ClockFit fit;
  EXPECT_FALSE(fit.to_ours(0));
  fit.add(0, at_ns(0));
  EXPECT_EQ(fit.add(60'000'000'000, at_ns(60'000'000'000)), ClockFit::Seen::kept);
  EXPECT_EQ(fit.add(70'000'000'000, at_ns(60'020'000'000)), ClockFit::Seen::restarted);
}

TEST(ClockFit, HoldsNoMoreThanItsWindow) {
  ClockFitLimits limits;
  limits.window_s = 10;
  ClockFit fit(limits);
  // The latency rises by 3 ms for good: when the old messages are forgotten, the fit follows.
  std::int64_t device_ns = 0;
  for (int i = 0; i < 50 * 20; ++i, device_ns += 20'000'000) fit.add(device_ns, at_ns(device_ns));
  for (int i = 0; i < 50 * 20; ++i, device_ns += 20'000'000)
    fit.add(device_ns, at_ns(device_ns + 3'000'000));
  EXPECT_NEAR(static_cast<double>(fit.to_ours(device_ns)->time_since_epoch().count() - device_ns),
              3e6, 1e3);
}

}  // namespace
}  // namespace drivers
