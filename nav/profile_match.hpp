// Where a robot is while it drives, by one profile of the scanner that looks level ahead, laid over
// the walls that are known. Pure.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "hal/values.hpp"
#include "nav/scan_match.hpp"

namespace nav {

// A profile, and how the body went while it was measured.
struct MovingProfile {
  hal::Profile profile;
  hal::Pose2 T_B_L;                                       // The scanner on the body,
  double height_m{};                                      // so far above the ground.
  Eigen::Matrix3d R_level = Eigen::Matrix3d::Identity();  // Slope: to level, from the body.
  hal::Pose2 W_first, W_last;  // The body as believed at the first and at the last beam.
};

struct ProfileMatchConfig {
  double near_m = 0.1, far_m = 30;
  double low_m = 0.1, high_m = 1.0;  // What ends lower is ground, what ends higher another wall.
  std::size_t beams_max = 360;       // Evenly thinned.
  // Walls are off by the same for some metres of way, and a profile is laid over them every metre:
  // what the map itself may be off by counts for so many profiles.
  double profiles_alike = 5;
  double gate_chi2 = 16.3;  // 99.9 % for three numbers.
  ScanMatchConfig match = driving();

  // From the guess alone: while it drives a robot is not lost, and looking about takes time.
  static ScanMatchConfig driving();
};

// Ends of beams in the body's frame as it stood at the last one, level.
std::vector<Eigen::Vector2d> level_points(const MovingProfile& seen,
                                          const ProfileMatchConfig& config = {});

// The body at the last beam, guessed to be at W_last with that covariance (x m, y m, heading rad).
// `good` is false where the walls are others, and where they are elsewhere than it can be (then
// `refused` too). Directions that the walls leave free have a large covariance.
struct ProfileMatch {
  ScanMatch match;
  bool refused{};
};
ProfileMatch match_profile(const WallMap& walls, const MovingProfile& seen,
                           const Eigen::Matrix3d& covariance,
                           const ProfileMatchConfig& config = {});

}  // namespace nav
