#include <memory>

#include "drivers/agilex_drive.hpp"
#include "sim/agilex_unit.hpp"
#include "tests/drivers/drive_bench.hpp"

namespace {

using namespace drivers_test;
using drivers::DeviceState;
using sim::UnitFault;

struct AgilexLoop : testing::Test, DriveBench {
  sim::CanWire::End& host =
      wire.attach({drivers::AgilexDrive::filters().begin(), drivers::AgilexDrive::filters().end()});
  sim::CanWire::End& base = wire.attach();
  sim::UnitFaults faults{clock};
  std::unique_ptr<sim::AgilexUnit> unit;
  std::unique_ptr<drivers::AgilexDrive> drive;

  void make_unit(const sim::AgilexUnit::Config& config = {}) {
    unit = std::make_unique<sim::AgilexUnit>(config, world, nullptr, clock, base, faults);
    spawn(unit->run());
  }
  void make_drive(const drivers::AgilexDrive::Config& config = {}) {
    drive = std::make_unique<drivers::AgilexDrive>(config, clock, host);
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

TEST_F(AgilexLoop, TakesCommandAndSaysWhoItIs) {
  make_drive();
  EXPECT_EQ(drive->state(), DeviceState::off);
  wait(10ms);
  EXPECT_EQ(drive->state(), DeviceState::starting);
  make_unit();
  wait(400ms);
  EXPECT_EQ(drive->state(), DeviceState::running);
  EXPECT_EQ(troubles(), "");
  wait(1s);
  EXPECT_EQ(drive->identity().maker, "AgileX Robotics");
  EXPECT_EQ(drive->identity().model, "agilex-scout2");
  EXPECT_EQ(drive->identity().firmware, "main board 2.3, drivers 1.5");
}

TEST(AgilexDrive, HearsEveryIdButLightsTransmitterAndMotorSpeeds) {
  hal::CanFrame frame;
  for (frame.id = 0; frame.id < 0x800; ++frame.id) {
    const std::uint32_t kind = frame.id & 0x7F0;
    EXPECT_NE(hal::passes(drivers::AgilexDrive::filters(), frame),
              kind == 0x230 || kind == 0x240 || kind == 0x250)
        << frame.id;
  }
  frame.extended = true;
  for (frame.id = 1; frame.id < 1u << 29; frame.id *= 3)
    EXPECT_TRUE(hal::passes(drivers::AgilexDrive::filters(), frame));
}

TEST_F(AgilexLoop, HearsTheTravelThatTheWorldDrove) {
  make_both();
  wait(1s);
  twist = {0.5, 0};
  wait(10s);
  twist = {};
  wait(2s);
  EXPECT_GT(world.driven_m(), 4);
  EXPECT_NEAR(heard_m(), world.driven_m(), 0.001);
  EXPECT_NEAR(left_m, right_m, 1e-9);
  EXPECT_EQ(troubles(), "");
}

TEST_F(AgilexLoop, TurnsLeftForAPositiveRate) {
  make_both();
  wait(1s);
  twist = {0, 0.4};
  wait(2s);
  twist = {};
  wait(2s);
  EXPECT_NEAR(right_m - left_m, world.robot().pose.heading_rad * world.config().track_m, 0.002);
  EXPECT_GT(world.robot().pose.heading_rad, 0.5);
}

TEST_F(AgilexLoop, ReportsTravelFiftyTimesASecond) {
  make_both();
  wait(1s);
  const int before = reports;
  wait(10s);
  EXPECT_EQ(reports - before, 500);
}

TEST_F(AgilexLoop, StopsByItselfWhenCommandsEnd) {
  make_unit();
  make_drive();
  wait(1s);
  twist = {0.5, 0};
  wait(2s);
  ASSERT_TRUE(world.moving());
  host.cut();  // The program is gone.
  wait(2500ms);
  EXPECT_FALSE(world.moving());
}

TEST_F(AgilexLoop, ACommandCountsForTwoHundredMilliseconds) {
  make_unit();
  drive = std::make_unique<drivers::AgilexDrive>(drivers::AgilexDrive::Config{}, clock, host);
  spawn(drive->run());
  wait(1s);
  ASSERT_TRUE(run(drive->command({0.5, 0})));
  wait(200ms);
  EXPECT_TRUE(world.moving());
  wait(2s);
  EXPECT_FALSE(world.moving());
  EXPECT_LT(world.driven_m(), 0.5 * 0.25 + 0.01) << "not until the base's own time-out";
}

TEST_F(AgilexLoop, NeverCommandsMoreThanTheModelMayDrive) {
  make_both();
  spawn(tap(wire.attach()));
  wait(1s);
  twist = {9, 1};
  wait(500ms);
  bool moved = false;
  for (const std::string& line : log) {
    if (line.find(" 273#") == std::string::npos) continue;
    moved = moved || line.ends_with("#5.220.0.167.0.0.0.0.");  // 1500 mm/s, 167 mrad/s.
    EXPECT_TRUE(line.ends_with("#0.0.0.0.0.0.0.0.") || line.ends_with("#5.220.0.167.0.0.0.0."))
        << line;
  }
  EXPECT_TRUE(moved);
}

// The bytes of the manual: version query, then command taken, then 0.15 m/s.
TEST_F(AgilexLoop, StartsWithTheBytesOfTheManual) {
  make_both();
  spawn(tap(wire.attach()));
  wait(1s);
  twist = {0.15, 0};
  wait(200ms);
  const auto at = [&](std::string_view frame) {
    return std::find_if(log.begin(), log.end(),
                        [&](const std::string& line) { return line.ends_with(frame); }) -
           log.begin();
  };
  const auto size = static_cast<std::ptrdiff_t>(log.size());
  const auto query = at(" 1041#1."), take = at(" 1057#1."), go = at(" 273#0.150.0.0.0.0.0.0.");
  ASSERT_LT(query, size);
  ASSERT_LT(take, size);
  ASSERT_LT(go, size);
  EXPECT_LT(query, take);
  EXPECT_LT(take, go);
}

TEST_F(AgilexLoop, RefusesWhatIsNotANumber) {
  make_both();
  wait(1s);
  EXPECT_EQ(run(drive->command({NAN, 0})).error(), errc::invalid_argument);
}

TEST_F(AgilexLoop, TellsOfABlockedWayUntilItBacksOff) {
  make_both();
  wait(1s);
  twist = {0.5, 0};
  for (int i = 0; i < 400 && world.collisions() == 0; ++i) wait(50ms);
  ASSERT_GT(world.collisions(), 0);
  const hal::Time hit = clock.now();
  answers.clear();
  const auto refused = [&] { return !answers.empty() && answers.back() == errc::io_error; };
  bool overloaded = false;
  while (!refused() && clock.now() < hit + 2s) {
    wait(50ms);
    overloaded = overloaded || says("motor current too high (motor 1)");
  }
  ASSERT_TRUE(refused());
  EXPECT_LE(clock.now() - hit, 800ms);
  EXPECT_TRUE(says("way blocked"));
  EXPECT_TRUE(overloaded);
  wait(1s);
  EXPECT_TRUE(refused()) << "as long as it would push on";
  EXPECT_FALSE(world.moving());

  twist = {};
  wait(1s);
  EXPECT_FALSE(answers.back());
  EXPECT_EQ(troubles(), "");
  const double before_m = heard_m();
  twist = {-0.2, 0};
  wait(3s);
  EXPECT_FALSE(answers.back());
  EXPECT_LT(heard_m() - before_m, -0.4);
}

TEST_F(AgilexLoop, DoesNotTakeAStartOrACrawlForABlockedWay) {
  make_both();
  for (const double speed_mps : {0.005, 0.02, 0.03, 0.05, 0.5, -0.5, 0.04, -0.04}) {
    twist = {speed_mps, 0};
    wait(4s);
    twist = {0, speed_mps};
    wait(4s);
  }
  for (std::size_t i = 20; i < answers.size(); ++i) EXPECT_FALSE(answers[i]) << i;
}

// --- The base's own troubles.

TEST_F(AgilexLoop, NeitherDrivesNorArmsAgainstAnEstop) {
  make_both();
  wait(1s);
  twist = {0.5, 0};
  wait(1s);
  unit->press_estop(true);
  wait(2s);
  EXPECT_FALSE(world.moving());
  EXPECT_TRUE(says("e-stop pressed"));
  EXPECT_EQ(drive->state(), DeviceState::starting);
  EXPECT_EQ(answers.back(), errc::operation_not_permitted);
  twist = {};
  unit->press_estop(false);
  wait(1s);
  EXPECT_EQ(drive->state(), DeviceState::running);
  EXPECT_FALSE(world.moving());
}

TEST_F(AgilexLoop, DoesNotFightTheTransmitter) {
  make_both();
  wait(1s);
  unit->switch_transmitter(true);
  wait(1s);
  spawn(tap(wire.attach()));
  wait(2s);
  EXPECT_TRUE(says("remote control has command"));
  for (const std::string& line : log) EXPECT_EQ(line.find(" 1057#"), std::string::npos) << line;
  EXPECT_EQ(answers.back(), errc::operation_not_permitted);
  unit->switch_transmitter(false);
  wait(1s);
  EXPECT_EQ(drive->state(), DeviceState::running);
}

TEST_F(AgilexLoop, ClearsAnExceptionOnce) {
  make_both();
  wait(1s);
  unit->set_exception(true);
  spawn(tap(wire.attach()));
  wait(2s);
  EXPECT_EQ(drive->state(), DeviceState::running);
  EXPECT_EQ(std::count_if(
                log.begin(), log.end(),
                [](const std::string& line) { return line.find(" 1089#0.") != std::string::npos; }),
            1);
}

TEST_F(AgilexLoop, NamesEveryFaultBitOfTheBase) {
  make_both();
  wait(1s);
  for (const drivers::Fault& fault : drivers::agilex::system_faults()) {
    unit->set_fault_bits(static_cast<std::uint16_t>(fault.value), 0);
    wait(200ms);
    EXPECT_TRUE(says(fault.name)) << fault.name;
  }
  for (const drivers::Fault& fault : drivers::agilex::motor_faults()) {
    unit->set_fault_bits(0, static_cast<std::uint8_t>(fault.value));
    wait(200ms);
    EXPECT_TRUE(says(std::string(fault.name) + " (motor 4)")) << fault.name;
  }
  unit->set_fault_bits(0, 0);
  wait(200ms);
  EXPECT_EQ(troubles(), "");
}

TEST_F(AgilexLoop, CountsAcrossTheWrapOfItsOdometry) {
  sim::AgilexUnit::Config config;
  config.odometry_mm = 2147483647 - 1000;
  make_unit(config);
  make_drive();
  wait(1s);
  twist = {0.5, 0};
  wait(8s);
  twist = {};
  wait(2s);
  EXPECT_GT(world.driven_m(), 3);
  EXPECT_NEAR(heard_m(), world.driven_m(), 0.001);
}

// --- Wrong wiring and settings.

TEST_F(AgilexLoop, NamesASilentBase) {
  faults.set({UnitFault::off, 0});
  make_both();
  wait(3s);
  EXPECT_EQ(troubles(), "no reports from the base (none since the start)");
  EXPECT_EQ(drive->state(), DeviceState::starting);
}

TEST_F(AgilexLoop, NamesABusWhereNobodyAcknowledges) {
  make_both();
  base.cut();
  wait(3s);
  EXPECT_EQ(troubles(), "nobody acknowledges on the bus");
  base.mend();
  wait(2s);
  EXPECT_EQ(drive->state(), DeviceState::running);
}

TEST_F(AgilexLoop, NamesABusThatIsDown) {
  make_both();
  wait(1s);
  host.cut();
  wait(2s);
  EXPECT_TRUE(says("CAN bus down")) << troubles();
  EXPECT_EQ(drive->state(), DeviceState::lost);
  host.mend();
  wait(2s);
  EXPECT_EQ(drive->state(), DeviceState::running);
  EXPECT_EQ(troubles(), "");
}

TEST_F(AgilexLoop, RecognisesAVersionOneBaseAndDoesNotDriveIt) {
  sim::AgilexUnit::Config config;
  config.dialect = drivers::agilex::Dialect::v1;
  make_unit(config);
  make_drive();
  twist = {0.5, 0};
  wait(3s);
  EXPECT_EQ(troubles(), "base speaks protocol version 1");
  EXPECT_EQ(drive->state(), DeviceState::starting);
  EXPECT_EQ(answers.back(), errc::not_connected);
}

TEST_F(AgilexLoop, NamesAnotherDeviceOnTheBus) {
  make_drive();
  sim::CanWire::End& other = wire.attach();
  spawn([](hal::CanBus& bus, hal::Clock& its_clock) -> hal::Task<void> {
    for (;;) {  // A CANopen drive's heartbeat.
      hal::CanFrame frame;
      frame.id = 0x705;
      frame.size = 1;
      frame.data[0] = 0x7F;
      EXPECT_TRUE(co_await bus.send(frame, its_clock.now() + 1s));
      co_await its_clock.sleep_for(100ms);
    }
  }(other, clock));
  wait(3s);
  EXPECT_EQ(troubles(), "another device on the bus (it sends 0x705)");
}

// --- Every fault of a unit, and the recovery.

class AgilexFault : public AgilexLoop, public testing::WithParamInterface<FaultCase> {};

TEST_P(AgilexFault, IsNamedAndOvercome) {
  make_both();
  wait(1s);
  twist = {0.2, 0};
  wait(2s);
  faults.set(GetParam().setting);
  bool named = false, ran = true;
  for (int i = 0; i < 200; ++i) {
    wait(50ms);
    named = named || says(GetParam().named);
    if (i > 40) ran = ran && drive->state() == DeviceState::running;
  }
  EXPECT_TRUE(named) << troubles();
  EXPECT_EQ(ran, GetParam().drives) << troubles();
  faults.clear();
  twist = {};
  wait(6s);
  EXPECT_EQ(drive->state(), DeviceState::running) << troubles();
  if (GetParam().setting.fault != UnitFault::wrong) {
    EXPECT_EQ(troubles(), "");
    EXPECT_LT(step_max_m, 0.5) << "no jump";
  }
  // What came back afterwards counts as before.
  const double truth_m = world.driven_m(), before_m = heard_m();
  twist = {-0.3, 0};
  wait(5s);
  twist = {};
  wait(2s);
  EXPECT_NEAR(before_m - heard_m(), world.driven_m() - truth_m, 0.001);
  EXPECT_GT(world.driven_m() - truth_m, 1);
  EXPECT_EQ(troubles(), "");
}

INSTANTIATE_TEST_SUITE_P(
    AllEight, AgilexFault,
    testing::Values(FaultCase{{UnitFault::off, 0}, "no reports from the base", false},
                    FaultCase{{UnitFault::stuck, 0}, "base's state is frozen", false},
                    FaultCase{{UnitFault::garbage, 0}, "another device on the bus", false},
                    FaultCase{{UnitFault::wrong, 0.5}, "odometry and speed disagree", true},
                    FaultCase{{UnitFault::slow, 3}, "reports are missing", true},
                    FaultCase{{UnitFault::delayed, 0.5}, "base answers late", true},
                    FaultCase{{UnitFault::intermittent, 2}, "no reports from the base", false},
                    FaultCase{{UnitFault::duplicated_reordered, 0}, "reports doubled", true}),
    [](const auto& its) {
      std::string name = sim::to_text({its.param.setting.fault, 0});
      name.resize(std::min(name.find(':'), name.size()));
      return name;
    });

TEST_F(AgilexLoop, LosesNoTravelWhileTheCableIsUnplugged) {
  make_both();
  wait(1s);
  twist = {0.5, 0};
  wait(3s);
  host.cut();  // The base rolls on until its time-out.
  wait(5s);
  host.mend();
  twist = {};
  wait(2s);
  EXPECT_NEAR(heard_m(), world.driven_m(), 0.001);
  EXPECT_GT(step_max_m, 0.2) << "the rest came in one report";
}

// The host's clock and its end of the bus when the process is held up: what is due meanwhile comes
// at the end of that, timers first, and frames wait with the times at which they arrived; then
// they are read one after another, while the timers go on.
class HeldUp final : public hal::Clock, public hal::CanBus {
 public:
  HeldUp(sim::SimClock& clock, hal::CanBus& bus) : clock_(clock), bus_(bus) {}

  void hold(hal::Duration span) { until_ = clock_.now() + span; }

  hal::Time now() const override { return clock_.now(); }
  hal::Task<void> sleep_until(hal::Time wake) override {
    co_await clock_.sleep_until(wake);
    if (clock_.now() < until_) co_await clock_.sleep_until(until_);
  }
  hal::Task<hal::Result<void>> send(hal::CanFrame frame, hal::Time deadline) override {
    return bus_.send(frame, deadline);
  }
  hal::Task<hal::Result<hal::ReceivedFrame>> receive() override {
    auto received = co_await bus_.receive();
    if (clock_.now() < until_)
      co_await clock_.sleep_until(until_ + 10us);
    else if (received && received->stamp < until_)
      co_await clock_.sleep_for(50us);
    co_return received;
  }

 private:
  sim::SimClock& clock_;
  hal::CanBus& bus_;
  hal::Time until_{};
};

struct AgilexHeldUp : AgilexLoop, testing::WithParamInterface<std::chrono::milliseconds> {
  std::unique_ptr<HeldUp> host_side;
  std::vector<hal::Time> silent, not_running;

  void make_held_up() {
    host_side = std::make_unique<HeldUp>(clock, host);
    make_unit();
    drive = std::make_unique<drivers::AgilexDrive>(drivers::AgilexDrive::Config{}, *host_side,
                                                   *host_side);
    spawn(look());  // First: it sees the moment before anything that waits was heard.
    spawn(drive->run());
    spawn(odometer(*drive));
  }
  hal::Task<void> look() {
    for (;;) {
      co_await host_side->sleep_for(1ms);
      if (drive->status().silent) silent.push_back(clock.now());
      if (drive->state() != DeviceState::running) not_running.push_back(clock.now());
    }
  }
};

TEST_P(AgilexHeldUp, ABaseThatWentOnTalkingIsNotSilent) {
  make_held_up();
  wait(1s);
  ASSERT_EQ(drive->state(), DeviceState::running);
  silent.clear();
  not_running.clear();
  for (int i = 0; i < 7; ++i) {  // At other moments of its cycle each time.
    wait(503ms);
    host_side->hold(GetParam());
    wait(GetParam() + 1ms);
    const auto answer = run(drive->command({0.1, 0}));
    EXPECT_TRUE(answer) << answer.error().message();
  }
  wait(1s);
  EXPECT_TRUE(silent.empty()) << silent.size() << " times";
  EXPECT_TRUE(not_running.empty()) << not_running.size() << " times";
  EXPECT_EQ(host.lost_frames(), 0U);
  EXPECT_NEAR(heard_m(), world.driven_m(), 0.001) << "no travel is lost";
  EXPECT_EQ(troubles(), "");
}

// The same when the base really fell silent meanwhile: that shows as soon as all is heard.
TEST_P(AgilexHeldUp, ABaseThatFellSilentMeanwhileIs) {
  make_held_up();
  wait(1s);
  silent.clear();
  faults.set({UnitFault::off, 0});
  const hal::Time off = clock.now();
  host_side->hold(GetParam());
  wait(GetParam());
  wait(300ms);
  ASSERT_FALSE(silent.empty());
  EXPECT_LE(silent.front() - off, std::max<hal::Duration>(GetParam() + 10ms, 260ms));
  EXPECT_TRUE(says("no reports from the base")) << troubles();
  faults.clear();
  wait(2s);
  EXPECT_EQ(drive->state(), DeviceState::running);
}

INSTANTIATE_TEST_SUITE_P(ForALittleAndForLong, AgilexHeldUp,
                         testing::Values(100ms, 150ms, 250ms, 400ms), [](const auto& param) {
                           return "ms" + std::to_string(param.param.count());
                         });

TEST_F(AgilexLoop, APowerCycleIsNoJump) {
  sim::AgilexUnit::Config config;
  config.odometry_mm = 500;  // So near zero that a jump would look like travel.
  make_unit(config);
  make_drive();
  wait(1s);
  faults.set({UnitFault::off, 0});
  wait(5s);
  faults.clear();
  wait(2s);
  EXPECT_EQ(drive->state(), DeviceState::running);
  EXPECT_NEAR(heard_m(), 0, 1e-9);
}

TEST_F(AgilexLoop, GivesTheBaseBackAtTheEnd) {
  make_both();
  wait(1s);
  twist = {0.5, 0};
  wait(1s);
  spawn(tap(wire.attach()));
  spawn(drive->release());
  wait(3s);
  EXPECT_FALSE(world.moving());
  EXPECT_EQ(std::count_if(
                log.begin(), log.end(),
                [](const std::string& line) { return line.find(" 1057#1.") != std::string::npos; }),
            0)
      << "not taken again";
  EXPECT_NE(std::find_if(
                log.begin(), log.end(),
                [](const std::string& line) { return line.find(" 1057#0.") != std::string::npos; }),
            log.end());
  EXPECT_EQ(answers.back(), errc::not_connected);
}

TEST(AgilexLoopFailures, GetsGoingWhicheverCallOfTheLinkFails) {
  int calls = 1;
  for (int n = 0; n <= calls; ++n) {  // 0: none.
    DriveBench bench;
    sim::UnitFaults faults(bench.clock);
    FailingBus bus(bench.wire.attach(), n);
    sim::AgilexUnit unit({}, bench.world, nullptr, bench.clock, bench.wire.attach(), faults);
    drivers::AgilexDrive drive({}, bench.clock, bus);
    bench.spawn(unit.run());
    bench.spawn(drive.run());
    bench.spawn(bench.commander(drive));
    bench.spawn(bench.odometer(drive));
    bench.twist = {0.3, 0};
    bench.wait(700ms);
    if (n == 0) calls = bus.calls();
    bench.wait(2s);
    EXPECT_EQ(drive.state(), DeviceState::running)
        << "call " << n << ": " << text(drive.troubles());
    bench.twist = {};
    bench.wait(2s);
    EXPECT_NEAR(bench.heard_m(), bench.world.driven_m(), 0.001) << "call " << n;
    EXPECT_GT(bench.world.driven_m(), 0.3);
  }
  EXPECT_GT(calls, 300);
}

TEST(AgilexLoopRepeats, ByteForByte) {
  const auto once = [] {
    DriveBench bench;
    sim::UnitFaults faults(bench.clock);
    sim::AgilexUnit unit({}, bench.world, nullptr, bench.clock, bench.wire.attach(), faults);
    drivers::AgilexDrive drive({}, bench.clock, bench.wire.attach());
    bench.spawn(bench.tap(bench.wire.attach()));
    bench.spawn(unit.run());
    bench.spawn(drive.run());
    bench.spawn(bench.commander(drive));
    bench.twist = {0.3, 0.1};
    bench.wait(2s);
    faults.set({UnitFault::duplicated_reordered, 0});
    bench.wait(2s);
    faults.set({UnitFault::garbage, 0});
    bench.wait(2s);
    return bench.log;
  };
  const auto first = once();
  EXPECT_EQ(first, once());
  EXPECT_GT(first.size(), 3000u);
}

}  // namespace
