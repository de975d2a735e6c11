// Missions with somebody at the serial console, who types what they should not. What must always
// hold is in rig/judge.
#include "tests/dst/rig/operator.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>

#include "tests/dst/rig/mission.hpp"

namespace {

using namespace std::chrono_literals;
using testing::Contains;
using testing::HasSubstr;
using Typed = dst::Operator::Typed;

constexpr const char* kLogin = "login\rcorrect horse\r";

dst::Scenario typing(std::vector<Typed> typed) {
  dst::Scenario scenario;
  scenario.releases_after = 5s;
  scenario.at_console.emplace();
  scenario.at_console->typed = std::move(typed);
  return scenario;
}

dst::Outcome run_with(const dst::Scenario& scenario) {
  return dst::run_mission(dst::make_quiet_yard(), scenario);
}

// Held down from `from` on for so long.
void hold(std::vector<Typed>& typed, char key, hal::Duration from, hal::Duration during) {
  for (hal::Duration at = from; at < from + during; at += 50ms)
    typed.push_back({at, std::string(1, key)});
}

TEST(Operator, ThatNobodyKnowsMovesNothingAndTheMissionGoesOn) {
  const dst::Outcome alone = run_with(typing({}));
  ASSERT_TRUE(alone.completed) << alone.end;
  std::vector<Typed> typed{{12s, "status\rwhy\rfaults\r"}, {13s, "teleop\r"}};
  hold(typed, 'w', 14s, 3s);
  for (const char* line : {"arm\r", "goto 1 1\r", "scan\r", "skip\r", "home\r", "resume\r",
                           "login\rwrong\r", "\x01\xFF\x80 garbage\r", "hom"})
    typed.push_back({typed.back().at + 1s, line});
  const dst::Outcome outcome = run_with(typing(typed));
  EXPECT_FALSE(outcome.violation) << dst::report(0, *outcome.violation);
  EXPECT_TRUE(outcome.completed) << outcome.end;
  EXPECT_EQ(outcome.scans, alone.scans);
  EXPECT_EQ(outcome.decisions_hash, alone.decisions_hash);
  EXPECT_EQ(outcome.frames_hash, alone.frames_hash) << "the drive was told otherwise";
  EXPECT_NE(outcome.console_hash, alone.console_hash);
}

TEST(Operator, ThatIsLoggedInDrivesWithKeysThatAreLostAndHandsBack) {
  std::vector<Typed> typed{{8s, kLogin}, {15s, "teleop\r"}};
  hold(typed, 'w', 16s, 1s);
  hold(typed, 'x', 17s + 500ms, 500ms);  // In between nobody holds a key.
  typed.push_back({20s, "qresume\r"});
  const dst::Outcome outcome = run_with(typing(typed));
  EXPECT_FALSE(outcome.violation) << dst::report(0, *outcome.violation);
  EXPECT_TRUE(outcome.completed) << outcome.end;
  EXPECT_NE(outcome.frames_hash, run_with(typing({})).frames_hash);
}

TEST(Operator, ThatLeavesInTheMiddleOfDrivingIsHelped) {
  std::vector<Typed> typed{{8s, kLogin}, {15s, "teleop\r"}};
  hold(typed, 'a', 16s, 1s);
  const dst::Outcome outcome = run_with(typing(typed));
  EXPECT_FALSE(outcome.violation) << dst::report(0, *outcome.violation);
  EXPECT_TRUE(outcome.completed) << outcome.end;
}

TEST(Operator, StopsTheRobotWithoutALoginAndAPersonReleasesIt) {
  const dst::Outcome alone = run_with(typing({}));
  const dst::Outcome outcome =
      run_with(typing({{13s, "stop\r"}, {17s, "disarm\r"}, {19s, "xstop"}}));
  EXPECT_FALSE(outcome.violation) << dst::report(0, *outcome.violation);
  EXPECT_TRUE(outcome.completed) << outcome.end;
  EXPECT_EQ(outcome.scans, alone.scans);
  EXPECT_GT(outcome.virtual_time, alone.virtual_time + 4s);
}

TEST(Operator, SendsTheRobotHomeAndTheMissionEndsWithThatReason) {
  const dst::Outcome outcome = run_with(typing({{8s, kLogin}, {15s, "home\r"}}));
  EXPECT_FALSE(outcome.violation) << dst::report(0, *outcome.violation);
  EXPECT_FALSE(outcome.completed);
  EXPECT_THAT(outcome.end, HasSubstr("sent home by the operator"));
}

// The judge does not see this password come, as it would not see that of a console that lets
// everybody in.
TEST(Operator, IsFoundOutByTheJudgeWhenNobodyShouldBeLoggedIn) {
  const dst::Outcome outcome =
      run_with(typing({{8s, "login\rcorrect"}, {9s, " horse\r"}, {15s, "skip\r"}}));
  ASSERT_TRUE(outcome.violation);
  EXPECT_THAT(outcome.violation->invariant, HasSubstr("nobody is logged in"));
}

std::string set_password() {
  return fmt::format("set-password\r{0}\r{0}\r", dst::kNewPassword);
}

TEST(Operator, ThatSetsAnotherPasswordLogsEverybodyOutAndTheOldOneNoLongerCounts) {
  const dst::Outcome outcome = run_with(typing(
      {{8s, kLogin}, {10s, set_password()}, {14s, "home\r"}, {16s, kLogin}, {18s, "home\r"}}));
  EXPECT_FALSE(outcome.violation) << dst::report(0, *outcome.violation);
  EXPECT_TRUE(outcome.password_set);
  EXPECT_TRUE(outcome.completed) << outcome.end;
  const std::string login = fmt::format("login\r{}\r", dst::kNewPassword);
  const dst::Outcome anew =
      run_with(typing({{8s, kLogin}, {10s, set_password()}, {14s, login}, {18s, "home\r"}}));
  EXPECT_FALSE(anew.violation) << dst::report(0, *anew.violation);
  EXPECT_THAT(anew.end, HasSubstr("sent home by the operator"));
}

// To the judge, whoever was logged in before the password was set is so no more.
TEST(Operator, IsFoundOutByTheJudgeWhenALoginOutlivesItsPassword) {
  const dst::Outcome outcome = run_with(typing({{8s, kLogin},
                                                {10s, set_password()},
                                                {14s, "login\rbattery"},
                                                {15s, " staple\r"},
                                                {18s, "skip\r"}}));
  ASSERT_TRUE(outcome.violation);
  EXPECT_THAT(outcome.violation->invariant, HasSubstr("nobody is logged in"));
}

TEST(Operator, SetsAnotherPasswordInSomeOfTheRandomMissions) {
  int there = 0, set = 0;
  for (std::uint64_t seed = 1; there < 8; ++seed) {
    const auto who = dst::draw_scenario(seed).at_console;
    const auto sets = [](const Typed& typed) { return typed.bytes == set_password(); };
    if (!who || std::ranges::none_of(who->typed, sets)) continue;
    ++there;
    const dst::Outcome outcome = dst::run_seed(seed);
    EXPECT_FALSE(outcome.violation) << dst::report(seed, *outcome.violation);
    set += outcome.password_set;
  }
  EXPECT_GE(set, 2);
}

TEST(Operator, TypesTheSameForTheSameSeed) {
  int there = 0;
  for (std::uint64_t seed = 1; there < 4; ++seed) {
    if (!dst::draw_scenario(seed).at_console) continue;
    ++there;
    const dst::Outcome one = dst::run_seed(seed), two = dst::run_seed(seed);
    EXPECT_TRUE(one.same_trace(two)) << "seed " << seed;
    EXPECT_NE(one.console_hash, 0U);
    EXPECT_FALSE(one.violation) << dst::report(seed, *one.violation);
  }
}

}  // namespace
