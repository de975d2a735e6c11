// The pilot of a robot that holds on to walls on its way: where satellites are not seen, and not
// where they are.
#include <gtest/gtest.h>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>

#include "mission/pilot.hpp"
#include "mission/walls_so_far.hpp"
#include "nav/polygons.hpp"
#include "sim/sim_clock.hpp"
#include "tests/sim/room.hpp"
#include "tests/support/direct_devices.hpp"
#include "tests/support/random_site.hpp"

namespace pilot_walls_tests {
namespace {

using namespace std::chrono_literals;
using Eigen::Vector2d;

const hal::Pose2 kStart{{3, 2}, 0};
constexpr double kLengthM = 40, kWidthM = 8;

struct House {
  Vector2d low_m, size_m;
};
const std::vector<House> kHouses{{{-1, -1}, {kLengthM + 2, 1}}, {{-1, kWidthM}, {kLengthM + 2, 1}},
                                 {{-1, 0}, {1, kWidthM}},       {{kLengthM, 0}, {1, kWidthM}},
                                 {{12, 5}, {3, 2.5}},           {{26, 5.5}, {2, 2}}};

nav::SiteMap map_of_yard() {
  std::vector<nav::Ring> rings;
  for (const House& house : kHouses)
    rings.push_back(support::rectangle_mm(house.low_m.x(), house.low_m.y(), house.size_m.x(),
                                          house.size_m.y()));
  nav::SiteMap map;
  map.obstacles = nav::normalise(rings);
  return map;
}

// No satellite is seen.
class NoSatellites final : public hal::Gnss {
 public:
  explicit NoSatellites(hal::Clock& clock) : clock_(clock) {}
  hal::Task<hal::Result<hal::GnssFix>> next_fix() override {
    co_await clock_.sleep_for(1s);
    co_return boost::system::errc::make_error_code(boost::system::errc::timed_out);
  }

 private:
  hal::Clock& clock_;
};

// A walled yard with two sheds, and a robot that goes up and down in it.
struct Trip {
  explicit Trip(std::uint64_t seed, bool satellites) {
    sim::Mesh mesh = sim_test::plain(100);
    for (const House& house : kHouses) {
      const Vector2d high_m = house.low_m + house.size_m;
      sim_test::add_box(mesh, {house.low_m.x(), house.low_m.y(), 0}, {high_m.x(), high_m.y(), 3});
    }
    scene = std::make_unique<sim::Scene>(mesh);
    sim::WorldConfig config;
    config.seed = seed;
    world = std::make_unique<sim::World>(*scene, config);
    robot = std::make_unique<direct::Robot>(*world, clock);
    hal::Gnss& gnss = satellites ? static_cast<hal::Gnss&>(robot->gnss) : no_satellites;
    devices = std::make_unique<hal::Devices>(hal::Devices{
        robot->drive, robot->imu, gnss, robot->scanner, robot->placement, {}, &robot->obstacles});
    EXPECT_TRUE(world->put_robot(kStart, 0));
    nav::FreeArea area;
    area.drivable = nav::subtract(nav::normalise({support::rectangle_mm(0, 0, kLengthM, kWidthM)}),
                                  map_of_yard().obstacles);
    area.standable = nav::offset(area.drivable, -500);
    roads = std::make_unique<mission::Roads>(area, 0.5);
    pilot = std::make_unique<mission::Pilot>(mission::RobotConfig{}, clock, *devices, kStart);
    boost::asio::co_spawn(io, pilot->track(), [](std::exception_ptr problem) {
      if (problem) std::rethrow_exception(problem);
    });
  }

  void know_walls(const mission::WallsSoFar& walls) {
    pilot->know_walls(compute, std::make_shared<const nav::WallMap>(walls.map()));
  }

  void drive(const hal::Pose2& goal) {
    bool ended = false;
    const hal::Time began = clock.now();
    boost::asio::co_spawn(io, pilot->drive_to(*roads, goal),
                          [&](std::exception_ptr problem, const mission::LegEnd& leg) {
                            if (problem) std::rethrow_exception(problem);
                            EXPECT_TRUE(leg.arrived) << leg.reason;
                            ended = true;
                          });
    EXPECT_TRUE(clock.run([&] { return ended || clock.now() > began + 1h; }));
    EXPECT_EQ(world->collisions(), 0);
  }
  void drive_up_and_down() {
    for (int i = 0; i < 2; ++i) {
      drive({{37, 4}, 0});
      drive({{3, 4}, 2});
    }
  }
  double error_m() const {
    return (pilot->pose().position_m - world->robot().pose.position_m).norm();
  }

