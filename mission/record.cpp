#include "mission/record.hpp"

#include <cmath>

#include "nav/linear.hpp"

namespace mission {

void ScanRecord::claim(const Eigen::Matrix3d& of_pose) {
  covariance = of_pose;
  sigma_position_m =
      std::sqrt(nav::axes_of(Eigen::Matrix2d(of_pose.topLeftCorner<2, 2>())).values[1]);
  sigma_heading_rad = std::sqrt(of_pose(2, 2));
}

}  // namespace mission
