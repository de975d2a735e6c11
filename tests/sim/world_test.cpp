#include "sim/world.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/sim/room.hpp"

namespace {

using namespace std::chrono_literals;
using boost::system::errc::address_not_available;
using boost::system::errc::invalid_argument;
using boost::system::errc::io_error;

constexpr double kPi = std::numbers::pi;

sim::WorldConfig perfect_world() {
  sim::WorldConfig config;
  config.slip_sigma = 0;
  config.gyro_sigma_radps = config.gyro_bias_sigma_radps = 0;
  config.gnss_sigma_m = 0;
  return config;
}

hal::Pose2 pose(double x, double y, double heading_rad) {
  return {{x, y}, heading_rad};
}

// A world with somebody who keeps commanding.
struct Driven {
  Driven(const sim::Mesh& mesh, const sim::WorldConfig& config)
      : scene(mesh), world(scene, config) {}

  hal::Result<void> drive(hal::Twist twist, double span_s) {
    hal::Result<void> last;
    for (const hal::Time end = now + hal::from_seconds(span_s); now < end;) {
      last = world.command(twist);
      now += 100ms;
      world.advance(now);
    }
    return last;
  }
  double x() const { return world.robot().pose.position_m.x(); }
  double y() const { return world.robot().pose.position_m.y(); }
  double heading_rad() const { return world.robot().pose.heading_rad; }

