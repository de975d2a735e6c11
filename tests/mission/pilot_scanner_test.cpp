// The pilot of a robot whose only eye is the scanner of its scans, through its driver and the
// packets of its unit: a VLP-16, and an Ouster.
#include <gtest/gtest.h>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "hal/angles.hpp"
#include "mission/look.hpp"
#include "mission/main_scanner.hpp"
#include "mission/main_units.hpp"
#include "mission/pilot.hpp"
#include "mission/walls_so_far.hpp"
#include "nav/polygons.hpp"
#include "sim/placement.hpp"
#include "sim/sim_clock.hpp"
#include "tests/sim/room.hpp"
#include "tests/support/random_site.hpp"

namespace pilot_scanner_tests {
namespace {

using namespace std::chrono_literals;
using Eigen::Vector2d;

const hal::Pose2 kStart{{4, 5}, 0}, kGoal{{26, 5}, 0};

struct Crate {
  Vector2d low_m, high_m;
  double top_m = 1;
};

mission::RobotConfig robot_config(const std::string& name) {
  const auto file = std::filesystem::path(VANTAGE_SOURCE_DIR) / "configs" / "robots" / name;
  std::ifstream in(file);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  const auto loaded = mission::parse_mission("", "m.toml", text, file.string());
  EXPECT_TRUE(loaded.errors.empty()) << loaded.errors[0].text();
  EXPECT_EQ(loaded.config.robot.obstacles.device, "scanner");
  mission::RobotConfig robot = loaded.config.robot;
  if (!robot.scanner.metadata.empty())
    robot.scanner.metadata = file.parent_path() / robot.scanner.metadata;
  return robot;
}

// A walled yard of 30 x 10 m. The crates in it are on no map.
struct Trip {
  Trip(const std::string& robot_file, const std::vector<Crate>& crates,
       const std::vector<sim::Person>& people = {}, std::uint64_t seed = 1, bool satellites = true)
      : config(robot_config(robot_file)) {
    sim::Mesh mesh = sim_test::plain(100);
    for (const auto& [low_m, high_m] : walls())
      sim_test::add_box(mesh, {low_m.x(), low_m.y(), 0}, {high_m.x(), high_m.y(), 3});
    for (const Crate& crate : crates)
      sim_test::add_box(mesh, {crate.low_m.x(), crate.low_m.y(), 0},
                        {crate.high_m.x(), crate.high_m.y(), crate.top_m});
    scene = std::make_unique<sim::Scene>(mesh);
    sim::WorldConfig its;
    its.seed = seed;
    its.people = people;
    its.radius_m = config.body.radius_m;
    its.track_m = config.body.track_m;
    its.speed_max_mps = config.body.speed_max_mps;
    its.scanner.height_m = config.scanner.height_m;
    its.scanner.range_min_m = config.scanner.range_min_m;
    its.scanner.range_max_m = config.scanner.range_max_m;
    world = std::make_unique<sim::World>(*scene, its);
    EXPECT_TRUE(world->put_robot(kStart, 0));
    robot = std::make_unique<mission::SimulatedRobot>(config, mission::kSimAnchor, seed, 1, *world,
                                                      clock);
    if (!satellites) robot->units().faults("gnss")->set(sim::parse_unit_fault("off").setting);
    placement = std::make_unique<sim::SimPlacement>(*world, clock);
    mission::RobotDrivers& drivers = robot->drivers();
    devices = std::make_unique<hal::Devices>(hal::Devices{drivers.drive(),
                                                          drivers.imu(),
                                                          drivers.gnss(),
                                                          drivers.scanner(),
                                                          *placement,
                                                          {},
                                                          drivers.obstacles()});
    nav::FreeArea area;
    area.drivable = nav::normalise({support::rectangle_mm(0, 0, 30, 10)});
    area.standable = nav::offset(area.drivable, -nav::to_mm({config.body.radius_m, 0}).x);
    roads = std::make_unique<mission::Roads>(area, config.body.radius_m);
    spawn(robot->run());
    clock.run_until(hal::Time(20s));  // Until all devices run.
    pilot = std::make_unique<mission::Pilot>(config, clock, *devices, kStart);
    spawn(pilot->track());
  }
  void spawn(hal::Task<void> task) {
    boost::asio::co_spawn(io, std::move(task), [](std::exception_ptr problem) {
      if (problem) std::rethrow_exception(problem);
    });
  }
  static std::vector<std::pair<Vector2d, Vector2d>> walls() {
    return {{{-1, -1}, {31, 0}}, {{-1, 10}, {31, 11}}, {{-1, 0}, {0, 10}},
            {{30, 0}, {31, 10}}, {{8, 9}, {10, 10}},   {{19, 0}, {20, 1}}};
  }
  static nav::SiteMap map() {
    std::vector<nav::Ring> rings;
    for (const auto& [low_m, high_m] : walls()) {
      const Vector2d size_m = high_m - low_m;
      rings.push_back(support::rectangle_mm(low_m.x(), low_m.y(), size_m.x(), size_m.y()));
    }
    nav::SiteMap site;
    site.obstacles = nav::normalise(rings);
    return site;
  }
  void know_walls() {
    const mission::WallsSoFar walls(map(), true, mission::look_height_m(config));
    pilot->know_walls(compute, std::make_shared<const nav::WallMap>(walls.map()));
  }

