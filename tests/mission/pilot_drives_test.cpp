// The pilot with every drive that ships, in a yard with a crate that the map lacks.
#include <gtest/gtest.h>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <memory>

#include "drivers/agilex_drive.hpp"
#include "drivers/cia402_drive.hpp"
#include "mission/pilot.hpp"
#include "nav/polygons.hpp"
#include "sim/agilex_unit.hpp"
#include "sim/cia402_unit.hpp"
#include "sim/links.hpp"
#include "sim/sim_clock.hpp"
#include "tests/sim/room.hpp"
#include "tests/support/direct_devices.hpp"

namespace {

using namespace std::chrono_literals;

constexpr double kYardM = 30;
const hal::Pose2 kStart{{4, 15}, 0}, kGoal{{26, 15}, 0};

const sim::Scene& yard_with_crate() {
  static const sim::Mesh mesh = [] {
    sim::Mesh yard = sim_test::plain(100);
    sim_test::add_box(yard, {14.7, 14.7, 0}, {15.3, 15.3, 1});
    return yard;
  }();
  // Never destroyed: when statics are, Embree's own are already gone.
  static const auto* const scene = new sim::Scene(mesh);
  return *scene;
}

nav::FreeArea open_yard() {
  const auto far = static_cast<std::int32_t>(kYardM * 1000);
  nav::FreeArea area;
  area.drivable = nav::normalise({nav::Ring{{0, 0}, {far, 0}, {far, far}, {0, far}}});
  area.standable = nav::offset(area.drivable, -500);
  return area;
}

struct Yard {
  boost::asio::io_context io;
  sim::SimClock clock{io};
  sim::World world{yard_with_crate(), {}};
  direct::Robot robot{world, clock};
  sim::CanWire wire{clock};
  sim::UnitFaults left_faults{clock}, right_faults{clock};

  void spawn(hal::Task<void> task) {
    boost::asio::co_spawn(io, std::move(task), [](std::exception_ptr problem) {
      if (problem) std::rethrow_exception(problem);
    });
  }

  // Drives once across the yard.
  mission::LegEnd drive(hal::Drive& drive) {
    hal::Devices devices = robot.devices();
    hal::Devices all{drive, devices.imu, devices.gnss, devices.scanner, devices.placement};
    mission::Pilot pilot({}, clock, all, kStart);
    mission::Roads roads(open_yard(), 0.5);
    spawn(pilot.track());
    std::optional<mission::LegEnd> end;
    boost::asio::co_spawn(io, pilot.drive_to(roads, kGoal),
                          [&](std::exception_ptr problem, mission::LegEnd leg) {
                            if (problem) std::rethrow_exception(problem);
                            end = std::move(leg);
                          });
    EXPECT_TRUE(clock.run([&] { return end.has_value() || clock.now() > hal::Time(1h); }));
    return end.value_or(mission::LegEnd{});
  }

  void check(const mission::LegEnd& leg) {
    EXPECT_TRUE(leg.arrived) << leg.reason;
    EXPECT_GE(world.collisions(), 1) << "the crate was in the way";
    EXPECT_LT((world.robot().pose.position_m - kGoal.position_m).norm(), 0.4);
    EXPECT_NEAR(leg.driven_m, world.driven_m(), 0.1 * world.driven_m());
    EXPECT_LT(clock.now(), hal::Time(5min));
  }
};

TEST(PilotDrives, RoundACrateWithTheSimulatedDrive) {
  Yard yard;
  ASSERT_TRUE(yard.world.put_robot(kStart, 0));
  yard.check(yard.drive(yard.robot.drive));
}

TEST(PilotDrives, RoundACrateWithAnAgilexBase) {
  Yard yard;
  ASSERT_TRUE(yard.world.put_robot(kStart, 0));
  sim::AgilexUnit unit({}, yard.world, nullptr, yard.clock, yard.wire.attach(), yard.left_faults);
  drivers::AgilexDrive::Config config;
  config.track_m = yard.world.config().track_m;
  drivers::AgilexDrive drive(config, yard.clock, yard.wire.attach());
  yard.spawn(unit.run());
  yard.spawn(drive.run());
  yard.clock.run_until(hal::Time(2s));
  yard.check(yard.drive(drive));
}

TEST(PilotDrives, RoundACrateWithTwoCia402Drives) {
  Yard yard;
  ASSERT_TRUE(yard.world.put_robot(kStart, 0));
  sim::Cia402NodeConfig left, right;
  right.node = 2;
  sim::Cia402Unit unit(left, right, yard.world, yard.clock, yard.wire.attach(), yard.wire.attach(),
                       yard.left_faults, yard.right_faults);
  drivers::Cia402Drive::Config config;
  config.track_m = yard.world.config().track_m;
  drivers::Cia402Drive drive(config, yard.clock, yard.wire.attach());
  yard.spawn(unit.run());
  yard.spawn(drive.run());
  yard.clock.run_until(hal::Time(3s));
  yard.check(yard.drive(drive));
}

}  // namespace
