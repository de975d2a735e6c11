// A robot with a scanner that looks for obstacles: the gate heeds whether it speaks.
#include <gmock/gmock.h>

#include "tests/mission/mission_site.hpp"

namespace {

using namespace std::chrono_literals;
using mission::FaultCode;
using testing::HasSubstr;

const std::string kLookingRobot = mission_test::kQuickRobot + "[obstacles]\ndevice = 'hokuyo'\n";

double speed_mps(mission::SimBackend& backend) {
  return std::abs(backend.world().rolling().forward_mps);
}

TEST(RangeSource, StopsTheRobotWhileItIsSilentAndNoLonger) {
  const mission_test::SmallSite site(kLookingRobot);
  hal::Time off_at{};
  bool stood = false, held = false;
  const auto outcome = site.run([&](mission::SimBackend& backend) {
    const hal::Time now = backend.clock().now();
    ASSERT_LT(now, hal::Time(3h)) << "it hangs";
    sim::UnitFaults& scanner = *backend.units().faults("obstacles");
    if (off_at == hal::Time{} && speed_mps(backend) > 0.5) {
      scanner.set(sim::parse_unit_fault("off").setting);
      off_at = now;
    }
    if (off_at == hal::Time{} || now > off_at + 5s) return;
    held = held || backend.gate().held_by() == FaultCode::range_stale;
    // 250 ms from its last profile, and how long the base brakes.
    if (now > off_at + 1500ms) stood = stood || speed_mps(backend) < 0.01;
    if (stood && now > off_at + 3s) scanner.clear();
  });
  EXPECT_NE(off_at, hal::Time{});
  EXPECT_TRUE(held);
  EXPECT_TRUE(stood);
  EXPECT_TRUE(outcome.record.completed) << outcome.record.end;
  EXPECT_TRUE(outcome.record.dropped.empty()) << outcome.record.dropped[0].reason;
}

TEST(RangeSource, ThatNeverSpeaksEndsTheWayWithItsReason) {
  const mission_test::SmallSite site(kLookingRobot);
  const auto outcome = site.run([&](mission::SimBackend& backend) {
    ASSERT_LT(backend.clock().now(), hal::Time(3h)) << "it hangs";
    if (backend.clock().now() > hal::Time(20s))
      backend.units().faults("obstacles")->set(sim::parse_unit_fault("off").setting);
  });
  ASSERT_FALSE(outcome.record.dropped.empty());
  EXPECT_THAT(outcome.record.dropped.back().reason,
              HasSubstr("the scanner that looks for obstacles says nothing"));
}

}  // namespace
