// The history against a filter that goes through all that was told, in order, each time.
#include "nav/localizer_history.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <vector>

#include "nav/localizer.hpp"
#include "tests/support/random_site.hpp"

namespace {

using Told = std::vector<nav::LocalizerEvent>;

hal::Time tick(int count) {
  return hal::Time{} + std::chrono::milliseconds(20) * count;
}

// As a robot tells it: gyro and wheels at 50 Hz, of the same stamps, satellites at 5 Hz. Each with
// the tick at which it arrives.
std::vector<std::pair<int, nav::LocalizerEvent>> robot(
    support::Dice& dice, int ticks, const std::function<int(std::size_t)>& late) {
  std::vector<std::pair<int, nav::LocalizerEvent>> told;
  const auto tell = [&](int at, const nav::LocalizerEvent& event) {
    told.emplace_back(at + late(event.index()), event);
  };
  for (int i = 1; i <= ticks; ++i) {
    const double way_m = i / 100 % 3 == 0 ? 0 : 0.02 + dice.gauss(0.001);
    tell(i, hal::WheelTravel{tick(i), way_m, way_m * 1.01});
    if (i % 10 == 0)
      tell(i, nav::GnssPosition{tick(i), {0.02 * i + dice.gauss(0.02), dice.gauss(0.02)}});
    tell(i, nav::InertialSample{tick(i), {0, 0, dice.gauss(0.001)}, {}});
  }
  std::stable_sort(told.begin(), told.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  return told;
}

struct Plain {
  nav::LocalizerConfig config;
  Told told;

  void add(const nav::LocalizerEvent& event) {
    told.insert(std::upper_bound(told.begin(), told.end(), event, nav::goes_before), event);
  }
  nav::LocalizerFilter filter(std::size_t count) const {
    nav::LocalizerFilter filter(config, {}, 0.01 * Eigen::Matrix3d::Identity());
    for (std::size_t i = 0; i < count; ++i) filter.apply(config, told[i]);
    return filter;
  }
};

void expect_same(const nav::LocalizerFilter& a, const nav::LocalizerFilter& b) {
  ASSERT_EQ(a.pose().position_m, b.pose().position_m);
  ASSERT_EQ(a.pose().heading_rad, b.pose().heading_rad);
  ASSERT_EQ(a.covariance(), b.covariance());
  ASSERT_EQ(a.gyro_bias_radps(), b.gyro_bias_radps());
}

void expect_plain(std::uint64_t seed, double history_s,
                  const std::function<int(std::size_t, support::Dice&)>& late) {
  support::Dice dice(seed), lateness(seed + 100);
  Plain plain;
  plain.config.history_s = history_s;
  nav::LocalizerHistory history(plain.config, {}, 0.01 * Eigen::Matrix3d::Identity());
  int count = 0;
  for (const auto& [when, event] :
       robot(dice, 300, [&](auto kind) { return late(kind, lateness); })) {
    const auto done = history.add(event);
    ASSERT_FALSE(done.too_late);
    plain.add(event);
    if (++count % 7 != 0) continue;
    expect_same(history.filter(), plain.filter(plain.told.size()));
    // Of a travel report that others have corrected since.
    const auto back =
        plain.told.size() - 1 - std::min<std::size_t>(plain.told.size() - 1, count % 50);
    if (!std::holds_alternative<hal::WheelTravel>(plain.told[back])) continue;
    std::size_t same = back;
    while (same + 1 < plain.told.size() &&
           nav::stamp_of(plain.told[same + 1]) == nav::stamp_of(plain.told[back]))
      ++same;
    const auto then = plain.filter(same + 1).pose();
    const auto at = history.pose_at(nav::stamp_of(plain.told[back]));
    ASSERT_EQ(at.position_m, then.position_m);
    ASSERT_EQ(at.heading_rad, then.heading_rad);
  }
}

TEST(LocalizerHistory, GyroThatComesJustAfterItsTravelReport) {
  expect_plain(1, 2, [](std::size_t, support::Dice&) { return 0; });
}

TEST(LocalizerHistory, SatellitesThatComeLate) {
  expect_plain(2, 2, [](std::size_t kind, support::Dice& dice) {
    return kind == 2 ? static_cast<int>(dice.uniform(0, 60)) : 0;
  });
}

TEST(LocalizerHistory, AllInAnyOrder) {
  for (std::uint64_t seed = 3; seed < 8; ++seed)
    expect_plain(seed, 2, [](std::size_t, support::Dice& dice) {
      return static_cast<int>(dice.uniform(0, 90));
    });
}

// Late ones make its blocks long: they are halved.
TEST(LocalizerHistory, AGyroThatIsAlwaysLateAndAHistoryThatIsLong) {
  expect_plain(9, 100, [](std::size_t kind, support::Dice&) { return kind == 0 ? 45 : 0; });
  expect_plain(10, 100, [](std::size_t kind, support::Dice& dice) {
    return kind == 1 ? 0 : static_cast<int>(dice.uniform(0, 300));
  });
}

// The robot tells its travel before the gyro of that time: it waits, and what is asked meanwhile
// counts it.
TEST(LocalizerHistory, TravelThatWaitsForItsGyroIsCountedWhenItIsAsked) {
  for (const int every : {1, 3, 1000}) {
    support::Dice dice(11);
    Plain plain;
    nav::Localizer localizer(plain.config, {}, 0.01 * Eigen::Matrix3d::Identity());
    int count = 0;
    for (const auto& [when, event] : robot(dice, 200, [](std::size_t) { return 0; })) {
      if (const auto* travel = std::get_if<hal::WheelTravel>(&event))
        localizer.predict(*travel);
      else
        localizer.add(event);
      plain.add(event);
      if (++count % every != 0) continue;
      const auto filter = plain.filter(plain.told.size());
      ASSERT_EQ(localizer.pose().position_m, filter.pose().position_m);
      ASSERT_EQ(localizer.pose_at(nav::stamp_of(event)).heading_rad, filter.pose().heading_rad);
      ASSERT_EQ(localizer.covariance(), filter.covariance());
      ASSERT_EQ(localizer.standing(), filter.standing());
    }
    ASSERT_EQ(localizer.covariance(), plain.filter(plain.told.size()).covariance());
  }
}

}  // namespace
