#include <chrono>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "drivers/flir_ptu.hpp"
#include "drivers/sick_lms.hpp"
#include "drivers/sweep_scanner.hpp"
#include "sim/flir_ptu_unit.hpp"
#include "sim/sick_lms_unit.hpp"
#include "tests/drivers/loop_rig.hpp"

namespace drivers {
namespace {

using namespace std::chrono_literals;
using Eigen::Vector3d;
using sim::UnitFault;
constexpr double kRadPerDeg = std::numbers::pi / 180;

// An LMS111 that looks up, on an E46-70: half a circle at 25 deg/s shows all.
struct Setting {
  SickLmsConfig lms;
  FlirPtuConfig ptu;
  SweepScannerConfig sweep;
  sim::SickLmsUnitConfig lms_unit;
  sim::FlirPtuUnitConfig ptu_unit;

  Setting() {
    ptu.acceleration_radps2 = 60 * kRadPerDeg;
    sweep.acceleration_radps2 = ptu.acceleration_radps2;
    sweep.mount.P_offset_m = {0.08, 0.01, 0.12};
    sweep.mount.tilt_rad = 90 * kRadPerDeg;
    sweep.mount.roll_rad = 1 * kRadPerDeg;
    sweep.mount.yaw_rad = -0.5 * kRadPerDeg;
    sweep.field.elevation_min_rad = -44 * kRadPerDeg;
    sweep.field.azimuth_step_rad = 0.5 * kRadPerDeg;
    lms_unit.T_P_L = sweep.mount.T_P_L();
    lms_unit.ranges.range_min_m = 0.1;
    lms_unit.ranges.range_max_m = 20;
    lms_unit.ranges.range_sigma_m = 0;
    lms_unit.ranges.lost_share_max = 0;
  }
};

class SweepLoop : public drivers_test::LoopRig {
 protected:
  void build(const Setting& setting) {
    lms_wire.emplace(clock);
    ptu_wire.emplace(clock);
    lms_faults.emplace(clock, 5);
    ptu_faults.emplace(clock, 6);
    ptu_unit.emplace(setting.ptu_unit, clock, ptu_wire->b(), *ptu_faults);
    lms_unit.emplace(setting.lms_unit, world, clock, lms_wire->b(), *lms_faults, *ptu_unit);
    lms.emplace(setting.lms, clock, lms_wire->a());
    ptu.emplace(setting.ptu, clock, ptu_wire->a());
    SweepScannerConfig config = setting.sweep;
    config.clock_jitter_s = [this] { return lms->clock_jitter_s(); };
    config.progress = [this](double share) {
      progress.push_back(share);
      if (on_progress) on_progress(share);
    };
    scanner.emplace(config, clock, *lms, *ptu);
    spawn(lms_unit->run());
    spawn(ptu_unit->run());
    spawn(lms->run());
    spawn(ptu->run());
  }
  ~SweepLoop() override { halt_all(); }

  hal::Result<hal::ScanCloud> scan() { return result_of(scanner->scan()); }
  std::string told_all() const { return scanner->problem() + '\n' + told(*lms) + told(*ptu); }

  // How far the worst point of a scan lies off the room's walls (12 x 10 x 4 m).
  double worst_off_the_walls(const hal::ScanCloud& cloud) const {
    const auto T_W_S = world.robot().T_W_S(world.config().scanner.height_m);
    double worst_m = 0;
    for (std::size_t i = 0; i < cloud.ranges_m.size(); ++i) {
      if (!(cloud.ranges_m[i] > 0)) continue;
      const Vector3d p = T_W_S * (cloud.beams[i].S_origin_m.cast<double>() +
                                  cloud.ranges_m[i] * cloud.beams[i].S_direction.cast<double>());
      const double off_m = std::min({std::abs(std::abs(p.x()) - 6), std::abs(std::abs(p.y()) - 5),
                                     std::abs(p.z()), std::abs(p.z() - 4)});
      worst_m = std::max(worst_m, off_m);
    }
    return worst_m;
  }

