// Registration on scans of real scanners, against transforms that others found.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <ctime>
#include <sstream>

#include "nav/registration/cloud_file.hpp"
#include "nav/registration/pose_graph.hpp"
#include "tests/support/scans.hpp"

namespace {

using nav::PreparedScan;
using nav::Registration;
using nav::RegistrationConfig;
using nav::Verdict;
using scans::kDeg;

nav::Points load(const std::string& name) {
  return nav::parse_cloud(scans::bytes_of(scans::folder() / name), name).value();
}

Eigen::Isometry3d matrix(const std::string& name) {
  std::ifstream file(scans::folder() / name);
  Eigen::Isometry3d T;
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 4; ++column) file >> T.matrix()(row, column);
  EXPECT_TRUE(file) << name;
  return T;
}

// Rows of a CSV without its header, commas made blanks.
std::vector<std::istringstream> rows(const std::string& name) {
  std::ifstream file(scans::folder() / name);
  std::vector<std::istringstream> all;
  std::string line;
  std::getline(file, line);
  while (std::getline(file, line)) {
    std::replace(line.begin(), line.end(), ',', ' ');
    all.emplace_back(line);
  }
  return all;
}

Eigen::Isometry3d take_pose(std::istringstream& row) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 4; ++c) row >> T.matrix()(r, c);
  return T;
}

void expect_found(const Registration& result, const Eigen::Isometry3d& truth, double within_m,
                  double within_deg, const std::string& what) {
  const auto error = nav::motion_between(truth, result.T_reference_reading);
  EXPECT_EQ(result.verdict, Verdict::accepted) << what << ": " << result.reason;
  EXPECT_LE(error.head<3>().norm(), within_m) << what;
  EXPECT_LE(error.tail<3>().norm() / kDeg, within_deg) << what;
}

// 0.5 m in eight directions, 5 deg either way about each axis.
std::vector<Eigen::Isometry3d> off_by_half_a_metre(const Eigen::Isometry3d& truth) {
  std::vector<Eigen::Isometry3d> guesses;
  for (int k = 0; k < 8; ++k) {
    nav::Vector6d off = nav::Vector6d::Zero();
    off.head<2>() << 0.5 * std::cos(k * 45 * kDeg), 0.5 * std::sin(k * 45 * kDeg);
    off[k < 6 ? 5 : k - 3] = (k % 2 ? 5 : -5) * kDeg;
    guesses.push_back(nav::moved(truth, off));
  }
  return guesses;
}

TEST(RegistrationScans, SmallGicpPairWithin2CmAndHalfADegree) {
  SCANS_OR_SKIP("pair_small_gicp");
  const RegistrationConfig config;
  const PreparedScan reference(load("pair_small_gicp/target.ply"), config);
  const PreparedScan reading(load("pair_small_gicp/source.ply"), config, {},
                             PreparedScan::Use::reading_only);
  const auto truth = matrix("pair_small_gicp/T_target_source.txt");
  auto guesses = off_by_half_a_metre(truth);
  guesses.push_back(Eigen::Isometry3d::Identity());
  for (std::size_t i = 0; i < guesses.size(); ++i)
    expect_found(nav::register_scans(reference, reading, guesses[i], config), truth, 0.02, 0.5,
                 fmt::format("guess {}", i));
}

TEST(RegistrationScans, CarParkPairWithin5CmAndHalfADegree) {
  SCANS_OR_SKIP("pair_libpointmatcher_car");
  const RegistrationConfig config;
  const PreparedScan reference(load("pair_libpointmatcher_car/car_cloud400.csv"), config);
  const PreparedScan reading(load("pair_libpointmatcher_car/car_cloud401.csv"), config);
  const auto truth = matrix("pair_libpointmatcher_car/T_ref_reading_3d.txt");
  auto guesses = off_by_half_a_metre(truth);
  guesses.push_back(Eigen::Isometry3d::Identity());  // 14 deg off.
  for (std::size_t i = 0; i < guesses.size(); ++i)
    expect_found(nav::register_scans(reference, reading, guesses[i], config), truth, 0.05, 0.5,
                 fmt::format("guess {}", i));
}

class StopAndGo : public testing::Test {
 protected:
  void SetUp() override {
    SCANS_OR_SKIP("imm_stop_and_go_a");
    for (int i = 1; i <= 12; ++i)
      scans_.emplace_back(load(fmt::format("imm_stop_and_go_a/scan{:03}.pcd", i)), config_);
    for (auto& row : rows("imm_stop_and_go_a/initial_poses.csv")) {
      std::string scan;
      row >> scan;
      guesses_.push_back(take_pose(row));
    }
    ASSERT_EQ(guesses_.size(), scans_.size());
  }

