// The localizer and the scan matching on logs that other people recorded, with truth.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <numbers>
#include <sstream>
#include <vector>

#include "hal/angles.hpp"
#include "nav/localizer.hpp"
#include "nav/scan_match.hpp"

namespace {

using hal::kDeg;

std::filesystem::path folder(const std::string& log) {
  return std::filesystem::path(VANTAGE_SOURCE_DIR) / "../shared/data/logs" / log;
}
#define LOG_OR_SKIP(name) \
  if (!std::filesystem::exists(folder(name))) GTEST_SKIP() << "no log " << (name)

// Rows of numbers; lines that start with none are left out.
std::vector<std::vector<double>> table(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::vector<std::vector<double>> rows;
  for (std::string line; std::getline(file, line);) {
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream words(line);
    std::vector<double> row;
    for (double value; words >> value;) row.push_back(value);
    if (!row.empty()) rows.push_back(row);
  }
  return rows;
}

hal::Time at(double time_s, double first_s) {
  return hal::Time{} + hal::from_seconds(time_s - first_s);
}

// True poses over time.
class Truth {
 public:
  explicit Truth(std::vector<std::vector<double>> rows) : rows_(std::move(rows)) {}
  // Nothing where no row is within 0.2 s.
  std::optional<hal::Pose2> pose(double time_s) const {
    const auto next = std::lower_bound(rows_.begin(), rows_.end(), time_s,
                                       [](const auto& row, double t) { return row[0] < t; });
    if (next == rows_.end() || (*next)[0] - time_s > 0.2) return std::nullopt;
    return hal::Pose2{{(*next)[1], (*next)[2]}, (*next)[3]};
  }

