#include "mission/sensor_log.hpp"

#include <gtest/gtest.h>

namespace mission {
namespace {

using Sensor = SensorLog::Sensor;
using What = SensorEvent::What;

hal::Time at(double s) {
  return hal::Time(hal::from_seconds(s));
}

TEST(SensorLog, TellsWhenASensorFallsSilentAndForHowLong) {
  SensorLog log(at(0));
  for (double s = 1; s <= 10; ++s) log.heard(Sensor::imu, at(s)), log.heard(Sensor::gnss, at(s));
  for (double s = 11; s <= 40; ++s) log.heard(Sensor::imu, at(s));
  const auto lost = log.take(at(40));
  ASSERT_EQ(lost.size(), 1U);
  EXPECT_EQ(lost[0].sensor, "satellites");
  EXPECT_EQ(lost[0].what, What::lost);
  EXPECT_EQ(lost[0].at, at(13));
  EXPECT_TRUE(log.take(at(41)).empty());  // Told once.
  EXPECT_EQ(log.silent_s(Sensor::gnss, at(40)), 30);
  log.heard(Sensor::gnss, at(50));
  log.heard(Sensor::imu, at(50));
  const auto back = log.take(at(50));
  ASSERT_EQ(back.size(), 3U);  // The IMU was away too.
  EXPECT_EQ(back[0].what, What::back);
  EXPECT_EQ(back[0].for_s, 40);
  EXPECT_EQ(back[2].sensor, "IMU");
  EXPECT_EQ(log.losses(Sensor::gnss), 1);
  EXPECT_EQ(log.silent_s(Sensor::gnss, at(52)), 40);
  EXPECT_EQ(log.losses(Sensor::imu), 1);
}

TEST(SensorLog, ASensorThatNeverSpokeIsLost) {
  SensorLog log(at(0));
  EXPECT_EQ(log.take(at(60)).size(), 2U);
}

TEST(SensorLog, CountsFixesAndTellsOfStreaksThatWereRefused) {
  SensorLog log(at(0));
  for (int i = 0; i < 25; ++i) log.judged(nav::Gate::rejected, at(1 + 0.2 * i));
  log.judged(nav::Gate::accepted, at(6));
  for (int i = 0; i < 5; ++i) log.judged(nav::Gate::rejected, at(7));
  log.judged(nav::Gate::accepted, at(7));
  for (int i = 0; i < 3; ++i) log.heard(Sensor::imu, at(7)), log.heard(Sensor::gnss, at(7));
  std::vector<SensorEvent> refused;
  for (const SensorEvent& event : log.take(at(7)))
    if (event.what == What::refused) refused.push_back(event);
  ASSERT_EQ(refused.size(), 1U);  // Five are no streak.
  EXPECT_EQ(refused[0].count, 25U);
  EXPECT_NEAR(refused[0].for_s, 5, 1e-6);
  EXPECT_EQ(log.gnss().fixes, 32U);
  EXPECT_EQ(log.gnss().refused, 30U);
  EXPECT_EQ(log.gnss().resets, 0U);
}

TEST(SensorLog, TellsOfAReset) {
  SensorLog log(at(0));
  log.judged(nav::Gate::reset, at(1));
  ASSERT_EQ(log.take(at(1)).size(), 1U);
  EXPECT_EQ(log.gnss().resets, 1U);
}

TEST(SensorLog, KeepsABoundedNumberOfEvents) {
  SensorLog log(at(0));
  for (int i = 0; i < 5000; ++i) log.judged(nav::Gate::reset, at(1));
  EXPECT_EQ(log.take(at(1)).size(), SensorLog::kEventsMax);
  EXPECT_EQ(log.gnss().resets, 5000U);
}

}  // namespace
}  // namespace mission