  Registration pair(std::size_t a, std::size_t b) const {
    return nav::register_scans(scans_[a], scans_[b], guesses_[a].inverse() * guesses_[b], config_);
  }

  RegistrationConfig config_;
  std::vector<PreparedScan> scans_;
  std::vector<Eigen::Isometry3d> guesses_;
};

TEST_F(StopAndGo, EveryConsecutivePairFromTheAuthorsPoses) {
  int pairs = 0;
  for (auto& row : rows("imm_stop_and_go_a/reference_relative_poses.csv")) {
    std::string a, b, kind;
    row >> a >> b;
    const auto truth = take_pose(row);
    double skipped, check_m, check_deg;
    for (int i = 0; i < 5; ++i) row >> skipped;
    row >> kind >> check_m >> check_deg;
    const auto from = static_cast<std::size_t>(std::stoi(a.substr(4)) - 1);
    const auto to = static_cast<std::size_t>(std::stoi(b.substr(4)) - 1);
    if (to != from + 1) continue;
    expect_found(pair(from, to), truth, 3 * check_m + 0.02, 3 * check_deg + 0.3, a + " " + b);
    ++pairs;
  }
  EXPECT_EQ(pairs, 11);
}

TEST_F(StopAndGo, WrongPairsAreRefused) {
  // Each with the guess that fits its neighbour: the wrong scan was picked.
  for (const std::size_t apart : {3U, 4U, 5U, 6U, 7U, 11U})
    for (std::size_t a = 0; a + apart < scans_.size(); a += 2) {
      const auto result = nav::register_scans(scans_[a], scans_[a + apart],
                                              guesses_[a].inverse() * guesses_[a + 1], config_);
      EXPECT_EQ(result.verdict, Verdict::refused)
          << a << " " << a + apart << ": conflict " << result.conflict;
      EXPECT_FALSE(result.reason.empty());
    }
}

// Neighbours and next neighbours: 21 links over 12 scans that must agree with each other.
TEST_F(StopAndGo, APoseGraphOfAllOverlappingPairsAgreesWithItself) {
  nav::PoseGraph graph;
  graph.T_W_S = guesses_;
  for (std::size_t a = 0; a < scans_.size(); ++a)
    for (std::size_t b = a + 1; b < std::min(a + 3, scans_.size()); ++b) {
      const auto result = pair(a, b);
      ASSERT_NE(result.verdict, Verdict::refused) << a << " " << b << ": " << result.reason;
      graph.links.push_back({static_cast<int>(a), static_cast<int>(b), result.T_reference_reading,
                             result.covariance});
    }
  ASSERT_EQ(graph.links.size(), 21U);
  const auto fit = nav::fit_pose_graph(graph).value();
  EXPECT_TRUE(fit.settled);
  EXPECT_TRUE(fit.odd_links.empty());
  RecordProperty("chi2", std::to_string(fit.chi2));
  EXPECT_LT(fit.chi2, 2.0 * 6 * (21 - 11));  // As many equations more than unknowns.
  // One link spoilt by a metre: it is named, and pulls as if it were not there.
  graph.links[8].T_from_to.translation().x() += 1;
  const auto spoilt = nav::fit_pose_graph(graph).value();
  EXPECT_EQ(spoilt.odd_links, std::vector<int>{8});
  graph.links.erase(graph.links.begin() + 8);
  const auto without = nav::fit_pose_graph(graph).value();
  for (std::size_t i = 0; i < scans_.size(); ++i)
    EXPECT_LT(nav::motion_between(without.T_W_S[i], spoilt.T_W_S[i]).head<3>().norm(), 0.01) << i;
}

TEST(RegistrationScans, ScansOfDifferentSitesAreRefused) {
  SCANS_OR_SKIP("pair_small_gicp");
  SCANS_OR_SKIP("pair_libpointmatcher_car");
  SCANS_OR_SKIP("imm_stop_and_go_a");
  const RegistrationConfig config;
  const PreparedScan gicp(load("pair_small_gicp/target.ply"), config);
  const PreparedScan car(load("pair_libpointmatcher_car/car_cloud400.csv"), config);
  const PreparedScan imm(load("imm_stop_and_go_a/scan005.pcd"), config);
  for (const auto& [a, b] : {std::pair{&gicp, &car}, {&gicp, &imm}, {&car, &imm}}) {
    const auto result = nav::register_scans(*a, *b, Eigen::Isometry3d::Identity(), config);
    EXPECT_EQ(result.verdict, Verdict::refused);
    EXPECT_FALSE(result.reason.empty());
  }
}

}  // namespace
