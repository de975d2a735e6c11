#include "nav/registration/pose_graph.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <Eigen/SparseCholesky>
#include <cmath>
#include <numeric>
#include <stdexcept>

#include "nav/linear.hpp"

namespace nav {
namespace {

using Sparse = Eigen::SparseMatrix<double>;

// The parts that links connect, each named by its first scan.
std::vector<int> first_of_part(const PoseGraph& graph) {
  std::vector<int> part(graph.T_W_S.size());
  std::iota(part.begin(), part.end(), 0);
  for (bool changed = true; changed;) {
    changed = false;
    for (const auto& link : graph.links) {
      int& a = part[static_cast<std::size_t>(link.from)];
      int& b = part[static_cast<std::size_t>(link.to)];
      changed = changed || a != b;
      a = b = std::min(a, b);
    }
  }
  return part;
}

// Column of each scan among the unknowns, in scans; -1 stays put.
std::vector<int> unknowns(const PoseGraph& graph, int& count) {
  const auto part = first_of_part(graph);
  std::vector<bool> tied(part.size());
  for (const auto& prior : graph.priors)
    tied[static_cast<std::size_t>(part[static_cast<std::size_t>(prior.scan)])] = true;
  std::vector<int> column(part.size());
  count = 0;
  for (std::size_t i = 0; i < part.size(); ++i) {
    const bool anchor = part[i] == static_cast<int>(i) && !tied[i];
    column[i] = anchor ? -1 : count++;
  }
  return column;
}

// What a link's residual does when a scan moves: blocks for `from` and `to`.
struct LinkSlopes {
  Matrix6d from = Matrix6d::Zero(), to = Matrix6d::Zero();
};

// d(rotation vector) by a small turn put in front of it.
Eigen::Matrix3d inverse_left_slope(const Eigen::Vector3d& rotation_rad) {
  const double angle_rad = rotation_rad.norm();
  const Eigen::Matrix3d K = cross_matrix(rotation_rad);
  if (angle_rad < 1e-6) return Eigen::Matrix3d::Identity() - K / 2;
  const double c = 1 / (angle_rad * angle_rad) -
                   (1 + std::cos(angle_rad)) / (2 * angle_rad * std::sin(angle_rad));
  return Eigen::Matrix3d::Identity() - K / 2 + c * K * K;
}

LinkSlopes slopes(const Vector6d& residual, const Eigen::Isometry3d& T_W_from,
                  const Eigen::Isometry3d& T_W_to) {
  const Eigen::Matrix3d R = T_W_from.linear().transpose();
  const Eigen::Matrix3d turn = inverse_left_slope(residual.tail<3>()) * R;
  LinkSlopes s;
  s.to.topLeftCorner<3, 3>() = R;
  s.to.bottomRightCorner<3, 3>() = turn;
  s.from.topLeftCorner<3, 3>() = -R;
  s.from.topRightCorner<3, 3>() = R * cross_matrix(T_W_to.translation() - T_W_from.translation());
  s.from.bottomRightCorner<3, 3>() = -turn;
  return s;
}

class Solver {
 public:
  Solver(const PoseGraph& graph, const PoseGraphConfig& config)
      : graph_(graph), config_(config), column_(unknowns(graph, count_)) {
    for (const auto& link : graph.links) link_information_.push_back(inverse_of(link.covariance));
    for (const auto& prior : graph.priors)
      prior_information_.push_back(inverse_of(prior.covariance));
  }

  PoseGraphFit run() {
    PoseGraphFit fit;
    fit.T_W_S = graph_.T_W_S;
    // First without the kernel: guesses may be far off all links.
    bool robust = false;
    while (fit.steps < config_.steps_max && count_ > 0) {
      const double step = solve(fit.T_W_S, robust);
      ++fit.steps;
      fit.settled = step < 1;
      if (!fit.settled) continue;
      if (robust || !std::isfinite(config_.kernel_sigmas)) break;
      robust = true;
    }
    fit.settled = fit.settled || count_ == 0;
    finish(fit);
    return fit;
  }

 private:
  double kernel_weight(double chi2, bool robust) const {
    if (!robust || !std::isfinite(config_.kernel_sigmas)) return 1;
    const double scale2 = config_.kernel_sigmas * config_.kernel_sigmas * 6;
    return std::pow(scale2 / (scale2 + chi2), 2);
  }

  void add(int row_scan, int column_scan, const Matrix6d& block) {
    const int row = column_[static_cast<std::size_t>(row_scan)];
    const int column = column_[static_cast<std::size_t>(column_scan)];
    if (row < 0 || column < 0) return;
    for (int i = 0; i < 6; ++i)
      for (int j = 0; j < 6; ++j) entries_.emplace_back(6 * row + i, 6 * column + j, block(i, j));
  }
  void add(int scan, const Vector6d& gradient) {
    const int row = column_[static_cast<std::size_t>(scan)];
    if (row >= 0) gradient_.segment<6>(6 * row) += gradient;
  }

  void add_link(std::size_t i, const std::vector<Eigen::Isometry3d>& poses, bool robust) {
    const PoseLink& link = graph_.links[i];
    const auto& from = poses[static_cast<std::size_t>(link.from)];
    const auto& to = poses[static_cast<std::size_t>(link.to)];
    const Vector6d residual = link_residual(link, from, to);
    const Matrix6d& information = link_information_[i];
    const Matrix6d weighted =
        kernel_weight(residual.dot(information * residual), robust) * information;
    const LinkSlopes s = slopes(residual, from, to);
    add(link.from, link.from, s.from.transpose() * weighted * s.from);
    add(link.from, link.to, s.from.transpose() * weighted * s.to);
    add(link.to, link.from, s.to.transpose() * weighted * s.from);
    add(link.to, link.to, s.to.transpose() * weighted * s.to);
    add(link.from, Vector6d(s.from.transpose() * weighted * residual));
    add(link.to, Vector6d(s.to.transpose() * weighted * residual));
  }

