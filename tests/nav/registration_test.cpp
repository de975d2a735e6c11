// Registration against a slow oracle, and against scenes whose answer is known.
#include "nav/registration/registration.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "nav/linear.hpp"
#include "nav/registration/icp.hpp"
#include "tests/support/scans.hpp"

namespace {

using nav::Points;
using nav::PreparedScan;
using nav::RegistrationConfig;
using nav::Verdict;
using scans::kDeg;
using scans::pose;

// The nearest of all points, one after the other.
std::pair<std::size_t, double> brute_nearest(const Points& points, const Eigen::Vector3d& to) {
  std::size_t best = 0;
  double best_m = 1e9;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double off_m = (points[i].cast<double>() - to).norm();
    if (off_m < best_m) best_m = off_m, best = i;
  }
  return {best, best_m};
}

std::vector<std::size_t> brute_neighbours(const Points& points, std::size_t of, std::size_t count) {
  std::vector<std::size_t> order(points.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::partial_sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(count), order.end(),
                    [&](std::size_t a, std::size_t b) {
                      return (points[a] - points[of]).norm() < (points[b] - points[of]).norm();
                    });
  order.resize(count);
  return order;
}

Eigen::Vector3d brute_normal(const Points& points, std::size_t of,
                             const nav::NormalConfig& config) {
  const auto around = brute_neighbours(points, of, config.neighbours);
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const auto i : around) mean += points[i].cast<double>() / static_cast<double>(around.size());
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const auto i : around) {
    const Eigen::Vector3d d = points[i].cast<double>() - mean;
    spread += d * d.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(spread);
  const Eigen::Array3d length = eigen.eigenvalues().array().max(0).sqrt();
  if (length[0] > config.flat_max * length[1] || length[1] < config.line_max * length[2])
    return Eigen::Vector3d::Zero();
  return eigen.eigenvectors().col(0);
}

struct Row {
  Eigen::Matrix<double, 1, 6> J;
  double r;
};

// Plain Gauss-Newton with numbers in double and every neighbour sought by hand.
Eigen::Isometry3d oracle(const Points& reference, const Points& reading, Eigen::Isometry3d T,
                         double reach_m, const RegistrationConfig& config) {
  std::vector<Eigen::Vector3d> normals;
  for (std::size_t i = 0; i < reference.size(); ++i)
    normals.push_back(brute_normal(reference, i, config.normals));
  for (int step = 0; step < 30; ++step) {
    std::vector<Row> rows;
    for (const auto& point : reading) {
      const Eigen::Vector3d p = T * point.cast<double>();
      const auto [at, off_m] = brute_nearest(reference, p);
      if (off_m >= reach_m || normals[at].isZero()) continue;
      Row row;
      row.J << normals[at].transpose(), p.cross(normals[at]).transpose();
      row.r = normals[at].dot(p - reference[at].cast<double>());
      rows.push_back(row);
    }
    std::vector<double> sizes;
    for (const Row& row : rows) sizes.push_back(std::abs(row.r));
    std::sort(sizes.begin(), sizes.end());
    const double sigma = std::max(1.4826 * sizes[sizes.size() / 2], config.noise_floor_m);
    const double scale2 = std::pow(config.kernel_scale * sigma, 2);
    nav::Matrix6d H = nav::Matrix6d::Zero();
    nav::Vector6d g = nav::Vector6d::Zero();
    for (const Row& row : rows) {
      const double w = std::pow(scale2 / (scale2 + row.r * row.r), 2);
      H += w * row.J.transpose() * row.J;
      g += w * row.J.transpose() * row.r;
    }
    const nav::Vector6d d = H.ldlt().solve(-g);
    Eigen::Isometry3d D = Eigen::Isometry3d::Identity();
    D.linear() = nav::rotation_of(d.tail<3>());
    D.translation() = d.head<3>();
    T = D * T;
  }
  return T;
}

nav::Vector6d error_of(const nav::Registration& result, const Eigen::Isometry3d& truth) {
  return nav::motion_between(truth, result.T_reference_reading);
}

