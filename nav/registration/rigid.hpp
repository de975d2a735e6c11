// Small motions of rigid poses. A motion is (translation m, rotation vector rad), and moving a pose
// by it turns the pose about its own origin: R' = exp(rotation) R, t' = t + translation, all in the
// axes of the frame that the pose maps to. Covariances of poses are covariances of such motions.
#pragma once

#include <Eigen/Geometry>

namespace nav {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

inline Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

Eigen::Matrix3d rotation_of(const Eigen::Vector3d& rotation_rad);
// The rotation vector of R, at most pi long.
Eigen::Vector3d rotation_vector(const Eigen::Matrix3d& R);
Eigen::Isometry3d moved(const Eigen::Isometry3d& pose, const Vector6d& motion);
// The motion that takes `from` to `to`.
Vector6d motion_between(const Eigen::Isometry3d& from, const Eigen::Isometry3d& to);

}  // namespace nav
