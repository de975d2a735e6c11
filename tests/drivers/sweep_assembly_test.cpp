#include "drivers/sweep_assembly.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>

#include "hal/pan_fan.hpp"

namespace drivers {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;
using namespace std::chrono_literals;
constexpr double kDeg = std::numbers::pi / 180;

const Vector3d kLow(-4, -3, -1.5), kHigh(5, 6, 2.5);  // A room, in S.

double range_in_room(const Vector3d& from, const Vector3d& along) {
  double range_m = 1e9;
  for (int axis = 0; axis < 3; ++axis)
    if (std::abs(along[axis]) > 1e-12)
      range_m =
          std::min(range_m, ((along[axis] > 0 ? kHigh : kLow)[axis] - from[axis]) / along[axis]);
  return range_m;
}

double distance_to_walls(const Vector3d& p) {
  return std::min((p - kLow).cwiseAbs().minCoeff(), (p - kHigh).cwiseAbs().minCoeff());
}

// What a mirror that really hangs at T_P_L measures while the pan axis turns from angle0 at time 0.
struct Truth {
  Isometry3d T_P_L = SweepMount{}.T_P_L();
  double angle0_rad{}, rate_radps{};
  MirrorField mirror{-45 * kDeg, 0.5 * kDeg, 541, 0.02 / 720, 0.02};

