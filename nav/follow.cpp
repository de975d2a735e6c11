#include "nav/follow.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "hal/angles.hpp"

namespace nav {
namespace {

using Eigen::Vector2d;

constexpr double kTurnGain = 2.0;       // 1/s, of heading errors turned away in place.
constexpr double kTurnMinRadps = 0.04;  // Slower than this, wheels only shudder.
constexpr double kTurnDoneRad = 0.05;   // In-place turns towards a leg end here ...
constexpr double kTurnAgainRad = 1.0;   // ... and begin again here.
constexpr double kCreepMps = 0.03;      // Slowest approach to the end of a leg.
constexpr double kApproachGain = 1.5;   // 1/s, of the distance to the end of a leg.
constexpr double kCornerReachedM = 0.04;
constexpr double kGoalReachedM = 0.012;
constexpr double kProjectionWindowM = 0.6;
constexpr double kProgressMinM = 0.01;
constexpr double kCorrectionProgressMinM = 0.003;

double bearing_rad(const Vector2d& along) {
  return std::atan2(along.y(), along.x());
}

// The path without pieces of no length, measured.
class Line {
 public:
  explicit Line(const Path& path) {
    for (std::size_t i = 0; i < path.points_m.size(); ++i) {
      const double step_m = i == 0 ? 0 : (path.points_m[i] - path.points_m[i - 1]).norm();
      if (i > 0 && step_m < 1e-9) continue;
      const double infinite = std::numeric_limits<double>::infinity();
      if (i > 0)
        clearance_m_.push_back(path.clearance_m.empty() ? infinite : path.clearance_m[i - 1]);
      along_m_.push_back(along_m_.empty() ? 0 : along_m_.back() + step_m);
      points_m_.push_back(path.points_m[i]);
    }
  }

  int last() const { return static_cast<int>(points_m_.size()) - 1; }
  const Vector2d& point(int vertex) const { return points_m_[static_cast<std::size_t>(vertex)]; }
  double along_m(int vertex) const { return along_m_[static_cast<std::size_t>(vertex)]; }
  double clearance_m(int piece) const { return clearance_m_[static_cast<std::size_t>(piece)]; }
  Vector2d direction(int piece) const { return (point(piece + 1) - point(piece)).normalized(); }

  // The piece that holds the place `at_m` along the line.
  int piece_at(double at_m) const {
    const auto next = std::upper_bound(along_m_.begin() + 1, along_m_.end() - 1, at_m);
    return static_cast<int>(next - along_m_.begin()) - 1;
  }

  // Where the leg that begins at a vertex ends: at the next sharp corner, or at the goal.
  int leg_end(int from, double corner_min_rad) const {
    int vertex = from + 1;
    for (; vertex < last(); ++vertex)
      if (std::abs(hal::wrapped(bearing_rad(direction(vertex)) -
                                bearing_rad(direction(vertex - 1)))) > corner_min_rad)
        break;
    return vertex;
  }

  // The place nearest to p between two places along the line.
  double nearest_m(const Vector2d& p, double from_m, double to_m) const {
    double best_m = from_m;
    double best_distance_m = std::numeric_limits<double>::infinity();
    for (int piece = piece_at(from_m); piece < last() && along_m(piece) <= to_m; ++piece) {
      const double raw_m = along_m(piece) + direction(piece).dot(p - point(piece));
      const double lowest_m = std::max(from_m, along_m(piece));
      const double highest_m = std::max(lowest_m, std::min(to_m, along_m(piece + 1)));
      const double at_m = std::clamp(raw_m, lowest_m, highest_m);
      const double distance_m = (place(at_m, last()) - p).norm();
      if (distance_m >= best_distance_m) continue;
      best_distance_m = distance_m;
      best_m = at_m;
    }
    return best_m;
  }

  // The point at_m along the line; beyond the end vertex straight on.
  Vector2d place(double at_m, int end) const {
    const int piece = std::min(piece_at(at_m), end - 1);
    return point(piece) + direction(piece) * (at_m - along_m(piece));
  }

