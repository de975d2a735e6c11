// A mission's gate over an AgileX base in simulation, and what the bus carried.
#pragma once

#include <gmock/gmock.h>

#include <functional>
#include <memory>

#include "drivers/agilex_drive.hpp"
#include "mission/gated_drive.hpp"
#include "sim/agilex_unit.hpp"
#include "tests/drivers/drive_bench.hpp"

namespace gate_test {

using namespace drivers_test;
using mission::Answer;
using mission::FaultCode;
using mission::GatedDrive;
using mission::Mode;
using testing::Contains;
using testing::HasSubstr;
namespace agilex = drivers::agilex;

inline constexpr hal::Duration kFrameTime = 1ms;  // More than any frame takes at 500 kbit/s.

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
  bool scanning = false;
  int heard = 0;  // Of the gate, how often.

  void make(mission::Boot boot = mission::Boot::clean) {
    GatedDrive::Config config;
    config.boot = boot;
    config.gate.has_range = true;
    config.safety = [this] { return safety; };
    config.tell = [this](const std::string& what) { told.push_back(what); };
    config.starts_held = held;
    config.scanning = [this] { return scanning; };
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

}  // namespace gate_test