TEST(Registration, NearestPointsAreThoseOfBruteForce) {
  support::Dice dice(1);
  Points points;
  for (int i = 0; i < 2000; ++i)
    points.emplace_back(static_cast<float>(dice.uniform(-9, 9)),
                        static_cast<float>(dice.uniform(-9, 9)),
                        static_cast<float>(dice.uniform(0, 2)));
  const nav::NearestPoints tree(points);
  for (int i = 0; i < 500; ++i) {
    const Eigen::Vector3f to(static_cast<float>(dice.uniform(-10, 10)),
                             static_cast<float>(dice.uniform(-10, 10)),
                             static_cast<float>(dice.uniform(-1, 3)));
    const auto [at, off_m] = brute_nearest(points, to.cast<double>());
    nav::Neighbour found;
    ASSERT_EQ(tree.nearest(to, 1.F, found), off_m < 1) << i;
    if (off_m < 1) {
      EXPECT_EQ(found.index, at) << i;
    }
  }
}

TEST(Registration, ThinningKeepsTheMeanOfEveryVoxelWhateverTheOrder) {
  support::Dice dice(2);
  Points points;
  for (int i = 0; i < 5000; ++i)
    points.emplace_back(static_cast<float>(dice.uniform(-30, 30)),
                        static_cast<float>(dice.uniform(-30, 30)),
                        static_cast<float>(dice.uniform(-3, 9)));
  const Points means = nav::thinned(points, 2.0);
  std::map<std::array<int, 3>, std::pair<Eigen::Vector3d, int>> cells;
  for (const auto& p : points) {
    auto& [sum, count] =
        cells[{static_cast<int>(std::floor(p.z() / 2)), static_cast<int>(std::floor(p.y() / 2)),
               static_cast<int>(std::floor(p.x() / 2))}];
    sum = (count == 0 ? Eigen::Vector3d(0, 0, 0) : sum) + p.cast<double>();
    ++count;
  }
  ASSERT_EQ(means.size(), cells.size());
  std::size_t i = 0;
  for (const auto& [cell, sum] : cells)
    EXPECT_LT((means[i++].cast<double>() - sum.first / sum.second).norm(), 1e-5);
}

TEST(Registration, EmptyReturnsAndNonsenseAreNotUsable) {
  const float nan = std::nanf(""), inf = INFINITY;
  const Points points{{0, 0, 0}, {1, 2, 0}, {nan, 1, 1}, {inf, 0, 0}, {0.1F, 0, 0}, {900, 0, 0}};
  EXPECT_EQ(nav::usable_points(points, 0.5, 150), (Points{{1, 2, 0}}));
}

TEST(Registration, FindsWhatPlainGaussNewtonWithBruteForceFinds) {
  const auto truth = pose(0.3, -0.2, 0.05, 3, 1, -1);
  RegistrationConfig config;
  config.levels = {{1.0, 1.2, 1.2, 60}};
  const auto reference =
      nav::thinned(scans::sampled(scans::yard(), pose(0, 0, 1.5, 0), 3, 0.02, 3), 1.0);
  const auto reading =
      nav::thinned(scans::sampled(scans::yard(), pose(0, 0, 1.5, 0) * truth, 3, 0.02, 4), 1.0);
  ASSERT_LT(reading.size(), config.points_max);
  const auto expected = oracle(reference, reading, Eigen::Isometry3d::Identity(), 1.2, config);
  // Thinned already: to prepare them again changes nothing.
  const nav::Surface surface = nav::make_surface(reference, config.normals);
  Eigen::Isometry3d at = Eigen::Isometry3d::Identity();
  for (int step = 0; step < 60; ++step) {
    const auto pairs = nav::plane_pairs(surface, reading, config.points_max, at, 1.2, {});
    nav::plane_step(nav::plane_equations(pairs, config, {}), config.free_below, at);
  }
  const auto off = nav::motion_between(expected, at);
  EXPECT_LT(off.head<3>().norm(), 1e-4);
  EXPECT_LT(off.tail<3>().norm(), 1e-5);
  const auto error = nav::motion_between(truth, at);
  EXPECT_LT(error.head<3>().norm(), 0.03);
}