 private:
  std::vector<Vector2d> points_m_;
  std::vector<double> along_m_;
  std::vector<double> clearance_m_;
};

class Step {
 public:
  Step(const FollowConfig& config, FollowState& state, const Path& path, const hal::Pose2& pose,
       double cap_mps)
      : config_(config), state_(state), path_(path), pose_(pose), cap_mps_(cap_mps), line_(path) {}

  hal::Twist run() {
    if (done(state_)) return stop();
    state_.goal_distance_m = goal_distance_m();
    state_.goal_heading_off_rad = std::abs(heading_off_rad());
    if (state_.leg < 0) begin_leg(0);
    hal::Twist twist;
    switch (state_.phase) {
      case FollowPhase::turning:
      case FollowPhase::driving:
        twist = along_leg();
        break;
      case FollowPhase::correcting:
        twist = correct();
        break;
      default:
        twist = align();
        break;
    }
    watch();
    if (done(state_)) return stop();
    twist = limited(twist);
    state_.speed_mps = twist.forward_mps;
    state_.turn_radps = twist.turn_radps;
    return twist;
  }

 private:
  hal::Twist stop() {
    state_.speed_mps = state_.turn_radps = 0;
    return {};
  }

  // The forward speed that comes nearest to what is wanted and can be had one period from the last.
  double reachable_mps(double wanted_mps) const {
    const double capped_mps = std::clamp(wanted_mps, -cap_mps_, cap_mps_);
    const double v = state_.speed_mps;
    const double faster_mps = config_.accel_max_mps2 * config_.period_s;
    const double slower_mps = config_.brake_max_mps2 * config_.period_s;
    return std::clamp(capped_mps, v > 0 ? v - slower_mps : v - faster_mps,
                      v < 0 ? v + slower_mps : v + faster_mps);
  }

  hal::Twist limited(const hal::Twist& wanted) const {
    const double most_radps = config_.turn_accel_max_radps2 * config_.period_s;
    const double w = state_.turn_radps;
    return {reachable_mps(wanted.forward_mps),
            std::clamp(wanted.turn_radps, w - most_radps, w + most_radps)};
  }

  double heading_off_rad() const {
    return path_.final_heading_rad ? hal::wrapped(*path_.final_heading_rad - pose_.heading_rad) : 0;
  }

  double goal_distance_m() const { return (line_.point(line_.last()) - pose_.position_m).norm(); }

  void enter(FollowPhase phase) {
    state_.phase = phase;
    state_.arrived = phase == FollowPhase::arrived;
    if (phase == FollowPhase::turning || phase == FollowPhase::driving) return;
    state_.ticks_stalled = 0;
    state_.progress_mark = phase == FollowPhase::correcting ? goal_distance_m() : 0;
  }

  void begin_leg(int vertex) {
    state_.leg = vertex;
    if (vertex >= line_.last()) return at_goal();
    state_.progress_m = std::max(state_.progress_m, line_.along_m(vertex));
    enter(FollowPhase::turning);
  }

  void at_goal() {
    const bool near = goal_distance_m() <= config_.position_tolerance_m * 0.8;
    if (near || state_.corrections >= config_.corrections_max) return enter(FollowPhase::aligning);
    ++state_.corrections;
    enter(FollowPhase::correcting);
  }

  hal::Twist along_leg() {
    if (state_.leg >= line_.last()) return {};
    const int end = line_.leg_end(state_.leg, config_.corner_min_rad);
    const double end_m = line_.along_m(end);
    const double window_m = std::min(end_m, state_.progress_m + kProjectionWindowM);
    state_.progress_m = line_.nearest_m(pose_.position_m, state_.progress_m, window_m);
    state_.cross_track_m = (line_.place(state_.progress_m, end) - pose_.position_m).norm();
    state_.remaining_m = line_.along_m(line_.last()) - state_.progress_m;
    const double rest_m = end_m - state_.progress_m;
    if (state_.cross_track_m > config_.off_path_max_m) {
      enter(FollowPhase::off_path);
      return {};
    }
    if (rest_m <= (end == line_.last() ? kGoalReachedM : kCornerReachedM)) {
      begin_leg(end);
      return {};
    }
    return pursue(end, rest_m);
  }

