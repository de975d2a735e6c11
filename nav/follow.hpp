// Drives along a path: regulated pure pursuit, in-place turns at sharp corners, a slow final
// approach.
#pragma once

#include <limits>
#include <optional>
#include <string_view>
#include <vector>

#include "hal/values.hpp"
#include "nav/roadmap.hpp"

namespace nav {

// A path to follow, in W.
struct Path {
  std::vector<Eigen::Vector2d> points_m;    // At least one; the last is the goal.
  std::vector<double> clearance_m;          // Of each piece; empty: room everywhere.
  std::optional<double> final_heading_rad;  // Empty: any.
};

// The route as a path that ends in the goal's heading.
Path path_along(const Route& route, std::optional<double> final_heading_rad);

struct FollowConfig {
  double period_s = 0.05;  // Between two calls.
  double speed_max_mps = 1.0;
  double turn_max_radps = 0.785;
  double accel_max_mps2 = 0.5;  // Speeding up, and braking where it is foreseen.
  double brake_max_mps2 = 1.0;  // Braking at all.
  double turn_accel_max_radps2 = 2.0;
  double lateral_max_mps2 = 0.4;  // In curves.
  double robot_radius_m = 0.5;
  double clearance_full_m = 0.3;  // Beyond the radius: from here on full speed, at none a crawl.
  double crawl_mps = 0.15;        // Slowest speed that regulation alone asks for.
  double lookahead_min_m = 0.35;
  double lookahead_s = 0.6;            // Look-ahead grows with speed.
  double corner_min_rad = 0.6;         // Sharper corners are turned in place.
  double position_tolerance_m = 0.05;  // At the goal.
  double heading_tolerance_rad = 0.0175;
  double off_path_max_m = 1.0;  // Farther from the path than this: gives up.
  double stalled_max_s = 15.0;  // Without progress for so long: gives up.
  int corrections_max = 4;      // Of the last centimetres; then where it stands has to do.
};

enum class FollowPhase {
  turning,     // In place, towards the next leg of the path.
  driving,     // Along a leg.
  correcting,  // The goal was missed by more than the tolerance: turns to it and creeps there.
  aligning,    // In place, to the final heading.
  arrived,     // Done; the twist is zero from now on.
  off_path,    // Gave up: too far from the path. The twist is zero from now on.
  stalled      // Gave up: no progress. The twist is zero from now on.
};
std::string_view name(FollowPhase phase);

// Where the following of one path stands. Start each path with a fresh one.
struct FollowState {
  FollowPhase phase = FollowPhase::turning;
  bool arrived{};          // phase == arrived.
  bool in_tolerance{};     // Arrived within the position tolerance, not only as near as it could.
  double progress_m{};     // Along the path; never falls.
  double remaining_m{};    // Along the path.
  double cross_track_m{};  // Distance from the path.
  double speed_mps{};      // Commanded last.
  double turn_radps{};     // The same.
  // How far pose and goal are apart; once arrived, how near the robot came to it.
  double goal_distance_m{};
  double goal_heading_off_rad{};  // Never negative; 0 where any heading will do.

  // For follow() only.
  int leg{-1};  // First vertex of the present leg; legs meet in sharp corners.
  int corrections{};
  int ticks_stalled{};
  double progress_mark{};  // Beaten by a margin, it shows that the robot still gets on.
};

inline bool done(const FollowState& state) {
  return state.phase == FollowPhase::arrived || state.phase == FollowPhase::off_path ||
         state.phase == FollowPhase::stalled;
}

// One control step: what to command for one period. |forward| <= speed_max and |turn| <= turn_max;
// backwards only at a crawl, to correct the last centimetres. From step to step neither changes by
// more than the config allows in a period, but that the twist is zero at once when it is done.
//
// Somebody who watches for obstacles sets `cap_mps`, the fastest forwards or backwards: the robot
// brakes to it. As long as it is held so, it does not count as stalled.
hal::Twist follow(const FollowConfig& config, FollowState& state, const Path& path,
                  const hal::Pose2& pose, double cap_mps = std::numeric_limits<double>::infinity());
// The same along a route, to the goal's heading.
hal::Twist follow(const FollowConfig& config, FollowState& state, const Route& route,
                  const hal::Pose2& goal, const hal::Pose2& pose);

}  // namespace nav
