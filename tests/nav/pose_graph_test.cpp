// The sparse pose graph against a dense one with slopes by differences, and on made-up tours.
#include "nav/registration/pose_graph.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <limits>

#include "nav/linear.hpp"
#include "tests/support/scans.hpp"

namespace {

using nav::Matrix6d;
using nav::Vector6d;
using scans::kDeg;

Vector6d noise(support::Dice& dice, double sigma_m, double sigma_rad) {
  Vector6d v;
  for (int i = 0; i < 6; ++i) v[i] = dice.gauss(i < 3 ? sigma_m : sigma_rad);
  return v;
}

Matrix6d spread(double sigma_m, double sigma_rad) {
  Vector6d v;
  v << Eigen::Vector3d::Constant(sigma_m * sigma_m),
      Eigen::Vector3d::Constant(sigma_rad * sigma_rad);
  return v.asDiagonal();
}

// A tour around a square that ends where it began; every station is linked to the next, and the
// last to the first.
struct Tour {
  std::vector<Eigen::Isometry3d> truth;
  nav::PoseGraph graph;
};

Tour tour(int stations, std::uint64_t seed) {
  support::Dice dice(seed);
  Tour t;
  for (int i = 0; i < stations; ++i) {
    const double angle_deg = 360.0 * i / stations;
    t.truth.push_back(scans::pose(30 * std::cos(angle_deg * kDeg), 30 * std::sin(angle_deg * kDeg),
                                  0.02 * i, 3 * angle_deg, 1, -2));
  }
  Eigen::Isometry3d at = t.truth[0];
  for (int i = 0; i < stations; ++i) {
    const int next = (i + 1) % stations;
    const auto a = static_cast<std::size_t>(i), b = static_cast<std::size_t>(next);
    const Eigen::Isometry3d measured =
        nav::moved(t.truth[a].inverse() * t.truth[b], noise(dice, 0.01, 0.001));
    t.graph.links.push_back({i, next, measured, spread(0.01, 0.001)});
    t.graph.T_W_S.push_back(at);  // Dead reckoning along the links, worse by the localizer's drift.
    at = nav::moved(at * measured, noise(dice, 0.1, 0.01));
  }
  return t;
}

double objective_row(const nav::PoseGraph& graph, const std::vector<Eigen::Isometry3d>& poses,
                     Eigen::VectorXd& rows) {
  rows.resize(static_cast<Eigen::Index>(6 * (graph.links.size() + graph.priors.size())));
  Eigen::Index at = 0;
  const auto put = [&](const Vector6d& residual, const Matrix6d& covariance) {
    const Matrix6d root = Eigen::LLT<Matrix6d>(nav::inverse_of(covariance)).matrixU();
    rows.segment<6>(at) = root * residual;
    at += 6;
  };
  for (const auto& link : graph.links)
    put(nav::link_residual(link, poses[static_cast<std::size_t>(link.from)],
                           poses[static_cast<std::size_t>(link.to)]),
        link.covariance);
  for (const auto& prior : graph.priors)
    put(nav::motion_between(prior.T_W_S, poses[static_cast<std::size_t>(prior.scan)]),
        prior.covariance);
  return rows.squaredNorm();
}

// Dense Gauss-Newton with slopes by central differences. The first pose stays put without priors.
std::vector<Eigen::Isometry3d> oracle(const nav::PoseGraph& graph) {
  auto poses = graph.T_W_S;
  const std::size_t first = graph.priors.empty() ? 1 : 0;
  const auto unknown = static_cast<Eigen::Index>(6 * (poses.size() - first));
  for (int step = 0; step < 15; ++step) {
    Eigen::VectorXd r;
    objective_row(graph, poses, r);
    Eigen::MatrixXd J(r.size(), unknown);
    for (Eigen::Index k = 0; k < unknown; ++k) {
      const auto scan = first + static_cast<std::size_t>(k / 6);
      Vector6d motion = Vector6d::Zero();
      motion[k % 6] = 1e-6;
      auto plus = poses, minus = poses;
      plus[scan] = nav::moved(poses[scan], motion);
      minus[scan] = nav::moved(poses[scan], -motion);
      Eigen::VectorXd r_plus, r_minus;
      objective_row(graph, plus, r_plus);
      objective_row(graph, minus, r_minus);
      J.col(k) = (r_plus - r_minus) / 2e-6;
    }
    const Eigen::VectorXd d = (J.transpose() * J).ldlt().solve(-J.transpose() * r);
    for (std::size_t scan = first; scan < poses.size(); ++scan)
      poses[scan] =
          nav::moved(poses[scan], d.segment<6>(6 * static_cast<Eigen::Index>(scan - first)));
  }
  return poses;
}

TEST(PoseGraph, AgreesWithDenseGaussNewton) {
  for (const bool with_priors : {false, true}) {
    auto t = tour(9, 3);
    if (with_priors)
      t.graph.priors = {{2, nav::moved(t.truth[2], Vector6d::Constant(0.01)), spread(0.05, 0.02)},
                        {7, t.truth[7], spread(0.02, 0.01)}};
    nav::PoseGraphConfig config;
    config.kernel_sigmas = std::numeric_limits<double>::infinity();
    const auto fit = nav::fit_pose_graph(t.graph, config).value();
    EXPECT_TRUE(fit.settled);
    const auto expected = oracle(t.graph);
    for (std::size_t i = 0; i < expected.size(); ++i)
      EXPECT_LT(nav::motion_between(expected[i], fit.T_W_S[i]).norm(), 1e-6) << i << with_priors;
    Eigen::VectorXd rows;
    EXPECT_NEAR(fit.chi2, objective_row(t.graph, expected, rows), 1e-6);
  }
}

TEST(PoseGraph, ClosingTheTourHalvesTheErrorOfDeadReckoningAndMore) {
  double before_m = 0, after_m = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const auto t = tour(24, seed);
    const auto fit = nav::fit_pose_graph(t.graph).value();
    for (std::size_t i = 0; i < t.truth.size(); ++i) {
      before_m += (t.graph.T_W_S[i].translation() - t.truth[i].translation()).norm();
      after_m += (fit.T_W_S[i].translation() - t.truth[i].translation()).norm();
    }
  }
  EXPECT_LT(after_m, before_m / 10);
}

