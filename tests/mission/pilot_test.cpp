// The pilot in a simulated yard, with devices that misbehave.
#include "mission/pilot.hpp"

#include <gtest/gtest.h>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/io_context.hpp>

#include "sim/sim_clock.hpp"
#include "tests/sim/room.hpp"
#include "tests/support/direct_devices.hpp"

namespace {

// Every tenth fix lies 40 m off, as beside a tall wall, and claims to be as good as the others.
class MultipathGnss final : public hal::Gnss {
 public:
  explicit MultipathGnss(hal::Gnss& gnss) : gnss_(gnss) {}
  hal::Task<hal::Result<hal::GnssFix>> next_fix() override {
    auto fix = co_await gnss_.next_fix();
    if (fix && ++fixes_ % 10 == 0) fix->position_m.x() += 40, ++jumps;
    co_return fix;
  }
  std::uint64_t jumps{};

 private:
  hal::Gnss& gnss_;
  std::uint64_t fixes_{};
};

TEST(Pilot, CountsTheFixesItRefusesAndDoesNotFollowThem) {
  const sim::Mesh mesh = sim_test::plain(100);
  const sim::Scene scene(mesh);
  boost::asio::io_context io;
  sim::SimClock clock(io);
  sim::World world(scene, {});
  ASSERT_TRUE(world.put_robot({{3, 4}, 0.5}, 0));
  direct::Robot robot(world, clock);
  MultipathGnss gnss(robot.gnss);
  hal::Devices real = robot.devices();
  hal::Devices devices{real.drive, real.imu, gnss, real.scanner, real.placement};
  mission::Pilot pilot({}, clock, devices, {{3, 4}, 0.5});
  boost::asio::co_spawn(io, pilot.track(), boost::asio::detached);
  clock.run_until(hal::Time(std::chrono::seconds(60)));

  EXPECT_EQ(pilot.gnss().fixes, 300U);
  EXPECT_EQ(gnss.jumps, 30U);
  // One honest fix in a thousand lies outside the gate too.
  EXPECT_GE(pilot.gnss().refused, gnss.jumps);
  EXPECT_LE(pilot.gnss().refused, gnss.jumps + 3);
  EXPECT_EQ(pilot.gnss().resets, 0U);
  EXPECT_LT((pilot.pose().position_m - Eigen::Vector2d(3, 4)).norm(), 0.1);
}

}  // namespace
