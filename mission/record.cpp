#include "mission/record.hpp"

#include <cmath>

#include "nav/linear.hpp"

namespace mission {
namespace {

// Along its worse axis.
double position_sigma_m(const Eigen::Matrix3d& of_pose) {
  return std::sqrt(nav::axes_of(Eigen::Matrix2d(of_pose.topLeftCorner<2, 2>())).values[1]);
}

}  // namespace

void ScanRecord::claim(const Eigen::Matrix3d& of_pose) {
  covariance = of_pose;
  sigma_position_m = position_sigma_m(of_pose);
  sigma_heading_rad = std::sqrt(of_pose(2, 2));
}

void ScanRecord::arrive(const hal::Pose2& at, const Eigen::Matrix3d& of_pose) {
  arrived = at;
  arrived_sigma_m = position_sigma_m(of_pose);
  arrived_sigma_rad = std::sqrt(of_pose(2, 2));
}

}  // namespace mission
