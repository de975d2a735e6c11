// What the gate knows of the mission around it: poses, disks, ranges, zones, the battery.
#include <cmath>
#include <map>

#include "mission/disk_watch.hpp"
#include "tests/mission/gated_rig.hpp"

namespace gate_test {
namespace {

struct GatedSurroundings : GatedBase {
  mission::Surroundings around;
  void drive_there() {
    drive_off();
    around.range_at = std::nullopt;
    gate->watch_surroundings([this] { return around; });
    wait(1s);
    ASSERT_GT(world.rolling().forward_mps, 0.39);
  }
};

TEST_F(GatedSurroundings, HoldWhileThePoseIsUncertainAndNoLonger) {
  drive_there();
  const hal::Time began = clock.now();
  around.pose_uncertain = true;
  wait(500ms);
  ASSERT_TRUE(zero_after(began));
  EXPECT_LE(*zero_after(began) - began, mission::kGatePeriod + kFrameTime);
  EXPECT_EQ(gate->mode(), Mode::holding);
  EXPECT_EQ(gate->held_by(), FaultCode::pose_uncertain);
  EXPECT_THAT(gate->why(), HasSubstr("F320-pose-uncertain"));
  EXPECT_THAT(told, Contains(HasSubstr("the robot holds: F320")));
  EXPECT_EQ(told_mission.back(), errc::operation_not_permitted);
  around.pose_uncertain = false;
  wait(1s);
  EXPECT_GT(world.rolling().forward_mps, 0.39) << "nobody has to release it";
}

TEST_F(GatedSurroundings, HoldForAFaultOfADeviceUntilItIsOver) {
  drive_there();
  around.hold_fault = FaultCode::drive_hot;
  wait(1s);
  EXPECT_NEAR(world.rolling().forward_mps, 0, 0.01);
  EXPECT_EQ(gate->held_by(), FaultCode::drive_hot);
  EXPECT_THAT(told, Contains(HasSubstr("the robot holds: F020-drive-hot")));
  around.hold_fault.reset();
  wait(1s);
  EXPECT_GT(world.rolling().forward_mps, 0.39);
}

// However the disk fails: the robot stands at once, says so, and goes on by itself.
TEST_F(GatedSurroundings, HoldWhileTheDiskFailsAndUntilAllOfItWorks) {
  using Part = mission::DiskWatch::Part;
  drive_there();
  mission::DiskWatch disk;
  gate->watch_surroundings([&] {
    mission::Surroundings is = around;
    is.hold_fault = disk.fault();
    return is;
  });
  const auto fails = [&](Part part, errc::errc_t why) {
    disk.failed(part, {"scans/0003.ply", "write", errc::make_error_code(why)}, clock.now());
  };
  wait(1s);
  ASSERT_GT(world.rolling().forward_mps, 0.39) << "a disk that is well holds nothing";
  const hal::Time began = clock.now();
  fails(Part::files, errc::no_space_on_device);
  wait(500ms);
  ASSERT_TRUE(zero_after(began));
  EXPECT_LE(*zero_after(began) - began, mission::kGatePeriod + kFrameTime);
  EXPECT_EQ(moving_after(*zero_after(began)), 0);
  EXPECT_EQ(gate->mode(), Mode::holding);
  EXPECT_EQ(gate->held_by(), FaultCode::disk_full);
  EXPECT_THAT(told, Contains(HasSubstr("the robot holds: F700-disk-full")));
  EXPECT_EQ(told_mission.back(), errc::operation_not_permitted);
  fails(Part::journal, errc::io_error);
  disk.works(Part::files);
  wait(500ms);
  EXPECT_EQ(gate->held_by(), FaultCode::disk_failed) << "the journal does not work yet";
  EXPECT_NEAR(world.rolling().forward_mps, 0, 0.01);
  disk.works(Part::journal);
  wait(1s);
  EXPECT_TRUE(gate->released());
  EXPECT_GT(world.rolling().forward_mps, 0.39) << "nobody has to release it";
}

TEST_F(GatedSurroundings, HoldForADiskOnlyWhereNothingStops) {
  drive_there();
  around.hold_fault = FaultCode::disk_full;
  wait(500ms);
  gate->ask_hold();
  around.hold_fault.reset();
  const hal::Time mended = clock.now();
  wait(1s);
  EXPECT_EQ(moving_after(mended), 0) << "a person's hold outlives it";
  EXPECT_FALSE(gate->released());
}

TEST_F(GatedSurroundings, HoldWhenTheRangeSourceIsSilentFor250ms) {
  drive_there();
  around.range_at = clock.now();
  const hal::Time last = clock.now();
  wait(245ms);
  EXPECT_GT(world.rolling().forward_mps, 0.39);
  wait(300ms);
  ASSERT_TRUE(zero_after(last));
  EXPECT_LE(*zero_after(last) - last, 250ms + mission::kGatePeriod + kFrameTime);
  EXPECT_EQ(gate->held_by(), FaultCode::range_stale);
  EXPECT_EQ(told_mission.back(), errc::resource_unavailable_try_again);
  around.range_at.reset();  // Not at work any more.
  wait(1s);
  EXPECT_GT(world.rolling().forward_mps, 0.39);
}

TEST_F(GatedSurroundings, LimitTheSpeedOfMissionsAndStopThemWhereNobodyKnowsIt) {
  drive_there();
  around.zone_speed_max_mps = 0.15;
  wait(1s);
  EXPECT_NEAR(world.rolling().forward_mps, 0.15, 0.01);
  around.zone_speed_max_mps = std::numeric_limits<double>::quiet_NaN();
  wait(1s);
  EXPECT_NEAR(world.rolling().forward_mps, 0, 0.01);
  EXPECT_THAT(gate->why(), HasSubstr("drive it back by hand"));
  for (std::uint32_t key = 1; key <= 10; ++key) {
    gate->hear({.sequence = key, .dead_man = true, .twist = {-0.2, 0}});
    wait(50ms);
  }
  EXPECT_LT(world.rolling().forward_mps, -0.05) << "a person sees where they drive";
}

TEST_F(GatedSurroundings, SendItHomeOnTheBatterysReserve) {
  drive_there();
  around.battery_reserve = true;
  wait(100ms);
  EXPECT_EQ(gate->mode(), Mode::returning);
  EXPECT_GT(world.rolling().forward_mps, 0.39);
}

}  // namespace
}  // namespace gate_test
