#include "nav/obstacle_map.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>

namespace nav {
namespace {

using Eigen::Vector2d;

constexpr double kWayStepM = 0.05;    // Between two places looked at along a way.
constexpr double kNearerShare = 0.2;  // Of a step: what comes nearer by less runs alongside.
constexpr double kStillMps = 1e-3;
constexpr double kZoneCreepMps = 0.04;  // Slower than this would take for ever.

Vector2d towards(double heading_rad) {
  return {std::cos(heading_rad), std::sin(heading_rad)};
}

// Where the robot's centre comes by, kWayStepM apart, from where it is.
using Way = std::vector<Vector2d>;

Way way_along(const Path& path, double progress_m, double horizon_m, const Vector2d& from_m) {
  Way way{from_m};
  double along_m = 0, next_m = progress_m + kWayStepM;
  for (std::size_t i = 1; i < path.points_m.size(); ++i) {
    const Vector2d& a = path.points_m[i - 1];
    const Vector2d piece = path.points_m[i] - a;
    const double length_m = piece.norm();
    for (; next_m <= along_m + length_m && next_m <= progress_m + horizon_m; next_m += kWayStepM)
      way.push_back(a + piece * ((next_m - along_m) / length_m));
    along_m += length_m;
  }
  return way;
}

Way way_of(const hal::Pose2& pose, const hal::Twist& twist, double horizon_m) {
  Way way{pose.position_m};
  const double direction = twist.forward_mps < 0 ? -1 : 1;
  const double curvature = twist.turn_radps / twist.forward_mps;
  hal::Pose2 at = pose;
  for (double s = kWayStepM; s <= horizon_m; s += kWayStepM) {
    const double turn_rad = direction * curvature * kWayStepM;
    at.position_m += direction * kWayStepM * towards(at.heading_rad + turn_rad / 2);
    at.heading_rad += turn_rad;
    way.push_back(at.position_m);
  }
  return way;
}

double length_m(const Path& path) {
  double sum_m = 0;
  for (std::size_t i = 1; i < path.points_m.size(); ++i)
    sum_m += (path.points_m[i] - path.points_m[i - 1]).norm();
  return sum_m;
}

struct Bump {
  double distance_m = std::numeric_limits<double>::infinity();  // Along the way.
  Vector2d W_point_m{0, 0};
};

// Where along the way something comes to touch the robot. A thing that is nearer than `keep`
// already is in the way only where the robot goes on towards it.
Bump first_bump(const ZoneConfig& config, std::span<const Vector2d> obstacles, const Way& way) {
  const double keep_m = config.robot_radius_m + config.keep_m;
  Bump first;
  for (const Vector2d& point : obstacles) {
    double before_m = (point - way.front()).norm();
    if (before_m > keep_m + static_cast<double>(way.size()) * kWayStepM) continue;
    for (std::size_t i = 1; i < way.size(); ++i) {
      const double s = static_cast<double>(i - 1) * kWayStepM;
      if (s >= first.distance_m) break;
      const double there_m = (point - way[i]).norm();
      const bool touches = there_m < keep_m - config.keep_m / 2 && there_m < before_m;
      const bool closes = there_m < keep_m && there_m < before_m - kNearerShare * kWayStepM;
      before_m = there_m;
      if (!touches && !closes) continue;
      first = {s, point};
      break;
    }
  }
  return first;
}

double nearest_beside_m(std::span<const Vector2d> obstacles, const Way& way, double upto_m) {
  double nearest_m = std::numeric_limits<double>::infinity();
  const auto steps = static_cast<std::size_t>(upto_m / kWayStepM) + 1;
  for (const Vector2d& point : obstacles)
    for (std::size_t i = 0; i < std::min(steps, way.size()); i += 2)
      nearest_m = std::min(nearest_m, (point - way[i]).norm());
  return nearest_m;
}

}  // namespace

void ObstacleMap::add(const hal::Profile& profile, const hal::Pose2& W_scanner, hal::Time now) {
  take_out_empty(profile, W_scanner, now);
  auto latest = cells_.end();
  for (std::size_t i = 0; i < profile.ranges_m.size(); ++i) {
    const double range_m = profile.ranges_m[i];
    if (!(range_m >= config_.range_min_m && range_m <= config_.reach_m)) continue;
    const double angle_rad = W_scanner.heading_rad + profile.angle_first_rad +
                             static_cast<double>(i) * profile.angle_step_rad;
    hit(W_scanner.position_m + range_m * towards(angle_rad), W_scanner.position_m, now, latest);
  }
}

// Beams beside each other often end in one cell. Of one profile's returns there the nearest counts:
// it is the one to be touched first.
ObstacleMap::Cell& ObstacleMap::hit(const Vector2d& W_point_m, const Vector2d& W_from_m,
                                    hal::Time now, Cells::iterator& latest) {
  const std::pair<int, int> place(static_cast<int>(std::floor(W_point_m.x() / config_.cell_m)),
                                  static_cast<int>(std::floor(W_point_m.y() / config_.cell_m)));
  if (latest == cells_.end() || latest->first != place) latest = cells_.try_emplace(place).first;
  Cell& cell = latest->second;
  const bool nearer = (W_point_m - W_from_m).norm() < (cell.W_point_m - W_from_m).norm();
  if (cell.hits == 0 || cell.seen != now || nearer) cell.W_point_m = W_point_m;
  cell.hits = std::min(cell.hits + 1, config_.hits_min);
  cell.misses = 0;
  cell.seen = now;
  return cell;
}

// The beam at its middle and those beside it: the edge of something that stands before a cell must
// not take it out.
ObstacleMap::Look ObstacleMap::look_at(const Cell& cell, const hal::Profile& profile,
                                       const hal::Pose2& W_scanner) const {
  const auto beams = static_cast<long>(profile.ranges_m.size());
  const Vector2d to_cell = cell.W_point_m - W_scanner.position_m;
  const double middle_rad = W_scanner.heading_rad + profile.angle_first_rad +
                            static_cast<double>(beams / 2) * profile.angle_step_rad;
  const double off_rad =
      std::remainder(std::atan2(to_cell.y(), to_cell.x()) - middle_rad, 2 * std::numbers::pi);
  const long beam = beams / 2 + std::lround(off_rad / profile.angle_step_rad);
  Look look = Look::passed;
  for (long i = beam - 1; i <= beam + 1; ++i) {
    if (i < 0 || i >= beams) return Look::nothing;
    const double range_m = profile.ranges_m[static_cast<std::size_t>(i)];
    if (range_m == 0)
      look = Look::came_back_from_nowhere;
    else if (!(range_m > to_cell.norm() + config_.see_through_m))
      return Look::nothing;
  }
  return look;
}

// What is black gives nothing back now and then: only many such beams say that a cell is empty.
void ObstacleMap::take_out_empty(const hal::Profile& profile, const hal::Pose2& W_scanner,
                                 hal::Time now) {
  for (auto entry = cells_.begin(); entry != cells_.end();) {
    Cell& cell = entry->second;
    const Look look = look_at(cell, profile, W_scanner);
    const bool empty = look == Look::passed || (look == Look::came_back_from_nowhere &&
                                                ++cell.misses >= config_.misses_max);
    const bool old = hal::seconds(now - cell.seen) > config_.forget_s;
    entry = empty || old ? cells_.erase(entry) : std::next(entry);
  }
}

std::vector<Vector2d> ObstacleMap::points_m() const {
  std::vector<Vector2d> points;
  for (const auto& [_, cell] : cells_)
    if (cell.hits >= config_.hits_min) points.push_back(cell.W_point_m);
  return points;
}

double stopping_speed_mps(const ZoneConfig& config, double distance_m) {
  const double lag_mps = config.brake_max_mps2 * config.reaction_s;
  return std::sqrt(lag_mps * lag_mps + 2 * config.brake_max_mps2 * std::max(0.0, distance_m)) -
         lag_mps;
}

Zones look_ahead(const ZoneConfig& config, std::span<const Vector2d> W_obstacles_m,
                 const Path& path, double progress_m, const hal::Pose2& pose,
                 const hal::Twist& twist) {
  Zones zones;
  const Way way = way_along(path, progress_m, config.horizon_m, pose.position_m);
  const Bump on_path = first_bump(config, W_obstacles_m, way);
  if (on_path.distance_m < length_m(path) - progress_m - config.end_slack_m) {
    zones.W_in_way_m = on_path.W_point_m;
    zones.cap_mps = stopping_speed_mps(config, on_path.distance_m - config.stop_gap_m);
  }
  if (std::abs(twist.forward_mps) > kStillMps) {
    const double v = std::abs(twist.forward_mps);
    const double runs_m =
        config.touch_gap_m + v * config.reaction_s + v * v / (2 * config.brake_max_mps2);
    const Bump on_arc =
        first_bump(config, W_obstacles_m, way_of(pose, twist, runs_m + 2 * kWayStepM));
    const double arc_mps = stopping_speed_mps(config, on_arc.distance_m - config.touch_gap_m);
    if (arc_mps < zones.cap_mps) {
      zones.cap_mps = arc_mps;
      zones.W_in_way_m = on_arc.W_point_m;
    }
  }
  const double beside_m =
      nearest_beside_m(W_obstacles_m, way, 1.0) - config.robot_radius_m - config.keep_m;
  if (beside_m < config.slow_beside_m)
    zones.cap_mps = std::min(zones.cap_mps, config.slow_mps + std::max(0.0, beside_m));
  zones.stop = zones.cap_mps < kZoneCreepMps;
  if (zones.stop) zones.cap_mps = 0;
  return zones;
}

}  // namespace nav
