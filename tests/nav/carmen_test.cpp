// Scans of robots that other people drove, matched against the finished grid.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <memory>
#include <numbers>
#include <optional>
#include <sstream>
#include <vector>

#include "hal/angles.hpp"
#include "nav/localizer.hpp"
#include "nav/scan_match.hpp"
#include "tests/nav/logs.hpp"

namespace {

using hal::kDeg;
using recorded::at;
using recorded::folder;
using recorded::Score;
using recorded::step_by;
using recorded::travel_of;

// A map_server grid: the middles of its occupied cells.
std::vector<Eigen::Vector2d> occupied(const std::filesystem::path& stem) {
  std::ifstream yaml(stem.string() + ".yaml");
  double resolution_m = 0;
  Eigen::Vector2d origin_m(0, 0);
  for (std::string line; std::getline(yaml, line);) {
    if (line.starts_with("resolution:")) resolution_m = std::stod(line.substr(11));
    if (line.starts_with("origin:"))
      std::sscanf(line.c_str(), "origin: [%lf, %lf", &origin_m.x(), &origin_m.y());
  }
  std::ifstream pgm(stem.string() + ".pgm", std::ios::binary);
  std::string magic;
  int width = 0, height = 0, most = 0;
  pgm >> magic >> width >> height >> most;
  pgm.get();
  std::vector<Eigen::Vector2d> points;
  for (int row = 0; row < height; ++row)
    for (int column = 0; column < width; ++column)
      if (pgm.get() < 90)  // 0 is occupied, 254 free, 205 unknown.
        points.push_back(origin_m +
                         resolution_m * Eigen::Vector2d(column + 0.5, height - row - 0.5));
  return points;
}

std::string unpacked(const std::filesystem::path& gz) {
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe(
      popen(("zcat '" + gz.string() + "'").c_str(), "r"), pclose);
  std::string text;
  std::array<char, 65536> piece;
  for (std::size_t got; (got = std::fread(piece.data(), 1, piece.size(), pipe.get())) > 0;)
    text.append(piece.data(), got);
  return text;
}

struct CarmenLog {
  const char* name;
  const char* file;
  const char* grid;
};

class Carmen : public testing::TestWithParam<CarmenLog> {};

// Raw odometry between the scans, each scan matched against the finished grid; the corrected pose
// of each scan is looked at only to judge.
TEST_P(Carmen, ScanMatchingKeepsTheRobotLocalizedThroughout) {
  LOG_OR_SKIP(GetParam().name);
  const auto log = folder(GetParam().name);
  nav::WallMapConfig map_config;
  const nav::WallMap map(occupied(log / GetParam().grid), map_config);
  ASSERT_GT(map.walls().size(), 1000U);

  nav::LocalizerConfig config;
  config.slip_sigma = 0.3;  // Up to 10 deg of heading in a metre, and jumps.
  config.slip_length_m = 0.3;
  config.wheel_turn_error = 0.6;
  nav::ScanMatchConfig match_config;
  match_config.map_sigma_m = 0.08;  // Cells of 0.1 m, drawn from scans.
  match_config.map_sigma_rad = 0.01;
  std::optional<nav::Localizer> localizer;
  hal::Pose2 odometry, reckoned;
  // The lines are in the order in which it happened, their stamps are not always.
  double latest_s = 0;
  Score score, reckoning;
  double worst_deg = 0;
  int scans = 0, matched = 0, refused = 0, lost_scans = 0, lost_row = 0, lost_row_max = 0;
  std::vector<double> nees;
  std::istringstream lines(unpacked(log / GetParam().file));
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string kind;
    words >> kind;
    if (kind == "ODOM") {
      hal::Pose2 next;
      double skipped, stamp_s;
      words >> next.position_m.x() >> next.position_m.y() >> next.heading_rad >> skipped >>
          skipped >> skipped >> stamp_s;
      // At stamp 0 the log puts its odometry back to the corrected pose: no motion.
      if (stamp_s > 0 && localizer) {
        const Eigen::Vector2d step =
            Eigen::Rotation2Dd(-odometry.heading_rad) * (next.position_m - odometry.position_m);
        const double turn =
            std::remainder(next.heading_rad - odometry.heading_rad, 2 * std::numbers::pi);
        const double along = step.x() * std::cos(turn / 2) + step.y() * std::sin(turn / 2);
        latest_s = std::max(latest_s + 1e-6, stamp_s);
        localizer->add(travel_of(at(latest_s, 0), along, turn, config.track_m));
        step_by(reckoned, along, turn);
      }
      odometry = next;
    }
    if (kind != "FLASER") continue;
    hal::Profile profile;
    std::size_t beams;
    words >> beams;
    profile.ranges_m.resize(beams);
    for (float& range_m : profile.ranges_m) words >> range_m;
    hal::Pose2 corrected;
    double skipped, stamp_s;
    words >> corrected.position_m.x() >> corrected.position_m.y() >> corrected.heading_rad >>
        skipped >> skipped >> skipped >> stamp_s;
    profile.angle_first_rad = -std::numbers::pi / 2;
    profile.angle_step_rad =
        std::numbers::pi / static_cast<double>(beams % 2 == 1 ? beams - 1 : beams);
    latest_s = std::max(latest_s + 1e-6, stamp_s);
    // The first scan has no odometry before it.
    if (++scans == 1) continue;
    if (!localizer) {
      reckoned = corrected;
      localizer.emplace(config, corrected, Eigen::Vector3d(0.01, 0.01, 0.001).asDiagonal());
    }
    const auto points = nav::profile_points(profile, {}, 0.1, 30);
    const auto match = nav::match_scan(map, points, localizer->pose(), match_config);
    matched += match.good;
    if (match.good)
      refused += localizer->add(nav::PoseFix{at(latest_s, 0), match.pose, match.covariance}).gate !=
                 nav::Gate::accepted;
    Eigen::Vector3d error;
    error << localizer->pose().position_m - corrected.position_m,
        std::remainder(localizer->pose().heading_rad - corrected.heading_rad, 2 * std::numbers::pi);
    score.add(error.head<2>(), error.dot(localizer->covariance().inverse() * error));
    reckoning.add(reckoned.position_m - corrected.position_m, 0);
    worst_deg = std::max(worst_deg, std::abs(error[2]) / kDeg);
    nees.push_back(error.dot(localizer->covariance().inverse() * error));
    const bool lost = error.head<2>().norm() > 0.5 || std::abs(error[2]) > 10 * kDeg;
    lost_scans += lost;
    lost_row = lost ? lost_row + 1 : 0;
    lost_row_max = std::max(lost_row_max, lost_row);
  }
  std::nth_element(nees.begin(), nees.begin() + static_cast<std::ptrdiff_t>(nees.size() / 2),
                   nees.end());
  const double nees_median = nees[nees.size() / 2];
  RecordProperty("lost_scans", std::to_string(lost_scans));
  RecordProperty("lost_in_a_row", std::to_string(lost_row_max));
  RecordProperty("nees_median", std::to_string(nees_median));
  RecordProperty("scans", std::to_string(scans));
  RecordProperty("matched", std::to_string(matched));
  RecordProperty("refused", std::to_string(refused));
  RecordProperty("rms_m", std::to_string(score.rms_m()));
  RecordProperty("worst_m", std::to_string(score.worst_m));
  RecordProperty("worst_deg", std::to_string(worst_deg));
  RecordProperty("nees_mean", std::to_string(score.nees_mean()));
  RecordProperty("dead_reckoning_rms_m", std::to_string(reckoning.rms_m()));
  EXPECT_GT(scans, 200);
  EXPECT_GT(matched, scans * 9 / 10);
  EXPECT_LT(refused, scans / 20);
  EXPECT_LT(score.rms_m(), 0.12);
  // Once the log of Seattle turns by 80 deg without a line of odometry: found again by the scans.
  EXPECT_LE(lost_row_max, 3);
  EXPECT_LE(lost_scans, scans * 3 / 100);
  EXPECT_LT(score.worst_m, 1);
  EXPECT_LT(nees_median, 4);
}
INSTANTIATE_TEST_SUITE_P(
    Logs, Carmen,
    testing::Values(CarmenLog{"carmen_intel", "intel-corrected.log.gz", "intel_grid"},
                    CarmenLog{"carmen_freiburg101", "freiburg-101-corrected.log.gz",
                              "freiburg101_grid"},
                    CarmenLog{"carmen_seattle", "seattle-corrected.log.gz", "seattle_grid"}),
    [](const auto& param) { return std::string(param.param.name); });

}  // namespace
