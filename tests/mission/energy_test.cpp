#include "mission/energy.hpp"

#include <gtest/gtest.h>

#include "tests/mission/mission_site.hpp"

namespace energy_tests {
namespace {

using mission::EnergyBook;

// 180 W driving, 70 W scanning, 50 W standing.
mission::BatteryConfig battery(double capacity_wh, double reserve_share = 0.1) {
  mission::BatteryConfig config;
  config.capacity_wh = capacity_wh;
  config.reserve_share = reserve_share;
  return config;
}

TEST(Energy, IsPowerTimesTime) {
  EXPECT_DOUBLE_EQ(mission::energy_wh(battery(1), {3600, 0, 0}), 180);
  EXPECT_DOUBLE_EQ(mission::energy_wh(battery(1), {20, 3600, 7200}), 1 + 70 + 100);
}

TEST(Energy, KeepsTheWayHomeAndTheReserve) {
  EnergyBook book(battery(100), 360);  // A scan takes 7 Wh, 100 s of driving 5.
  EXPECT_DOUBLE_EQ(book.needed_wh(100, 200), 5 + 7 + 10 + 10);
  EXPECT_TRUE(book.affords(100, 200));
  book.drove(1360);  // 68 Wh: exactly enough is left.
  EXPECT_DOUBLE_EQ(book.left_wh(), 32);
  EXPECT_TRUE(book.affords(100, 200));
  book.stood(1);
  EXPECT_FALSE(book.affords(100, 200));
}

TEST(Energy, LearnsHowLongAScanTakes) {
  EnergyBook book(battery(100), 360);
  EXPECT_DOUBLE_EQ(book.scan_s(), 360);
  book.scanned(100);
  book.scanned(200);
  EXPECT_DOUBLE_EQ(book.scan_s(), 150);
}

TEST(Energy, ForetellsAsManyScansAsTheBatteryHas) {
  const EnergyBook book(battery(100), 360);
  // Each stop takes 12 Wh; 20 Wh are for the way home and the reserve.
  const auto forecast = book.forecast(std::vector<double>(10, 100.0), 200);
  EXPECT_EQ(forecast.scans_left, 6);
  EXPECT_DOUBLE_EQ(forecast.minutes_left, 6 * 460 / 60.0);
  EXPECT_DOUBLE_EQ(forecast.needed_wh, 32);
  EXPECT_EQ(book.forecast({100}, 200).scans_left, 1);
  EXPECT_EQ(book.forecast({100}, 5000).scans_left, 0);
}

TEST(Energy, TellsHowFarOffItsForecastsWere) {
  EnergyBook book(battery(1000), 60);
  book.foretold(0, {.left_wh = 0, .needed_wh = 0, .scans_left = 2, .minutes_left = 9});
  book.foretold(300, {.left_wh = 0, .needed_wh = 0, .scans_left = 1, .minutes_left = 7});
  const auto error = book.error_at(600);  // It took 10 and 5 minutes.
  EXPECT_EQ(error.forecasts, 2);
  EXPECT_DOUBLE_EQ(error.mean_abs_min, 1.5);
  EXPECT_DOUBLE_EQ(error.max_abs_min, 2);
  EXPECT_DOUBLE_EQ(error.mean_share, (0.1 + 0.4) / 2);
}

TEST(Energy, OfAMissionIsReckonedAndForetold) {
  // What a scan takes is known to a few seconds.
  const mission_test::SmallSite site("[scanner]\nscan_s = 40.0\n" +
                                     mission_test::kQuickRobot.substr(10));
  const auto outcome = site.run();
  const auto& energy = outcome.record.energy;
  EXPECT_TRUE(outcome.record.completed);
  EXPECT_NEAR(energy.spent.total_s(), outcome.record.mission_s, 1);
  EXPECT_GT(energy.left_wh, energy.reserve_wh);
  EXPECT_GE(energy.error.forecasts, 2);
  EXPECT_LT(energy.error.mean_share, 0.2);
  std::printf(
      "%.1f s a scan, %.1f Wh used; %d forecasts of the time left, off by %.1f min (%.1f %%) on "
      "average\n",
      energy.spent.scan_s / static_cast<double>(outcome.record.scans.size()), energy.used_wh,
      energy.error.forecasts, energy.error.mean_abs_min, 100 * energy.error.mean_share);
}

// What the whole mission takes, less a little, is not enough: it ends early, at home.
TEST(Energy, EndsAMissionInTimeToComeHome) {
  const double needed_wh = mission_test::SmallSite().run().record.energy.used_wh;
  const mission_test::SmallSite site(mission_test::kQuickRobot + "[battery]\ncapacity_wh = " +
                                     std::to_string(0.9 * needed_wh + 0.1) + "\n");
  const auto outcome = site.run();
  const auto& record = outcome.record;
  EXPECT_TRUE(record.completed) << record.end;
  ASSERT_FALSE(record.dropped.empty());
  EXPECT_NE(record.dropped.back().reason.find("the battery has"), std::string::npos)
      << record.dropped.back().reason;
  EXPECT_GE(record.energy.left_wh, 0.9 * record.energy.reserve_wh);
  ASSERT_FALSE(record.driven_m.empty());
  if (!record.driven_m.back().empty()) {
    const auto& way_m = record.driven_m.back();
    EXPECT_LT((way_m.back() - record.driven_m.front().front()).norm(), 1.5);
  }
}

}  // namespace
}  // namespace energy_tests
