#include <memory>

#include "drivers/cia402_drive.hpp"
#include "sim/cia402_unit.hpp"
#include "tests/drivers/can_frames.hpp"
#include "tests/drivers/drive_bench.hpp"
#include "tests/drivers/recordings.hpp"

namespace {

using namespace drivers_test;
using drivers::DeviceState;
using sim::UnitFault;

sim::Cia402NodeConfig node_config(std::uint8_t node) {
  sim::Cia402NodeConfig config;
  config.node = node;
  config.serial = 100U + node;
  return config;
}

struct Cia402Bench : DriveBench {
  sim::CanWire::End& host = wire.attach();
  sim::CanWire::End& left_end = wire.attach();
  sim::CanWire::End& right_end = wire.attach();
  sim::UnitFaults left_faults{clock, 1}, right_faults{clock, 2};
  sim::Cia402NodeConfig left_config = node_config(1), right_config = node_config(2);
  drivers::Cia402Drive::Config config;
  std::unique_ptr<sim::Cia402Unit> unit;
  std::unique_ptr<drivers::Cia402Drive> drive;

  void make_unit() {
    unit = std::make_unique<sim::Cia402Unit>(left_config, right_config, world, clock, left_end,
                                             right_end, left_faults, right_faults);
    spawn(unit->run());
  }
  void make_drive(hal::CanBus* bus = nullptr) {
    drive = std::make_unique<drivers::Cia402Drive>(config, clock, bus != nullptr ? *bus : host);
    spawn(drive->run());
    spawn(commander(*drive));
    spawn(odometer(*drive));
  }
  void make_both() {
    make_unit();
    make_drive();
  }
  bool says(std::string_view what) const { return names(drive->troubles(), what); }
  std::string troubles() const { return text(drive->troubles()); }
};

struct Cia402Loop : testing::Test, Cia402Bench {};

TEST_F(Cia402Loop, BringsBothDrivesUp) {
  make_both();
  EXPECT_EQ(drive->state(), DeviceState::off);
  wait(10ms);
  EXPECT_EQ(drive->state(), DeviceState::starting);
  wait(2s);
  EXPECT_EQ(drive->state(), DeviceState::running) << troubles();
  EXPECT_EQ(troubles(), "");
  EXPECT_EQ(drive->identity().maker, "vendor 0x00000059");
  EXPECT_EQ(drive->identity().model, "simulated drive");
  EXPECT_EQ(drive->identity().serial, "101");
  EXPECT_EQ(drive->identity().firmware, "1.0");
}

TEST_F(Cia402Loop, HearsTheTravelThatTheWorldDrove) {
  make_both();
  wait(3s);
  twist = {0.5, 0};
  wait(10s);
  twist = {};
  wait(2s);
  EXPECT_GT(world.driven_m(), 4);
  EXPECT_NEAR(heard_m(), world.driven_m(), 0.001);
  EXPECT_EQ(troubles(), "");
}

TEST_F(Cia402Loop, TurnsLeftForAPositiveRateAlsoWithAMirroredMotor) {
  config.right.units_per_mps = -1000;
  config.right.counts_per_m = -10000;
  right_config.units_per_mps = -1000;
  right_config.counts_per_m = -10000;
  make_both();
  wait(3s);
  twist = {0, 0.4};
  wait(2s);
  twist = {};
  wait(2s);
  EXPECT_NEAR(right_m - left_m, world.robot().pose.heading_rad * world.config().track_m, 0.002);
  EXPECT_GT(world.robot().pose.heading_rad, 0.5);
  EXPECT_EQ(troubles(), "");
}

TEST_F(Cia402Loop, CountsAcrossTheWrapOfItsPosition) {
  left_config.position = 2147483647 - 5000;
  right_config.position = -2147483647 + 5000;
  make_both();
  wait(3s);
  twist = {0.5, 0};
  wait(6s);
  twist = {-0.5, 0};
  wait(10s);
  twist = {};
  wait(2s);
  EXPECT_GT(world.driven_m(), 7);
  EXPECT_NEAR(heard_m(), world.robot().pose.position_m.x(), 0.002);
}

// Written in this order, each read back: the heartbeats before the mapping, the mapping only while
// the PDO is off, start after all.
TEST_F(Cia402Loop, ConfiguresInTheOrderThatDrivesInsistOn) {
  make_both();
  spawn(tap(wire.attach()));
  wait(2s);
  const auto at = [&](const std::string& frame) {
    const auto found = std::find_if(log.begin(), log.end(), [&](const std::string& line) {
      return line.find(" " + frame) != std::string::npos;
    });
    EXPECT_NE(found, log.end()) << frame;
    return found - log.begin();
  };
  const std::vector<std::ptrdiff_t> order{
      at("1537#64.0.16.0."),              // 601: read 0x1000
      at("1537#43.23.16.0.100.0."),       // heartbeat every 100 ms
      at("1537#64.23.16.0."),             // read back
      at("1537#35.22.16.1.44.1.127.0."),  // master 127 silent for 300 ms
      at("1537#43.7.96.0.3.0."),          // then quick stop
      at("1537#35.0.20.1.1.2.0.128."),    // RPDO1 off
      at("1537#47.0.22.0.0."),            // mapping emptied
      at("1537#35.0.22.1.16.0.64.96."),   // 0x60400010
      at("1537#35.0.22.2.32.0.255.96."),  // 0x60FF0020
      at("1537#47.0.22.0.2."),            // two objects
      at("1537#35.0.20.1.1.2.0.0."),      // RPDO1 on
      at("1537#47.96.96.0.3."),           // profile velocity
      at("0#1.1."),                       // start
      at("513#6.0."),
      at("513#7.0."),
      at("513#15.0.")};
  EXPECT_TRUE(std::is_sorted(order.begin(), order.end()));
}

TEST_F(Cia402Loop, StopsByItselfWhenTheProgramIsGone) {
  make_both();
  wait(3s);
  twist = {0.5, 0};
  wait(2s);
  ASSERT_TRUE(world.moving());
  host.cut();
  wait(2500ms);
  EXPECT_FALSE(world.moving());
}

TEST_F(Cia402Loop, TellsOfABlockedWayUntilItBacksOff) {
  make_both();
  wait(3s);
  twist = {0.5, 0};
  for (int i = 0; i < 400 && world.collisions() == 0; ++i) wait(50ms);
  ASSERT_GT(world.collisions(), 0);
  const hal::Time hit = clock.now();
  const auto refused = [&] { return answers.back() == errc::io_error; };
  while (!refused() && clock.now() < hit + 2s) wait(50ms);
  ASSERT_TRUE(refused());
  EXPECT_LE(clock.now() - hit, 800ms);
  EXPECT_TRUE(says("way blocked"));
  twist = {};
  wait(1s);
  EXPECT_FALSE(answers.back());
  EXPECT_EQ(troubles(), "") << "it did not push until the drives fail";
  twist = {-0.2, 0};
  wait(3s);
  EXPECT_FALSE(answers.back());
  EXPECT_LT(world.robot().pose.position_m.x(), kWallM - 0.9);
}

// --- The drives' own troubles.

TEST_F(Cia402Loop, StopsBothWhenOneFailsAndResetsTheFault) {
  make_both();
  wait(3s);
  twist = {0.5, 0};
  wait(2s);
  const double heading_rad = world.robot().pose.heading_rad;
  unit->left().fail(0x2310);
  wait(100ms);
  EXPECT_TRUE(says("current too high (left drive, node 1: code 0x2310)")) << troubles();
  wait(700ms);
  EXPECT_LT(world.rolling().forward_mps, 0.02);
  EXPECT_NEAR(world.robot().pose.heading_rad, heading_rad, 0.15) << "one side alone would spin it";
  EXPECT_EQ(answers.back(), errc::operation_not_permitted);
  twist = {};
  wait(3s);
  EXPECT_EQ(drive->state(), DeviceState::running) << troubles();
  EXPECT_EQ(troubles(), "");
}

TEST_F(Cia402Loop, GivesUpResettingAFaultThatComesBack) {
  make_both();
  wait(3s);
  for (int i = 0; i < 4; ++i) {
    unit->left().fail(0x3210);
    wait(2s);
  }
  wait(5s);
  EXPECT_TRUE(says("drive's fault persists (left drive, node 1)")) << troubles();
  left_faults.set({UnitFault::off, 0});
  wait(2s);
  left_faults.clear();
  wait(4s);
  EXPECT_EQ(drive->state(), DeviceState::running) << troubles();
}

TEST_F(Cia402Loop, NamesEveryEmergencyOfTheSheet) {
  make_both();
  wait(3s);
  for (const int code : {0x1000, 0x2310, 0x2340, 0x3110, 0x3120, 0x3210, 0x3220, 0x4210,
                         0x4310, 0x5000, 0x6100, 0x6320, 0x7121, 0x7305, 0x7306, 0x8110,
                         0x8120, 0x8130, 0x8140, 0x8210, 0x8611, 0x9000, 0xFF01}) {
    const auto value = static_cast<std::uint16_t>(code);
    left_faults.set({UnitFault::off, 0});  // Counts resets anew.
    wait(1s);
    left_faults.clear();
    wait(3s);
    unit->left().fail(value);
    wait(200ms);
    EXPECT_TRUE(says(drivers::canopen::emergency_fault(value).name)) << code << troubles();
  }
}

TEST_F(Cia402Loop, NamesAnOpenEnableInput) {
  make_both();
  unit->right().open_sto(true);
  wait(5s);
  EXPECT_EQ(troubles(),
            "drive does not enable its power stage (right drive, node 2: stays in switch-on "
            "disabled)");
  EXPECT_EQ(drive->state(), DeviceState::starting);
  unit->right().open_sto(false);
  wait(1s);
  EXPECT_EQ(drive->state(), DeviceState::running);
}

TEST_F(Cia402Loop, StopsTheOtherSideWhenOneLosesPowerAndGoesOnAfterwards) {
  make_both();
  wait(3s);
  twist = {0.5, 0};
  wait(2s);
  const double heading_rad = world.robot().pose.heading_rad;
  left_faults.set({UnitFault::off, 0});
  wait(1s);
  EXPECT_LT(world.rolling().forward_mps, 0.02);
  EXPECT_NEAR(world.robot().pose.heading_rad, heading_rad, 0.25);
  wait(1s);
  EXPECT_EQ(drive->state(), DeviceState::lost);
  EXPECT_TRUE(says("drive silent (left drive, node 1")) << troubles();
  twist = {};
  left_faults.clear();
  wait(4s);
  EXPECT_EQ(drive->state(), DeviceState::running) << troubles();
  EXPECT_EQ(troubles(), "");
  EXPECT_LT(step_max_m, 0.4) << "its position began anew, which is no travel";
  const double heard = heard_m(), truth_m = world.driven_m();
  twist = {-0.3, 0};
  wait(4s);
  twist = {};
  wait(2s);
  EXPECT_NEAR(heard - heard_m(), world.driven_m() - truth_m, 0.001);
}

// --- Wrong wiring and settings.

TEST_F(Cia402Loop, NamesAWrongNodeIdAndWhomItHears) {
  right_config.node = 5;
  make_both();
  wait(4s);
  EXPECT_EQ(troubles(), "drive silent (right drive, node 2: heard node 5)");
}

TEST_F(Cia402Loop, NamesABusWhereNobodyAcknowledges) {
  make_both();
  left_end.cut();
  right_end.cut();
  wait(3s);
  EXPECT_TRUE(says("nobody acknowledges on the bus")) << troubles();
  left_end.mend();
  right_end.mend();
  wait(6s);
  EXPECT_EQ(drive->state(), DeviceState::running) << troubles();
}

TEST_F(Cia402Loop, NamesABusThatIsDown) {
  make_both();
  wait(3s);
  host.cut();
  wait(2s);
  EXPECT_TRUE(says("CAN bus down")) << troubles();
  EXPECT_EQ(drive->state(), DeviceState::lost);
  host.mend();
  wait(6s);
  EXPECT_EQ(drive->state(), DeviceState::running) << troubles();
  EXPECT_EQ(troubles(), "");
}

TEST_F(Cia402Loop, NamesADeviceThatIsNoDrive) {
  left_config.device_type = 0x00030191;  // Inputs and outputs.
  make_both();
  wait(4s);
  EXPECT_EQ(troubles(), "not a CiA 402 drive (left drive, node 1)");
}

TEST_F(Cia402Loop, NamesAnotherDriveThanTheOneInTheRobotFile) {
  config.product = 0x777;
  make_both();
  wait(4s);
  EXPECT_TRUE(
      says("another drive than expected (left drive, node 1: vendor 0x00000059 product "
           "0x00000402)"))
      << troubles();
}

TEST_F(Cia402Loop, NamesADriveWithoutTheMode) {
  left_config.modes = 0x01;
  make_both();
  wait(4s);
  EXPECT_TRUE(
      says("drive does not have this velocity mode (left drive, node 1: it has 0x00000001)"))
      << troubles();
}

using drivers::canopen::Mapped;
const Mapped kControl{drivers::cia402::kControlword, 16, false},
    kStatus{drivers::cia402::kStatusword, 16, false}, kMode{drivers::cia402::kModes, 8, true},
    kTarget{drivers::cia402::kVelocityTarget, 32, true},
    kSpeed{drivers::cia402::kVelocityActual, 32, true},
    kWhere{drivers::cia402::kPosition, 32, true};

// The PDOs that CiA 402 proposes: speed in the fourth, position in the third.
TEST_F(Cia402Loop, DrivesWithTheMappingThatADriveInsistsOn) {
  right_config.fixed_mapping = {{1, false, 1, 0, {kControl}},
                                {4, false, 1, 0, {kControl, kTarget, kMode}},
                                {3, true, 1, 0, {kStatus, kWhere}},
                                {4, true, 1, 0, {kSpeed, kStatus}}};
  make_both();
  wait(4s);
  ASSERT_EQ(drive->state(), DeviceState::running) << troubles();
  twist = {0.5, 0};
  wait(6s);
  twist = {0, -0.4};
  wait(2s);
  twist = {};
  wait(2s);
  EXPECT_GT(world.driven_m(), 2.5);
  EXPECT_LT(world.robot().pose.heading_rad, -0.4);
  EXPECT_NEAR(right_m - left_m, world.robot().pose.heading_rad * world.config().track_m, 0.005);
  EXPECT_EQ(troubles(), "");
}

TEST_F(Cia402Loop, NamesWhatAFixedMappingLacks) {
  left_config.fixed_mapping = {{1, false, 1, 0, {kControl}},
                               {2, false, 1, 0, {kControl, kTarget, kWhere}},
                               {1, true, 1, 0, {kStatus, kSpeed}}};
  make_both();
  wait(4s);
  EXPECT_TRUE(
      says("drive's fixed PDO mapping does not do (left drive, node 1: no RPDO with "
           "controlword and target speed alone, no TPDO with the position)"))
      << troubles();
}

TEST_F(Cia402Loop, NamesAnotherMasterOnTheBus) {
  make_both();
  sim::CanWire::End& other = wire.attach();
  spawn([](hal::CanBus& bus, hal::Clock& its_clock) -> hal::Task<void> {
    for (;;) {
      EXPECT_TRUE(co_await bus.send(can("211#0000000000000000"), its_clock.now() + 1s));
      co_await its_clock.sleep_for(20ms);
    }
  }(other, clock));
  wait(3s);
  EXPECT_TRUE(says("another device or master on the bus (it sends 0x0211)")) << troubles();
}

TEST_F(Cia402Loop, ChecksTheSettingsAgainstAnEds) {
  config.eds = drivers::eds::parse(
                   "[DeviceInfo]\nVendorNumber=0x59\nProductNumber=0x402\n"
                   "[1017]\nParameterName=heartbeat\nObjectType=0x7\nDataType=0x0007\n"
                   "AccessType=rw\n",
                   "drive.eds")
                   .value();
  make_both();
  wait(4s);
  EXPECT_TRUE(
      says("EDS does not fit (left drive, node 1: 0x1017:0 heartbeat every ms: of another "
           "size)"))
      << troubles();
}

// --- Every fault of a node, and the recovery.

class Cia402Fault : public Cia402Loop,
                    public testing::WithParamInterface<std::tuple<FaultCase, bool>> {};

TEST_P(Cia402Fault, IsNamedAndOvercome) {
  const auto& [fault, of_left] = GetParam();
  sim::UnitFaults& faults = of_left ? left_faults : right_faults;
  make_both();
  wait(3s);
  twist = {0.2, 0};
  wait(2s);
  faults.set(fault.setting);
  bool named = false;
  double spin_rad = 0;
  for (int i = 0; i < 200; ++i) {
    wait(50ms);
    named = named || says(fault.named);
    spin_rad = std::max(spin_rad, std::abs(world.robot().pose.heading_rad));
  }
  EXPECT_TRUE(named) << troubles();
  EXPECT_LT(spin_rad, 0.3) << "both sides stop when one drops out";
  faults.clear();
  twist = {};
  wait(8s);
  EXPECT_EQ(drive->state(), DeviceState::running) << troubles();
  EXPECT_LT(step_max_m, 0.5) << "no jump";
  const double truth_m = world.driven_m(), before_m = heard_m();
  twist = {-0.3, 0};
  wait(5s);
  twist = {};
  wait(3s);
  EXPECT_NEAR(before_m - heard_m(), world.driven_m() - truth_m, 0.001);
  EXPECT_GT(world.driven_m() - truth_m, 1);
  EXPECT_EQ(troubles(), "");
}

INSTANTIATE_TEST_SUITE_P(
    AllEight, Cia402Fault,
    testing::Combine(
        testing::Values(FaultCase{{UnitFault::off, 0}, "drive silent"},
                        FaultCase{{UnitFault::stuck, 0}, "position and speed disagree"},
                        FaultCase{{UnitFault::garbage, 0}, "drive silent"},
                        FaultCase{{UnitFault::wrong, 0.5}, "position and speed disagree"},
                        FaultCase{{UnitFault::slow, 3}, "reports are missing"},
                        FaultCase{{UnitFault::delayed, 0.5}, "drive answers late"},
                        FaultCase{{UnitFault::intermittent, 2}, "drive silent"},
                        FaultCase{{UnitFault::duplicated_reordered, 0}, "reports doubled"}),
        testing::Bool()),
    [](const auto& its) {
      std::string name = sim::to_text({std::get<0>(its.param).setting.fault, 0});
      name.resize(std::min(name.find(':'), name.size()));
      return name + (std::get<1>(its.param) ? "_left" : "_right");
    });

TEST(Cia402LoopFailures, GetsGoingWhicheverCallOfTheLinkFails) {
  int calls = 1;
  for (int n = 0; n <= calls; ++n) {  // 0: none.
    Cia402Bench bench;
    FailingBus bus(bench.host, n);
    bench.make_unit();
    bench.make_drive(&bus);
    bench.twist = {0.3, 0};
    bench.wait(1500ms);
    if (n == 0) calls = bus.calls();
    bench.wait(5s);
    EXPECT_EQ(bench.drive->state(), DeviceState::running)
        << "call " << n << ": " << bench.troubles();
    bench.twist = {};
    bench.wait(2s);
    EXPECT_GT(bench.world.driven_m(), 0.3);
    EXPECT_NEAR(bench.heard_m(), bench.world.driven_m(), 0.001) << "call " << n;
  }
  EXPECT_GT(calls, 250);
}

TEST(Cia402LoopRepeats, ByteForByte) {
  const auto once = [] {
    Cia402Bench bench;
    bench.make_both();
    bench.spawn(bench.tap(bench.wire.attach()));
    bench.twist = {0.3, 0.1};
    bench.wait(3s);
    bench.left_faults.set({UnitFault::duplicated_reordered, 0});
    bench.wait(2s);
    bench.right_faults.set({UnitFault::garbage, 0});
    bench.wait(2s);
    return bench.log;
  };
  const auto first = once();
  EXPECT_EQ(first, once());
  EXPECT_GT(first.size(), 1500u);
}

}  // namespace
