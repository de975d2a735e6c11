#include <gtest/gtest.h>

#include <memory>

#include "drivers/power_io.hpp"
#include "sim/power_units.hpp"
#include "tests/drivers/drive_bench.hpp"

namespace {

using namespace drivers_test;
using drivers::DeviceState;
using sim::UnitFault;

// Lets the n-th request fail once.
class FailingRegisters final : public hal::Registers {
 public:
  FailingRegisters(hal::Registers& link, int& calls, int fails_at)
      : link_(link), calls_(calls), fails_at_(fails_at) {}

  hal::Task<hal::Result<std::vector<std::uint16_t>>> read_input(Range range) override {
    if (fails()) co_return broken();
    co_return co_await link_.read_input(range);
  }
  hal::Task<hal::Result<std::vector<std::uint16_t>>> read_holding(Range range) override {
    if (fails()) co_return broken();
    co_return co_await link_.read_holding(range);
  }
  hal::Task<hal::Result<std::vector<bool>>> read_coils(Range range) override {
    if (fails()) co_return broken();
    co_return co_await link_.read_coils(range);
  }
  hal::Task<hal::Result<std::vector<bool>>> read_discrete(Range range) override {
    if (fails()) co_return broken();
    co_return co_await link_.read_discrete(range);
  }
  hal::Task<hal::Result<void>> write_register(std::uint16_t at, std::uint16_t value) override {
    if (fails()) co_return broken();
    co_return co_await link_.write_register(at, value);
  }
  hal::Task<hal::Result<void>> write_coil_raw(std::uint16_t at, std::uint16_t value) override {
    if (fails()) co_return broken();
    co_return co_await link_.write_coil_raw(at, value);
  }

 private:
  bool fails() { return ++calls_ == fails_at_; }
  static boost::system::error_code broken() {
    return boost::system::errc::make_error_code(errc::timed_out);
  }

  hal::Registers& link_;
  int& calls_;
  int fails_at_;
};

struct PowerBench : DriveBench {
  sim::UnitFaults battery_faults{clock, 1}, board_faults{clock, 2}, safety_faults{clock, 3};
  sim::BatteryConfig battery_config;
  std::unique_ptr<sim::Battery> charge;
  std::unique_ptr<sim::VictronUnit> victron;
  sim::RelayUnit board{clock, board_faults};
  sim::PilzUnit safety{safety_faults};
  std::unique_ptr<sim::RegisterWire> battery_wire, board_wire, safety_wire;
  std::vector<std::unique_ptr<FailingRegisters>> failing;
  int calls = 0, fails_at = 0;
  drivers::PowerIo::Config config;
  std::unique_ptr<drivers::PowerIo> io_unit;

  void make_units(const sim::VictronUnit::Config& victron_config = {}) {
    charge = std::make_unique<sim::Battery>(battery_config, world);
    victron = std::make_unique<sim::VictronUnit>(victron_config, *charge, clock, battery_faults);
    battery_wire = wire_to(*victron, 40ms, 1);
    board_wire = wire_to(board, 20ms, 2);
    safety_wire = wire_to(safety, 20ms, 3);
    spawn(board.run());
  }
  std::unique_ptr<sim::RegisterWire> wire_to(sim::RegisterUnit& unit, hal::Duration reply,
                                             std::uint64_t seed) {
    return std::make_unique<sim::RegisterWire>(clock, unit,
                                               sim::RegisterWire::Config{reply, 500ms, seed});
  }
  hal::Registers* link(sim::RegisterWire& its_wire) {
    failing.push_back(std::make_unique<FailingRegisters>(its_wire.client(), calls, fails_at));
    return failing.back().get();
  }
  void make_driver() {
    io_unit = std::make_unique<drivers::PowerIo>(
        config, clock,
        drivers::PowerIo::Links{link(*battery_wire), link(*battery_wire), link(*board_wire),
                                link(*safety_wire)});
    spawn(io_unit->run());
  }
  void make_all() {
    make_units();
    make_driver();
  }

