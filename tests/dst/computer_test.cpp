// What befalls the computer in the middle of a mission: its clock is set, its disk fails, its power
// is cut. Devices are well.
#include <gmock/gmock.h>

#include "tests/dst/rig/mission.hpp"

namespace {

using namespace std::chrono_literals;

dst::Scenario quiet() {
  dst::Scenario scenario;
  scenario.releases_after = 5s;
  return scenario;
}

dst::Outcome run(const dst::Scenario& scenario) {
  dst::Outcome outcome = dst::run_mission(dst::make_quiet_yard(), scenario);
  EXPECT_FALSE(outcome.violation) << dst::report(0, *outcome.violation);
  return outcome;
}

TEST(Computer, GoesOnAsBeforeHoweverItsClockIsSet) {
  dst::Scenario scenario = quiet();
  const dst::Outcome before = run(scenario);
  scenario.clock_jumps = {{10s, std::chrono::years(-56)}, {20s, 1h}, {30s, -2h}, {40s, 1s}};
  const dst::Outcome set = run(scenario);
  EXPECT_TRUE(set.completed) << set.end;
  EXPECT_TRUE(set.same_trace(before));
}

TEST(Computer, WritesTheSameToADiskThatTakesItInParts) {
  dst::Scenario scenario = quiet();
  const dst::Outcome before = run(scenario);
  scenario.disk = dst::DiskTrouble{dst::DiskFault::short_writes, 1s, dst::kForEver};
  EXPECT_TRUE(run(scenario).same_trace(before));
}

TEST(Computer, WaitsForADiskThatFlushesSlowly) {
  dst::Scenario scenario = quiet();
  const dst::Outcome before = run(scenario);
  scenario.disk = dst::DiskTrouble{dst::DiskFault::slow_flushes, 1s, dst::kForEver};
  const dst::Outcome slow = run(scenario);
  EXPECT_TRUE(slow.completed) << slow.end;
  EXPECT_EQ(slow.scans, before.scans);
  EXPECT_EQ(slow.resumed, 0);
  EXPECT_GT(slow.virtual_time, before.virtual_time + 1s);
}

TEST(Computer, StandsWhileItsDiskFailsAndGoesOnWhenItWorksAgain) {
  const dst::Outcome before = run(quiet());
  for (const dst::DiskFault fault : {dst::DiskFault::full, dst::DiskFault::io_error})
    for (const int eighths : {1, 3, 5, 7}) {
      const hal::Duration from = eighths * before.virtual_time / 8;
      SCOPED_TRACE(testing::Message() << dst::name(fault) << " after " << hal::seconds(from));
      dst::Scenario scenario = quiet();
      scenario.disk = dst::DiskTrouble{fault, from, 100s};
      dst::Options options;
      options.observe = true;
      const dst::Outcome outcome = dst::run_mission(dst::make_quiet_yard(), scenario, options);
      EXPECT_FALSE(outcome.violation) << dst::report(0, *outcome.violation);
      EXPECT_TRUE(outcome.completed) << outcome.end;
      EXPECT_EQ(outcome.resumed, 0);
      EXPECT_EQ(outcome.scans, before.scans);
      EXPECT_TRUE(outcome.held);
      const char* const name =
          fault == dst::DiskFault::full ? "F700-disk-full" : "F701-disk-failed";
      EXPECT_TRUE(outcome.named.contains(name)) << testing::PrintToString(outcome.named);
      EXPECT_GT(outcome.virtual_time, before.virtual_time + 80s);
    }
}

TEST(Computer, EndsByNameWhenItsDiskFailsAndGoesOnWhenItIsMended) {
  const dst::Outcome before = run(quiet());
  for (const dst::DiskFault fault : {dst::DiskFault::full, dst::DiskFault::io_error})
    for (const hal::Duration from : {hal::Duration(20s), before.virtual_time / 2}) {
      SCOPED_TRACE(testing::Message() << dst::name(fault) << " after " << hal::seconds(from));
      dst::Scenario scenario = quiet();
      scenario.disk = dst::DiskTrouble{fault, from, dst::kForEver};
      const dst::Outcome outcome = run(scenario);
      EXPECT_EQ(outcome.resumed, 1);
      EXPECT_TRUE(outcome.completed) << outcome.end;
      EXPECT_EQ(outcome.scans, before.scans);
    }
}

// Whether it works again on the way, at home, or never: it is at home at the end, and goes on from
// there.
TEST(Computer, GoesHomeWhenItsDiskFailsForTooLong) {
  const dst::Outcome before = run(quiet());
  for (const dst::DiskFault fault : {dst::DiskFault::full, dst::DiskFault::io_error})
    for (const hal::Duration during : {hal::Duration(315s), hal::Duration(450s), dst::kForEver})
      for (const hal::Duration from : {hal::Duration(20s), before.virtual_time / 2}) {
        SCOPED_TRACE(testing::Message() << dst::name(fault) << " after " << hal::seconds(from)
                                        << " for " << hal::seconds(during));
        dst::Scenario scenario = quiet();
        scenario.disk = dst::DiskTrouble{fault, from, during, true};
        dst::Options options;
        options.observe = true;
        const dst::Outcome outcome = dst::run_mission(dst::make_quiet_yard(), scenario, options);
        EXPECT_FALSE(outcome.violation) << dst::report(0, *outcome.violation);
        EXPECT_TRUE(outcome.named.contains("F704-disk-given-up"))
            << testing::PrintToString(outcome.named);
        EXPECT_EQ(outcome.resumed, 1);
        EXPECT_TRUE(outcome.completed) << outcome.end;
        EXPECT_EQ(outcome.scans, before.scans);
      }
}

TEST(Computer, KeepsEveryScanWhenItsPowerIsCutAnywhere) {
  const dst::Outcome before = run(quiet());
  for (int i = 1; i <= 8; ++i) {
    SCOPED_TRACE(testing::Message() << "cut after " << i << " ninths");
    dst::Scenario scenario = quiet();
    scenario.seed = static_cast<std::uint64_t>(i);
    scenario.power_cut = dst::PowerCut{i * before.virtual_time / 9, 17 * i};
    const dst::Outcome outcome = run(scenario);
    EXPECT_EQ(outcome.resumed, 1);
    EXPECT_TRUE(outcome.completed) << outcome.end;
    EXPECT_EQ(outcome.scans, before.scans);
  }
}

TEST(Computer, KeepsEveryScanWhenItsPowerIsCutAgainAsItGoesOn) {
  const dst::Outcome before = run(quiet());
  for (int i = 1; i <= 3; ++i) {
    SCOPED_TRACE(testing::Message() << "cut after " << i << " quarters");
    dst::Scenario scenario = quiet();
    scenario.seed = static_cast<std::uint64_t>(i);
    scenario.power_cut = dst::PowerCut{i * before.virtual_time / 4, 17 * i};
    scenario.cut_again = dst::PowerCut{10s * i, 31 * i};
    const dst::Outcome outcome = run(scenario);
    EXPECT_EQ(outcome.resumed, 2);
    EXPECT_TRUE(outcome.completed) << outcome.end;
    EXPECT_EQ(outcome.scans, before.scans);
  }
}

}  // namespace