TEST(Registration, FindsTheWayBackFromHalfAMetreAndFiveDegreesAllAround) {
  const auto T_W_A = pose(-4, -2, 1.5, 20), T_W_B = pose(1, 1, 1.6, 60, 2, -1);
  const auto truth = T_W_A.inverse() * T_W_B;
  const RegistrationConfig config;
  const PreparedScan a(scans::seen_from(scans::yard(), T_W_A, 1, 0.01, 5), config);
  const PreparedScan b(scans::seen_from(scans::yard(), T_W_B, 1, 0.01, 6), config);
  for (int k = 0; k < 8; ++k) {
    nav::Vector6d off;
    off << 0.5 * std::cos(k * 45 * kDeg), 0.5 * std::sin(k * 45 * kDeg), 0, 0, 0,
        (k % 2 ? 5 : -5) * kDeg;
    const auto result = nav::register_scans(a, b, nav::moved(truth, off), config);
    EXPECT_EQ(result.verdict, Verdict::accepted) << result.reason;
    EXPECT_EQ(result.guess_tried, 0);
    EXPECT_LT(error_of(result, truth).head<3>().norm(), 0.02) << k;
    EXPECT_LT(error_of(result, truth).tail<3>().norm(), 0.2 * kDeg) << k;
    EXPECT_GT(result.overlap, 0.7);
    EXPECT_LT(result.conflict, 0.01);
    EXPECT_LT(result.rms_m, 0.03);
    EXPECT_NEAR(result.moved_m, 0.5, 0.05);
  }
}

TEST(Registration, CovarianceCoversTheErrorOver40Pairs) {
  const auto T_W_A = pose(-4, -2, 1.5, 20);
  const RegistrationConfig config;
  const PreparedScan a(scans::seen_from(scans::yard(), T_W_A, 1.5, 0.02, 7), config);
  double chi2 = 0;
  for (int k = 0; k < 40; ++k) {
    const auto T_W_B = pose(-3 + 0.15 * k, 2 - 0.1 * k, 1.5, 7 * k);
    const PreparedScan b(scans::seen_from(scans::yard(), T_W_B, 1.5, 0.02, 100 + k), config);
    const auto truth = T_W_A.inverse() * T_W_B;
    const auto result = nav::register_scans(a, b, truth, config);
    ASSERT_EQ(result.verdict, Verdict::accepted) << k << ": " << result.reason;
    const auto error = error_of(result, truth);
    chi2 += error.dot(nav::inverse_of(result.covariance) * error) / 40;
  }
  RecordProperty("chi2_mean", std::to_string(chi2));
  EXPECT_LT(chi2, 9);    // 6 degrees of freedom: claims no more than it knows,
  EXPECT_GT(chi2, 0.5);  // and not much less.
}

TEST(Registration, ALongCorridorIsHeldWhereTheGuessHadItAndNamed) {
  const RegistrationConfig config;
  const auto T_W_A = pose(0, 0, 1.5, 0), T_W_B = pose(2, 0.3, 1.5, 2);
  const PreparedScan a(scans::seen_from(scans::corridor(), T_W_A, 1, 0.01, 8), config);
  const PreparedScan b(scans::seen_from(scans::corridor(), T_W_B, 1, 0.01, 9), config);
  const auto guess = pose(2.4, 0.1, 0, 4);
  const auto result = nav::register_scans(a, b, guess, config);
  EXPECT_EQ(result.verdict, Verdict::held_in_part) << result.reason;
  EXPECT_EQ(result.reason, "free along x");
  EXPECT_TRUE(result.shift[0].is_free);
  EXPECT_FALSE(result.shift[1].is_free);
  EXPECT_GT(result.shift[0].sigma, 10 * result.shift[1].sigma);
  EXPECT_NEAR(result.T_reference_reading.translation().x(), 2.4, 0.06);  // As guessed.
  EXPECT_NEAR(result.T_reference_reading.translation().y(), 0.3, 0.01);  // As it is.
  EXPECT_LT(
      nav::rotation_vector(result.T_reference_reading.linear() * pose(0, 0, 0, -2).linear()).norm(),
      0.2 * kDeg);
}

TEST(Registration, ARoundTowerLeavesTheTurnAboutItsAxisFree) {
  std::vector<scans::Panel> tower{{{-8, -8, 0}, {16, 0, 0}, {0, 16, 0}}};
  for (int k = 0; k < 180; ++k) {
    const Eigen::Vector3d from(6 * std::cos(2 * k * kDeg), 6 * std::sin(2 * k * kDeg), 0);
    const Eigen::Vector3d to(6 * std::cos((2 * k + 2) * kDeg), 6 * std::sin((2 * k + 2) * kDeg), 0);
    tower.push_back({from, to - from, {0, 0, 5}});
  }
  const RegistrationConfig config;
  const PreparedScan a(scans::seen_from(tower, pose(0, 0, 1.5, 0), 2, 0.01, 10), config);
  const PreparedScan b(scans::seen_from(tower, pose(0.3, 0.2, 1.5, 0), 2, 0.01, 11), config);
  const auto result = nav::register_scans(a, b, pose(0, 0, 0, 3), config);
  EXPECT_EQ(result.verdict, Verdict::held_in_part) << result.reason;
  EXPECT_EQ(result.reason, "free about z");
}