  sim::Scene scene;
  sim::World world;
  hal::Time now{};
};

TEST(World, DrivesStraightByTheCommandedSpeedLessTheLag) {
  Driven robot(sim_test::plain(100), perfect_world());
  ASSERT_TRUE(robot.world.put_robot(pose(1, 2, kPi / 2), 0));
  ASSERT_TRUE(robot.drive({0.5, 0}, 10));
  // A first-order lag costs the speed times its time constant.
  EXPECT_NEAR(robot.y(), 2 + 0.5 * (10 - 0.2), 0.01);
  EXPECT_NEAR(robot.x(), 1, 1e-9);
  EXPECT_NEAR(robot.heading_rad(), kPi / 2, 1e-9);
  EXPECT_NEAR(robot.world.driven_m(), 4.9, 0.01);
}

TEST(World, TurnsOnTheSpot) {
  Driven robot(sim_test::plain(100), perfect_world());
  ASSERT_TRUE(robot.world.put_robot(pose(1, 2, 0), 0));
  ASSERT_TRUE(robot.drive({0, 0.5}, 4));
  EXPECT_NEAR(robot.heading_rad(), 0.5 * (4 - 0.2), 0.01);
  EXPECT_NEAR(robot.x(), 1, 1e-9);
  EXPECT_NEAR(robot.y(), 2, 1e-9);
}

TEST(World, DrivesACircleOfTheRadiusItIsCommanded) {
  Driven robot(sim_test::plain(100), perfect_world());
  ASSERT_TRUE(robot.world.put_robot(pose(0, 0, 0), 0));
  // Both sides lag alike, so the path is the circle of radius 0.8 / 0.4 around (0, 2) throughout.
  for (int i = 0; i < 100; ++i) {
    robot.drive({0.8, 0.4}, 0.3);
    ASSERT_NEAR(std::hypot(robot.x(), robot.y() - 2), 2, 1e-6);
  }
}

TEST(World, ClampsToItsLimitsWithoutChangingTheCurve) {
  Driven robot(sim_test::plain(100), perfect_world());
  ASSERT_TRUE(robot.world.put_robot(pose(0, 0, 0), 0));
  robot.drive({4.0, 0.4}, 10);
  const double radius_m = 10;
  EXPECT_NEAR(std::hypot(robot.x(), robot.y() - radius_m), radius_m, 1e-6);
  EXPECT_LE(robot.world.driven_m(), 10.0);
  EXPECT_GT(robot.world.driven_m(), 9.0);
  Driven turner(sim_test::plain(100), perfect_world());
  ASSERT_TRUE(turner.world.put_robot(pose(0, 0, 0), 0));
  turner.drive({0, -9}, 2);
  EXPECT_NEAR(turner.heading_rad(), -kPi / 4 * (2 - 0.2), 0.01);
}

TEST(World, StopsHalfASecondAfterTheLastCommand) {
  Driven robot(sim_test::plain(100), perfect_world());
  ASSERT_TRUE(robot.world.put_robot(pose(0, 0, 0), 0));
  robot.drive({1, 0}, 5);
  const double before_m = robot.x();
  robot.world.advance(robot.now + 400ms - 100ms);
  EXPECT_NEAR(robot.x() - before_m, 0.3, 0.01);
  robot.world.advance(robot.now + 5s);
  EXPECT_FALSE(robot.world.moving());
  // The rest of the half second since the command, then the lag's way.
  EXPECT_NEAR(robot.x() - before_m, 0.4 + 0.2, 0.02);
}

TEST(World, RefusesTwistsThatAreNotNumbers) {
  Driven robot(sim_test::plain(100), perfect_world());
  EXPECT_EQ(robot.world.command({std::nan(""), 0}).error(), invalid_argument);
  EXPECT_EQ(robot.world.command({0, std::numeric_limits<double>::infinity()}).error(),
            invalid_argument);
}

TEST(World, DoesNotDependOnHowOftenItIsAdvanced) {
  const auto run = [](hal::Duration step) {
    const sim::Scene scene(sim_test::plain(100));
    sim::World world(scene, {});
    EXPECT_TRUE(world.put_robot(pose(0, 0, 0), 0));
    for (hal::Time t{}; t < hal::Time(60s); t += 400ms) {
      world.advance(t);
      EXPECT_TRUE(world.command({0.7, 0.1}));
      for (hal::Time u = t; u <= t + 400ms; u += step) world.advance(u);
    }
    world.advance(hal::Time(60s));
    return world.robot().pose;
  };
  const auto rare = run(400ms), often = run(7ms);
  EXPECT_EQ(rare.position_m, often.position_m);
  EXPECT_EQ(rare.heading_rad, often.heading_rad);
}

TEST(World, EncodersLoseNothingToTheirTicks) {
  auto config = perfect_world();
  config.encoder_tick_m = 0.007;  // Coarser than a report's travel at low speed.
  Driven robot(sim_test::plain(100), config);
  ASSERT_TRUE(robot.world.put_robot(pose(0, 0, 0), 0));
  double left_m = 0, right_m = 0;
  for (int i = 0; i < 1000; ++i) {
    robot.drive({0.03, 0.02}, 0.1);
    const auto travel = robot.world.take_travel();
    EXPECT_NEAR(std::remainder(travel.left_m, 0.007), 0, 1e-12);
    left_m += travel.left_m;
    right_m += travel.right_m;
  }
  EXPECT_NEAR((left_m + right_m) / 2, robot.world.driven_m(), 0.007);
  EXPECT_NEAR(std::remainder((right_m - left_m) / 0.6 - robot.heading_rad(), 2 * kPi), 0,
              2 * 0.007 / 0.6);
}

TEST(World, SlipMakesTheTravelErrorItClaims) {
  constexpr int kRuns = 300;
  constexpr double kWay_s = 101;
  sim::WorldConfig config;
  config.slip_sigma = 0.05;
  config.slip_length_m = 2;
  const sim::Scene scene(sim_test::plain(200));
  double left2_m2 = 0, right2_m2 = 0, product_m2 = 0, way_m = 0;
  for (int run = 0; run < kRuns; ++run) {
    config.seed = static_cast<std::uint64_t>(run) + 1;
    sim::World world(scene, config);
    ASSERT_TRUE(world.put_robot(pose(-50, 0, 0), 0));
    double truth_left_m = 0, truth_right_m = 0, heading_rad = 0, left_m = 0, right_m = 0;
    for (hal::Time t{}; t < hal::Time(hal::from_seconds(kWay_s)); t += 100ms) {
      ASSERT_TRUE(world.command({1, 0}));
      const double before_m = world.driven_m();
      world.advance(t);
      // What the sides really did, from the true motion.
      const double forward_m = world.driven_m() - before_m;
      const double turn_rad = std::remainder(world.robot().pose.heading_rad - heading_rad, 2 * kPi);
      heading_rad = world.robot().pose.heading_rad;
      truth_left_m += forward_m - turn_rad * config.track_m / 2;
      truth_right_m += forward_m + turn_rad * config.track_m / 2;
      const auto travel = world.take_travel();
      left_m += travel.left_m;
      right_m += travel.right_m;
    }
    const double left_error_m = truth_left_m - left_m, right_error_m = truth_right_m - right_m;
    left2_m2 += left_error_m * left_error_m / kRuns;
    right2_m2 += right_error_m * right_error_m / kRuns;
    product_m2 += left_error_m * right_error_m / kRuns;
    way_m += left_m / kRuns;
  }
  const double length_m = config.slip_length_m;
  const double variance_m2 = 2 * config.slip_sigma * config.slip_sigma * length_m *
                             (way_m - length_m * (1 - std::exp(-way_m / length_m)));
  const double tolerance = 5 * std::sqrt(2.0 / kRuns);
  EXPECT_NEAR(left2_m2 / variance_m2, 1, tolerance);
  EXPECT_NEAR(right2_m2 / variance_m2, 1, tolerance);
  EXPECT_NEAR(product_m2 / variance_m2, 0, tolerance) << "the sides slip independently";
}

TEST(World, GyroSaysTheTurnRatePlusItsBiasAndNoise) {
  sim::WorldConfig config = perfect_world();
  config.gyro_sigma_radps = 0.01;
  Driven robot(sim_test::plain(100), config);
  ASSERT_TRUE(robot.world.put_robot(pose(0, 0, 0), 0));
  robot.drive({0, 0.3}, 3);
  double sum = 0, squares = 0;
  constexpr int kSamples = 5000;
  for (int i = 0; i < kSamples; ++i) {
    robot.drive({0, 0.3}, 0.1);
    const double error = robot.world.sample_imu().yaw_rate_radps - 0.3;
    sum += error;
    squares += error * error;
  }
  EXPECT_NEAR(sum / kSamples, 0, 5 * 0.01 / std::sqrt(kSamples));
  EXPECT_NEAR(std::sqrt(squares / kSamples), 0.01, 5 * 0.01 / std::sqrt(2 * kSamples));
}

TEST(World, GyroBiasStaysWithinARunAndVariesOverSeedsAsClaimed) {
  const sim::Scene scene(sim_test::plain(10));
  double squares = 0;
  constexpr int kSeeds = 2000;
  for (int seed = 0; seed < kSeeds; ++seed) {
    sim::WorldConfig config = perfect_world();
    config.seed = static_cast<std::uint64_t>(seed);
    config.gyro_bias_sigma_radps = 0.002;
    sim::World world(scene, config);
    const double bias = world.sample_imu().yaw_rate_radps;
    world.advance(hal::Time(100s));
    EXPECT_EQ(world.sample_imu().yaw_rate_radps, bias);
    squares += bias * bias / kSeeds;
  }
  EXPECT_NEAR(std::sqrt(squares), 0.002, 5 * 0.002 / std::sqrt(2 * kSeeds));
}

TEST(World, GnssErrorIsAsLargeAsTheReceiverClaimsAndPartlyWanders) {
  sim::WorldConfig config = perfect_world();
  config.gnss_sigma_m = 0.03;
  Driven robot(sim_test::plain(100), config);
  ASSERT_TRUE(robot.world.put_robot(pose(3, 4, 0), 0));
  double square_m2 = 0, lagged_m2 = 0, before_m = 0;
  constexpr int kFixes = 200'000;
  for (int i = 0; i < kFixes; ++i) {
    robot.now += 1s;
    robot.world.advance(robot.now);
    const auto fix = robot.world.sample_gnss();
    EXPECT_EQ(fix.sigma_m, 0.03);
    EXPECT_EQ(fix.stamp, robot.now);
    const double error_m = fix.position_m.x() - 3;
    square_m2 += error_m * error_m / kFixes;
    lagged_m2 += error_m * before_m / kFixes;
    before_m = error_m;
  }
  EXPECT_NEAR(std::sqrt(square_m2), 0.03, 0.0015);
  EXPECT_NEAR(lagged_m2 / square_m2, 0.5 * std::exp(-1 / 60.0), 0.05);
}

TEST(World, NoSatelliteIsSeenWithinAnOutage) {
  sim::WorldConfig config = perfect_world();
  config.gnss_outages = {{{0, 0}, {10, 0}, {10, 4}, {4, 4}, {4, 10}, {0, 10}},
                         {{20, 0}, {30, 0}, {25, 5}}};
  Driven robot(sim_test::plain(100), config);
  const auto hidden_at = [&](double x_m, double y_m) {
    EXPECT_TRUE(robot.world.put_robot(pose(x_m, y_m, 0), 0));
    return robot.world.gnss_hidden();
  };
  EXPECT_TRUE(hidden_at(2, 8));
  EXPECT_TRUE(hidden_at(8, 2));
  EXPECT_FALSE(hidden_at(8, 8));  // In the notch.
  EXPECT_TRUE(hidden_at(25, 2));
  EXPECT_FALSE(hidden_at(15, 2));
  EXPECT_FALSE(hidden_at(-5, 2));
}

TEST(World, OneSensorsNoiseDoesNotChangeAnothers) {
  const sim::Scene scene(sim_test::plain(100));
  const auto run = [&](bool read_others) {
    sim::World world(scene, {});
    EXPECT_TRUE(world.put_robot(pose(0, 0, 0), 0));
    for (hal::Time t{}; t < hal::Time(20s); t += 200ms) {
      EXPECT_TRUE(world.command({0.5, 0.2}));
      world.advance(t);
      if (read_others) {
        world.sample_imu();
        world.take_travel();
      }
    }
    return std::pair(world.robot().pose.position_m, world.sample_gnss().position_m);
  };
  EXPECT_EQ(run(false), run(true));
}

sim::Mesh wall_at_x5() {
  sim::Mesh mesh = sim_test::plain(100);
  sim_test::add_box(mesh, {5, -20, 0}, {5.2, 20, 3});
  return mesh;
}

TEST(World, StopsAtAWallAndRefusesToPushOn) {
  Driven robot(wall_at_x5(), perfect_world());
  ASSERT_TRUE(robot.world.put_robot(pose(0, 0, 0), 0));
  EXPECT_EQ(robot.drive({1, 0}, 10).error(), io_error);
  EXPECT_NEAR(robot.x(), 4.5, 0.02);
  EXPECT_LE(robot.x(), 4.5);
  EXPECT_EQ(robot.world.collisions(), 1) << "pushing again is not another collision";
  EXPECT_FALSE(robot.world.moving());
}

TEST(World, BacksOffFromAWallAndHitsItAgain) {
  Driven robot(wall_at_x5(), perfect_world());
  ASSERT_TRUE(robot.world.put_robot(pose(0, 0, 0), 0));
  robot.drive({1, 0}, 10);
  EXPECT_TRUE(robot.drive({-0.5, 0}, 4));
  EXPECT_LT(robot.x(), 3);
  EXPECT_EQ(robot.drive({1, 0}, 10).error(), io_error);
  EXPECT_EQ(robot.world.collisions(), 2);
}

TEST(World, TurnsAwayFromAWallAndDrivesOn) {
  Driven robot(wall_at_x5(), perfect_world());
  ASSERT_TRUE(robot.world.put_robot(pose(0, 0, 0), 0));
  robot.drive({1, 0}, 10);
  EXPECT_TRUE(robot.drive({0, 0.7}, kPi / 0.7));
  EXPECT_GT(std::abs(robot.heading_rad()), 2);
  EXPECT_TRUE(robot.drive({1, 0}, 3));
  EXPECT_LT(robot.x(), 3);
  EXPECT_EQ(robot.world.collisions(), 1);
}

TEST(World, HitsWithItsSideNotOnlyItsFront) {
  Driven robot(wall_at_x5(), perfect_world());
  ASSERT_TRUE(robot.world.put_robot(pose(4.45, -10, 1.55), 0));  // Closes in by 2 cm a metre.
  EXPECT_EQ(robot.drive({1, 0}, 20).error(), io_error);
  EXPECT_LE(robot.x(), 4.5);
  EXPECT_LT(robot.y(), 0);
}

TEST(World, NoPoleIsTooThinToHit) {
  sim::Mesh mesh = sim_test::plain(100);
  mesh.W_vertices_m.insert(mesh.W_vertices_m.end(),
                           {{5, 0.37, 0.4}, {5, 0.371, 0.4}, {5, 0.37, 0.41}});
  const auto n = static_cast<std::uint32_t>(mesh.W_vertices_m.size());
  mesh.triangles.push_back({n - 3, n - 2, n - 1});
  Driven robot(mesh, perfect_world());
  ASSERT_TRUE(robot.world.put_robot(pose(0, 0, 0), 0));
  EXPECT_EQ(robot.drive({1, 0}, 10).error(), io_error);
  const double contact_m = 5 - std::sqrt(0.25 - 0.37 * 0.37);
  EXPECT_NEAR(robot.x(), contact_m, 0.02);
}

TEST(World, PassesBelowAnArchAndOverAKerb) {
  sim::Mesh mesh = sim_test::plain(100);
  sim_test::add_box(mesh, {5, -2, 1.6}, {6, 2, 4});
  sim_test::add_box(mesh, {9, -2, 0}, {12, 2, 0.1});
  Driven robot(mesh, perfect_world());
  ASSERT_TRUE(robot.world.put_robot(pose(0, 0, 0), 0));
  EXPECT_TRUE(robot.drive({1, 0}, 10.7));
  EXPECT_NEAR(robot.x(), 10.5, 0.1);
  EXPECT_NEAR(robot.world.robot().ground_z_m, 0.1, 1e-4) << "stands on the kerb";
  EXPECT_TRUE(robot.drive({1, 0}, 5));
  EXPECT_NEAR(robot.world.robot().ground_z_m, 0, 1e-4);
  EXPECT_EQ(robot.world.collisions(), 0);
}

TEST(World, StopsBeforeItFallsIntoAMoat) {
  sim::Mesh mesh;
  mesh.add_quad({-50, -50, 0}, {5, -50, 0}, {5, 50, 0}, {-50, 50, 0});
  mesh.add_quad({5, -50, 0}, {5, 50, 0}, {5, 50, -3}, {5, -50, -3});
  mesh.add_quad({5, -50, -3}, {50, -50, -3}, {50, 50, -3}, {5, 50, -3});
  Driven robot(mesh, perfect_world());
  ASSERT_TRUE(robot.world.put_robot(pose(0, 0, 0), 0));
  EXPECT_EQ(robot.drive({1, 0}, 10).error(), io_error);
  EXPECT_LE(robot.x(), 4.62);
  EXPECT_GE(robot.x(), 4.35);
}

TEST(World, ClimbsARampAndKeepsToItsGround) {
  sim::Mesh mesh = sim_test::plain(4);
  mesh.add_quad({4, -4, 0}, {24, -4, 3}, {24, 4, 3}, {4, 4, 0});
  Driven robot(mesh, perfect_world());
  ASSERT_TRUE(robot.world.put_robot(pose(0, 0, 0), 0));
  EXPECT_TRUE(robot.drive({1, 0}, 15));
  EXPECT_NEAR(robot.world.robot().ground_z_m, (robot.x() - 4) * 0.15, 0.02);
  EXPECT_GT(robot.x(), 14);
}

TEST(World, PutsTheRobotOnlyWhereItCanStand) {
  Driven robot(wall_at_x5(), perfect_world());
  EXPECT_TRUE(robot.world.put_robot(pose(4.4, 0, 0), 0.7));
  EXPECT_NEAR(robot.world.robot().ground_z_m, 0, 1e-4);
  EXPECT_EQ(robot.world.put_robot(pose(4.6, 0, 0), 0).error(), address_not_available);
  EXPECT_EQ(robot.world.put_robot(pose(0, 0, 0), 2).error(), address_not_available);
  EXPECT_EQ(robot.world.put_robot(pose(500, 0, 0), 0).error(), address_not_available);
  EXPECT_EQ(robot.x(), 4.4) << "a refusal changes nothing";
}

}  // namespace
