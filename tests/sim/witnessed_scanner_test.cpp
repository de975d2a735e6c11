#include "sim/witnessed_scanner.hpp"

#include <gtest/gtest.h>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>

#include "sim/sim_clock.hpp"
#include "tests/sim/room.hpp"

namespace {

using namespace std::chrono_literals;

struct SlowScanner final : hal::Scanner {
  explicit SlowScanner(hal::Clock& its_clock) : clock(its_clock) {}
  hal::Task<hal::Result<hal::ScanCloud>> scan() override {
    co_await clock.sleep_for(10s);
    if (fails) co_return make_error_code(boost::system::errc::io_error);
    hal::ScanCloud cloud;
    cloud.stamp = clock.now();
    co_return cloud;
  }
  hal::Clock& clock;
  bool fails = false;
};

struct WitnessedScannerTest : testing::Test {
  WitnessedScannerTest() { EXPECT_TRUE(world.put_robot({{1, 0.5}, 0.3}, 0)); }
  hal::Result<hal::ScanCloud> scan() {
    std::optional<hal::Result<hal::ScanCloud>> result;
    boost::asio::co_spawn(io, scanner.scan(), [&](std::exception_ptr, auto got) { result = got; });
    clock.run([&] { return result.has_value(); });
    return *result;
  }

  boost::asio::io_context io;
  sim::SimClock clock{io};
  sim::Scene scene{sim_test::room(8, 8, 3)};
  sim::World world{scene, {}};
  SlowScanner inner{clock};
  sim::WitnessedScanner scanner{inner, world, clock};
};

TEST_F(WitnessedScannerTest, RemembersWhereAScanWasTaken) {
  ASSERT_TRUE(scan());
  ASSERT_EQ(world.scans().size(), 1U);
  EXPECT_EQ(world.scans()[0].at.pose.position_m, Eigen::Vector2d(1, 0.5));
  EXPECT_EQ(world.scans()[0].stamp, hal::Time(10s));
  EXPECT_FALSE(world.scans()[0].by_hand);
  world.place_scanner({{{2, 2}, 0}, 0});
  ASSERT_TRUE(scan());
  EXPECT_TRUE(world.scans()[1].by_hand);
}

TEST_F(WitnessedScannerTest, RemembersNoScanThatFailed) {
  inner.fails = true;
  EXPECT_EQ(scan().error(), std::errc::io_error);
  EXPECT_TRUE(world.scans().empty());
}

TEST_F(WitnessedScannerTest, RefusesAScanOfARobotThatMoved) {
  boost::asio::co_spawn(
      io,
      [&]() -> hal::Task<void> {
        co_await clock.sleep_for(3s);
        world.advance(clock.now());
        (void)world.command({0.5, 0});
      },
      [](std::exception_ptr) {});
  EXPECT_EQ(scan().error(), std::errc::device_or_resource_busy);
  EXPECT_TRUE(world.scans().empty());
}

}  // namespace
