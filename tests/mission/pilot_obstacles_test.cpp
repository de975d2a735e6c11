// The pilot of a robot that sees what is in its way: crates, people, blocked roads.
#include <gtest/gtest.h>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>

#include "mission/pilot.hpp"
#include "nav/polygons.hpp"
#include "sim/sim_clock.hpp"
#include "tests/sim/room.hpp"
#include "tests/support/direct_devices.hpp"
#include "tests/support/random_site.hpp"

namespace pilot_obstacles_tests {
namespace {

using namespace std::chrono_literals;
using Eigen::Vector2d;

const hal::Pose2 kStart{{4, 5}, 0}, kGoal{{26, 5}, 0};

struct Crate {
  Vector2d low_m, high_m;
};

// A yard of 30 x 10 m. What stands in it is on no map.
struct Trip {
  explicit Trip(const std::vector<Crate>& crates, const std::vector<sim::Person>& people = {}) {
    sim::Mesh mesh = sim_test::plain(100);
    for (const Crate& crate : crates)
      sim_test::add_box(mesh, {crate.low_m.x(), crate.low_m.y(), 0},
                        {crate.high_m.x(), crate.high_m.y(), 1});
    scene = std::make_unique<sim::Scene>(mesh);
    sim::WorldConfig config;
    config.people = people;
    world = std::make_unique<sim::World>(*scene, config);
    robot = std::make_unique<direct::Robot>(*world, clock);
    devices = std::make_unique<hal::Devices>(robot->seeing_devices());
    EXPECT_TRUE(world->put_robot(kStart, 0));
    nav::FreeArea area;
    area.drivable = nav::normalise({support::rectangle_mm(0, 0, 30, 10)});
    area.standable = nav::offset(area.drivable, -500);
    roads = std::make_unique<mission::Roads>(area, 0.5);
    pilot = std::make_unique<mission::Pilot>(mission::RobotConfig{}, clock, *devices, kStart);
    boost::asio::co_spawn(io, pilot->track(), [](std::exception_ptr problem) {
      if (problem) std::rethrow_exception(problem);
    });
  }

  mission::LegEnd drive(const hal::Pose2& goal = kGoal) {
    std::optional<mission::LegEnd> end;
    const hal::Time began = clock.now();
    boost::asio::co_spawn(io, pilot->drive_to(*roads, goal),
                          [&](std::exception_ptr problem, mission::LegEnd leg) {
                            if (problem) std::rethrow_exception(problem);
                            end = std::move(leg);
                          });
    EXPECT_TRUE(clock.run([&] { return end.has_value() || clock.now() > began + 1h; }));
    took_s = hal::seconds(clock.now() - began);
    EXPECT_EQ(world->collisions(), 0);
    return end.value_or(mission::LegEnd{});
  }

