// The gate over two CiA 402 drives, and its loop itself.
#include "drivers/cia402_drive.hpp"
#include "drivers/real_clock.hpp"
#include "sim/cia402_unit.hpp"
#include "tests/drivers/allocations.hpp"
#include "tests/mission/gated_rig.hpp"
#include "tests/support/well_drive.hpp"

namespace gate_test {
namespace {

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

// What a loop allocates in a virtual second, once it runs.
template <class Loop>
std::uint64_t allocated_by(Loop loop) {
  boost::asio::io_context io;
  sim::SimClock clock(io);
  test::WellDrive drive(clock);
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

TEST(GatedDriveLoop, AllocatesNothingInVirtualTime) {
  const auto gates = [](hal::Clock&, GatedDrive& gate) { return gate.run(); };
  const auto pieces = [](hal::Clock& clock, GatedDrive&) -> hal::Task<void> {
    for (std::unique_ptr<int> piece;; piece = std::make_unique<int>(1))
      co_await clock.sleep_for(mission::kGatePeriod);
  };
  EXPECT_EQ(allocated_by(pieces), 100U) << "it counts nothing";
  EXPECT_EQ(allocated_by(gates), 0U);
}

// What wakes it on a robot allocates nothing either.
TEST(GatedDriveLoop, AllocatesNothingInRealTime) {
  boost::asio::io_context io{1};
  drivers::RealClock clock;
  test::WellDrive drive(clock);
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
}  // namespace gate_test