  double pan_at(hal::Time t) const { return angle0_rad + rate_radps * hal::seconds(t); }
  hal::Profile profile(hal::Time stamp) const {
    hal::Profile p;
    p.stamp = stamp;
    p.beam_period_s = mirror.beam_period_s;
    p.angle_first_rad = mirror.angle_first_rad;
    p.angle_step_rad = mirror.angle_step_rad;
    for (std::uint32_t i = 0; i < mirror.beams; ++i) {
      const double a = mirror.angle_first_rad + i * mirror.angle_step_rad;
      const double pan = pan_at(stamp + hal::from_seconds(i * mirror.beam_period_s));
      const Isometry3d T_S_L = Eigen::AngleAxisd(pan, Vector3d::UnitZ()) * T_P_L;
      const Vector3d along = T_S_L.linear() * Vector3d(std::cos(a), std::sin(a), 0);
      p.ranges_m.push_back(static_cast<float>(range_in_room(T_S_L.translation(), along)));
    }
    return p;
  }
  std::vector<hal::Profile> profiles(int count) const {
    std::vector<hal::Profile> all;
    for (int i = 0; i < count; ++i)
      all.push_back(profile(hal::Time(hal::from_seconds(i * mirror.interval_s))));
    return all;
  }
  PanFit fit() const {
    PanFit fit;
    fit.angle_rad = angle0_rad;
    fit.rate_radps = rate_radps;
    fit.used = 100;
    return fit;
  }
};

// Turns as planned, beginning some columns before.
Truth turning(const SweepPlan& plan, Truth truth) {
  truth.rate_radps = plan.rate_radps;
  truth.angle0_rad = plan.pan_first_rad - 7.3 * plan.pan_step_rad;
  return truth;
}

double worst_off_the_walls(const hal::ScanCloud& cloud) {
  double worst_m = 0;
  for (std::size_t i = 0; i < cloud.ranges_m.size(); ++i) {
    if (!(cloud.ranges_m[i] > 0)) continue;
    const Vector3d p = cloud.beams[i].S_origin_m.cast<double>() +
                       cloud.ranges_m[i] * cloud.beams[i].S_direction.cast<double>();
    worst_m = std::max(worst_m, distance_to_walls(p));
  }
  return worst_m;
}

Vector3d nominal(const hal::ScanPattern& pattern, std::size_t beam) {
  const double az = pattern.azimuth_first_rad +
                    static_cast<double>(beam / pattern.rows) * pattern.azimuth_step_rad;
  const double el = pattern.elevation_first_rad +
                    static_cast<double>(beam % pattern.rows) * pattern.elevation_step_rad;
  return {std::cos(el) * std::cos(az), std::cos(el) * std::sin(az), std::sin(el)};
}

double worst_off_the_pattern_rad(const hal::ScanCloud& cloud) {
  double worst = 0;
  for (std::size_t i = 0; i < cloud.beams.size(); ++i)
    worst = std::max(
        worst, (nominal(cloud.pattern, i) - cloud.beams[i].S_direction.cast<double>()).norm());
  return worst;
}

SweepMount looking_up() {  // 270 degrees, from -45 over the zenith to -45.
  SweepMount mount;
  mount.P_offset_m = {0.08, 0.01, 0.12};
  return mount;
}
MirrorField lms1xx() {
  return {-45 * kDeg, 0.5 * kDeg, 541, 0.02 / 720, 0.02};
}
SweepField field(double low_deg = -45) {
  return {2 * std::numbers::pi, low_deg * kDeg, 90 * kDeg, 0.5 * kDeg};
}

TEST(SweepPlan, TurnsHalfACircleWhenTheMirrorSeesBothSides) {
  const auto plan = plan_sweep(field(), lms1xx(), looking_up().T_P_L());
  ASSERT_EQ(plan.problem, "");
  EXPECT_TRUE(plan.both_sides);
  EXPECT_NEAR(plan.pan_first_rad, -89.75 * kDeg, 1e-9);
  EXPECT_NEAR(plan.pan_last_rad, 89.75 * kDeg, 1e-9);
  EXPECT_NEAR(plan.rate_radps, 25 * kDeg, 1e-9);
  EXPECT_EQ(plan.rows, 541U);
  EXPECT_NEAR(plan.elevation_first_rad, -45 * kDeg, 1e-9);
  EXPECT_NEAR(plan.elevation_step_rad, 0.5 * kDeg, 1e-12);
}

TEST(SweepPlan, TurnsTheWholeCircleWhenTheFarSideIsTooHigh) {
  SweepMount mount;
  mount.tilt_rad = -30 * kDeg;  // Down: from -75 over the zenith to -15 behind it.
  const auto plan = plan_sweep(field(-60), lms1xx(), mount.T_P_L());
  ASSERT_EQ(plan.problem, "");
  EXPECT_FALSE(plan.both_sides);
  EXPECT_NEAR(plan.pan_last_rad - plan.pan_first_rad, 359.5 * kDeg, 1e-9);
  EXPECT_EQ(plan.rows, 301U);  // From -60 to the zenith: the far side would only come twice.
  EXPECT_NEAR(plan.elevation_first_rad, -60 * kDeg, 1e-9);
}

TEST(SweepPlan, TurnsNoFurtherThanANarrowFieldNeeds) {
  auto narrow = field();
  narrow.fov_rad = 90 * kDeg;
  const auto plan = plan_sweep(narrow, lms1xx(), looking_up().T_P_L());
  ASSERT_EQ(plan.problem, "");
  EXPECT_NEAR(plan.pan_first_rad, -44.75 * kDeg, 1e-9);
  EXPECT_NEAR(plan.pan_last_rad, 44.75 * kDeg, 1e-9);
  EXPECT_EQ(plan.rows, 271U);
}

TEST(SweepPlan, KnowsAScannerThatHangsTheOtherWayRound) {
  SweepMount mount = looking_up();
  Isometry3d T_P_L = mount.T_P_L();
  T_P_L.linear() = T_P_L.linear() * Eigen::AngleAxisd(std::numbers::pi, Vector3d::UnitX());
  MirrorField mirror{-225 * kDeg, 0.5 * kDeg, 541, 0.02 / 720, 0.02};
  const auto plan = plan_sweep(field(), mirror, T_P_L);
  ASSERT_EQ(plan.problem, "");
  Truth truth;
  truth.T_P_L = T_P_L;
  truth.mirror = mirror;
  truth = turning(plan, truth);
  const auto sweep = assemble_sweep(plan, T_P_L, truth.profiles(400), truth.fit(), 0);
  EXPECT_LT(worst_off_the_walls(sweep.cloud), 1e-5);
  EXPECT_LT(worst_off_the_pattern_rad(sweep.cloud), 0.4 * kDeg);
}

TEST(SweepPlan, SaysWhatCannotBeHad) {
  EXPECT_EQ(plan_sweep(field(-60), lms1xx(), looking_up().T_P_L()).problem,
            "the mirror reaches from -45.0 deg to 90.0 deg, not from -60.0 deg to 90.0 deg: tilt "
            "the scanner or ask for less");
  SweepMount lying;
  lying.roll_rad = 90 * kDeg;
  EXPECT_EQ(plan_sweep(field(), lms1xx(), lying.T_P_L()).problem,
            "the mirror's axis must lie level: profiles must be upright");
  EXPECT_NE(plan_sweep(field(), {}, looking_up().T_P_L()).problem, "");
  EXPECT_NE(plan_sweep({0, 0, 1, 1}, lms1xx(), looking_up().T_P_L()).problem, "");
}

TEST(SweepAssembly, PutsEveryBeamOfASkewedMountOnTheWalls) {
  SweepMount mount = looking_up();
  mount.roll_rad = 1.5 * kDeg;
  mount.tilt_rad = 0.7 * kDeg;
  mount.yaw_rad = 2 * kDeg;
  const auto plan = plan_sweep(field(-44), lms1xx(), mount.T_P_L());
  ASSERT_EQ(plan.problem, "");
  Truth truth;
  truth.T_P_L = mount.T_P_L();
  truth = turning(plan, truth);
  const auto sweep = assemble_sweep(plan, mount.T_P_L(), truth.profiles(400), truth.fit(), 0);
  EXPECT_LT(worst_off_the_walls(sweep.cloud), 1e-5);
  EXPECT_EQ(sweep.cloud.pattern.columns, 360U);
  EXPECT_EQ(sweep.quality.columns_lost, 0U);
  EXPECT_LT(worst_off_the_pattern_rad(sweep.cloud), 2 * kDeg);
  EXPECT_NEAR(sweep.cloud.pattern.azimuth_step_rad, 0.5 * kDeg, 1e-9);
}

TEST(SweepAssembly, WithoutMountErrorsKeepsToThePatternWithinOneStep) {
  const auto plan = plan_sweep(field(), lms1xx(), looking_up().T_P_L());
  Truth truth;
  truth.T_P_L = looking_up().T_P_L();
  truth = turning(plan, truth);
  const auto sweep = assemble_sweep(plan, truth.T_P_L, truth.profiles(400), truth.fit(), 0);
  EXPECT_LT(worst_off_the_pattern_rad(sweep.cloud), 0.5 * kDeg);
  EXPECT_EQ(sweep.cloud.stamp,
            truth.profiles(400)[7 + 359].stamp + hal::from_seconds(541 * 0.02 / 720));
}

// 10 ms at 25 deg/s are 0.25 degrees: 44 mm at 10 m.
TEST(SweepAssembly, APanClockThatIsLateMovesWallsUntilItIsCalibrated) {
  const auto plan = plan_sweep(field(), lms1xx(), looking_up().T_P_L());
  Truth truth;
  truth.T_P_L = looking_up().T_P_L();
  truth = turning(plan, truth);
  PanFit late = truth.fit();
  late.origin += 10ms;  // The angles belong to times 10 ms earlier than it says.
  const auto profiles = truth.profiles(400);
  EXPECT_GT(worst_off_the_walls(assemble_sweep(plan, truth.T_P_L, profiles, late, 0).cloud), 0.02);
  EXPECT_LT(worst_off_the_walls(assemble_sweep(plan, truth.T_P_L, profiles, late, 0.01).cloud),
            1e-5);
}

TEST(SweepAssembly, AMountAngleThatIsWrongMovesWalls) {
  const auto plan = plan_sweep(field(), lms1xx(), looking_up().T_P_L());
  Truth truth;
  SweepMount bent = looking_up();
  bent.roll_rad = 0.3 * kDeg;
  truth.T_P_L = bent.T_P_L();
  truth = turning(plan, truth);
  const auto sweep =
      assemble_sweep(plan, looking_up().T_P_L(), truth.profiles(400), truth.fit(), 0);
  EXPECT_GT(worst_off_the_walls(sweep.cloud), 0.01);
}

// The fan is what is kept of a scan's beams.
bool is_told_by_its_fan(const hal::ScanCloud& cloud) {
  const auto beams = cloud.fan ? hal::beams_of(*cloud.fan) : std::vector<hal::Beam>();
  return beams.size() == cloud.beams.size() &&
         std::memcmp(beams.data(), cloud.beams.data(), beams.size() * sizeof(hal::Beam)) == 0;
}

TEST(SweepAssembly, LostProfilesLeaveColumnsThatClaimNothing) {
  const auto plan = plan_sweep(field(), lms1xx(), looking_up().T_P_L());
  Truth truth;
  truth.T_P_L = looking_up().T_P_L();
  truth = turning(plan, truth);
  auto profiles = truth.profiles(400);
  profiles.erase(profiles.begin() + 100, profiles.begin() + 103);  // Columns 93 to 95.
  const auto sweep = assemble_sweep(plan, truth.T_P_L, profiles, truth.fit(), 0);
  EXPECT_EQ(sweep.cloud.pattern.columns, 360U);
  EXPECT_EQ(sweep.quality.columns_lost, 3U);
  for (std::size_t c = 0; c < 360; ++c)
    EXPECT_EQ(std::isnan(sweep.cloud.ranges_m[c * plan.rows]), c >= 93 && c < 96) << c;
  EXPECT_LT(worst_off_the_walls(sweep.cloud), 1e-5);
  EXPECT_LT(worst_off_the_pattern_rad(sweep.cloud), 0.5 * kDeg);
  EXPECT_EQ(sweep_problem(sweep.quality, plan, {}), "");
  EXPECT_TRUE(is_told_by_its_fan(sweep.cloud));
}

TEST(SweepAssembly, CountsProfilesThatAreMissingAtTheEnds) {
  const auto plan = plan_sweep(field(), lms1xx(), looking_up().T_P_L());
  Truth truth;
  truth.T_P_L = looking_up().T_P_L();
  truth = turning(plan, truth);
  auto profiles = truth.profiles(400);
  profiles.erase(profiles.begin(), profiles.begin() + 18);
  const auto sweep = assemble_sweep(plan, truth.T_P_L, profiles, truth.fit(), 0);
  EXPECT_EQ(sweep.quality.columns_lost, 11U);
  EXPECT_EQ(sweep.quality.columns, 360U);
  EXPECT_EQ(sweep_problem(sweep.quality, plan, {}), "11 of 360 profiles are lost");
}

TEST(SweepAssembly, WithoutProfilesThereIsNoScan) {
  const auto plan = plan_sweep(field(), lms1xx(), looking_up().T_P_L());
  const auto sweep = assemble_sweep(plan, looking_up().T_P_L(), {}, {}, 0);
  EXPECT_EQ(sweep.cloud.pattern.beams(), 0U);
  EXPECT_EQ(sweep_problem(sweep.quality, plan, {}), "no profile came from the sweep");
}

TEST(SweepAssembly, ScannerCrystalsMayDifferByAThousandth) {
  const auto plan = plan_sweep(field(), lms1xx(), looking_up().T_P_L());
  Truth truth;
  truth.T_P_L = looking_up().T_P_L();
  truth.mirror.interval_s *= 1.003;
  truth = turning(plan, truth);
  const auto sweep = assemble_sweep(plan, truth.T_P_L, truth.profiles(400), truth.fit(), 0);
  EXPECT_EQ(sweep.quality.columns_lost, 0U);
  EXPECT_EQ(sweep.cloud.pattern.columns, 359U);
  EXPECT_LT(worst_off_the_walls(sweep.cloud), 1e-5);
}

TEST(SweepAssembly, StopsMakeAScanToo) {
  const auto plan = plan_sweep(field(), lms1xx(), looking_up().T_P_L());
  std::vector<StoppedProfile> stops;
  for (int i = 0; i < 360; ++i) {
    Truth truth;
    truth.T_P_L = looking_up().T_P_L();
    truth.angle0_rad = plan.pan_first_rad + i * plan.pan_step_rad;
    stops.push_back({truth.angle0_rad, truth.profile(hal::Time(i * 200ms)), i == 17});
  }
  const auto sweep = assemble_stops(plan, looking_up().T_P_L(), stops);
  EXPECT_EQ(sweep.quality.columns, 360U);
  EXPECT_EQ(sweep.quality.columns_lost, 1U);
  EXPECT_TRUE(std::isnan(sweep.cloud.ranges_m[17 * plan.rows]));
  EXPECT_LT(worst_off_the_walls(sweep.cloud), 1e-5);
  EXPECT_LT(worst_off_the_pattern_rad(sweep.cloud), 1e-6);
  EXPECT_TRUE(is_told_by_its_fan(sweep.cloud));
}

TEST(SweepQuality, NamesTheLimitThatBreaks) {
  SweepPlan plan;
  plan.rate_radps = 0.4;
  SweepQuality good{1000, 0, 1e-5, 1e-4, 100, 0.4, 0.001};
  EXPECT_EQ(sweep_problem(good, plan, {}), "");
  auto bad = good;
  bad.pan_readings = 3;
  EXPECT_EQ(sweep_problem(bad, plan, {}), "only 3 pan angles");
  bad = good;
  bad.pan_residual_rms_rad = 1e-3;
  EXPECT_EQ(sweep_problem(bad, plan, {}), "the pan unit turned unevenly: 1000e-6 rad rms");
  bad = good;
  bad.rate_radps = 0.2;
  EXPECT_EQ(sweep_problem(bad, plan, {}),
            "the pan unit turned at 200000e-6 instead of 400000e-6 rad/s");
  bad = good;
  bad.clock_jitter_s = 0.2;
  EXPECT_EQ(sweep_problem(bad, plan, {}), "profiles arrive too unevenly: 200000e-6 s");
}

}  // namespace
}  // namespace drivers
