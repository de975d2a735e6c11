// Missions on devices that fail, one for each seed. What must always hold is in rig/judge.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>

#include "tests/dst/rig/missions.hpp"
#include "tests/dst/rig/soak.hpp"

namespace {

using namespace std::chrono_literals;

bool nightly() {
  return std::getenv("VANTAGE_NIGHTLY") != nullptr;
}

// Two hundred missions; with VANTAGE_NIGHTLY ten thousand.
class Quarter : public testing::TestWithParam<int> {};

TEST_P(Quarter, KeepsWhatMustAlwaysHold) {
  const int count = nightly() ? 2500 : 50;
  const auto first = static_cast<std::uint64_t>(GetParam() * count + 1);
  const dst::Sums sums =
      dst::run_seeds(first, count, 1, [](std::uint64_t seed, const dst::Outcome& outcome) {
        if (outcome.violation) ADD_FAILURE() << dst::report(seed, *outcome.violation);
      });
  std::printf("%s", sums.text().c_str());
  EXPECT_EQ(sums.missions, count);
  EXPECT_GT(sums.completed, count / 4) << "missions that hardly begin show nothing";
  EXPECT_GT(sums.stops, count / 2);
}

INSTANTIATE_TEST_SUITE_P(FaultyMissions, Quarter, testing::Range(0, 4));

TEST(FaultyMissions, RepeatByteForByte) {
  for (const std::uint64_t seed : {1U, 2U, 3U, 4U, 5U, 6U}) {
    const dst::Outcome one = dst::run_seed(seed), two = dst::run_seed(seed);
    EXPECT_TRUE(one.same_trace(two)) << "seed " << seed;
    EXPECT_NE(one.frames_hash, dst::run_seed(seed + 100).frames_hash);
  }
}

// Seeds that once showed a mistake, as they were named when it was mended.
class KeptSeed : public testing::TestWithParam<std::uint64_t> {};

TEST_P(KeptSeed, KeepsWhatMustAlwaysHold) {
  const dst::Outcome outcome = dst::run_seed(GetParam());
  EXPECT_FALSE(outcome.violation) << dst::report(GetParam(), *outcome.violation);
}

// In the order given: the robot crept for the proof of its drive's time-out while a scan was taken;
// its drive had fallen silent during that proof. A press of the reset button counted again, or only
// then, when safety inputs were heard again (the next three).
INSTANTIATE_TEST_SUITE_P(FaultyMissions, KeptSeed, testing::Values(62, 73, 20696, 20707, 21269));

// Five devices that are switched on one after the other, a minute apart.
dst::Scenario arrivals(const std::vector<std::string>& order) {
  dst::Scenario scenario;
  scenario.releases_after = 5s;
  hal::Duration at{};
  for (const std::string& role : order)
    scenario.faults.push_back({role, {sim::UnitFault::off, 0}, 0s, at += 60s});
  return scenario;
}

TEST(Arrivals, EndInTheSameStateInWhateverOrderDevicesCome) {
  const support::RandomYard yard = dst::make_quiet_yard();
  const dst::Outcome at_once = dst::run_mission(yard, arrivals({}));
  ASSERT_TRUE(at_once.completed) << at_once.end;
  std::vector<std::string> order{"drive", "gnss", "imu", "pan", "scanner"};
  int permutation = 0;
  do {
    if (!nightly() && permutation++ % 20 != 0) continue;
    const dst::Outcome late = dst::run_mission(yard, arrivals(order));
    EXPECT_FALSE(late.violation) << dst::report(0, *late.violation);
    EXPECT_TRUE(late.completed) << late.end;
    EXPECT_EQ(late.scans, at_once.scans);
    EXPECT_EQ(late.stops, 0) << testing::PrintToString(order);
    EXPECT_GT(late.virtual_time, at_once.virtual_time + 290s);
  } while (std::ranges::next_permutation(order).found);
}

TEST(Soak, KeepsMemoryAndDescriptorsFlatWhileDevicesComeAndGo) {
  const dst::SoakResult result =
      dst::soak(1, nightly() ? hal::Duration(72h) : hal::Duration(30min));
  std::printf("%s", result.text().c_str());
  EXPECT_FALSE(result.outcome.violation) << dst::report(1, *result.outcome.violation);
  EXPECT_TRUE(result.outcome.completed) << result.outcome.end;
  EXPECT_TRUE(result.flat()) << result.text();
}

}  // namespace