  std::unique_ptr<sim::Scene> scene;
  boost::asio::io_context io;
  sim::SimClock clock{io};
  NoSatellites no_satellites{clock};
  std::unique_ptr<sim::World> world;
  std::unique_ptr<direct::Robot> robot;
  std::unique_ptr<hal::Devices> devices;
  std::unique_ptr<mission::Roads> roads;
  std::unique_ptr<mission::Pilot> pilot;
  hal::ComputeHere compute;
};

TEST(PilotWalls, KeepItsPlaceWhereNoSatellitesAreSeen) {
  double worst_m = 0, sum_m = 0, blind_m = 0;
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    Trip trip(seed, false), blind(seed, false);
    trip.know_walls(mission::WallsSoFar(map_of_yard(), true, 0.3));
    trip.drive_up_and_down();
    blind.drive_up_and_down();
    EXPECT_GT(trip.pilot->profiles().used, 60U) << seed;
    EXPECT_EQ(blind.pilot->profiles().used, 0U) << seed;
    worst_m = std::max(worst_m, trip.error_m());
    sum_m += trip.error_m();
    blind_m += blind.error_m();
  }
  EXPECT_LT(worst_m, 0.15);
  EXPECT_LT(3 * sum_m, blind_m);
}

TEST(PilotWalls, AreNotAskedWhereSatellitesTellThePlace) {
  Trip trip(5, true);
  trip.clock.run_until(hal::Time(2s));
  trip.know_walls(mission::WallsSoFar(map_of_yard(), true, 0.3));
  trip.drive({{37, 4}, 0});
  EXPECT_EQ(trip.pilot->profiles().used, 0U);
  EXPECT_LT(trip.error_m(), 0.15);
}

// A map of another place moves it nowhere.
TEST(PilotWalls, OfAnotherPlaceAreNotFollowed) {
  Trip trip(6, false), blind(6, false);
  nav::SiteMap other;
  other.obstacles = nav::normalise(
      {support::rectangle_mm(0, 3.1, 9, 0.2), support::rectangle_mm(20, -6, 0.3, 9)});
  trip.know_walls(mission::WallsSoFar(other, true, 0.3));
  trip.drive({{37, 2}, 0});
  blind.drive({{37, 2}, 0});
  EXPECT_GT(trip.pilot->profiles().unlike + trip.pilot->profiles().refused, 20U);
  EXPECT_LT(trip.error_m(), blind.error_m() + 0.1);
}

// Points about the height of the scanner that stand upright; ground, eaves and far away do not.
TEST(WallsSoFar, AreWhatScansShowUprightAtItsHeight) {
  std::vector<Eigen::Vector3f> W_points_m;
  for (float z_m = 10; z_m < 13; z_m += 0.05F)
    for (float y_m = 0; y_m < 4; y_m += 0.05F) {
      W_points_m.emplace_back(5.03F, y_m, z_m);                          // A wall.
      W_points_m.emplace_back(-60.0F, y_m, z_m);                         // Too far away.
      if (z_m > 11.5F) W_points_m.emplace_back(8.0F, y_m, z_m);          // Under an arch.
      W_points_m.emplace_back(y_m, -3.0F, 10.25F + 0.01F * (z_m - 10));  // A kerb.
    }
  mission::WallsSoFar walls({}, true, 0.3);
  walls.add(1, W_points_m, {0, 0}, 10);
  const nav::WallMap map = walls.map();
  ASSERT_FALSE(map.walls().empty());
  for (const nav::WallMap::Wall& wall : map.walls()) EXPECT_NEAR(wall.point_m.x(), 5.03, 0.01);
  walls.clear();
  EXPECT_TRUE(walls.map().walls().empty());
  // A scan that comes again stands where it then does.
  walls.add(1, W_points_m, {0, 0}, 10);
  for (Eigen::Vector3f& point : W_points_m) point.x() += 1;
  walls.add(1, W_points_m, {0, 0}, 10);
  const nav::WallMap moved = walls.map();
  ASSERT_EQ(moved.walls().size(), map.walls().size());
  for (const nav::WallMap::Wall& wall : moved.walls()) EXPECT_NEAR(wall.point_m.x(), 6.03, 0.01);
}

}  // namespace
}  // namespace pilot_walls_tests
