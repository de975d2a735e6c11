#include "sim/people.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "sim/cast_ahead.hpp"
#include "sim/sim_clock.hpp"
#include "sim/world.hpp"
#include "tests/sim/room.hpp"

namespace {

using namespace std::chrono_literals;
using Eigen::Vector2d;
using Eigen::Vector3d;

const Vector2d kFar(100, 100);

void walk(sim::Walker& walker, double span_s, const Vector2d& robot_m = kFar, bool moves = false) {
  for (double t = 0; t < span_s - 1e-9; t += 0.02) walker.walk(0.02, robot_m, 0.5, moves);
}

TEST(People, WalkTheirWayThereAndBack) {
  sim::Walker walker({.way_m = {{0, 0}, {6, 0}}, .speed_mps = 1.2, .start_s = 1});
  walk(walker, 1);
  EXPECT_NEAR(walker.position_m().x(), 0, 0.03);
  walk(walker, 2.5);
  EXPECT_NEAR(walker.position_m().x(), 3, 0.05);
  walk(walker, 5);
  EXPECT_NEAR(walker.position_m().x(), 3, 0.1);
}

TEST(People, StopAStepBeforeARobotAndTurnRoundIfItStays) {
  sim::Walker walker({.way_m = {{0, 0}, {6, 0}}});
  walk(walker, 3.5, {4, 0}, true);
  EXPECT_NEAR(walker.position_m().x(), 4 - 0.5 - 0.25 - sim::Walker::kStepsAsideM, 0.03);
  walk(walker, 3, {4, 0}, true);
  EXPECT_LT(walker.position_m().x(), 1.5);
}

TEST(People, AreMetByRaysThatAreNotTooHighForThem) {
  const sim::Walker walker({.way_m = {{3, 0}}});
  EXPECT_NEAR(walker.range_m({0, 0, 0.3}, {1, 0, 0}), 2.75, 1e-9);
  EXPECT_TRUE(std::isinf(walker.range_m({0, 0, 0.3}, {-1, 0, 0})));
  EXPECT_TRUE(std::isinf(walker.range_m({0, 0.3, 0.3}, {1, 0, 0})));
  EXPECT_TRUE(std::isinf(walker.range_m({0, 0, 1.8}, {1, 0, 0})));
  const Vector3d down = Vector3d(1, 0, -0.2).normalized();
  EXPECT_NEAR(walker.range_m({0, 0, 1.8}, down), std::hypot(2.75, 0.55), 1e-9);
}

TEST(People, AreRunIntoByARobotThatDoesNotLook) {
  const sim::Mesh mesh = sim_test::plain(100);
  const sim::Scene scene(mesh);
  sim::WorldConfig config;
  config.slip_sigma = 0;
  config.people = {{.way_m = {{5, 0.2}}}};
  sim::World world(scene, config);
  ASSERT_TRUE(world.put_robot({{0, 0}, 0}, 0));
  for (hal::Time now{}; now < hal::Time(10s); now += 100ms) {
    (void)world.command({1, 0});
    world.advance(now);
  }
  EXPECT_EQ(world.collisions(), 1);
  EXPECT_NEAR(world.robot().pose.position_m.x(), 5 - std::sqrt(0.75 * 0.75 - 0.04), 0.1);
  EXPECT_FALSE(world.command({1, 0}));
  EXPECT_TRUE(world.command({-0.2, 0}));
}

// As when a mission goes on whose robot stopped where somebody's way begins.
TEST(People, MakeRoomWhereARobotIsPut) {
  const sim::Mesh mesh = sim_test::plain(100);
  const sim::Scene scene(mesh);
  sim::WorldConfig config;
  config.people = {{.way_m = {{0.1, 0}, {0.1, 9}}, .start_s = 100}};
  sim::World world(scene, config);
  ASSERT_TRUE(world.put_robot({{0, 0}, 0}, 0));
  const Eigen::Vector2d at_m = world.people().front().position_m();
  EXPECT_NEAR(at_m.x(), 0.1, 1e-9);
  EXPECT_NEAR(at_m.norm(), config.radius_m + 0.25 + sim::Walker::kPassesM, 0.1);
  (void)world.command({1, 0});
  world.advance(hal::Time(2s));
  EXPECT_EQ(world.collisions(), 0);
  EXPECT_EQ(world.people().front().position_m(), at_m) << "before they set out";
}

TEST(People, ShowInProfilesWhereTheyAreNow) {
  const sim::Mesh mesh = sim_test::room(10, 10, 5);
  const sim::Scene scene(mesh);
  boost::asio::io_context io;
  sim::SimClock clock(io);
  sim::WorldConfig config;
  config.people = {{.way_m = {{3, 0}, {3, 9}}, .speed_mps = 1, .start_s = 2}};
  config.scanner.height_m = 0.5;
  sim::World world(scene, config);
  ASSERT_TRUE(world.put_robot({{0, 0}, 0}, 0));
  sim::ScannerModel ranges;
  ranges.range_min_m = 0.1;
  ranges.range_sigma_m = 0;
  const sim::FixedPan fixed;
  sim::CastAhead ahead({.ranges = ranges}, world, clock, fixed,
                       [](std::uint64_t number) { return hal::Time(number * 100ms); });
  ahead.set_arc({.beams = 3, .angle_first_rad = -0.5, .angle_step_rad = 0.5}, 10ms);
  EXPECT_NEAR(ahead.of(0)[1], 2.75, 1e-3);
  clock.run_until(hal::Time(5s));
  EXPECT_NEAR(ahead.of(50)[1], 10, 1e-3);
}

}  // namespace