  hal::SafetyInputs inputs() { return *run(io_unit->inputs()); }
  hal::Result<hal::BatteryState> battery() { return run(io_unit->battery()); }
  bool says(std::string_view what) const { return names(io_unit->troubles(), what); }
  std::string troubles() const { return text(io_unit->troubles()); }
};

struct PowerLoop : testing::Test, PowerBench {};

TEST_F(PowerLoop, StartsAndSaysWhoTheyAre) {
  make_all();
  EXPECT_EQ(io_unit->state(), DeviceState::off);
  EXPECT_TRUE(inputs().estop_pressed) << "before anybody was asked";
  EXPECT_EQ(battery().error(), errc::not_connected);
  wait(2s);
  EXPECT_EQ(io_unit->state(), DeviceState::running);
  EXPECT_EQ(troubles(), "");
  EXPECT_EQ(io_unit->identity().maker, "Victron Energy");
  EXPECT_EQ(io_unit->identity().serial, "HQ2024SIM000");
  EXPECT_EQ(io_unit->identity().firmware, "relay board 2.00");
  EXPECT_FALSE(inputs().estop_pressed);
  EXPECT_FALSE(inputs().bumper_pressed);
}

TEST_F(PowerLoop, TellsTheBatteryAsItIs) {
  make_all();
  wait(1h);
  const auto state = battery();
  ASSERT_TRUE(state);
  charge->update(clock.now());
  EXPECT_NEAR(*state->voltage_v, charge->voltage_v(), 0.006);
  EXPECT_NEAR(*state->current_a, -charge->current_a(), 0.06);
  EXPECT_NEAR(*state->charge_percent, charge->charge_percent(), 0.1);
  EXPECT_NEAR(*state->temperature_c, 25, 1e-9);
  EXPECT_NEAR(*state->time_to_go_s, charge->time_to_go_s(), 100);
  // 60 W for an hour, off 29 V or so.
  EXPECT_NEAR(charge->consumed_ah(), 60 / 28.8, 0.05);
}

TEST_F(PowerLoop, DrivingTakesMoreThanStanding) {
  make_all();
  wait(10s);
  const double standing_a = -*battery()->current_a;
  ASSERT_TRUE(world.command({0.5, 0}));
  for (int i = 0; i < 40; ++i) {
    ASSERT_TRUE(world.command({0.5, 0}));
    wait(100ms);
    world.advance(clock.now());
  }
  EXPECT_GT(-*battery()->current_a, standing_a + 5);
}

TEST_F(PowerLoop, WhatTheBatteryDoesNotKnowIsNothing) {
  battery_config.temperature_c = 3276.7;  // Reads 0x7FFF.
  make_all();
  wait(2s);
  EXPECT_FALSE(battery()->temperature_c);
  EXPECT_TRUE(battery()->voltage_v);
}

TEST_F(PowerLoop, NamesEveryAlarmOfTheBattery) {
  make_units({"HQ1", true});
  make_driver();
  wait(2s);
  int alarms = 0;
  for (std::uint16_t at = 260; at < 330; ++at) {
    const std::vector<std::uint16_t> image{2};
    const auto found = drivers::victron::alarms_in(image, at);
    if (found.empty()) continue;
    ++alarms;
    victron->set_alarm(at, 2);
    wait(2s);
    EXPECT_EQ(troubles(), std::string(found[0].fault->name) + " (alarm)");
    victron->set_alarm(at, 1);
    wait(2s);
    EXPECT_EQ(troubles(), std::string(found[0].fault->name) + " (warning)");
    victron->set_alarm(at, 0);
  }
  EXPECT_EQ(alarms, 18);
}

TEST_F(PowerLoop, SeesTheEstopWithinATenthOfASecond) {
  make_all();
  wait(2s);
  board.press_estop(true);
  wait(100ms);
  EXPECT_TRUE(inputs().estop_pressed);
  board.press_estop(false);
  wait(100ms);
  EXPECT_FALSE(inputs().estop_pressed);
  safety.press_estop(true);
  wait(100ms);
  EXPECT_TRUE(inputs().estop_pressed);
  safety.press_estop(false);
  safety.press_bumper(true);
  wait(100ms);
  EXPECT_FALSE(inputs().estop_pressed);
  EXPECT_TRUE(inputs().bumper_pressed);
}

TEST_F(PowerLoop, ABrokenWireCountsAsPressedUntilBothContactsWorked) {
  make_all();
  wait(2s);
  board.set_input(0, false);
  wait(100ms);
  EXPECT_TRUE(inputs().estop_pressed);
  EXPECT_EQ(troubles(), "");
  wait(600ms);
  EXPECT_EQ(troubles(), "e-stop contacts contradict each other");
  board.set_input(0, true);
  wait(1s);
  EXPECT_TRUE(inputs().estop_pressed) << "not yet known to work";
  board.press_estop(true);
  wait(200ms);
  board.press_estop(false);
  wait(200ms);
  EXPECT_FALSE(inputs().estop_pressed);
  EXPECT_EQ(troubles(), "");
}

TEST_F(PowerLoop, ResetCountsWhenItIsLetGoAfterAWhile) {
  make_all();
  wait(2s);
  board.press_reset(true);
  wait(300ms);
  EXPECT_FALSE(inputs().reset_pressed);
  board.press_reset(false);
  wait(200ms);
  EXPECT_TRUE(inputs().reset_pressed);
  wait(600ms);
  EXPECT_FALSE(inputs().reset_pressed);
  board.press_reset(true);
  wait(4s);
  EXPECT_EQ(troubles(), "reset button stuck");
  board.press_reset(false);
  wait(200ms);
  EXPECT_FALSE(inputs().reset_pressed);
  EXPECT_EQ(troubles(), "");
}

TEST_F(PowerLoop, ARelayIsADeadMansSwitch) {
  make_all();
  wait(2s);
  for (int i = 0; i < 10; ++i) {
    ASSERT_TRUE(run(io_unit->set_relay(3, true, 700ms)));
    EXPECT_TRUE(board.relay(3));
    wait(300ms);
    EXPECT_TRUE(board.relay(3));
  }
  EXPECT_EQ(troubles(), "");
  wait(600ms);
  EXPECT_FALSE(board.relay(3)) << "nobody repeated it";
  ASSERT_TRUE(run(io_unit->set_relay(3, true, 10s)));
  ASSERT_TRUE(run(io_unit->set_relay(3, false, 10s)));
  EXPECT_FALSE(board.relay(3));
  wait(2s);
  EXPECT_EQ(troubles(), "");
}

TEST_F(PowerLoop, RefusesRelaysAndTimesThatItDoesNotHave) {
  make_all();
  EXPECT_EQ(run(io_unit->set_relay(0, true, 1s)).error(), errc::not_connected);
  wait(2s);
  EXPECT_EQ(run(io_unit->set_relay(8, true, 1s)).error(), errc::argument_out_of_domain);
  EXPECT_EQ(run(io_unit->set_relay(-1, true, 1s)).error(), errc::argument_out_of_domain);
  EXPECT_EQ(run(io_unit->set_relay(0, true, 50ms)).error(), errc::argument_out_of_domain);
  EXPECT_EQ(run(io_unit->set_relay(0, true, 1h)).error(), errc::argument_out_of_domain);
}

TEST_F(PowerLoop, NamesARelayThatSomethingElseSwitches) {
  make_all();
  wait(2s);
  ASSERT_TRUE(run(io_unit->set_relay(3, true, 10s)));
  ASSERT_TRUE(board.write_coil_raw(3, 0));
  wait(2s);
  EXPECT_EQ(troubles(), "relay does not follow (channel 3)");
}

TEST_F(PowerLoop, PutsChannelsBackIntoNormalMode) {
  make_units();
  board.set_mode(5, 1);
  make_driver();
  wait(2s);
  EXPECT_EQ(board.read_holding({0x1005, 1})->front(), 0);
  EXPECT_EQ(io_unit->state(), DeviceState::running);
}

TEST_F(PowerLoop, NamesAGatewayThatDoesNotKnowTheBattery) {
  class Nobody final : public sim::RegisterUnit {
    hal::Result<std::vector<std::uint16_t>> read_holding(hal::RegisterRange) override {
      return boost::system::errc::make_error_code(errc::network_unreachable);  // Exception 10.
    }
  } nobody;
  make_units();
  battery_wire = wire_to(nobody, 40ms, 1);
  make_driver();
  wait(3s);
  EXPECT_TRUE(says("gateway does not know this unit (battery")) << troubles();
  EXPECT_NE(io_unit->state(), DeviceState::running);
}

TEST_F(PowerLoop, NamesABoardThatIsNoRelayBoard) {
  class Small final : public sim::RegisterUnit {
    hal::Result<std::vector<bool>> read_discrete(hal::RegisterRange) override {
      return std::vector<bool>(4, true);
    }
  } small;
  make_units();
  board_wire = wire_to(small, 20ms, 1);
  make_driver();
  wait(3s);
  EXPECT_TRUE(says("not a board with eight inputs")) << troubles();
  EXPECT_TRUE(inputs().estop_pressed);
}

TEST_F(PowerLoop, WithoutAnEstopInputItIsPressedForEver) {
  make_units();
  config.estop.reset();
  io_unit = std::make_unique<drivers::PowerIo>(
      config, clock, drivers::PowerIo::Links{nullptr, nullptr, link(*board_wire), nullptr});
  spawn(io_unit->run());
  wait(3s);
  EXPECT_TRUE(inputs().estop_pressed);
  EXPECT_EQ(troubles(), "no e-stop input");
}

// --- Every fault of every unit.

enum class Whose { battery, board, safety };
struct PowerFaultCase {
  sim::FaultSetting setting;
  std::array<std::string_view, 3> named;  // Of battery, board, safety controller.
};

void PrintTo(const PowerFaultCase& fault, std::ostream* out) {
  *out << sim::to_text(fault.setting);
}

class PowerFault : public PowerLoop,
                   public testing::WithParamInterface<std::tuple<PowerFaultCase, Whose>> {};

TEST_P(PowerFault, IsNamedAndOvercome) {
  const auto& [fault, whose] = GetParam();
  sim::UnitFaults* const all[]{&battery_faults, &board_faults, &safety_faults};
  sim::UnitFaults& faults = *all[static_cast<std::size_t>(whose)];
  make_all();
  wait(2s);
  ASSERT_TRUE(run(io_unit->set_relay(3, true, 2s)));
  faults.set(fault.setting);
  const std::string_view wanted = fault.named[static_cast<std::size_t>(whose)];
  bool named = wanted.empty(), pressed = false;
  for (int i = 0; i < 100; ++i) {
    wait(100ms);
    named = named || says(wanted);
    pressed = pressed || inputs().estop_pressed;
  }
  EXPECT_TRUE(named) << troubles();
  const bool silent =
      fault.setting.fault == UnitFault::off || fault.setting.fault == UnitFault::garbage ||
      fault.setting.fault == UnitFault::delayed || fault.setting.fault == UnitFault::intermittent;
  if (silent) {
    EXPECT_EQ(pressed, whose != Whose::battery) << "silence is pressed";
  }
  faults.clear();
  if (fault.setting.fault == UnitFault::wrong) {
    board.press_estop(true);
    wait(500ms);
    board.press_estop(false);
  }
  wait(5s);
  EXPECT_EQ(troubles(), "");
  EXPECT_EQ(io_unit->state(), DeviceState::running);
  EXPECT_FALSE(inputs().estop_pressed);
}

std::string case_name(const testing::TestParamInfo<PowerFault::ParamType>& its) {
  static constexpr const char* kWhose[]{"_battery", "_board", "_safety"};
  std::string name = sim::to_text({std::get<0>(its.param).setting.fault, 0});
  name.resize(std::min(name.find(':'), name.size()));
  return name + kWhose[static_cast<std::size_t>(std::get<1>(its.param))];
}

// A safety controller or a battery that sticks looks like one where nothing changes: no protocol
// of theirs has a counter. The board's relays are switched, and do not follow.
INSTANTIATE_TEST_SUITE_P(
    AllEight, PowerFault,
    testing::Combine(
        testing::Values(
            PowerFaultCase{{UnitFault::off, 0},
                           {"no answer (battery", "no answer (relay board", "no answer (safety"}},
            PowerFaultCase{{UnitFault::stuck, 0}, {"", "relay does not follow (channel 3)", ""}},
            PowerFaultCase{{UnitFault::garbage, 0},
                           {"damaged replies (battery", "damaged replies (relay board",
                            "damaged replies (safety"}},
            PowerFaultCase{{UnitFault::wrong, 0.5},
                           {"battery values disagree", "e-stop contacts contradict each other",
                            "safety controller fault"}},
            PowerFaultCase{
                {UnitFault::slow, 3},
                {"answers late (battery", "answers late (relay board", "answers late (safety"}},
            PowerFaultCase{{UnitFault::delayed, 0.5},
                           {"no answer (battery", "no answer (relay board", "no answer (safety"}},
            PowerFaultCase{{UnitFault::intermittent, 2},
                           {"no answer (battery", "no answer (relay board", "no answer (safety"}},
            PowerFaultCase{{UnitFault::duplicated_reordered, 0},
                           {"damaged replies (battery", "damaged replies (relay board",
                            "damaged replies (safety"}}),
        testing::Values(Whose::battery, Whose::board, Whose::safety)),
    case_name);

TEST_F(PowerLoop, AnUnpluggedCableIsNamedAndPressed) {
  make_all();
  wait(2s);
  board_wire->cut();
  wait(500ms);
  EXPECT_TRUE(inputs().estop_pressed);
  wait(1s);
  EXPECT_TRUE(says("not connected (relay board")) << troubles();
  EXPECT_EQ(io_unit->state(), DeviceState::lost);
  board_wire->mend();
  wait(4s);
  EXPECT_EQ(io_unit->state(), DeviceState::running);
  EXPECT_EQ(troubles(), "");
}

TEST(PowerLoopFailures, GetsGoingWhicheverRequestFails) {
  int calls = 1;
  for (int n = 0; n <= calls; ++n) {  // 0: none.
    PowerBench bench;
    bench.fails_at = n;
    bench.make_all();
    bench.wait(2s);
    if (n == 0) calls = bench.calls;
    bench.wait(5s);
    EXPECT_EQ(bench.io_unit->state(), DeviceState::running) << n;
    EXPECT_EQ(bench.troubles(), "") << n;
    EXPECT_FALSE(bench.inputs().estop_pressed) << n;
    EXPECT_TRUE(bench.battery()) << n;
  }
  EXPECT_GT(calls, 80);
}

}  // namespace