  std::unique_ptr<sim::Scene> scene;
  boost::asio::io_context io;
  sim::SimClock clock{io};
  std::unique_ptr<sim::World> world;
  std::unique_ptr<direct::Robot> robot;
  std::unique_ptr<hal::Devices> devices;
  std::unique_ptr<mission::Roads> roads;
  std::unique_ptr<mission::Pilot> pilot;
  double took_s{};
};

TEST(PilotObstacles, GoesRoundACrateWithoutTouchingIt) {
  Trip trip({{{14.7, 4.7}, {15.3, 5.3}}});
  const mission::LegEnd leg = trip.drive();
  EXPECT_TRUE(leg.arrived) << leg.reason;
  EXPECT_GE(leg.obstacles_met, 1);
  EXPECT_LT(leg.short_of_goal_m, 0.06);
  EXPECT_LT(trip.took_s, 80);
}

TEST(PilotObstacles, DrivesAtFullSpeedWhereNothingIsInTheWay) {
  Trip trip({});
  const mission::LegEnd leg = trip.drive();
  EXPECT_TRUE(leg.arrived) << leg.reason;
  EXPECT_EQ(leg.obstacles_met, 0);
  EXPECT_EQ(leg.waited_s, 0);
  EXPECT_LT(trip.took_s, 32);
}

TEST(PilotObstacles, WaitsForSomebodyWhoCrosses) {
  sim::Person person{.way_m = {{15, 0.5}, {15, 9.5}}, .speed_mps = 0.8};
  int waited = 0;
  for (int i = 0; i < 6; ++i) {
    person.start_s = 3 + i;
    Trip trip({}, {person});
    const mission::LegEnd leg = trip.drive();
    EXPECT_TRUE(leg.arrived) << leg.reason;
    waited += leg.waited_s > 0;
  }
  EXPECT_GE(waited, 1);
}

TEST(PilotObstacles, GoesRoundSomebodyWhoStays) {
  Trip trip({}, {{.way_m = {{15, 5}}}});
  const mission::LegEnd leg = trip.drive();
  EXPECT_TRUE(leg.arrived) << leg.reason;
  EXPECT_GE(leg.obstacles_met, 1);
}

TEST(PilotObstacles, GoesRoundAShedThatTheMapLacks) {
  Trip trip({{{10, 2}, {18, 8.2}}});
  const mission::LegEnd leg = trip.drive();
  EXPECT_TRUE(leg.arrived) << leg.reason;
}

TEST(PilotObstacles, GivesUpWithAReasonWhereTheRoadIsBlocked) {
  Trip trip({{{15, -1}, {15.5, 11}}});
  const mission::LegEnd leg = trip.drive();
  EXPECT_FALSE(leg.arrived);
  EXPECT_NE(leg.reason.find("something was in the way at (15."), std::string::npos) << leg.reason;
  EXPECT_LT(trip.took_s, 600);
  // What is on this side can be reached as before.
  EXPECT_TRUE(trip.drive({{6, 8}, 0}).arrived);
}

TEST(PilotObstacles, TakesTheRoadAgainWhenItIsOpen) {
  // They stand shoulder to shoulder, then leave.
  std::vector<sim::Person> people;
  for (int i = 0; i < 14; ++i)
    people.push_back({.way_m = {{15, 0.3 + 0.7 * i}, {15, 20 + 0.7 * i}, {90, 90}},
                      .speed_mps = 1,
                      .start_s = 150});
  Trip trip({}, people);
  const mission::LegEnd first = trip.drive();
  EXPECT_FALSE(first.arrived);
  trip.clock.run_until(hal::Time(6min));
  const mission::LegEnd second = trip.drive();
  EXPECT_TRUE(second.arrived) << second.reason;
}

TEST(PilotObstacles, StandsStillWhileItCannotLookAhead) {
  Trip trip({});
  trip.robot->obstacles.broken = true;
  const mission::LegEnd leg = trip.drive();
  EXPECT_FALSE(leg.arrived);
  EXPECT_EQ(leg.reason, "the scanner that looks for obstacles says nothing");
  EXPECT_EQ(trip.world->driven_m(), 0);
  trip.robot->obstacles.broken = false;
  EXPECT_TRUE(trip.drive().arrived);
}

// The crate reaches 1 cm into the place where the robot is to stand.
TEST(PilotObstacles, ComesAsNearAsItCanToAGoalThatIsHardlyBlocked) {
  Trip trip({{{26.49, 4}, {27, 6}}});
  const mission::LegEnd leg = trip.drive();
  EXPECT_TRUE(leg.arrived) << leg.reason;
  EXPECT_GT(leg.short_of_goal_m, 0.01);
  EXPECT_LT(leg.short_of_goal_m, 0.15);
}

TEST(PilotObstacles, LeavesAGoalThatIsBlocked) {
  Trip trip({{{26.2, 4}, {27, 6}}});
  const mission::LegEnd leg = trip.drive();
  EXPECT_FALSE(leg.arrived);
  EXPECT_NE(leg.reason.find("closer to an obstacle"), std::string::npos) << leg.reason;
}

}  // namespace
}  // namespace pilot_obstacles_tests
