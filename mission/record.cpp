#include "mission/record.hpp"

#include <Eigen/Eigenvalues>
#include <cmath>

namespace mission {

void ScanRecord::claim(const Eigen::Matrix3d& of_pose) {
  covariance = of_pose;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(of_pose.topLeftCorner<2, 2>());
  sigma_position_m = std::sqrt(axes.eigenvalues().maxCoeff());
  sigma_heading_rad = std::sqrt(of_pose(2, 2));
}

}  // namespace mission