TEST(Registration, TheSameBitsOnAnyNumberOfThreads) {
  const RegistrationConfig config;
  const auto points_a = scans::seen_from(scans::yard(), pose(-4, -2, 1.5, 20), 1, 0.01, 12);
  const auto points_b = scans::seen_from(scans::yard(), pose(-2, 0, 1.5, 30), 1, 0.01, 13);
  const auto alone = nav::register_scans(PreparedScan(points_a, config),
                                         PreparedScan(points_b, config), pose(2, 2, 0, 10), config);
  const auto threads = nav::register_scans(PreparedScan(points_a, config, scans::on_two_threads),
                                           PreparedScan(points_b, config, scans::on_two_threads),
                                           pose(2, 2, 0, 10), config, scans::on_two_threads);
  EXPECT_EQ(alone.T_reference_reading.matrix(), threads.T_reference_reading.matrix());
  EXPECT_EQ(alone.covariance, threads.covariance);
  EXPECT_EQ(alone.steps, threads.steps);
  EXPECT_EQ(alone.rms_m, threads.rms_m);
}

TEST(Registration, ScansOfDifferentPlacesAreRefusedWithTheReason) {
  const RegistrationConfig config;
  const PreparedScan a(scans::seen_from(scans::yard(), pose(0, 0, 1.5, 0), 1, 0.01, 14), config);
  const PreparedScan b(scans::seen_from(scans::corridor(), pose(0, 0, 1.5, 0), 1, 0.01, 15),
                       config);
  const auto result = nav::register_scans(a, b, Eigen::Isometry3d::Identity(), config);
  EXPECT_EQ(result.verdict, Verdict::refused);
  EXPECT_FALSE(result.reason.empty());
}

TEST(Registration, AnEmptyScanIsRefusedNotTripped) {
  const RegistrationConfig config;
  const PreparedScan a(scans::seen_from(scans::yard(), pose(0, 0, 1.5, 0), 2, 0.01, 16), config);
  const PreparedScan empty(Points{}, config), one(Points{{1, 2, 3}}, config);
  for (const auto* other : {&empty, &one}) {
    for (const auto& result :
         {nav::register_scans(a, *other, Eigen::Isometry3d::Identity(), config),
          nav::register_scans(*other, a, Eigen::Isometry3d::Identity(), config)}) {
      EXPECT_EQ(result.verdict, Verdict::refused);
      EXPECT_NE(result.reason.find("pairs"), std::string::npos) << result.reason;
    }
  }
}

TEST(Registration, AGuessThatFailsIsTriedAgainTurnedOrShifted) {
  const auto T_W_A = pose(-4, -2, 1.5, 20), T_W_B = pose(1, 1, 1.5, 60);
  const auto truth = T_W_A.inverse() * T_W_B;
  RegistrationConfig config;
  config.levels = {{0.5, 0.7, 0.5, 40}, {0.25, 0.5, 0.4, 25}};  // Finds little by itself.
  const PreparedScan a(scans::seen_from(scans::yard(), T_W_A, 1, 0.01, 17), config);
  const PreparedScan b(scans::seen_from(scans::yard(), T_W_B, 1, 0.01, 18), config);
  nav::Vector6d off;
  off << 0, 0, 0, 0, 0, 16 * kDeg;
  config.retry_m = 0;
  config.retry_rad = 14 * kDeg;
  const auto result = nav::register_scans(a, b, nav::moved(truth, off), config);
  EXPECT_NE(result.verdict, Verdict::refused) << result.reason;
  EXPECT_EQ(result.guess_tried, 2);
  EXPECT_LT(error_of(result, truth).head<3>().norm(), 0.03);
  config.retry_rad = 0;
  EXPECT_EQ(nav::register_scans(a, b, nav::moved(truth, off), config).verdict, Verdict::refused);
}

}  // namespace
