#include "nav/profile_match.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "hal/angles.hpp"
#include "nav/linear.hpp"
#include "nav/moving.hpp"

namespace nav {
ScanMatchConfig ProfileMatchConfig::driving() {
  ScanMatchConfig config;
  config.searches = false;
  config.steps_max = 25;
  config.reach_start_m = 1.0;
  config.noise_start_m = 0.4;
  config.beams_min = 40;
  return config;
}

std::vector<Eigen::Vector2d> level_points(const MovingProfile& seen,
                                          const ProfileMatchConfig& config) {
  const hal::Profile& profile = seen.profile;
  const std::size_t beams = profile.ranges_m.size();
  const std::size_t every = std::max<std::size_t>(
      1, (beams + config.beams_max - 1) / std::max<std::size_t>(1, config.beams_max));
  const Eigen::Isometry2d T_last_W = placed(seen.W_last).inverse(), T_B_L = placed(seen.T_B_L);
  std::vector<Eigen::Vector2d> points;
  for (std::size_t i = 0; i < beams; i += every) {
    const double range_m = profile.ranges_m[i];
    if (!(range_m >= config.near_m && range_m <= config.far_m)) continue;
    const double angle_rad =
        profile.angle_first_rad + static_cast<double>(i) * profile.angle_step_rad;
    const Eigen::Vector2d B_point =
        T_B_L * Eigen::Vector2d(range_m * std::cos(angle_rad), range_m * std::sin(angle_rad));
    const Eigen::Vector3d level = seen.R_level * Eigen::Vector3d(B_point.x(), B_point.y(), 0);
    const double above_m = seen.height_m + level.z();
    if (above_m < config.low_m || above_m > config.high_m) continue;
    points.emplace_back(T_last_W * on_the_way(seen.W_first, seen.W_last, share_of_turn(i, beams)) *
                        Eigen::Vector2d(level.head<2>()));
  }
  return points;
}

ProfileMatch match_profile(const WallMap& walls, const MovingProfile& seen,
                           const Eigen::Matrix3d& covariance, const ProfileMatchConfig& config) {
  ProfileMatch found{match_scan(walls, level_points(seen, config), seen.W_last, config.match)};
  ScanMatch& match = found.match;
  if (!match.good) return found;
  const Eigen::Vector3d map_sigmas(config.match.map_sigma_m, config.match.map_sigma_m,
                                   config.match.map_sigma_rad);
  match.covariance.diagonal() += (config.profiles_alike - 1) * map_sigmas.cwiseAbs2();
  Eigen::Vector3d off;
  off << match.pose.position_m - seen.W_last.position_m,
      hal::wrapped(match.pose.heading_rad - seen.W_last.heading_rad);
  const Axes<3> axes = axes_of(Eigen::Matrix3d(match.covariance + covariance));
  const double chi2 = (axes.vectors.transpose() * off).cwiseAbs2().cwiseQuotient(axes.values).sum();
  if (chi2 <= config.gate_chi2) return found;
  match.good = false;
  found.refused = true;
  match.reason = fmt::format("its walls are {:.2f} m and {:.1f} deg beside where the robot can be",
                             off.head<2>().norm(), hal::degrees(std::abs(off.z())));
  return found;
}

}  // namespace nav
