#include "nav/registration/rigid.hpp"

#include <cmath>

namespace nav {

Eigen::Matrix3d rotation_of(const Eigen::Vector3d& rotation_rad) {
  const double angle_rad = rotation_rad.norm();
  if (angle_rad < 1e-12) return Eigen::Matrix3d::Identity() + cross_matrix(rotation_rad);
  return Eigen::AngleAxisd(angle_rad, rotation_rad / angle_rad).toRotationMatrix();
}

Eigen::Vector3d rotation_vector(const Eigen::Matrix3d& R) {
  const Eigen::Quaterniond q(R);
  const double sine = q.vec().norm();
  if (sine < 1e-12) return 2 * q.vec() * (q.w() < 0 ? -1 : 1);
  return 2 * std::atan2(q.w() < 0 ? -sine : sine, std::abs(q.w())) / sine * q.vec();
}

Eigen::Isometry3d moved(const Eigen::Isometry3d& pose, const Vector6d& motion) {
  Eigen::Isometry3d result;
  result.linear() =
      Eigen::Quaterniond(rotation_of(motion.tail<3>()) * pose.linear()).normalized().matrix();
  result.translation() = pose.translation() + motion.head<3>();
  return result;
}

Vector6d motion_between(const Eigen::Isometry3d& from, const Eigen::Isometry3d& to) {
  Vector6d motion;
  motion << to.translation() - from.translation(),
      rotation_vector(to.linear() * from.linear().transpose());
  return motion;
}

}  // namespace nav