  // Regulated pure pursuit of a point ahead on the leg; beyond its end straight on, so that the
  // robot arrives along the leg instead of twisting about its last point.
  hal::Twist pursue(int end, double rest_m) {
    const double ahead_m =
        std::max(config_.lookahead_min_m, config_.lookahead_s * std::abs(state_.speed_mps));
    const Vector2d to_target = line_.place(state_.progress_m + ahead_m, end) - pose_.position_m;
    const double off_rad = hal::wrapped(bearing_rad(to_target) - pose_.heading_rad);
    const bool turning = state_.phase == FollowPhase::turning;
    if (std::abs(off_rad) > (turning ? kTurnDoneRad : kTurnAgainRad)) {
      enter(FollowPhase::turning);
      return turn(off_rad);
    }
    enter(FollowPhase::driving);
    const double curvature = 2 * std::sin(off_rad) / std::max(to_target.norm(), 0.1);
    const double speed_mps = reachable_mps(regulated_mps(std::abs(curvature), rest_m));
    const double most_radps = config_.turn_max_radps;
    return {speed_mps, std::clamp(speed_mps * curvature, -most_radps, most_radps)};
  }

  double regulated_mps(double curvature, double rest_m) const {
    double speed_mps = config_.speed_max_mps;
    if (curvature > 1e-6) {
      speed_mps = std::min(speed_mps, std::sqrt(config_.lateral_max_mps2 / curvature));
      speed_mps = std::min(speed_mps, config_.turn_max_radps / curvature);
    }
    speed_mps = std::min(speed_mps, clearance_mps());
    speed_mps = std::max(speed_mps, std::min(config_.crawl_mps, config_.speed_max_mps));
    speed_mps = std::min(speed_mps, braking_mps(0, rest_m));
    speed_mps = std::min(speed_mps, std::max(kCreepMps, kApproachGain * rest_m));
    return std::min(speed_mps, state_.speed_mps + config_.accel_max_mps2 * config_.period_s);
  }

  // The speed from which the robot can brake to to_mps within the distance, one period from now.
  double braking_mps(double to_mps, double distance_m) const {
    const double a = config_.accel_max_mps2;
    const double lag = a * config_.period_s;
    return std::max(
        kCreepMps,
        std::sqrt(lag * lag + to_mps * to_mps + 2 * a * std::max(0.0, distance_m)) - lag);
  }

  // Slower in narrow places, and in time before them.
  double clearance_mps() const {
    const double full_mps = config_.speed_max_mps;
    const double sight_m = full_mps * full_mps / (2 * config_.accel_max_mps2) + 0.1;
    double speed_mps = full_mps;
    for (int piece = line_.piece_at(state_.progress_m); piece < line_.last(); ++piece) {
      const double ahead_m = line_.along_m(piece) - state_.progress_m;
      if (ahead_m > sight_m) break;
      const double room_m = line_.clearance_m(piece) - config_.robot_radius_m;
      const double share = std::clamp(room_m / config_.clearance_full_m, 0.0, 1.0);
      const double there_mps = config_.crawl_mps + share * (full_mps - config_.crawl_mps);
      speed_mps = std::min(speed_mps, braking_mps(std::max(0.0, there_mps), ahead_m));
    }
    return speed_mps;
  }

  // In place; brakes first.
  hal::Twist turn(double off_rad) const {
    const double brake_mps = config_.brake_max_mps2 * config_.period_s;
    const double v = state_.speed_mps;
    if (std::abs(v) > brake_mps) return {v > 0 ? v - brake_mps : v + brake_mps, 0};
    const double gain = std::min(kTurnGain, 0.5 / config_.period_s);
    const double least = std::min(kTurnMinRadps, std::abs(off_rad) / config_.period_s);
    const double rate = std::min(config_.turn_max_radps, std::max(least, gain * std::abs(off_rad)));
    return {0, off_rad > 0 ? rate : -rate};
  }

