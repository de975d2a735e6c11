#include "sim/placement.hpp"

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

struct PlacementTest : testing::Test {
  sim::Scene scene{[] {
    sim::Mesh mesh = sim_test::plain(100);
    sim_test::add_box(mesh, {5, -20, 0}, {5.4, 20, 3});
    return mesh;
  }()};
  asio::io_context io;
  sim::SimClock clock{io};
  sim::World world{scene, coarse()};
  sim::SimPlacement placement{world, clock};

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

TEST_F(PlacementTest, PlacesTheScannerNearTheWantedPoseAndSurveysIt) {
  const hal::Pose2 wanted{{20, 10}, 1.0};
  double position2 = 0, heading2 = 0, offset2_m2 = 0;
  constexpr int kTimes = 400;
  for (int i = 0; i < kTimes; ++i) {
    const auto placed = run(placement.place("yard", wanted));
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

TEST_F(PlacementTest, NobodyCanPlaceAScannerInAWallOrWithoutGround) {
  EXPECT_EQ(run(placement.place("yard", {{5.2, 0}, 0})).error(), errc::address_not_available);
  EXPECT_EQ(run(placement.place("yard", {{4.8, 0}, 0})).error(), errc::address_not_available);
  EXPECT_EQ(run(placement.place("attic", {{0, 0}, 0})).error(), errc::address_not_available);
  EXPECT_EQ(run(placement.place("cellar", {{0, 0}, 0})).error(), errc::invalid_argument);
  EXPECT_FALSE(world.placed_scanner());
}

TEST_F(PlacementTest, StandsWhereItWasPlacedUntilTheRobotDrives) {
  ASSERT_TRUE(run(placement.place("yard", {{20, 10}, 1.0})));
  ASSERT_TRUE(world.placed_scanner());
  EXPECT_NEAR(world.placed_scanner()->pose.position_m.x(), 20, 0.4);
  ASSERT_TRUE(world.command({0, 0}));
  EXPECT_TRUE(world.placed_scanner()) << "a stop is not a drive";
  ASSERT_TRUE(world.command({0, 0.1}));
  EXPECT_FALSE(world.placed_scanner());
}

}  // namespace
