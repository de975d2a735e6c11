// What the drivers make of a robot file.
#include <gmock/gmock.h>

#include "mission/main_scanner.hpp"
#include "tests/mission/mission_site.hpp"

namespace {

using testing::HasSubstr;

std::string problems(const std::string& robot) {
  const auto loaded = mission::parse_mission("", "m.toml", robot, "r.toml");
  EXPECT_TRUE(loaded.errors.empty()) << loaded.errors[0].text();
  std::string text;
  for (const auto& error : mission::robot_problems(loaded.config)) text += error.text() + "\n";
  return text;
}

// Half a circle and the run-up to 50 deg/s do not fit into 185 deg.
TEST(RobotProblems, CountTheRunUpOfASweepAndNameTheRemedy) {
  const std::string fast = "[scanner]\nazimuth_step_deg = 1.0\nelevation_step_deg = 0.5\n";
  const std::string refusal = problems(fast + "[pan]\nangle_max_deg = 185.0\n");
  EXPECT_THAT(refusal, HasSubstr("r.toml:5:1"));
  EXPECT_THAT(refusal, HasSubstr("to run up to 50.0 deg/s"));
  EXPECT_THAT(refusal, HasSubstr("smaller azimuth_step_deg"));
  EXPECT_EQ(problems(fast + "[pan]\nangle_max_deg = 360.0\n"), "");
  EXPECT_EQ(problems(fast + "[pan]\nangle_max_deg = 185.0\nstop_and_go = true\n"), "");
  EXPECT_EQ(problems("[scanner]\nazimuth_step_deg = 0.2\n"), "") << "3 deg of run-up fit";
}

TEST(RobotProblems, CompareWhatIsAskedWithWhatTheScannerHas) {
  const std::string refusal = problems(
      "[scanner]\ndevice = 'vlp16'\nlink = 'udp:2368'\nelevation_min_deg = -60.0\n"
      "elevation_step_deg = 0.1667\nfov_deg = 120.0\ntilt_deg = 35.0\n");
  for (const char* part : {"set elevation_min_deg = -15.0", "set elevation_max_deg = 15.0",
                           "set elevation_step_deg = 2", "set fov_deg = 360", "leave out tilt_deg"})
    EXPECT_THAT(refusal, HasSubstr(part));
  EXPECT_THAT(problems("[scanner]\ndevice = 'hokuyo'\nmodel = 'URG-04'\ntilt_deg = 90.0\n"
                       "elevation_min_deg = -20.0\nelevation_step_deg = 0.25\n"),
              HasSubstr("a URG-04LX measures every 0.3516 deg"));
  EXPECT_THAT(problems("[scanner]\ndevice = 'ouster'\nlink = 'udp:7502'\nmetadata = 'no.json'\n"),
              HasSubstr("api/v1/sensor/metadata"));
}

TEST(RobotProblems, SayWhichScannersCanLookAheadAndWhatIsThenLeftOut) {
  const std::string look = "[obstacles]\ndevice = 'scanner'\n";
  EXPECT_THAT(problems("[scanner]\nazimuth_step_deg = 0.2\n" + look),
              HasSubstr("a scanner on a pan unit cannot look ahead"));
  const std::string vlp16 =
      "[scanner]\ndevice = 'vlp16'\nlink = 'udp:2368'\nelevation_min_deg = -15\n"
      "elevation_max_deg = 15\nelevation_step_deg = 2\nazimuth_step_deg = 0.2\nfov_deg = 360\n";
  EXPECT_EQ(problems(vlp16 + look + "patience_s = 3.0\n"), "");
  const std::string refusal = problems(vlp16 + look + "height_m = 0.3\nlink = 'tcp:a:10940'\n");
  EXPECT_THAT(refusal, HasSubstr("leave out height_m"));
  EXPECT_THAT(refusal, HasSubstr("leave out link"));
}

// One mission with each robot that ships, on a small site; how much of what it could see it must
// have seen was measured once and is held.
struct Shipped {
  const char* robot;
  double seen_min;
  double points_min;  // Of a scan.
};

void PrintTo(const Shipped& shipped, std::ostream* to) {
  *to << shipped.robot;
}

class ShippedRobot : public testing::TestWithParam<Shipped> {};

TEST_P(ShippedRobot, SurveysASmallSiteThroughItsDriversAndUnits) {
  mission_test::SmallSite site("", 10);
  site.robot_file = std::string(VANTAGE_SOURCE_DIR) + "/configs/robots/" + GetParam().robot;
  const auto outcome = site.run();
  ASSERT_EQ(outcome.failure, "");
  ASSERT_TRUE(outcome.record.completed) << outcome.record.end;
  EXPECT_TRUE(outcome.record.dropped.empty()) << outcome.record.dropped[0].reason;
  ASSERT_GE(outcome.record.scans.size(), 2U);
  for (const auto& scan : outcome.record.scans)
    EXPECT_GE(static_cast<double>(scan.points), GetParam().points_min) << scan.name;
  ASSERT_TRUE(outcome.record.truth);
  const auto& truth = *outcome.record.truth;
  const double seen =
      static_cast<double>(truth.surface_seen) / static_cast<double>(truth.surface_visible);
  EXPECT_GE(seen, GetParam().seen_min);
  EXPECT_LT(truth.position_error_max_m, 0.15);
  std::printf("%s: %zu scans, %.1f %% of %lu surface voxels seen, %.0f s\n", GetParam().robot,
              outcome.record.scans.size(), 100 * seen,
              static_cast<unsigned long>(truth.surface_visible), outcome.record.mission_s);
}

INSTANTIATE_TEST_SUITE_P(All, ShippedRobot,
                         testing::Values(Shipped{"scout_lms511.toml", 0.96, 1e5},
                                         Shipped{"avenue.toml", 0.97, 1e5},
                                         Shipped{"bunker_vlp16.toml", 0.95, 1e4},
                                         Shipped{"scout_ouster.toml", 0.97, 1e4},
                                         Shipped{"scout_hokuyo.toml", 0.97, 1e5},
                                         Shipped{"scout_looking.toml", 0.96, 1e5},
                                         Shipped{"mini_lms111.toml", 0.95, 1e5}),
                         [](const auto& param) {
                           const std::string name = param.param.robot;
                           return name.substr(0, name.find('.'));
                         });

// How far the points of all scans that lie near the house's walls (x or y is 0 or 6) are from them.
double wall_error_rms_m(const std::filesystem::path& folder) {
  double squares_m2 = 0;
  std::size_t count = 0;
  for (const auto& file : std::filesystem::directory_iterator(folder)) {
    const auto cloud = mission::read_ply(file.path());
    if (!cloud) continue;
    for (const Eigen::Vector3f& p : cloud->W_points_m) {
      if (p.z() < 0.5F || p.z() > 4.5F) continue;
      const Eigen::Vector2f off = (p.head<2>().array() - 3).abs() - 3;  // Outside is positive.
      const float away_m = off.maxCoeff();
      if (std::abs(away_m) > 0.5F) continue;
      squares_m2 += away_m * away_m;
      ++count;
    }
  }
  EXPECT_GT(count, 1000U);
  return std::sqrt(squares_m2 / static_cast<double>(std::max<std::size_t>(count, 1)));
}

// A mount that is not the plain one: what is calibrated goes into every beam.
TEST(Mount, OfTheRobotFileIsWhatScansAreMadeWith) {
  const mission_test::SmallSite site(
      "[scanner]\nazimuth_step_deg = 1.0\nelevation_step_deg = 0.5\nrange_max_m = 40\n"
      "roll_deg = 1.5\nyaw_deg = 20.0\noffset_x_m = 0.15\noffset_y_m = -0.1\noffset_z_m = 0.05\n"
      "[pan]\nangle_max_deg = 360\n[sim]\nrange_sigma_m = 0.0\n");
  const auto prepared = site.prepared();
  const auto& scanner = prepared.config.robot.scanner;
  const Eigen::Isometry3d T_P_L = mission::mount_of(scanner).T_P_L();
  EXPECT_TRUE(T_P_L.translation().isApprox(Eigen::Vector3d(0.15, -0.1, 0.05)));
  const auto outcome = site.run();
  ASSERT_TRUE(outcome.record.completed) << outcome.record.end;
  const auto& truth = *outcome.record.truth;
  EXPECT_GE(static_cast<double>(truth.surface_seen),
            0.88 * static_cast<double>(truth.surface_visible));
  EXPECT_LE(wall_error_rms_m(site.out() / "scans"), 0.05) << "points beside the house's walls";
}

}  // namespace