  void linearise(const std::vector<Eigen::Isometry3d>& poses, bool robust) {
    entries_.clear();
    gradient_ = Eigen::VectorXd::Zero(6 * count_);
    for (std::size_t i = 0; i < graph_.links.size(); ++i) add_link(i, poses, robust);
    for (std::size_t i = 0; i < graph_.priors.size(); ++i) {
      const PosePrior& prior = graph_.priors[i];
      const Vector6d residual =
          motion_between(prior.T_W_S, poses[static_cast<std::size_t>(prior.scan)]);
      Matrix6d slope = Matrix6d::Identity();
      slope.bottomRightCorner<3, 3>() = inverse_left_slope(residual.tail<3>());
      add(prior.scan, prior.scan, slope.transpose() * prior_information_[i] * slope);
      add(prior.scan, Vector6d(slope.transpose() * prior_information_[i] * residual));
    }
    Sparse H(6 * count_, 6 * count_);
    H.setFromTriplets(entries_.begin(), entries_.end());
    cholesky_.compute(H);
  }

  // The size of the step against what counts as settled.
  double solve(std::vector<Eigen::Isometry3d>& poses, bool robust) {
    linearise(poses, robust);
    const Eigen::VectorXd step = cholesky_.solve(-gradient_);
    double largest = 0;
    for (std::size_t i = 0; i < poses.size(); ++i) {
      if (column_[i] < 0) continue;
      const Vector6d motion = step.segment<6>(6 * column_[i]);
      poses[i] = moved(poses[i], motion);
      largest = std::max({largest, motion.head<3>().norm() / config_.settled_m,
                          motion.tail<3>().norm() / config_.settled_rad});
    }
    return largest;
  }

  void finish(PoseGraphFit& fit) {
    for (std::size_t i = 0; i < graph_.links.size(); ++i) {
      const PoseLink& link = graph_.links[i];
      const Vector6d residual = link_residual(link, fit.T_W_S[static_cast<std::size_t>(link.from)],
                                              fit.T_W_S[static_cast<std::size_t>(link.to)]);
      fit.link_chi2.push_back(residual.dot(link_information_[i] * residual));
      fit.chi2 += fit.link_chi2.back();
      if (fit.link_chi2.back() > config_.odd_chi2) fit.odd_links.push_back(static_cast<int>(i));
    }
    for (std::size_t i = 0; i < graph_.priors.size(); ++i) {
      const Vector6d residual = motion_between(
          graph_.priors[i].T_W_S, fit.T_W_S[static_cast<std::size_t>(graph_.priors[i].scan)]);
      fit.chi2 += residual.dot(prior_information_[i] * residual);
    }
    fit.covariances.assign(fit.T_W_S.size(), Matrix6d::Zero());
    if (count_ == 0) return;
    linearise(fit.T_W_S, true);
    for (std::size_t i = 0; i < fit.T_W_S.size(); ++i) {
      if (column_[i] < 0) continue;
      Eigen::MatrixXd unit = Eigen::MatrixXd::Zero(6 * count_, 6);
      unit.middleRows<6>(6 * column_[i]).setIdentity();
      const Eigen::MatrixXd solved = cholesky_.solve(unit);
      const Matrix6d block = solved.middleRows<6>(6 * column_[i]);
      fit.covariances[i] = (block + block.transpose()) / 2;
    }
  }

  const PoseGraph& graph_;
  PoseGraphConfig config_;
  int count_ = 0;  // Before column_, which sets it.
  std::vector<int> column_;
  std::vector<Matrix6d> link_information_, prior_information_;
  std::vector<Eigen::Triplet<double>> entries_;
  Eigen::VectorXd gradient_;
  Eigen::SimplicialLDLT<Sparse> cholesky_;
};

bool positive(const Matrix6d& covariance) {
  return covariance.allFinite() && covariance.isApprox(covariance.transpose(), 1e-9) &&
         axes_of(covariance).values[0] > 0;
}

std::string problem_with(const PoseGraph& graph) {
  const auto scans = static_cast<int>(graph.T_W_S.size());
  const auto known = [&](int scan) { return scan >= 0 && scan < scans; };
  for (std::size_t i = 0; i < graph.links.size(); ++i) {
    const PoseLink& link = graph.links[i];
    if (!known(link.from) || !known(link.to) || link.from == link.to)
      return fmt::format("link {} joins scans {} and {} of {}", i, link.from, link.to, scans);
    if (!positive(link.covariance))
      return fmt::format("link {}: its covariance is not positive definite", i);
  }
  for (std::size_t i = 0; i < graph.priors.size(); ++i) {
    if (!known(graph.priors[i].scan))
      return fmt::format("prior {} names scan {} of {}", i, graph.priors[i].scan, scans);
    if (!positive(graph.priors[i].covariance))
      return fmt::format("prior {}: its covariance is not positive definite", i);
  }
  return {};
}

}  // namespace

void throw_exception_from_error(const PoseGraphError& error, const boost::source_location&) {
  throw std::runtime_error(error.what);
}

Vector6d link_residual(const PoseLink& link, const Eigen::Isometry3d& T_W_from,
                       const Eigen::Isometry3d& T_W_to) {
  return motion_between(link.T_from_to, T_W_from.inverse() * T_W_to);
}

PoseGraphResult<PoseGraphFit> fit_pose_graph(const PoseGraph& graph,
                                             const PoseGraphConfig& config) {
  if (auto problem = problem_with(graph); !problem.empty()) return PoseGraphError{problem};
  return Solver(graph, config).run();
}

}  // namespace nav
