#include "drivers/odometer.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "drivers/stall.hpp"

namespace {

using namespace std::chrono_literals;
using drivers::BlockedWay;
using drivers::Odometer;
using drivers::StallWatch;

hal::Time at(int cycle) {
  return hal::Time(cycle * 20ms);
}

TEST(Odometer, TheFirstReportOnlySaysWhereTheCountersStand) {
  Odometer odometer({1000, 2});
  EXPECT_TRUE(odometer.update(123456, -77, at(0)));
  EXPECT_FALSE(odometer.fresh());
}

TEST(Odometer, AddsUpUntilItIsTaken) {
  Odometer odometer({1000, 2});
  for (int i = 0; i < 10; ++i) odometer.update(10 * i, -5 * i, at(i));
  ASSERT_TRUE(odometer.fresh());
  const auto travel = odometer.take();
  EXPECT_DOUBLE_EQ(travel.left_m, 0.09);
  EXPECT_DOUBLE_EQ(travel.right_m, -0.045);
  EXPECT_EQ(travel.stamp, at(9));
  EXPECT_FALSE(odometer.fresh());
}

TEST(Odometer, CrossesTheWrapBothWays) {
  constexpr std::int32_t kMax = std::numeric_limits<std::int32_t>::max(),
                         kMin = std::numeric_limits<std::int32_t>::min();
  Odometer odometer({1000, 2});
  odometer.update(kMax - 4, kMin + 4, at(0));
  odometer.update(kMin + 5, kMax - 5, at(1));
  const auto travel = odometer.take();
  EXPECT_DOUBLE_EQ(travel.left_m, 0.010);
  EXPECT_DOUBLE_EQ(travel.right_m, -0.010);
}

TEST(Odometer, PassesOverSingleReportsThatCannotBeTrue) {
  Odometer odometer({1000, 2});
  odometer.update(0, 0, at(0));
  EXPECT_FALSE(odometer.update(90000, 0, at(1)));
  EXPECT_TRUE(odometer.doubtful());
  EXPECT_FALSE(odometer.update(0, -7000000, at(2)));
  EXPECT_TRUE(odometer.update(30, 30, at(3)));
  EXPECT_FALSE(odometer.doubtful());
  EXPECT_DOUBLE_EQ(odometer.take().left_m, 0.030) << "nothing is lost over it";
}

TEST(Odometer, BeginsAnewWhenSeveralReportsAgree) {
  Odometer odometer({1000, 2});
  odometer.update(50000, 50000, at(0));
  int passed_over = 0;
  for (int i = 1; i <= 10; ++i) passed_over += !odometer.update(i, i, at(i));
  EXPECT_EQ(passed_over, 5);
  EXPECT_EQ(odometer.restarts(), 1);
  EXPECT_NEAR(odometer.take().left_m, 0.004, 1e-9) << "the jump is no travel";
}

TEST(Odometer, GoesOnAfterALongSilenceAsFarAsItCouldRoll) {
  Odometer odometer({1000, 2});
  odometer.update(0, 0, at(0));
  EXPECT_TRUE(odometer.update(3000, 3000, at(5000))) << "3 m, before it stopped by itself";
  EXPECT_FALSE(odometer.update(30000, 30000, at(10000)));
}

StallWatch standing_for(int cycles, double told_mps) {
  StallWatch watch;
  for (int i = 0; i < cycles; ++i) watch.update(told_mps, 0, 20ms);
  return watch;
}

TEST(StallWatch, CountsOnlyWhileItIsToldToTurn) {
  EXPECT_EQ(standing_for(25, 0.5).standing(), 500ms);
  EXPECT_EQ(standing_for(25, -0.5).standing(), 500ms);
  EXPECT_EQ(standing_for(25, 0.01).standing(), 0ms);
}

TEST(StallWatch, ATurnOfTheCommandBeginsAnew) {
  StallWatch watch = standing_for(20, 0.5);
  watch.update(-0.5, 0, 20ms);
  EXPECT_EQ(watch.standing(), 0ms);
}

TEST(StallWatch, AWheelThatSlipsOnceIsNotFree) {
  StallWatch watch = standing_for(20, 0.5);
  watch.update(0.5, 0.01, 20ms);
  EXPECT_EQ(watch.standing(), 360ms);
  for (int i = 0; i < 20; ++i) watch.update(0.5, 0.01, 20ms);
  EXPECT_EQ(watch.standing(), 0ms);
}

TEST(BlockedWay, RefusesToPushOnUntilSomethingElseIsCommanded) {
  BlockedWay way;
  EXPECT_FALSE(way.refuses({1, 0}));
  way.block({0.5, 0.1});
  EXPECT_TRUE(way.refuses({0.1, -0.4}));
  EXPECT_TRUE(way.blocked());
  EXPECT_FALSE(way.refuses({0, 0.4}));
  EXPECT_FALSE(way.refuses({0.5, 0})) << "it may try again";
  way.block({-0.5, 0});
  EXPECT_FALSE(way.refuses({0.2, 0}));
  way.block({0, 0.3});
  EXPECT_TRUE(way.refuses({0, 0.1}));
  EXPECT_FALSE(way.refuses({0, -0.1}));
}

TEST(Agreement, SaysWhenSpeedAndCountersDiffer) {
  drivers::Agreement agreement;
  for (int i = 0; i < 100; ++i) agreement.update(0.5, 0.0105, 20ms);
  EXPECT_FALSE(agreement.disagree());
  for (int i = 0; i < 100; ++i) agreement.update(0.5, 0.015, 20ms);
  EXPECT_TRUE(agreement.disagree());
  for (int i = 0; i < 100; ++i) agreement.update(0, 0, 20ms);
  EXPECT_TRUE(agreement.disagree()) << "standing proves nothing";
  for (int i = 0; i < 100; ++i) agreement.update(0.5, 0.01, 20ms);
  EXPECT_FALSE(agreement.disagree());
}

}  // namespace
