// Whole missions whose devices fail on the way: they go on when the device comes back, and end by
// themselves, with the reason, when it does not.
#include <gmock/gmock.h>

#include "tests/mission/mission_site.hpp"

namespace {

using namespace std::chrono_literals;
using testing::AllOf;
using testing::HasSubstr;

// Something that is wrong with a unit from a time on, for a while.
struct BrokenDevice {
  const char* name;
  const char* role;
  const char* fault;  // "" : the e-stop of the base; "cut": the bus.
  hal::Duration from, during;
  bool completes;
  const char* says;      // In the reason for the end; "" where it completes.
  const char* and_says;  // Besides.
  bool released = true;  // A person releases the robot, 5 s after the trouble is over.
};

constexpr hal::Duration kEver = 24h;

void breaks(mission::SimBackend& backend, const BrokenDevice& broken, bool on) {
  const std::string fault = broken.fault;
  if (fault.empty()) {
    backend.units().agilex()->press_estop(on);
  } else if (fault == "cut") {
    on ? backend.robot().can().cut() : backend.robot().can().mend();
  } else if (on) {
    backend.units().faults(broken.role)->set(sim::parse_unit_fault(fault).setting);
  } else {
    backend.units().faults(broken.role)->clear();
  }
}

void PrintTo(const BrokenDevice& broken, std::ostream* to) {
  *to << broken.name;
}

class BrokenMission : public testing::TestWithParam<BrokenDevice> {};

TEST_P(BrokenMission, GoesOnOrEndsWithItsReason) {
  const BrokenDevice& broken = GetParam();
  const mission_test::SmallSite site;
  int phase = 0;
  const auto outcome = site.run([&](mission::SimBackend& backend) {
    const hal::Duration now = backend.clock().now().time_since_epoch();
    if (phase == 0 && now >= broken.from) breaks(backend, broken, true), ++phase;
    if (phase == 1 && now - broken.from >= broken.during) breaks(backend, broken, false), ++phase;
    if (phase == 2 && broken.released && now - broken.from >= broken.during + 5s)
      backend.gate().ask_release(), ++phase;
    ASSERT_LT(now, 3h) << "it hangs";
  });
  EXPECT_GE(phase, 1) << "over before anything broke, at " << outcome.record.mission_s << " s";
  EXPECT_EQ(outcome.record.completed, broken.completes) << outcome.record.end;
  if (broken.completes) {
    EXPECT_GE(outcome.record.scans.size(), 3U);
    EXPECT_TRUE(outcome.record.dropped.empty()) << outcome.record.dropped[0].reason;
    return;
  }
  EXPECT_EQ(outcome.failure, outcome.record.end);
  EXPECT_THAT(outcome.record.end, AllOf(HasSubstr(broken.says), HasSubstr(broken.and_says)));
  EXPECT_THAT(site.summary(), HasSubstr(broken.says)) << "the operator must find it there";
}

// The drive's faults begin on the way to the second station, the others' before the first scan.
INSTANTIATE_TEST_SUITE_P(
    Devices, BrokenMission,
    testing::Values(BrokenDevice{"PanOffForGood", "pan", "off", 5s, kEver, false,
                                 "no scan, tried 3 times", "pan ("},
                    BrokenDevice{"PanStuckForGood", "pan", "stuck", 5s, kEver, false,
                                 "no scan, tried 3 times", "pan ("},
                    BrokenDevice{"ScannerOffForGood", "scanner", "off", 5s, kEver, false,
                                 "no scan, tried 3 times", "scanner ("},
                    BrokenDevice{"ScannerGarbageForGood", "scanner", "garbage", 5s, kEver, false,
                                 "no scan, tried 3 times", "scanner ("},
                    BrokenDevice{"PanOffForAWhile", "pan", "off", 5s, 20s, true, "", ""},
                    BrokenDevice{"ScannerOffForAWhile", "scanner", "off", 5s, 10s, true, "", ""},
                    BrokenDevice{"DriveOffForGood", "drive", "off", 50s, kEver, false,
                                 "on the way to", "no reports from the base"},
                    BrokenDevice{"DriveOffForAWhile", "drive", "off", 50s, 30s, true, "", ""},
                    BrokenDevice{"BusCutForGood", "drive", "cut", 50s, kEver, false,
                                 "on the way to", "CAN bus down"},
                    BrokenDevice{"BusCutForAWhile", "drive", "cut", 50s, 20s, true, "", ""},
                    BrokenDevice{"EstopForGood", "drive", "", 50s, kEver, false,
                                 "held by its e-stop", "e-stop pressed"},
                    BrokenDevice{"EstopForAWhile", "drive", "", 50s, 300s, true, "", ""},
                    BrokenDevice{"DriveOffForAWhileAndNobodyReleases", "drive", "off", 50s, 30s,
                                 false, "on the way to", "to release it, press the reset button",
                                 false},
                    BrokenDevice{"EstopForAWhileAndNobodyReleases", "drive", "", 50s, 30s, false,
                                 "on the way to", "F001-estop-pressed", false},
                    BrokenDevice{"ImuOffForGood", "imu", "off", 50s, kEver, true, "", ""},
                    BrokenDevice{"GnssOffForGood", "gnss", "off", 50s, kEver, true, "", ""}),
    [](const auto& param) { return std::string(param.param.name); });

// 75 deg/s: within the angles of the robot file, and more than the unit's 60.
TEST(Missions, EndAtOnceWhenThePanUnitIsNotFastEnough) {
  const mission_test::SmallSite site(
      "[scanner]\nazimuth_step_deg = 1.5\nelevation_step_deg = 0.5\n[pan]\nangle_max_deg = 360\n");
  const auto outcome = site.run();
  EXPECT_FALSE(outcome.record.completed);
  EXPECT_THAT(outcome.failure, AllOf(HasSubstr("tried 1 times"), HasSubstr("at 75.0 deg/s"),
                                     HasSubstr("smaller azimuth step")));
  EXPECT_EQ(outcome.record.dropped.size(), 1U);
}

TEST(Missions, DoNotBeginWhenTheDriveWouldNotStopByItself) {
  const mission_test::SmallSite site;
  const auto outcome = site.run(
      [](mission::SimBackend& backend) { backend.units().agilex()->set_stops_by_itself(false); });
  EXPECT_FALSE(outcome.record.completed);
  EXPECT_THAT(outcome.failure, HasSubstr("not armed: F010-drive-no-timeout: it went on"));
  EXPECT_TRUE(outcome.record.scans.empty());
}

// The e-stop of two CiA 402 drives takes the torque from both.
class OpenSto : public testing::TestWithParam<hal::Duration> {};

TEST_P(OpenSto, HoldsTheRobotUntilItIsClosed) {
  const hal::Duration during = GetParam();
  const mission_test::SmallSite site(mission_test::kQuickRobot + "[drive]\ndevice = 'cia402'\n");
  bool released = false;
  const auto outcome = site.run([&](mission::SimBackend& backend) {
    const hal::Duration now = backend.clock().now().time_since_epoch();
    const bool open = now >= 50s && now < 50s + during;
    backend.units().cia402()->left().open_sto(open);
    backend.units().cia402()->right().open_sto(open);
    if (!released && now >= 50s + during + 5s) backend.gate().ask_release(), released = true;
    ASSERT_LT(now, 3h) << "it hangs";
  });
  EXPECT_EQ(outcome.record.completed, during < kEver) << outcome.record.end;
  if (during == kEver) {
    EXPECT_THAT(outcome.failure, AllOf(HasSubstr("held by its e-stop"),
                                       HasSubstr("check motor supply and STO wiring")));
  }
}

INSTANTIATE_TEST_SUITE_P(Missions, OpenSto, testing::Values(60s, kEver), [](const auto& param) {
  return param.param < kEver ? "ForAWhile" : "ForGood";
});

}  // namespace