TEST(PoseGraph, CovariancesCoverTheErrorOver200Tours) {
  double chi2 = 0;
  for (std::uint64_t seed = 100; seed < 300; ++seed) {
    const auto t = tour(8, seed);
    const auto fit = nav::fit_pose_graph(t.graph).value();
    EXPECT_EQ(fit.covariances[0], Matrix6d::Zero());
    const auto error = nav::motion_between(t.truth[4], fit.T_W_S[4]);
    chi2 += error.dot(nav::inverse_of(fit.covariances[4]) * error) / 200;
  }
  EXPECT_NEAR(chi2, 6, 1);
}

TEST(PoseGraph, AWrongLinkIsNamedAndBendsNothing) {
  auto t = tour(12, 5);
  // Chords, so that each station is held by more than two links.
  support::Dice dice(6);
  for (int i = 0; i + 3 < 12; ++i)
    t.graph.links.push_back({i, i + 3,
                             nav::moved(t.truth[static_cast<std::size_t>(i)].inverse() *
                                            t.truth[static_cast<std::size_t>(i) + 3],
                                        noise(dice, 0.01, 0.001)),
                             spread(0.01, 0.001)});
  t.graph.links[4].T_from_to = scans::pose(2, 1, 0, 20) * t.graph.links[4].T_from_to;
  const auto fit = nav::fit_pose_graph(t.graph).value();
  EXPECT_EQ(fit.odd_links, std::vector<int>{4});
  for (std::size_t i = 0; i < t.truth.size(); ++i)
    EXPECT_LT((fit.T_W_S[i].translation() - t.truth[i].translation()).norm(), 0.15) << i;
}

TEST(PoseGraph, PartsThatNothingConnectsEachKeepTheirFirstScan) {
  auto t = tour(6, 7);
  t.graph.links.erase(t.graph.links.begin() + 5);
  t.graph.links.erase(t.graph.links.begin() + 2);
  const auto fit = nav::fit_pose_graph(t.graph).value();
  EXPECT_TRUE(fit.settled);
  EXPECT_TRUE(fit.T_W_S[0].isApprox(t.graph.T_W_S[0]));
  EXPECT_TRUE(fit.T_W_S[3].isApprox(t.graph.T_W_S[3]));
  EXPECT_LT(fit.chi2, 1e-9);  // Chains: every link has its way.
}

TEST(PoseGraph, RefusesWhatNamesNoScanOrIsNoCovariance) {
  auto t = tour(4, 8);
  t.graph.links[1].to = 9;
  EXPECT_EQ(nav::fit_pose_graph(t.graph).error().what, "link 1 joins scans 1 and 9 of 4");
  t = tour(4, 8);
  t.graph.links[2].covariance(0, 0) = -1;
  EXPECT_EQ(nav::fit_pose_graph(t.graph).error().what,
            "link 2: its covariance is not positive definite");
  t = tour(4, 8);
  t.graph.priors = {{-1, t.truth[0], spread(1, 1)}};
  EXPECT_EQ(nav::fit_pose_graph(t.graph).error().what, "prior 0 names scan -1 of 4");
  EXPECT_TRUE(nav::fit_pose_graph({}).value().settled);
}

}  // namespace
