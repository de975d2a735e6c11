#include "sim/devices.hpp"

#include <gtest/gtest.h>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <cmath>
#include <optional>

#include "sim/sim_clock.hpp"
#include "tests/sim/room.hpp"

namespace {

using namespace std::chrono_literals;
namespace asio = boost::asio;
namespace errc = boost::system::errc;

sim::WorldConfig coarse() {
  sim::WorldConfig config;
  config.scanner.azimuth_step_rad = 0.1;
  config.scanner.elevation_step_rad = 0.1;
  config.region_ground_z_m = {{"yard", 0.0}, {"attic", 30.0}};
  return config;
}

struct DevicesTest : testing::Test {
  sim::Scene scene{[] {
    sim::Mesh mesh = sim_test::plain(100);
    sim_test::add_box(mesh, {5, -20, 0}, {5.4, 20, 3});
    return mesh;
  }()};
  asio::io_context io;
  sim::SimClock clock{io};
  sim::World world{scene, coarse()};
  sim::Robot robot{world, clock};

  void SetUp() override { ASSERT_TRUE(world.put_robot({{0, 0}, 0}, 0)); }

  // The task's result, and the time that it took.
  template <class T>
  T run(hal::Task<T> task) {
    std::optional<T> result;
    asio::co_spawn(io, std::move(task), [&](std::exception_ptr error, T value) {
      if (error) std::rethrow_exception(error);
      result = std::move(value);
    });
    EXPECT_TRUE(clock.run([&] { return result.has_value(); }));
    return std::move(*result);
  }
};

TEST_F(DevicesTest, TravelAndYawRateComeFiftyTimesASecond) {
  for (int i = 1; i <= 5; ++i) {
    EXPECT_EQ(run(robot.drive.next_travel())->stamp, hal::Time(i * 20ms));
  }
  clock.run_until(hal::Time(1010ms));
  EXPECT_EQ(run(robot.imu.next_sample())->stamp, hal::Time(1020ms));
  EXPECT_EQ(run(robot.imu.next_sample())->stamp, hal::Time(1040ms));
}

TEST_F(DevicesTest, FixesComeFiveTimesASecond) {
  EXPECT_EQ(run(robot.gnss.next_fix())->stamp, hal::Time(200ms));
  EXPECT_EQ(run(robot.gnss.next_fix())->stamp, hal::Time(400ms));
}

TEST_F(DevicesTest, TravelAddsUpWhenNobodyListens) {
  double heard_m = 0;
  for (int i = 0; i < 10; ++i) {
    ASSERT_TRUE(run(robot.drive.command({0.4, 0})));
    clock.run_until(clock.now() + 450ms);
    heard_m += run(robot.drive.next_travel())->left_m;
  }
  EXPECT_NEAR(heard_m, 0.4 * hal::seconds(clock.now()) - 0.4 * 0.2, 0.02);
}

TEST_F(DevicesTest, AScanTakesItsTimeAndTellsTheTruthWhereItWas) {
  const auto cloud = run(robot.scanner.scan());
  ASSERT_TRUE(cloud);
  EXPECT_EQ(clock.now(), hal::Time(300s));
  EXPECT_EQ(cloud->stamp, hal::Time(300s));
  EXPECT_EQ(cloud->ranges_m.size(), cloud->pattern.beams());
  ASSERT_EQ(world.scans().size(), 1u);
  EXPECT_EQ(world.scans()[0].at.pose.position_m, Eigen::Vector2d(0, 0));
  EXPECT_EQ(world.scans()[0].stamp, cloud->stamp);
  EXPECT_FALSE(world.scans()[0].by_hand);
}

TEST_F(DevicesTest, AScanIsTheRayCastFromTheTruePose) {
  const auto cloud = run(robot.scanner.scan());
  ASSERT_TRUE(cloud);
  const auto& config = world.config();
  const auto again = sim::cast_scan(scene, world.scans()[0].at.T_W_S(1.8), cloud->pattern,
                                    config.scanner, config.seed, 1, 1);
  EXPECT_EQ(cloud->ranges_m, again);
  EXPECT_NE(run(robot.scanner.scan())->ranges_m, again) << "the next scan has its own noise";
}

TEST_F(DevicesTest, RefusesToScanWhileTheRobotMoves) {
  ASSERT_TRUE(run(robot.drive.command({1, 0})));
  clock.run_until(clock.now() + 200ms);
  EXPECT_EQ(run(robot.scanner.scan()).error(), errc::device_or_resource_busy);
  EXPECT_EQ(clock.now(), hal::Time(200ms)) << "at once";
}

TEST_F(DevicesTest, SpoilsAScanThatTheRobotMovesIn) {
  asio::co_spawn(
      io,
      [this]() -> hal::Task<void> {
        co_await clock.sleep_for(10s);
        EXPECT_TRUE(co_await robot.drive.command({0.5, 0}));
      },
      [](std::exception_ptr error) {
        if (error) std::rethrow_exception(error);
      });
  EXPECT_EQ(run(robot.scanner.scan()).error(), errc::device_or_resource_busy);
  EXPECT_TRUE(world.scans().empty());
}

TEST_F(DevicesTest, DriveReportsTheWall) {
  errc::errc_t seen{};
  for (int i = 0; i < 100 && seen == errc::success; ++i) {
    const auto sent = run(robot.drive.command({1, 0}));
    if (!sent) seen = static_cast<errc::errc_t>(sent.error().value());
    clock.run_until(clock.now() + 100ms);
  }
  EXPECT_EQ(seen, errc::io_error);
  EXPECT_EQ(world.collisions(), 1);
}

TEST_F(DevicesTest, PlacesTheScannerNearTheWantedPoseAndSurveysIt) {
  const hal::Pose2 wanted{{20, 10}, 1.0};
  double position2 = 0, heading2 = 0, offset2_m2 = 0;
  constexpr int kTimes = 400;
  for (int i = 0; i < kTimes; ++i) {
    const auto placed = run(robot.placement.place("yard", wanted));
    ASSERT_TRUE(placed);
    const hal::Pose2& truth = world.placed_scanner()->pose;
    position2 += (placed->pose.position_m - truth.position_m).squaredNorm() /
                 (placed->position_sigma_m * placed->position_sigma_m) / kTimes;
    const double turn_rad = placed->pose.heading_rad - truth.heading_rad;
    heading2 +=
        turn_rad * turn_rad / (placed->heading_sigma_rad * placed->heading_sigma_rad) / kTimes;
    offset2_m2 += (truth.position_m - wanted.position_m).squaredNorm() / kTimes;
  }
  EXPECT_EQ(clock.now(), hal::Time(kTimes * 900s));
  EXPECT_NEAR(position2, 2, 5 * std::sqrt(4.0 / kTimes)) << "two axes, one sigma each";
  EXPECT_NEAR(heading2, 1, 5 * std::sqrt(2.0 / kTimes));
  EXPECT_NEAR(std::sqrt(offset2_m2 / 2), 0.05, 0.01);
}

TEST_F(DevicesTest, NobodyCanPlaceAScannerInAWallOrWithoutGround) {
  EXPECT_EQ(run(robot.placement.place("yard", {{5.2, 0}, 0})).error(), errc::address_not_available);
  EXPECT_EQ(run(robot.placement.place("yard", {{4.8, 0}, 0})).error(), errc::address_not_available);
  EXPECT_EQ(run(robot.placement.place("attic", {{0, 0}, 0})).error(), errc::address_not_available);
  EXPECT_EQ(run(robot.placement.place("cellar", {{0, 0}, 0})).error(), errc::invalid_argument);
  EXPECT_FALSE(world.placed_scanner());
}

TEST_F(DevicesTest, ScansFromWhereItWasPlacedUntilTheRobotDrives) {
  ASSERT_TRUE(run(robot.placement.place("yard", {{20, 10}, 1.0})));
  ASSERT_TRUE(run(robot.scanner.scan()));
  EXPECT_TRUE(world.scans()[0].by_hand);
  EXPECT_NEAR(world.scans()[0].at.pose.position_m.x(), 20, 0.4);
  ASSERT_TRUE(run(robot.drive.command({0, 0})));
  EXPECT_TRUE(world.placed_scanner()) << "a stop is not a drive";
  ASSERT_TRUE(run(robot.drive.command({0, 0.1})));
  clock.run_until(clock.now() + 5s);
  ASSERT_TRUE(run(robot.scanner.scan()));
  EXPECT_FALSE(world.scans()[1].by_hand);
}

}  // namespace
