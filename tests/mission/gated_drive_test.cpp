// The gate between a mission and a simulated drive, judged by the frames on the bus.
#include "mission/gated_drive.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <map>
#include <memory>

#include "drivers/agilex_drive.hpp"
#include "drivers/cia402_drive.hpp"
#include "drivers/real_clock.hpp"
#include "mission/disk_watch.hpp"
#include "sim/agilex_unit.hpp"
#include "sim/cia402_unit.hpp"
#include "tests/drivers/allocations.hpp"
#include "tests/drivers/drive_bench.hpp"

namespace {

using namespace drivers_test;
using mission::Answer;
using mission::FaultCode;
using mission::GatedDrive;
using mission::Mode;
using testing::Contains;
using testing::HasSubstr;
namespace agilex = drivers::agilex;

constexpr hal::Duration kFrameTime = 1ms;  // More than any frame takes at 500 kbit/s.

// An AgileX base, safety inputs that a test sets, and what the bus carried.
struct GatedBase : testing::Test, DriveBench {
  struct Command {
    hal::Time at;
    int forward_mmps{}, turn_mradps{};
    bool zero() const { return forward_mmps == 0 && turn_mradps == 0; }
  };

  sim::CanWire::End& host = wire.attach();
  sim::CanWire::End& base = wire.attach();
  sim::CanWire::End& stranger = wire.attach();
  sim::UnitFaults faults{clock};
  sim::AgilexUnit unit{{}, world, nullptr, clock, base, faults};
  drivers::AgilexDrive drive{{}, clock, host};
  std::optional<hal::SafetyInputs> safety;
  std::vector<std::string> told;
  std::unique_ptr<GatedDrive> gate;
  std::vector<Command> commands;            // Ours to the base.
  hal::Time state_at{}, motion_at{};        // When its latest reports were on the bus.
  std::optional<agilex::SystemState> said;  // The latest.
  std::optional<hal::Time> trouble_at;      // When a report first said what is wrong.
  std::vector<boost::system::error_code> told_mission;
  hal::Time planned_at{};
  bool plans = true;
  bool held = false;  // From the start.
  int heard = 0;      // Of the gate, how often.

  void make(mission::Boot boot = mission::Boot::clean) {
    GatedDrive::Config config;
    config.boot = boot;
    config.gate.has_range = true;
    config.safety = [this] { return safety; };
    config.tell = [this](const std::string& what) { told.push_back(what); };
    config.starts_held = held;
    config.alive = [this] { ++heard; };
    gate = std::make_unique<GatedDrive>(config, clock, drive);
    spawn(unit.run());
    spawn(drive.run());
    spawn(gate->run());
    spawn(listen());
    wait(1s);
  }
  Answer start() { return run(gate->start()); }
  void drive_off() {
    make();
    ASSERT_EQ(start(), Answer::released);
    twist = {0.4, 0};
    spawn(plan());
    wait(2s);
    ASSERT_GT(world.rolling().forward_mps, 0.39);
  }
  void release() {
    gate->ask_release();
    wait(4s);
  }