  // Turns to the goal, or its back to it if that is less, and creeps there.
  hal::Twist correct() {
    const double distance_m = goal_distance_m();
    if (distance_m <= config_.position_tolerance_m * 0.6) {
      enter(FollowPhase::aligning);
      return {};
    }
    const Vector2d to_goal = line_.point(line_.last()) - pose_.position_m;
    double off_rad = hal::wrapped(bearing_rad(to_goal) - pose_.heading_rad);
    const bool backwards = std::abs(off_rad) > std::numbers::pi / 2;
    if (backwards) off_rad = hal::wrapped(off_rad + std::numbers::pi);
    if (std::abs(off_rad) > 0.25) return turn(off_rad);
    const double speed_mps = std::min({config_.crawl_mps, config_.speed_max_mps, distance_m});
    const double rate =
        std::clamp(kTurnGain * off_rad, -config_.turn_max_radps, config_.turn_max_radps);
    return {backwards ? -speed_mps : speed_mps, rate};
  }

  hal::Twist align() {
    const double off_rad = heading_off_rad();
    if (std::abs(off_rad) > config_.heading_tolerance_rad * 0.6) return turn(off_rad);
    state_.in_tolerance = goal_distance_m() <= config_.position_tolerance_m;
    if (!state_.in_tolerance && state_.corrections < config_.corrections_max) {
      at_goal();
      if (state_.phase == FollowPhase::correcting) return {};
    }
    enter(FollowPhase::arrived);
    state_.remaining_m = 0;
    return {};
  }

  // Gives up when nothing gets better for long. A correction that does not get better is left as
  // it is: the robot stands as near as it can.
  void watch() {
    if (done(state_)) return;
    if (cap_mps_ < config_.crawl_mps && state_.phase != FollowPhase::aligning) return;  // Held.
    bool better = false;
    if (state_.phase == FollowPhase::correcting) {
      better = goal_distance_m() < state_.progress_mark - kCorrectionProgressMinM;
      if (better) state_.progress_mark = goal_distance_m();
    } else if (state_.phase != FollowPhase::aligning) {
      better = state_.progress_m > state_.progress_mark + kProgressMinM;
      if (better) state_.progress_mark = state_.progress_m;
    }
    state_.ticks_stalled = better ? 0 : state_.ticks_stalled + 1;
    const double turn_round_s = 2 * std::numbers::pi / config_.turn_max_radps;
    if (state_.ticks_stalled * config_.period_s < config_.stalled_max_s + turn_round_s) return;
    if (state_.phase != FollowPhase::correcting) return enter(FollowPhase::stalled);
    state_.corrections = config_.corrections_max;
    enter(FollowPhase::aligning);
  }

  const FollowConfig& config_;
  FollowState& state_;
  const Path& path_;
  const hal::Pose2& pose_;
  const double cap_mps_;
  const Line line_;
};

}  // namespace

std::string_view name(FollowPhase phase) {
  switch (phase) {
    case FollowPhase::turning:
      return "turning";
    case FollowPhase::driving:
      return "driving";
    case FollowPhase::correcting:
      return "correcting";
    case FollowPhase::aligning:
      return "aligning";
    case FollowPhase::arrived:
      return "arrived";
    case FollowPhase::off_path:
      return "off the path";
    case FollowPhase::stalled:
      return "stalled";
  }
  return "unknown";
}

Path path_along(const Route& route, std::optional<double> final_heading_rad) {
  return {route.points_m, route.clearance_m, final_heading_rad};
}

hal::Twist follow(const FollowConfig& config, FollowState& state, const Path& path,
                  const hal::Pose2& pose, double cap_mps) {
  return Step(config, state, path, pose, cap_mps).run();
}

hal::Twist follow(const FollowConfig& config, FollowState& state, const Route& route,
                  const hal::Pose2& goal, const hal::Pose2& pose) {
  return follow(config, state, path_along(route, goal.heading_rad), pose);
}

}  // namespace nav