  mission::LegEnd drive(const hal::Pose2& goal = kGoal) {
    std::optional<mission::LegEnd> end;
    const hal::Time began = clock.now();
    boost::asio::co_spawn(io, pilot->drive_to(*roads, goal),
                          [&](std::exception_ptr problem, mission::LegEnd leg) {
                            if (problem) std::rethrow_exception(problem);
                            end = std::move(leg);
                          });
    EXPECT_TRUE(clock.run([&] {
      for (const sim::Walker& walker : world->people())
        if (std::abs(world->rolling().forward_mps) > 0.05)
          nearest_person_m = std::min(
              nearest_person_m, (walker.position_m() - world->robot().pose.position_m).norm() -
                                    config.body.radius_m - walker.person().radius_m);
      return end.has_value() || clock.now() > began + 1h;
    }));
    took_s = hal::seconds(clock.now() - began);
    EXPECT_EQ(world->collisions(), 0);
    return end.value_or(mission::LegEnd{});
  }
  double error_m() const {
    return (pilot->pose().position_m - world->robot().pose.position_m).norm();
  }
  double error_deg() const {
    return hal::degrees(
        std::abs(hal::wrapped(pilot->pose().heading_rad - world->robot().pose.heading_rad)));
  }

  mission::RobotConfig config;
  std::unique_ptr<sim::Scene> scene;
  boost::asio::io_context io;
  sim::SimClock clock{io};
  hal::ComputeHere compute;
  std::unique_ptr<sim::World> world;
  std::unique_ptr<mission::SimulatedRobot> robot;
  std::unique_ptr<sim::SimPlacement> placement;
  std::unique_ptr<hal::Devices> devices;
  std::unique_ptr<mission::Roads> roads;
  std::unique_ptr<mission::Pilot> pilot;
  double took_s{}, nearest_person_m = 1e9;
};

class PilotScanner : public testing::TestWithParam<const char*> {};

bool nightly() {
  return std::getenv("VANTAGE_NIGHTLY") != nullptr;
}

TEST_P(PilotScanner, DrivesAtFullSpeedWhereNothingIsInTheWay) {
  Trip trip(GetParam(), {});
  const mission::LegEnd leg = trip.drive();
  EXPECT_TRUE(leg.arrived) << leg.reason;
  EXPECT_EQ(leg.obstacles_met, 0);
  EXPECT_EQ(leg.waited_s, 0);
  EXPECT_LT(trip.took_s, 34);
}

TEST_P(PilotScanner, GoesRoundACrateWithoutTouchingIt) {
  Trip trip(GetParam(), {{{14.7, 4.7}, {15.3, 5.3}}});
  const mission::LegEnd leg = trip.drive();
  EXPECT_TRUE(leg.arrived) << leg.reason;
  EXPECT_GE(leg.obstacles_met, 1);
  EXPECT_LT(trip.took_s, 90);
}

// Half a metre high: none of its beams meets it when the robot stands before it.
TEST_P(PilotScanner, GoesRoundALowCrateThatItDoesNotSeeWhereItStops) {
  Trip trip(GetParam(), {{{14.5, 4.5}, {15.5, 5.5}, 0.5}});
  const mission::LegEnd leg = trip.drive();
  EXPECT_TRUE(leg.arrived) << leg.reason;
  EXPECT_GE(leg.obstacles_met, 1);
}

TEST_P(PilotScanner, GivesUpWithAReasonWhereTheRoadIsBlocked) {
  if (!nightly()) GTEST_SKIP() << "takes two minutes: set VANTAGE_NIGHTLY";
  Trip trip(GetParam(), {{{15, 0}, {15.5, 10}}});
  const mission::LegEnd leg = trip.drive();
  EXPECT_FALSE(leg.arrived);
  EXPECT_NE(leg.reason.find("something was in the way at ("), std::string::npos) << leg.reason;
}

TEST_P(PilotScanner, WaitsForSomebodyWhoCrosses) {
  sim::Person person{.way_m = {{15, 0.5}, {15, 9.5}}, .speed_mps = 0.8};
  int waited = 0;
  for (int i = 0; i < 6; ++i) {
    person.start_s = 20 + 3 + i;
    Trip trip(GetParam(), {}, {person});
    const mission::LegEnd leg = trip.drive();
    EXPECT_TRUE(leg.arrived) << leg.reason;
    EXPECT_GT(trip.nearest_person_m, 0.02);
    waited += leg.waited_s > 0;
  }
  EXPECT_GE(waited, 1);
}

TEST_P(PilotScanner, StandsStillWhileItsScannerIsSilent) {
  Trip trip(GetParam(), {});
  trip.robot->units().faults("scanner")->set(sim::parse_unit_fault("off").setting);
  trip.clock.run_until(trip.clock.now() + 2s);
  const mission::LegEnd leg = trip.drive();
  EXPECT_FALSE(leg.arrived);
  EXPECT_EQ(leg.reason, "the scanner that looks for obstacles says nothing");
  EXPECT_LT(trip.world->driven_m(), 0.01);
}

TEST_P(PilotScanner, HoldsItsPlaceByTheWallsWhereNoSatellitesAreSeen) {
  if (!nightly()) GTEST_SKIP() << "takes a minute: set VANTAGE_NIGHTLY";
  double blind_m = 0, worst_m = 0;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    Trip trip(GetParam(), {}, {}, seed, false), blind(GetParam(), {}, {}, seed, false);
    trip.know_walls();
    for (Trip* one : {&trip, &blind})
      for (int i = 0; i < 2; ++i) {
        EXPECT_TRUE(one->drive({{26, 3}, 0}).arrived);
        if (one == &trip) {
          EXPECT_LT(trip.error_m(), 0.30);
          EXPECT_LT(trip.error_deg(), 1.5);
        }
        EXPECT_TRUE(one->drive({{4, 6}, 2}).arrived);
      }
    EXPECT_GT(trip.pilot->profiles().used, 40U);
    EXPECT_LT(trip.error_m(), 0.30);
    EXPECT_LT(trip.error_deg(), 1.5);
    worst_m = std::max(worst_m, trip.error_m());
    blind_m = std::max(blind_m, blind.error_m());
  }
  std::printf("%s: worst %.3f m, by the wheels alone %.3f m\n", GetParam(), worst_m, blind_m);
  EXPECT_LT(3 * worst_m, blind_m);
}

INSTANTIATE_TEST_SUITE_P(All, PilotScanner,
                         testing::Values("bunker_vlp16.toml", "scout_ouster.toml"),
                         [](const auto& param) {
                           const std::string name = param.param;
                           return name.substr(0, name.find('.'));
                         });

}  // namespace
}  // namespace pilot_scanner_tests
