#include "sim/pan_motion.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace {

using namespace std::chrono_literals;
using sim::PanMotion;

hal::Time at(double t_s) {
  return hal::Time(hal::from_seconds(t_s));
}

TEST(PanMotion, GoesUpToSpeedCruisesAndStopsAtItsTarget) {
  const PanMotion motion(at(1), 100, 0, 1100, 100, 50);  // 2 s ramps of 100 each, 8 s at 100.
  EXPECT_DOUBLE_EQ(motion.at(at(0)), 100);
  EXPECT_DOUBLE_EQ(motion.at(at(2)), 125);
  EXPECT_DOUBLE_EQ(motion.at(at(3)), 200);
  EXPECT_DOUBLE_EQ(motion.at(at(7)), 600);
  EXPECT_DOUBLE_EQ(motion.speed(at(7)), 100);
  EXPECT_NEAR(motion.at(at(12)), 1075, 1e-9);
  EXPECT_EQ(motion.end(), at(13));
  EXPECT_DOUBLE_EQ(motion.at(at(50)), 1100);
  EXPECT_DOUBLE_EQ(motion.speed(at(50)), 0);
}

TEST(PanMotion, DoesNotReachItsSpeedOnAShortWay) {
  const PanMotion motion(at(0), 0, 0, -50, 1000, 50);
  EXPECT_NEAR(motion.at(at(1)), -25, 1e-9);
  EXPECT_NEAR(motion.speed(at(1)), -50, 1e-9);
  EXPECT_EQ(motion.end(), at(2));
}

// Whatever it did before, it never jumps, never is faster than it may be and ends at its target.
TEST(PanMotion, ChangesItsMindSmoothly) {
  for (const double speed : {-80.0, -10.0, 0.0, 30.0, 90.0})
    for (const double target : {-500.0, -20.0, 0.0, 7.0, 400.0})
      for (const double speed_max : {20.0, 100.0}) {
        const PanMotion motion(at(0), 0, speed, target, speed_max, 50);
        double before = 0, before_speed = speed;
        for (double t = 0.01; t < hal::seconds(motion.end()) + 0.1; t += 0.01) {
          EXPECT_NEAR(motion.speed(at(t)), before_speed, 50 * 0.01 + 1e-6);
          EXPECT_NEAR(motion.at(at(t)) - before, (motion.speed(at(t)) + before_speed) / 2 * 0.01,
                      50 * 0.01 * 0.01);
          EXPECT_LE(std::abs(motion.speed(at(t))), std::max(speed_max, std::abs(speed)) + 1e-6);
          before = motion.at(at(t));
          before_speed = motion.speed(at(t));
        }
        EXPECT_DOUBLE_EQ(motion.at(motion.end()), target);
      }
}

TEST(PanMotion, StopsAsFastAsItMay) {
  const auto motion = PanMotion::stopping(at(0), 10, -100, 50);
  EXPECT_EQ(motion.end(), at(2));
  EXPECT_DOUBLE_EQ(motion.target(), -90);
  EXPECT_NEAR(motion.at(at(1)), -65, 1e-9);
}

}  // namespace