  hal::Task<void> plan() {
    for (;;) {
      if (plans) {
        planned_at = clock.now();
        const auto answer = co_await gate->command(twist);
        told_mission.push_back(answer ? boost::system::error_code{} : answer.error());
      }
      co_await clock.sleep_for(50ms);
    }
  }
  hal::Task<void> listen() {
    sim::CanWire::End& tap = wire.attach();
    for (;;) {
      const auto received = co_await tap.receive();
      if (received) hear(agilex::decode(received->frame, agilex::Dialect::v2), received->stamp);
    }
  }
  void hear(const agilex::Message& message, hal::Time at) {
    if (const auto* command = std::get_if<agilex::MotionCommand>(&message))
      commands.push_back({at, command->forward_mmps, command->turn_mradps});
    if (std::holds_alternative<agilex::MotionState>(message)) motion_at = at;
    const auto* state = std::get_if<agilex::SystemState>(&message);
    if (state == nullptr) return;
    const bool wrong =
        state->vehicle != agilex::VehicleState::normal || state->mode == agilex::ControlMode::rc;
    if (wrong && !trouble_at) trouble_at = at;
    said = *state;
  }
  hal::Task<void> send_as_stranger() {
    (void)co_await stranger.send(agilex::encode(agilex::MotionCommand{.forward_mmps = 300}),
                                 clock.now() + 10ms);
  }
  // The first zero at or after that time, and whether all since are zeros.
  std::optional<hal::Time> zero_after(hal::Time from) const {
    for (const Command& command : commands)
      if (command.at >= from && command.zero()) return command.at;
    return std::nullopt;
  }
  int moving_after(hal::Time from) const {
    return static_cast<int>(std::ranges::count_if(
        commands, [&](const Command& each) { return each.at > from && !each.zero(); }));
  }
};

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

// --- What the mission knows.

struct GatedSurroundings : GatedBase {
  mission::Surroundings around;
  void drive_there() {
    drive_off();
    around.range_at = std::nullopt;
    gate->watch_surroundings([this] { return around; });
    wait(1s);
    ASSERT_GT(world.rolling().forward_mps, 0.39);
  }
};

TEST_F(GatedSurroundings, HoldWhileThePoseIsUncertainAndNoLonger) {
  drive_there();
  const hal::Time began = clock.now();
  around.pose_uncertain = true;
  wait(500ms);
  ASSERT_TRUE(zero_after(began));
  EXPECT_LE(*zero_after(began) - began, mission::kGatePeriod + kFrameTime);
  EXPECT_EQ(gate->mode(), Mode::holding);
  EXPECT_EQ(gate->held_by(), FaultCode::pose_uncertain);
  EXPECT_THAT(gate->why(), HasSubstr("F320-pose-uncertain"));
  EXPECT_THAT(told, Contains(HasSubstr("the robot holds: F320")));
  EXPECT_EQ(told_mission.back(), errc::operation_not_permitted);
  around.pose_uncertain = false;
  wait(1s);
  EXPECT_GT(world.rolling().forward_mps, 0.39) << "nobody has to release it";
}

TEST_F(GatedSurroundings, HoldForAFaultOfADeviceUntilItIsOver) {
  drive_there();
  around.hold_fault = FaultCode::drive_hot;
  wait(1s);
  EXPECT_NEAR(world.rolling().forward_mps, 0, 0.01);
  EXPECT_EQ(gate->held_by(), FaultCode::drive_hot);
  EXPECT_THAT(told, Contains(HasSubstr("the robot holds: F020-drive-hot")));
  around.hold_fault.reset();
  wait(1s);
  EXPECT_GT(world.rolling().forward_mps, 0.39);
}

// However the disk fails: the robot stands at once, says so, and goes on by itself.
TEST_F(GatedSurroundings, HoldWhileTheDiskFailsAndUntilAllOfItWorks) {
  using Part = mission::DiskWatch::Part;
  drive_there();
  mission::DiskWatch disk;
  gate->watch_surroundings([&] {
    mission::Surroundings is = around;
    is.hold_fault = disk.fault();
    return is;
  });
  const auto fails = [&](Part part, errc::errc_t why) {
    disk.failed(part, {"scans/0003.ply", "write", errc::make_error_code(why)}, clock.now());
  };
  wait(1s);
  ASSERT_GT(world.rolling().forward_mps, 0.39) << "a disk that is well holds nothing";
  const hal::Time began = clock.now();
  fails(Part::files, errc::no_space_on_device);
  wait(500ms);
  ASSERT_TRUE(zero_after(began));
  EXPECT_LE(*zero_after(began) - began, mission::kGatePeriod + kFrameTime);
  EXPECT_EQ(moving_after(*zero_after(began)), 0);
  EXPECT_EQ(gate->mode(), Mode::holding);
  EXPECT_EQ(gate->held_by(), FaultCode::disk_full);
  EXPECT_THAT(told, Contains(HasSubstr("the robot holds: F700-disk-full")));
  EXPECT_EQ(told_mission.back(), errc::operation_not_permitted);
  fails(Part::journal, errc::io_error);
  disk.works(Part::files);
  wait(500ms);
  EXPECT_EQ(gate->held_by(), FaultCode::disk_failed) << "the journal does not work yet";
  EXPECT_NEAR(world.rolling().forward_mps, 0, 0.01);
  disk.works(Part::journal);
  wait(1s);
  EXPECT_TRUE(gate->released());
  EXPECT_GT(world.rolling().forward_mps, 0.39) << "nobody has to release it";
}

TEST_F(GatedSurroundings, HoldForADiskOnlyWhereNothingStops) {
  drive_there();
  around.hold_fault = FaultCode::disk_full;
  wait(500ms);
  gate->ask_hold();
  around.hold_fault.reset();
  const hal::Time mended = clock.now();
  wait(1s);
  EXPECT_EQ(moving_after(mended), 0) << "a person's hold outlives it";
  EXPECT_FALSE(gate->released());
}

TEST_F(GatedSurroundings, HoldWhenTheRangeSourceIsSilentFor250ms) {
  drive_there();
  around.range_at = clock.now();
  const hal::Time last = clock.now();
  wait(245ms);
  EXPECT_GT(world.rolling().forward_mps, 0.39);
  wait(300ms);
  ASSERT_TRUE(zero_after(last));
  EXPECT_LE(*zero_after(last) - last, 250ms + mission::kGatePeriod + kFrameTime);
  EXPECT_EQ(gate->held_by(), FaultCode::range_stale);
  EXPECT_EQ(told_mission.back(), errc::resource_unavailable_try_again);
  around.range_at.reset();  // Not at work any more.
  wait(1s);
  EXPECT_GT(world.rolling().forward_mps, 0.39);
}

TEST_F(GatedSurroundings, LimitTheSpeedOfMissionsAndStopThemWhereNobodyKnowsIt) {
  drive_there();
  around.zone_speed_max_mps = 0.15;
  wait(1s);
  EXPECT_NEAR(world.rolling().forward_mps, 0.15, 0.01);
  around.zone_speed_max_mps = std::numeric_limits<double>::quiet_NaN();
  wait(1s);
  EXPECT_NEAR(world.rolling().forward_mps, 0, 0.01);
  EXPECT_THAT(gate->why(), HasSubstr("drive it back by hand"));
  for (std::uint32_t key = 1; key <= 10; ++key) {
    gate->hear({.sequence = key, .dead_man = true, .twist = {-0.2, 0}});
    wait(50ms);
  }
  EXPECT_LT(world.rolling().forward_mps, -0.05) << "a person sees where they drive";
}

TEST_F(GatedSurroundings, SendItHomeOnTheBatterysReserve) {
  drive_there();
  around.battery_reserve = true;
  wait(100ms);
  EXPECT_EQ(gate->mode(), Mode::returning);
  EXPECT_GT(world.rolling().forward_mps, 0.39);
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

// --- Two CiA 402 drives.

struct GatedPair : testing::Test, DriveBench {
  sim::UnitFaults left_faults{clock}, right_faults{clock};
  std::unique_ptr<sim::Cia402Unit> unit;
  std::unique_ptr<drivers::Cia402Drive> drive;
  std::optional<hal::SafetyInputs> safety;
  std::unique_ptr<GatedDrive> gate;
  std::vector<std::string> told;

  Answer start(bool watches_master) {
    sim::Cia402NodeConfig left, right;
    right.node = 2;
    right.watches_master = watches_master;
    unit = std::make_unique<sim::Cia402Unit>(left, right, world, clock, wire.attach(),
                                             wire.attach(), left_faults, right_faults);
    drive = std::make_unique<drivers::Cia402Drive>(drivers::Cia402Drive::Config{}, clock,
                                                   wire.attach());
    GatedDrive::Config config;
    config.safety = [this] { return safety; };
    config.tell = [this](const std::string& what) { told.push_back(what); };
    gate = std::make_unique<GatedDrive>(config, clock, *drive);
    spawn(unit->run());
    spawn(drive->run());
    spawn(gate->run());
    wait(4s);
    EXPECT_EQ(drive->state(), drivers::DeviceState::running);
    return run(gate->start());
  }
};

TEST_F(GatedPair, IsArmedWhenBothStopWithoutOurHeartbeat) {
  EXPECT_EQ(start(true), Answer::released) << gate->proof();
  EXPECT_EQ(world.driven_m(), 0) << "the proof needs no motion";
  wait(2s);
  EXPECT_EQ(text(drive->troubles()), "");
  twist = {0.4, 0};
  spawn(commander(*gate));
  wait(2s);
  EXPECT_GT(world.rolling().forward_mps, 0.39) << testing::PrintToString(told);
}

TEST_F(GatedPair, IsNotArmedWhenOneGoesOnWithoutOurHeartbeat) {
  EXPECT_EQ(start(false), Answer::not_proven);
  EXPECT_THAT(gate->proof(), HasSubstr("went on although it heard no more commands"));
  twist = {0.4, 0};
  spawn(commander(*gate));
  wait(2s);
  EXPECT_EQ(world.driven_m(), 0);
}

TEST_F(GatedPair, PutsZerosOnTheBusWithinOnePeriodAndAFrame) {
  ASSERT_EQ(start(true), Answer::released) << gate->proof();
  std::map<std::uint32_t, std::vector<std::pair<hal::Time, hal::CanFrame>>> targets;  // By id.
  const auto listen = [&](sim::CanWire::End& tap) -> hal::Task<void> {
    for (;;) {
      const auto received = co_await tap.receive();
      if (received && (received->frame.id == 0x201 || received->frame.id == 0x202))
        targets[received->frame.id].emplace_back(received->stamp, received->frame);
    }
  };
  spawn(listen(wire.attach()));
  wait(1s);
  ASSERT_EQ(targets.size(), 2U);
  std::map<std::uint32_t, hal::CanFrame> standing;
  for (const auto& [id, frames] : targets) standing[id] = frames.back().second;
  twist = {0.4, 0};
  spawn(commander(*gate));
  wait(2003ms);
  ASSERT_GT(world.rolling().forward_mps, 0.39);
  const hal::Time pressed = clock.now();
  safety = hal::SafetyInputs{};  // Everything pressed.
  wait(200ms);
  for (const auto& [id, frames] : targets) {
    EXPECT_NE(std::ranges::find_if(frames,
                                   [&](const auto& each) {
                                     return each.first > pressed - 25ms &&
                                            each.second != standing[id];
                                   }),
              frames.end())
        << "it was not told to drive";
    const auto zero = std::ranges::find_if(frames, [&](const auto& each) {
      return each.first >= pressed && each.second == standing[id];
    });
    ASSERT_NE(zero, frames.end()) << id;
    EXPECT_LE(zero->first - pressed, mission::kGatePeriod + kFrameTime);
    for (auto after = zero; after != frames.end(); ++after)
      EXPECT_EQ(after->second, standing[id]) << "it drives on";
  }
}

TEST_F(GatedPair, StaysWhenItsStoInputWasOpenedAndClosed) {
  EXPECT_EQ(start(true), Answer::released) << gate->proof();
  twist = {0.4, 0};
  spawn(commander(*gate));
  wait(2s);
  unit->left().open_sto(true);
  wait(1500ms);
  EXPECT_NEAR(world.rolling().forward_mps, 0, 0.01);
  EXPECT_EQ(gate->stopped_by(), FaultCode::drive_fault);
  unit->left().open_sto(false);
  wait(5s);
  EXPECT_NEAR(world.rolling().forward_mps, 0, 0.01) << "it drives on by itself";
  gate->ask_release();
  wait(3s);
  EXPECT_GT(world.rolling().forward_mps, 0.39) << testing::PrintToString(told);
}

// --- The loop itself.

// Always well, and obeys nobody.
class QuietDrive final : public hal::GuardedDrive {
 public:
  explicit QuietDrive(hal::Clock& clock) : clock_(clock) {}
  hal::Task<hal::Result<void>> command(hal::Twist) override { co_return hal::Result<void>{}; }
  hal::Task<hal::Result<hal::WheelTravel>> next_travel() override {
    co_await clock_.sleep_for(1h);
    co_return hal::WheelTravel{};
  }
  hal::DriveStatus status() const override {
    hal::DriveStatus status;
    status.reported_at = clock_.now();
    status.silent = status.held = false;
    return status;
  }
  hal::Task<hal::Result<hal::Duration>> prove_timeout() override { co_return hal::Duration(500ms); }

 private:
  hal::Clock& clock_;
};

// What a loop allocates in a virtual second, once it runs.
template <class Loop>
std::uint64_t allocated_by(Loop loop) {
  boost::asio::io_context io;
  sim::SimClock clock(io);
  QuietDrive drive(clock);
  GatedDrive::Config config;
  config.safety = [] {
    hal::SafetyInputs released;
    released.estop_pressed = released.bumper_pressed = false;
    return std::optional(released);
  };
  GatedDrive gate(config, clock, drive);
  boost::asio::co_spawn(io, loop(clock, gate), [](std::exception_ptr problem) {
    if (problem) std::rethrow_exception(problem);
  });
  clock.run_until(hal::Time(1s));
  const auto before = allocations();
  clock.run_until(hal::Time(2s));
  return allocations() - before;
}

TEST(GatedDriveLoop, AllocatesNoMoreThanTheSleepsOfItsClock) {
  const auto sleeps = [](hal::Clock& clock, GatedDrive&) -> hal::Task<void> {
    for (hal::Time next = clock.now();; next += mission::kGatePeriod)
      co_await clock.sleep_until(next);
  };
  const auto gates = [](hal::Clock&, GatedDrive& gate) { return gate.run(); };
  const std::uint64_t by_sleeps = allocated_by(sleeps);
  EXPECT_GE(by_sleeps, 100U) << "the simulated clock keeps a list of sleepers";
  EXPECT_LE(allocated_by(gates), by_sleeps);
}

// What wakes it on a robot allocates nothing either.
TEST(GatedDriveLoop, AllocatesNothingInRealTime) {
  boost::asio::io_context io{1};
  drivers::RealClock clock;
  QuietDrive drive(clock);
  GatedDrive::Config config;
  int cycles = 0;
  std::uint64_t before = 0, after = 0;
  config.alive = [&] {
    if (++cycles == 20) before = allocations();
    if (cycles < 40) return;
    after = allocations();
    io.stop();
  };
  GatedDrive gate(config, clock, drive);
  boost::asio::co_spawn(io, gate.run(), [](std::exception_ptr problem) {
    if (problem) std::rethrow_exception(problem);
  });
  io.run();
  EXPECT_EQ(cycles, 40);
  EXPECT_GT(before, 0U) << "it counts nothing";
  EXPECT_EQ(after - before, 0U);
}

}  // namespace
