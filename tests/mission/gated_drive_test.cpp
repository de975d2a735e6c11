// The gate between a mission and a simulated drive, judged by the frames on the bus.
#include <cmath>

#include "tests/mission/gated_rig.hpp"

namespace gate_test {
namespace {

// --- Every cause, from when the program could know of it to the frame.

struct StopCase {
  const char* name;
  std::function<void(GatedBase&)> begins, ends;
  // When it was known; the time when it began unless given.
  std::function<hal::Time(GatedBase&)> known;
  bool latches = true;
};
hal::Time by_report(GatedBase& rig) {
  return rig.trouble_at.value();
}
void press(GatedBase& rig, bool estop, bool bumper) {
  hal::SafetyInputs inputs;
  inputs.estop_pressed = estop;
  inputs.bumper_pressed = bumper;
  rig.safety = inputs;
}

const std::vector<StopCase>& stop_cases() {
  static const std::vector<StopCase> cases{
      {"EstopInput",
       [](GatedBase& rig) { press(rig, true, false); },
       [](GatedBase& rig) { press(rig, false, false); },
       {}},
      {"BumperInput",
       [](GatedBase& rig) { press(rig, false, true); },
       [](GatedBase& rig) { press(rig, false, false); },
       {}},
      {"EstopOfTheBase", [](GatedBase& rig) { rig.unit.press_estop(true); },
       [](GatedBase& rig) { rig.unit.press_estop(false); }, by_report},
      {"RemoteControl", [](GatedBase& rig) { rig.unit.switch_transmitter(true); },
       [](GatedBase& rig) { rig.unit.switch_transmitter(false); }, by_report},
      {"SomebodyElsesCommand",
       [](GatedBase& rig) { rig.spawn(rig.send_as_stranger()); },
       [](GatedBase&) {},
       {}},
      {"APersonsHold", [](GatedBase& rig) { rig.gate->ask_hold(); }, [](GatedBase&) {}, {}},
      {"SilentDrive", [](GatedBase& rig) { rig.faults.set(sim::parse_unit_fault("off").setting); },
       [](GatedBase& rig) { rig.faults.clear(); },
       [](GatedBase& rig) { return rig.motion_at + 100ms; }},
      {"SilentMission", [](GatedBase& rig) { rig.plans = false; },
       [](GatedBase& rig) { rig.plans = true; },
       [](GatedBase& rig) { return rig.planned_at + 500ms; }, false},
  };
  return cases;
}

class Stopping : public GatedBase, public testing::WithParamInterface<std::size_t> {};

TEST_P(Stopping, PutsAZeroOnTheBusWithinOnePeriodAndAFrame) {
  const StopCase& stop = stop_cases()[GetParam()];
  drive_off();
  wait(3ms);  // Not in step with any cycle.
  const hal::Time began = clock.now();
  stop.begins(*this);
  wait(1500ms);
  const hal::Time known = stop.known ? stop.known(*this) : began;
  const auto zero = zero_after(known);
  ASSERT_TRUE(zero) << "never";
  EXPECT_LE(*zero - known, mission::kGatePeriod + kFrameTime)
      << (*zero - known) / 1us << " us; " << testing::PrintToString(told);
  EXPECT_EQ(moving_after(*zero), 0);
  EXPECT_NEAR(world.rolling().forward_mps, 0, 0.01);

  stop.ends(*this);
  wait(5s);
  if (!stop.latches) {
    EXPECT_GT(moving_after(*zero), 0) << "it waits for a release that nobody owes";
    return;
  }
  EXPECT_EQ(moving_after(*zero), 0) << "it drives on by itself";
  release();
  EXPECT_TRUE(gate->released()) << testing::PrintToString(told);
  EXPECT_GT(world.rolling().forward_mps, 0.39) << testing::PrintToString(told);
}

INSTANTIATE_TEST_SUITE_P(EveryCause, Stopping, testing::Range(std::size_t{0}, stop_cases().size()),
                         [](const auto& of) { return std::string(stop_cases()[of.param].name); });

// --- Releases.

TEST_F(GatedBase, IsNotReleasedWhileAStopIsThere) {
  drive_off();
  press(*this, true, false);
  wait(100ms);
  EXPECT_EQ(gate->mode(), Mode::stopped);
  EXPECT_EQ(gate->stopped_by(), FaultCode::estop_pressed);
  EXPECT_THAT(gate->why(), HasSubstr("F001-estop-pressed"));
  EXPECT_THAT(gate->why(), HasSubstr("to release it, press the reset button"));
  release();
  EXPECT_FALSE(gate->released());
  EXPECT_THAT(told, Contains(HasSubstr("not released: a stop is still there")));
  press(*this, false, false);
  wait(1s);
  EXPECT_FALSE(gate->released()) << "the release was for an e-stop that was pressed then";
  EXPECT_EQ(told_mission.back(), errc::operation_not_permitted);
  release();
  EXPECT_TRUE(gate->released());
  EXPECT_EQ(gate->why(), "");
}

TEST_F(GatedBase, IsReleasedByTheResetInputOncePressed) {
  drive_off();
  press(*this, true, false);
  wait(100ms);
  safety->reset_pressed = true;  // Before the e-stop is out: counts for nothing, also later.
  wait(100ms);
  safety->estop_pressed = false;
  wait(300ms);
  EXPECT_FALSE(gate->released());
  safety->reset_pressed = false;
  wait(100ms);
  EXPECT_FALSE(gate->released());
  safety->reset_pressed = true;
  wait(1s);
  EXPECT_TRUE(gate->released());
}

// Inputs that are not heard count as pressed, and what is told of the press outlasts that.
TEST_F(GatedBase, TakesOnePressOfTheResetInputForOneRelease) {
  drive_off();
  press(*this, true, false);
  wait(100ms);
  safety->estop_pressed = false;
  wait(100ms);
  safety->reset_pressed = true;
  wait(1s);
  ASSERT_TRUE(gate->released());
  *safety = {};  // Not heard.
  wait(50ms);
  EXPECT_FALSE(gate->released());
  safety->estop_pressed = safety->bumper_pressed = false;
  safety->reset_pressed = true;
  wait(1s);
  EXPECT_FALSE(gate->released());
}

TEST_F(GatedBase, DoesNotStartByItselfAfterAnEstopBefore) {
  make();
  unit.press_estop(true);
  wait(300ms);
  unit.press_estop(false);
  wait(1s);
  EXPECT_EQ(start(), Answer::not_enough);
  EXPECT_EQ(world.driven_m(), 0) << "not even to prove anything";
  release();
  EXPECT_TRUE(gate->released());
}

TEST_F(GatedBase, WaitsForAPersonAfterAPowerCut) {
  make(mission::Boot::power_cut);
  EXPECT_EQ(start(), Answer::not_enough);
  EXPECT_EQ(gate->stopped_by(), FaultCode::power_cut);
  EXPECT_EQ(world.driven_m(), 0);
  release();
  EXPECT_TRUE(gate->released());
}

TEST_F(GatedBase, DoesNotBeginByItselfWhenItStartsHeld) {
  held = true;
  make();
  EXPECT_EQ(start(), Answer::not_enough);
  EXPECT_THAT(told, Contains(HasSubstr("until a person releases it: press the reset button")));
  twist = {0.4, 0};
  spawn(plan());
  wait(5s);
  EXPECT_EQ(gate->mode(), Mode::holding);
  EXPECT_EQ(world.driven_m(), 0) << "not even to prove anything";
  release();
  EXPECT_TRUE(gate->released());
  wait(2s);
  EXPECT_GT(world.driven_m(), 0.4);
}

TEST_F(GatedBase, IsStoppedRatherThanHeldAfterACrash) {
  held = true;
  make(mission::Boot::crash);
  EXPECT_EQ(start(), Answer::not_enough);
  EXPECT_EQ(gate->stopped_by(), FaultCode::program_fault);
  EXPECT_EQ(gate->mode(), Mode::stopped);
}

TEST_F(GatedBase, IsHeardInEveryCycle) {
  make();
  const int before = heard;
  wait(1s);
  EXPECT_NEAR(heard - before, 100, 1);
}

TEST_F(GatedBase, IsNotReleasedByWhatWasAskedBeforeAPersonsHold) {
  drive_off();
  faults.set(sim::parse_unit_fault("off").setting);
  wait(2s);
  faults.clear();
  wait(3s);
  gate->ask_release();  // The time-out is proven anew first.
  wait(300ms);
  gate->ask_hold();
  wait(5s);
  EXPECT_FALSE(gate->released());
  EXPECT_NEAR(world.rolling().forward_mps, 0, 0.01);
  release();
  EXPECT_TRUE(gate->released()) << testing::PrintToString(told);
}

TEST_F(GatedBase, DoesNotStartByItselfWhenHeldMeanwhile) {
  make();
  std::optional<Answer> answer;
  boost::asio::co_spawn(io, gate->start(), [&](std::exception_ptr problem, Answer value) {
    if (problem) std::rethrow_exception(problem);
    answer = value;
  });
  wait(200ms);
  gate->ask_hold();
  wait(3s);
  EXPECT_EQ(answer, Answer::not_enough);
  release();
  EXPECT_TRUE(gate->released());
  EXPECT_THAT(told, Contains(HasSubstr("the robot is released")));
}

TEST_F(GatedBase, IsIdleWhenTheMissionIsOver) {
  drive_off();
  gate->finish();
  wait(100ms);
  EXPECT_EQ(gate->mode(), Mode::idle);
}

// --- An operator.

struct GatedByHand : GatedBase {
  std::uint32_t sequence = 0;
  void press(hal::Twist by_hand, bool pressed = true) {
    gate->hear({++sequence, pressed, by_hand});
  }
  void hold(hal::Twist by_hand, hal::Duration span) {
    for (hal::Duration passed{}; passed < span; passed += 50ms) {
      press(by_hand);
      wait(50ms);
    }
  }
};

TEST_F(GatedByHand, StopWithinOnePeriodOfTheDeadMansRelease) {
  drive_off();
  hold({0.3, 0}, 1s);
  EXPECT_EQ(gate->mode(), Mode::teleop);
  EXPECT_EQ(told_mission.back(), errc::operation_not_permitted) << "the mission drives, too";
  plans = false;
  wait(13ms);
  const hal::Time released = clock.now();
  press({}, false);
  wait(100ms);
  ASSERT_TRUE(zero_after(released));
  EXPECT_LE(*zero_after(released) - released, mission::kGatePeriod + kFrameTime);
}

TEST_F(GatedByHand, StopAfter200msOfSilenceAndForReplays) {
  drive_off();
  plans = false;
  hold({0.3, 0}, 1s);
  const hal::Time last = clock.now() - 50ms;
  wait(400ms);
  ASSERT_TRUE(zero_after(last));
  EXPECT_LE(*zero_after(last) - last, 200ms + mission::kGatePeriod + kFrameTime);
  const hal::Time replayed = clock.now();
  for (std::uint32_t old = 1; old <= sequence; ++old) {
    gate->hear({old, true, {0.3, 0}});
    wait(20ms);
  }
  EXPECT_EQ(moving_after(replayed), 0);
}

TEST_F(GatedByHand, MoveNothingThatWasNotReleased) {
  make();
  ASSERT_EQ(start(), Answer::released);
  gate->ask_hold();
  wait(100ms);
  const hal::Time since = clock.now();
  hold({0.3, 0}, 1s);
  EXPECT_EQ(moving_after(since), 0);
}

// --- The drive's own time-out.

TEST_F(GatedBase, CreepsTwoCentimetresAtMostToProveTheTimeout) {
  make();
  const hal::Time began = clock.now();
  EXPECT_EQ(start(), Answer::released);
  EXPECT_GT(world.driven_m(), 0.002) << "it proved nothing";
  EXPECT_LE(world.driven_m(), 0.02);
  EXPECT_LT(clock.now() - began, 1500ms);
  hal::Duration longest{};
  for (std::size_t i = 1; i < commands.size(); ++i)
    longest = std::max(longest, commands[i].at - commands[i - 1].at);
  EXPECT_GT(longest, 490ms) << "it was never left without commands";
}

TEST_F(GatedBase, IsNotArmedWhenTheBaseDoesNotStopByItself) {
  unit.set_stops_by_itself(false);
  make();
  EXPECT_EQ(start(), Answer::not_proven);
  EXPECT_THAT(gate->proof(), HasSubstr("went on although it heard no more commands"));
  wait(1s);
  EXPECT_NEAR(world.rolling().forward_mps, 0, 0.01) << "it is left creeping";
  twist = {0.4, 0};
  spawn(plan());
  release();
  EXPECT_FALSE(gate->released());
  EXPECT_LT(world.driven_m(), 0.06) << "two proofs";
  EXPECT_NEAR(world.rolling().forward_mps, 0, 0.01);
  EXPECT_THAT(told, Contains(HasSubstr("own time-out is not proven")));
}

TEST_F(GatedBase, EndsTheProofWhenTheEstopIsPressed) {
  make();
  std::optional<Answer> answer;
  boost::asio::co_spawn(io, gate->start(), [&](std::exception_ptr problem, Answer value) {
    if (problem) std::rethrow_exception(problem);
    answer = value;
  });
  wait(203ms);
  EXPECT_GT(world.rolling().forward_mps, 0);
  const hal::Time pressed = clock.now();
  press(*this, true, false);
  wait(500ms);
  EXPECT_EQ(answer, Answer::not_enough);
  ASSERT_TRUE(zero_after(pressed));
  EXPECT_LE(*zero_after(pressed) - pressed, mission::kGatePeriod + kFrameTime);
}

// A person pressed before the second stop, while a scan was taken: that press is none for it.
TEST_F(GatedBase, DoesNotCreepForAPressFromBeforeAnotherStop) {
  drive_off();
  const auto be_silent_once = [this] {
    faults.set(sim::parse_unit_fault("off").setting);
    wait(3s);
    faults.clear();
    wait(3s);
  };
  be_silent_once();
  ASSERT_EQ(gate->mode(), Mode::stopped);
  scanning = true;
  gate->ask_release();
  wait(1s);
  be_silent_once();
  const hal::Time scanned = clock.now();
  scanning = false;
  wait(4s);
  EXPECT_EQ(moving_after(scanned), 0);
  EXPECT_EQ(gate->mode(), Mode::stopped);
  EXPECT_THAT(gate->proof(), HasSubstr("something stopped the robot meanwhile"));
  release();
  EXPECT_NE(gate->mode(), Mode::stopped) << testing::PrintToString(told);
  EXPECT_GT(moving_after(scanned), 0);
}

TEST_F(GatedBase, ProvesTheTimeoutAgainAfterTheDriveWasSilent) {
  drive_off();
  faults.set(sim::parse_unit_fault("off").setting);
  wait(2s);
  unit.set_stops_by_itself(false);
  faults.clear();
  wait(3s);
  release();
  EXPECT_FALSE(gate->released());
  unit.set_stops_by_itself(true);
  release();
  EXPECT_TRUE(gate->released()) << testing::PrintToString(told);
}

}  // namespace
}  // namespace gate_test