  std::optional<sim::StreamWire> lms_wire, ptu_wire;
  std::optional<sim::UnitFaults> lms_faults, ptu_faults;
  std::optional<sim::FlirPtuUnit> ptu_unit;
  std::optional<sim::SickLmsUnit> lms_unit;
  std::optional<SickLms> lms;
  std::optional<FlirPtu> ptu;
  std::optional<SweepScanner> scanner;
  // While a scan is under way: before and after it the scanner is well.
  void lose_profiles_on_the_way() {
    on_progress = [this](double share) {
      const bool on_the_way = share > 0.2 && share < 0.8;
      if (on_the_way && !lms_faults->is(UnitFault::intermittent))
        lms_faults->set({UnitFault::intermittent, 0.3});
      if (!on_the_way) lms_faults->clear();
    };
  }

  std::vector<double> progress;
  std::function<void(double)> on_progress;
};

TEST_F(SweepLoop, ScansTheWholeRoomInHalfATurn) {
  build({});
  const auto cloud = scan();
  ASSERT_TRUE(cloud) << told_all();
  EXPECT_NEAR(cloud->pattern.columns, 360, 1);
  EXPECT_EQ(cloud->pattern.rows, 537U);
  EXPECT_EQ(scanner->quality().columns_lost, 0U);
  EXPECT_LT(scanner->quality().pan_residual_rms_rad, ptu->step_rad());
  EXPECT_LT(worst_off_the_walls(*cloud), 0.004) << "a millimetre of the ranges, and the clocks";
  std::size_t measured = 0;
  for (const float range_m : cloud->ranges_m) measured += range_m > 0;
  EXPECT_EQ(measured, cloud->pattern.beams());  // A closed room.
  EXPECT_FALSE(lms_unit->streaming());
  EXPECT_EQ(progress.front(), 0);
  EXPECT_EQ(progress.back(), 1);
  EXPECT_TRUE(std::is_sorted(progress.begin(), progress.end()));
}

TEST_F(SweepLoop, ScansAgainAndAgain) {
  build({});
  for (int i = 0; i < 3; ++i) {
    const auto cloud = scan();
    ASSERT_TRUE(cloud) << told_all();
    EXPECT_LT(worst_off_the_walls(*cloud), 0.004);
    run_for(100s);
  }
}

// A head whose positions are 20 ms old when it tells them: half a degree at 25 deg/s.
TEST_F(SweepLoop, ScansStraightWithOldPositionsWhenItKnowsHowOld) {
  Setting setting;
  setting.ptu_unit.position_age = 20ms;
  setting.sweep.pan_late_s = 0.02;
  build(setting);
  const auto cloud = scan();
  ASSERT_TRUE(cloud) << told_all();
  EXPECT_LT(worst_off_the_walls(*cloud), 0.004);
}

TEST_F(SweepLoop, ScansCrookedlyWithOldPositionsThatItTakesForNew) {
  Setting setting;
  setting.ptu_unit.position_age = 20ms;
  build(setting);
  const auto cloud = scan();
  ASSERT_TRUE(cloud) << told_all();
  EXPECT_GT(worst_off_the_walls(*cloud), 0.02);
}

TEST_F(SweepLoop, ScansAsAnLms511WhoseTelegramsComeATurnLate) {
  Setting setting;
  setting.lms.settings.lms5xx = setting.lms_unit.lms5xx = true;
  setting.lms.settings.frequency_centihz = 2500;
  setting.lms.settings.resolution_1e4deg = 5000;
  setting.lms.settings.start_1e4deg = -50000;
  setting.lms.settings.stop_1e4deg = 1850000;
  setting.sweep.field.elevation_min_rad = -4 * kRadPerDeg;
  build(setting);
  const auto cloud = scan();
  ASSERT_TRUE(cloud) << told_all();
  EXPECT_LT(worst_off_the_walls(*cloud), 0.004);
}

TEST_F(SweepLoop, StopAndGoIsTrueToAStep) {
  Setting setting;
  setting.sweep.stop_and_go = true;
  setting.sweep.field.azimuth_step_rad = 5 * kRadPerDeg;
  build(setting);
  const auto cloud = scan();
  ASSERT_TRUE(cloud) << told_all();
  EXPECT_EQ(cloud->pattern.columns, 36U);
  EXPECT_LT(worst_off_the_walls(*cloud), 0.003);
}

TEST_F(SweepLoop, AMountThatIsNotAsCalibratedShows) {
  Setting setting;
  setting.sweep.mount.roll_rad += 0.5 * kRadPerDeg;
  build(setting);
  const auto cloud = scan();
  ASSERT_TRUE(cloud) << told_all();
  EXPECT_GT(worst_off_the_walls(*cloud), 0.015);
}

TEST_F(SweepLoop, RefusesAFieldThatTheMountCannotGive) {
  Setting setting;
  setting.sweep.field.elevation_min_rad = -60 * kRadPerDeg;
  build(setting);
  EXPECT_EQ(scan().error(), std::errc::invalid_argument);
  EXPECT_NE(scanner->problem().find("tilt the scanner"), std::string::npos) << told_all();
  EXPECT_FALSE(lms_unit->streaming());
}

TEST_F(SweepLoop, RefusesAScanWithTooManyLostProfiles) {
  build({});
  ASSERT_TRUE(scan());
  lose_profiles_on_the_way();
  EXPECT_EQ(scan().error(), std::errc::io_error);
  EXPECT_NE(scanner->problem().find("profiles are lost"), std::string::npos) << told_all();
  on_progress = nullptr;
  EXPECT_TRUE(scan()) << told_all();
}

TEST_F(SweepLoop, LostProfilesAreColumnsThatClaimNothing) {
  Setting setting;
  setting.sweep.limits.lost_share_max = 0.9;
  build(setting);
  ASSERT_TRUE(scan());
  lose_profiles_on_the_way();
  const auto cloud = scan();
  ASSERT_TRUE(cloud) << told_all();
  std::uint32_t claimless = 0;
  for (std::uint32_t c = 0; c < cloud->pattern.columns; ++c)
    claimless += std::isnan(cloud->ranges_m[std::size_t{c} * cloud->pattern.rows]);
  EXPECT_GT(claimless, 50U);
  EXPECT_EQ(claimless, scanner->quality().columns_lost);
  EXPECT_LT(worst_off_the_walls(*cloud), 0.01);
}

TEST_F(SweepLoop, PassesOnWhatThePanUnitFailsWith) {
  build({});
  ASSERT_TRUE(scan());
  ptu_faults->set({UnitFault::off, 0});
  EXPECT_FALSE(scan());
  ptu_faults->clear();
  run_for(60s);
  EXPECT_TRUE(scan()) << told_all();
}

TEST_F(SweepLoop, RefusesAScanWhosePanUnitTurnsTooSlowly) {
  build({});
  ASSERT_TRUE(scan());
  ptu_faults->set({UnitFault::slow, 1.15});
  EXPECT_FALSE(scan());
  ptu_faults->clear();
  EXPECT_TRUE(scan()) << told_all();
}

// Both units and both drivers, with noise: the same seed, the same bytes.
struct OneRun : SweepLoop {
  void TestBody() override {}
  hal::ScanCloud cloud(int threads) {
    Setting setting;
    setting.lms_unit.ranges.range_sigma_m = 0.01;
    setting.lms_unit.ranges.lost_share_max = 0.95;
    setting.lms_unit.threads = threads;
    build(setting);
    auto result = scan();
    EXPECT_TRUE(result) << told_all();
    return std::move(*result);
  }
};

TEST(SweepLoopRepeats, WithAnyNumberOfThreads) {
  const hal::ScanCloud one = OneRun().cloud(1), other = OneRun().cloud(2);
  EXPECT_EQ(one.ranges_m, other.ranges_m);
  EXPECT_EQ(one.stamp, other.stamp);
  ASSERT_EQ(one.beams.size(), other.beams.size());
  for (std::size_t i = 0; i < one.beams.size(); ++i)
    ASSERT_EQ(one.beams[i].S_direction, other.beams[i].S_direction);
}

}  // namespace
}  // namespace drivers
