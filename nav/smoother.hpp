// Where the robot was, with all of a log at hand: the localizer's filter forward, and what it
// learnt later brought back to each pose. Pure: values in, values out.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <span>
#include <vector>

#include "hal/values.hpp"
#include "nav/localizer_filter.hpp"

namespace nav {

// In W; the heading in (-pi, pi].
struct SmoothedPose {
  hal::Time stamp{};
  hal::Pose2 pose;
  Eigen::Matrix3d covariance;  // Of (x m, y m, heading rad).
  Eigen::Isometry3d T_W_B;     // With slope and height above the start.
};

// What became of one event on the way forward.
struct Taken {
  Gate gate = Gate::rejected;
  double nis{};  // Squared normalised innovation, where it was gated.
  int dimension{};
};

struct SmoothedLog {
  std::vector<SmoothedPose> poses;  // One for each travel report that was taken, in order.
  std::vector<Taken> taken;         // One for each event, as they were given.
  LocalizerFilter last;             // At the end of the log, as the localizer would have it.
};

// Events in any order. covariance: of (x m, y m, heading rad) at the start, in W. Refused
// measurements count as little as they do for the localizer. Needs some 50 bytes of memory an
// event beside events and poses.
SmoothedLog smooth(const LocalizerConfig& config, const hal::Pose2& start,
                   const Eigen::Matrix3d& covariance, std::span<const LocalizerEvent> events);

}  // namespace nav
