// Where a body was while a scanner on it turned once.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>

#include "hal/angles.hpp"
#include "hal/values.hpp"

namespace nav {

inline Eigen::Isometry2d placed(const hal::Pose2& pose) {
  return Eigen::Translation2d(pose.position_m) * Eigen::Rotation2Dd(pose.heading_rad);
}

// Of the way from one pose to the other, `share` of it.
inline Eigen::Isometry2d on_the_way(const hal::Pose2& from, const hal::Pose2& to, double share) {
  const double turn_rad = hal::wrapped(to.heading_rad - from.heading_rad);
  return Eigen::Translation2d(from.position_m + share * (to.position_m - from.position_m)) *
         Eigen::Rotation2Dd(from.heading_rad + share * turn_rad);
}

// When beam i of a turn's is measured, from 0 at the first to 1 at the last.
inline double share_of_turn(std::size_t i, std::size_t beams) {
  return static_cast<double>(i) / static_cast<double>(std::max<std::size_t>(2, beams) - 1);
}

}  // namespace nav
