// All scans at once: the poses that agree best with all registrations, marks and first guesses.
// Sparse Gauss-Newton with a robust kernel, so that a wrong registration does not bend the rest.
#pragma once

#include <Eigen/Geometry>
#include <boost/system/result.hpp>
#include <string>
#include <vector>

#include "nav/registration/rigid.hpp"

namespace nav {

// What one registration says: where scan `to` lies in the frame of scan `from`.
struct PoseLink {
  int from{}, to{};
  Eigen::Isometry3d T_from_to = Eigen::Isometry3d::Identity();
  Matrix6d covariance = Matrix6d::Identity();  // Of motions of that pose: see rigid.hpp.
};

// What is known of one scan by itself: from the localizer, or from marks.
struct PosePrior {
  int scan{};
  Eigen::Isometry3d T_W_S = Eigen::Isometry3d::Identity();
  Matrix6d covariance = Matrix6d::Identity();
};

struct PoseGraph {
  std::vector<Eigen::Isometry3d> T_W_S;  // First guesses, one a scan.
  std::vector<PoseLink> links;
  std::vector<PosePrior> priors;  // None: the first scan of each connected part stays put.
};

struct PoseGraphConfig {
  int steps_max = 50;
  double settled_m = 1e-7, settled_rad = 1e-8;
  // Links farther off than so many sigmas pull less and less (Geman and McClure); infinity: plain
  // least squares.
  double kernel_sigmas = 4;
  // A link whose chi-square at the end is above this is at odds with the rest (6 degrees of
  // freedom, 1 in 100,000 by chance).
  double odd_chi2 = 34;
};

struct PoseGraphFit {
  std::vector<Eigen::Isometry3d> T_W_S;
  std::vector<Matrix6d> covariances;  // Of motions of each; zero for a scan that stays put.
  std::vector<double> link_chi2;
  std::vector<int> odd_links;  // At odds with the rest: register again, or leave them out.
  double chi2{};               // Of all links and priors, without the kernel.
  int steps{};
  bool settled{};
};

struct PoseGraphError {
  std::string what;
};
template <class T>
using PoseGraphResult = boost::system::result<T, PoseGraphError>;
[[noreturn]] void throw_exception_from_error(const PoseGraphError& error,
                                             const boost::source_location& where);

// Fails for links or priors that name no scan, and for covariances that are not positive definite.
PoseGraphResult<PoseGraphFit> fit_pose_graph(const PoseGraph& graph,
                                             const PoseGraphConfig& config = {});

// By how much the link's measured pose must move to agree with the two scans.
Vector6d link_residual(const PoseLink& link, const Eigen::Isometry3d& T_W_from,
                       const Eigen::Isometry3d& T_W_to);

}  // namespace nav