 private:
  std::vector<std::vector<double>> rows_;
};

struct Score {
  double squares{}, nees{}, worst_m{};
  int count{};
  void add(const Eigen::Vector2d& error_m, double one_nees) {
    squares += error_m.squaredNorm();
    worst_m = std::max(worst_m, error_m.norm());
    nees += one_nees;
    ++count;
  }
  double rms_m() const { return std::sqrt(squares / count); }
  double nees_mean() const { return nees / count; }
};

hal::WheelTravel travel_of(hal::Time stamp, double way_m, double turn_rad, double track_m) {
  return {stamp, way_m - turn_rad * track_m / 2, way_m + turn_rad * track_m / 2};
}

void step_by(hal::Pose2& pose, double way_m, double turn_rad) {
  const double along = pose.heading_rad + turn_rad / 2;
  pose.position_m += way_m * Eigen::Vector2d(std::cos(along), std::sin(along));
  pose.heading_rad += turn_rad;
}

class Mrclam : public testing::TestWithParam<int> {};

TEST_P(Mrclam, LandmarksBeatDeadReckoningTenfoldWithAnHonestCovariance) {
  LOG_OR_SKIP("mrclam_dataset7");
  const auto log = folder("mrclam_dataset7");
  const std::string robot = "Robot" + std::to_string(GetParam());
  std::map<int, int> subject_of;
  for (const auto& row : table(log / "Barcodes.dat"))
    subject_of[static_cast<int>(row[1])] = static_cast<int>(row[0]);
  std::map<int, Eigen::Vector2d> landmarks;
  for (const auto& row : table(log / "Landmark_Groundtruth.dat"))
    landmarks[static_cast<int>(row[0])] = {row[1], row[2]};
  const auto odometry = table(log / (robot + "_Odometry.dat"));
  const auto sightings = table(log / (robot + "_Measurement.dat"));
  const Truth truth(table(log / (robot + "_Groundtruth.dat")));
  const double first_s = odometry[0][0];

  nav::LocalizerConfig config;
  config.track_m = 0.26;
  config.slip_sigma = 0.1;  // What a small robot that is told its speeds, not asked, does.
  config.slip_length_m = 1;
  const hal::Pose2 start = truth.pose(first_s).value();
  nav::Localizer localizer(config, start, Eigen::Vector3d(1e-4, 1e-4, 1e-3).asDiagonal());
  hal::Pose2 reckoned = start;
  Score score, reckoning;
  int seen = 0, refused = 0;
  auto sighting = sightings.begin();
  for (std::size_t i = 0; i + 1 < odometry.size(); ++i) {
    const double now_s = odometry[i + 1][0], span_s = now_s - odometry[i][0];
    const double way_m = odometry[i][1] * span_s, turn_rad = odometry[i][2] * span_s;
    for (; sighting != sightings.end() && (*sighting)[0] <= now_s; ++sighting) {
      const auto landmark = landmarks.find(subject_of[static_cast<int>((*sighting)[1])]);
      if (landmark == landmarks.end()) continue;  // Another robot.
      const double range_m = (*sighting)[2];
      ++seen;
      refused += localizer
                     .add(nav::LandmarkSighting{at((*sighting)[0], first_s), landmark->second,
                                                range_m, (*sighting)[3], 0.2 + 0.15 * range_m, 0.2})
                     .gate == nav::Gate::rejected;
    }
    localizer.add(travel_of(at(now_s, first_s), way_m, turn_rad, config.track_m));
    step_by(reckoned, way_m, turn_rad);
    if (i % 70 != 0 || now_s < first_s + 5) continue;  // Once a second.
    const auto pose = truth.pose(now_s);
    if (!pose) continue;
    Eigen::Vector3d error;
    error << localizer.pose().position_m - pose->position_m,
        std::remainder(localizer.pose().heading_rad - pose->heading_rad, 2 * std::numbers::pi);
    score.add(error.head<2>(), error.dot(localizer.covariance().inverse() * error));
    reckoning.add(reckoned.position_m - pose->position_m, 0);
  }
  RecordProperty("rms_m", std::to_string(score.rms_m()));
  RecordProperty("dead_reckoning_rms_m", std::to_string(reckoning.rms_m()));
  RecordProperty("nees_mean", std::to_string(score.nees_mean()));
  RecordProperty("refused", std::to_string(refused) + " of " + std::to_string(seen));
  EXPECT_GT(score.count, 600);
  EXPECT_LT(score.rms_m(), reckoning.rms_m() / 10);
  EXPECT_LT(score.worst_m, 0.7);
  EXPECT_GT(score.nees_mean(), 0.5);
  EXPECT_LT(score.nees_mean(), 6);
  EXPECT_LT(refused, seen / 10);
}
INSTANTIATE_TEST_SUITE_P(Robots, Mrclam, testing::Values(1, 2));

// Wheels and gyro of a mower, and distances to four beacons that read 7 % long.
TEST(Plaza, BeaconRangesBeatDeadReckoningTenfoldWithAnHonestCovariance) {
  LOG_OR_SKIP("plaza1_mower");
  const auto log = folder("plaza1_mower");
  const auto steps = table(log / "DR.csv"), ranges = table(log / "TD.csv");
  const auto path = table(log / "DRp.csv");  // The log's own dead reckoning.
  std::map<int, Eigen::Vector2d> beacons;
  for (const auto& row : table(log / "TL.csv"))
    beacons[static_cast<int>(row[0])] = {row[1], row[2]};
  auto rows = table(log / "GT.csv");
  const hal::Pose2 start{{rows[0][1], rows[0][2]}, rows[0][3]};
  const double first_s = rows[0][0];
  const Truth truth(std::move(rows));

  nav::LocalizerConfig config;
  config.slip_sigma = 0.03;
  config.slip_length_m = 10;
  config.gyro_sigma_radps = 0.006;
  config.gyro_bias_sigma_radps = 1e-4;
  nav::Localizer localizer(config, start, Eigen::Vector3d(1e-4, 1e-4, 1e-4).asDiagonal());
  // How long the ranges read, from the first two minutes of dead reckoning: no truth in it.
  double scale = 0, scale_count = 0;
  hal::Pose2 reckoned = start;
  Score score, own_reckoning, integrated;
  auto range = ranges.begin();
  int seen = 0, refused = 0;
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const double now_s = steps[i][0];
    const double before_s = i > 0 ? steps[i - 1][0] : first_s;
    for (; range != ranges.end() && (*range)[0] <= now_s; ++range) {
      const auto& beacon = beacons.at(static_cast<int>((*range)[2]));
      const double range_m = (*range)[3];
      if (now_s < first_s + 120) {
        scale += range_m / (reckoned.position_m - beacon).norm();
        ++scale_count;
        continue;
      }
      ++seen;
      refused += localizer
                     .add(nav::BeaconRange{at((*range)[0], first_s), beacon,
                                           range_m * scale_count / scale, 1.2})
                     .gate == nav::Gate::rejected;
    }
    for (const double share : {0.5, 1.0})
      localizer.add(nav::InertialSample{at(before_s + share * (now_s - before_s), first_s),
                                        {0, 0, steps[i][2] / (now_s - before_s)}});
    localizer.add(travel_of(at(now_s, first_s), steps[i][1], 0, config.track_m));
    step_by(reckoned, steps[i][1], steps[i][2]);
    if (i % 5 != 0) continue;  // Once a second.
    const auto pose = truth.pose(now_s);
    if (!pose) continue;
    const Eigen::Vector2d error = localizer.pose().position_m - pose->position_m;
    score.add(error, error.dot(localizer.covariance().topLeftCorner<2, 2>().inverse() * error));
    own_reckoning.add(Eigen::Vector2d(path[i + 1][1], path[i + 1][2]) - pose->position_m, 0);
    integrated.add(reckoned.position_m - pose->position_m, 0);
  }
  RecordProperty("rms_m", std::to_string(score.rms_m()));
  RecordProperty("dead_reckoning_rms_m", std::to_string(own_reckoning.rms_m()));
  RecordProperty("integrated_deltas_rms_m", std::to_string(integrated.rms_m()));
  RecordProperty("nees_mean", std::to_string(score.nees_mean()));
  RecordProperty("scale", std::to_string(scale / scale_count));
  RecordProperty("refused", std::to_string(refused) + " of " + std::to_string(seen));
  EXPECT_GT(score.count, 1500);
  EXPECT_LT(score.rms_m(), own_reckoning.rms_m() / 10);
  EXPECT_LT(score.rms_m(), integrated.rms_m() / 3);
  EXPECT_GT(score.nees_mean(), 0.3);
  EXPECT_LT(score.nees_mean(), 4);
}

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
  double way_m = 0, turn_rad = 0;
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
        localizer->add(travel_of(at(stamp_s, 0), along, turn, config.track_m));
        step_by(reckoned, along, turn);
        way_m += std::abs(along);
        turn_rad += std::abs(turn);
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
      refused += localizer->add(nav::PoseFix{at(stamp_s, 0), match.pose, match.covariance}).gate !=
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
