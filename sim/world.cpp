#include "sim/world.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "hal/angles.hpp"

namespace sim {
namespace {

// Noise sources; new ones get new numbers, so that the others stay as they are.
enum Source : std::uint64_t {
  kSlipLeft = 1,
  kSlipRight,
  kGyro,
  kGyroBias,
  kGnssWhite,
  kGnssX,
  kGnssY
};

constexpr double kStandstill_mps = 2e-3;  // Static friction: slower than this is not moving.
constexpr double kGroundLook_m = 0.1;     // Between two looks at the ground under the rim.
constexpr double kLookAhead_m = 1.0;
constexpr double kGroundReach_m = 1.0;
constexpr double kScrape = 0.25;  // A turn on the spot may rub along something.
constexpr int kRimPoints = 8;

const double kTick_s = hal::seconds(World::kTick);

boost::system::error_code failed(boost::system::errc::errc_t code) {
  return boost::system::errc::make_error_code(code);
}

}  // namespace

Eigen::Isometry3d StandingPose::T_W_S(double scanner_height_m) const {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() << pose.position_m, ground_z_m + scanner_height_m;
  T.linear() = Eigen::AngleAxisd(pose.heading_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  return T;
}

World::World(const Scene& scene, const WorldConfig& config)
    : scene_(scene),
      config_(config),
      left_{0, 0, {config.seed, kSlipLeft, config.slip_sigma, config.slip_length_m}, 0, 0},
      right_{0, 0, {config.seed, kSlipRight, config.slip_sigma, config.slip_length_m}, 0, 0},
      gyro_(config.seed, kGyro),
      gyro_bias_radps_(NoiseStream(config.seed, kGyroBias).normal(config.gyro_bias_sigma_radps)),
      gnss_white_(config.seed, kGnssWhite),
      gnss_wander_x_(config.seed, kGnssX, config.gnss_sigma_m * std::sqrt(config.gnss_wander_share),
                     config.gnss_wander_s),
      gnss_wander_y_(config.seed, kGnssY, config.gnss_sigma_m * std::sqrt(config.gnss_wander_share),
                     config.gnss_wander_s) {
  robot_.ground_z_m = config.ground_z_m;
  for (const Person& person : config.people) people_.emplace_back(person);
}

// What wheels stand on: the highest surface that is a step up or down at most.
std::optional<double> World::ground_within_step(const Eigen::Vector2d& W_point, double z_m) const {
  const double step_m = config_.step_max_m;
  const auto hit = scene_.cast({W_point.x(), W_point.y(), z_m + step_m}, -Eigen::Vector3d::UnitZ(),
                               0, 2 * step_m);
  return hit ? std::optional(z_m + step_m - hit->distance_m) : std::nullopt;
}

hal::Result<StandingPose> World::standing(const hal::Pose2& pose, double expected_ground_z_m,
                                          double radius_m) const {
  if (!pose.position_m.allFinite() || !std::isfinite(pose.heading_rad))
    return failed(boost::system::errc::invalid_argument);
  // The surface nearest to the expected height, not the roof of a shed; then what lies on it.
  const Eigen::Vector3d above(pose.position_m.x(), pose.position_m.y(),
                              expected_ground_z_m + kGroundReach_m);
  std::optional<double> base_m;
  for (const double z_m : scene_.heights_below(above, 2 * kGroundReach_m))
    if (!base_m || std::abs(z_m - expected_ground_z_m) < std::abs(*base_m - expected_ground_z_m))
      base_m = z_m;
  const auto ground_m = base_m ? ground_within_step(pose.position_m, *base_m) : std::nullopt;
  if (!ground_m) return failed(boost::system::errc::address_not_available);
  const double clear_m = scene_.clearance_m(pose.position_m, *ground_m + config_.step_max_m,
                                            *ground_m + config_.collision_height_m, radius_m);
  if (clear_m < radius_m) return failed(boost::system::errc::address_not_available);
  return StandingPose{pose, *ground_m};
}

hal::Result<void> World::put_robot(const hal::Pose2& pose, double expected_ground_z_m) {
  const auto at = standing(pose, expected_ground_z_m, config_.radius_m);
  if (!at) return at.error();
  robot_ = *at;
  for (Walker& walker : people_) walker.make_room(pose.position_m, config_.radius_m);
  left_.target_mps = left_.speed_mps = right_.target_mps = right_.speed_mps = 0;
  clear_m_ = ground_checked_m_ = 0;
  blocked_direction_ = 0;
  return {};
}

hal::Result<void> World::command(const hal::Twist& twist) {
  if (!std::isfinite(twist.forward_mps) || !std::isfinite(twist.turn_radps))
    return failed(boost::system::errc::invalid_argument);
  const bool pushes = blocked_direction_ * twist.forward_mps > 0 && !free_ahead(twist.forward_mps);
  const double turn_radps =
      std::clamp(twist.turn_radps, -config_.turn_max_radps, config_.turn_max_radps);
  const double rim_mps = turn_radps * config_.track_m / 2;
  const double left_mps = pushes ? 0 : twist.forward_mps - rim_mps;
  const double right_mps = pushes ? 0 : twist.forward_mps + rim_mps;
  // Both sides slow down alike, so that the path keeps its curvature.
  const double fastest_mps = std::max(std::abs(left_mps), std::abs(right_mps));
  const double scale = std::min(1.0, config_.speed_max_mps / std::max(fastest_mps, 1e-9));
  left_.target_mps = left_mps * scale;
  right_.target_mps = right_mps * scale;
  command_expires_ = ticks_ + std::lround(config_.command_expiry_s / kTick_s);
  if (left_.target_mps != 0 || right_.target_mps != 0) placed_scanner_.reset();
  if (pushes) return failed(boost::system::errc::io_error);
  return {};
}

void World::advance(hal::Time now) {
  const std::int64_t until = now.time_since_epoch() / kTick;
  while (ticks_ < until) {
    const bool still = !moving() && left_.target_mps == 0 && right_.target_mps == 0;
    if (still && people_.empty()) {  // Nothing happens until somebody commands something.
      ticks_ = until;
      yaw_rate_radps_ = 0;
    } else {
      ++ticks_;
      tick();
      walk();
    }
  }
}

void World::tick() {
  if (ticks_ > command_expires_) left_.target_mps = right_.target_mps = 0;
  const double left_m = roll(left_);
  const double right_m = roll(right_);
  const double before_rad = robot_.pose.heading_rad;
  move(left_m, right_m);
  yaw_rate_radps_ = hal::wrapped(robot_.pose.heading_rad - before_rad) / kTick_s;
}

void World::walk() {
  for (Walker& walker : people_)
    walker.walk(kTick_s, robot_.pose.position_m, config_.radius_m, moving());
}

bool World::runs_into_person(const Eigen::Vector2d& to) const {
  return std::ranges::any_of(people_, [&](const Walker& walker) {
    const double touching_m = config_.radius_m + walker.person().radius_m;
    const double now_m = (walker.position_m() - robot_.pose.position_m).norm();
    return (walker.position_m() - to).norm() < std::min(touching_m, now_m);
  });
}

double World::range_to_people_m(const Eigen::Vector3d& W_from,
                                const Eigen::Vector3d& W_direction) const {
  double nearest_m{};
  ranges_to_people_m(W_from, {&W_direction, 1}, {&nearest_m, 1});
  return nearest_m;
}

void World::ranges_to_people_m(const Eigen::Vector3d& W_from,
                               std::span<const Eigen::Vector3d> W_directions,
                               std::span<double> ranges_m) const {
  std::ranges::fill(ranges_m, std::numeric_limits<double>::infinity());
  const Eigen::Vector3d above_ground = W_from - config_.ground_z_m * Eigen::Vector3d::UnitZ();
  for (const Walker& walker : people_) walker.shorten(above_ground, W_directions, ranges_m);
}

double World::roll(Side& side) {
  side.speed_mps += (side.target_mps - side.speed_mps) * (1 - std::exp(-kTick_s / config_.lag_s));
  if (side.target_mps == 0 && std::abs(side.speed_mps) < kStandstill_mps) side.speed_mps = 0;
  const double rolled_m = side.speed_mps * kTick_s;
  side.rolled_m += rolled_m;
  return rolled_m * (1 + side.slip.step(std::abs(rolled_m)));
}

void World::move(double left_m, double right_m) {
  const double forward_m = (left_m + right_m) / 2;
  const double turn_rad = (right_m - left_m) / config_.track_m;
  // The chord of the arc that both sides roll.
  const double chord_m =
      std::abs(turn_rad) < 1e-9 ? forward_m : forward_m * std::sin(turn_rad / 2) / (turn_rad / 2);
  const double course_rad = robot_.pose.heading_rad + turn_rad / 2;
  StandingPose to = robot_;
  to.pose.position_m += chord_m * Eigen::Vector2d(std::cos(course_rad), std::sin(course_rad));
  to.pose.heading_rad = hal::wrapped(to.pose.heading_rad + turn_rad);
  clear_m_ -= std::abs(chord_m);
  ground_checked_m_ += std::abs(chord_m);
  if (ground_checked_m_ >= kGroundLook_m)
    if (const auto ground_m = ground_within_step(to.pose.position_m, to.ground_z_m))
      to.ground_z_m = *ground_m;
  if (chord_m != 0 && blocked(to)) {
    robot_.pose.heading_rad = to.pose.heading_rad;
    clear_m_ = 0;
    if (std::abs(chord_m) < kScrape * std::abs(turn_rad) * config_.track_m) return;
    blocked_direction_ = chord_m > 0 ? 1 : -1;
    return stop_against_something();
  }
  if (chord_m != 0 && blocked_direction_ * chord_m <= 0) blocked_direction_ = 0;
  driven_m_ += std::abs(chord_m);
  robot_ = to;
}

bool World::blocked(const StandingPose& to) {
  if (runs_into_person(to.pose.position_m)) return true;
  if (clear_m_ <= 0) {
    const double radius_m = config_.radius_m;
    clear_m_ =
        scene_.clearance_m(to.pose.position_m, to.ground_z_m + config_.step_max_m,
                           to.ground_z_m + config_.collision_height_m, radius_m + kLookAhead_m) -
        radius_m;
    if (clear_m_ < 0) return true;
  }
  if (ground_checked_m_ < kGroundLook_m) return false;
  if (ground_breaks_off(to)) return true;
  ground_checked_m_ = 0;
  return false;
}

// A moat's edge under the centre or the rim. A slope within the step over the radius is ground.
bool World::ground_breaks_off(const StandingPose& at) const {
  if (!ground_within_step(at.pose.position_m, at.ground_z_m)) return true;
  for (int i = 0; i < kRimPoints; ++i) {
    const double angle_rad = 2 * std::numbers::pi * i / kRimPoints;
    const Eigen::Vector2d rim =
        at.pose.position_m +
        config_.radius_m * Eigen::Vector2d(std::cos(angle_rad), std::sin(angle_rad));
    if (!ground_within_step(rim, at.ground_z_m)) return true;
  }
  return false;
}

void World::stop_against_something() {
  ++collisions_;
  left_.target_mps = left_.speed_mps = right_.target_mps = right_.speed_mps = 0;
}

// Whether the robot, after a contact and perhaps a turn, could move a little this way.
bool World::free_ahead(double forward_mps) const {
  constexpr double kProbe_m = 0.05;
  StandingPose ahead = robot_;
  ahead.pose.position_m +=
      std::copysign(kProbe_m, forward_mps) *
      Eigen::Vector2d(std::cos(robot_.pose.heading_rad), std::sin(robot_.pose.heading_rad));
  const double clear_m =
      scene_.clearance_m(ahead.pose.position_m, ahead.ground_z_m + config_.step_max_m,
                         ahead.ground_z_m + config_.collision_height_m, config_.radius_m);
  return clear_m >= config_.radius_m && !ground_breaks_off(ahead) &&
         !runs_into_person(ahead.pose.position_m);
}

hal::Twist World::rolling() const {
  return {(left_.speed_mps + right_.speed_mps) / 2,
          (right_.speed_mps - left_.speed_mps) / config_.track_m};
}

hal::WheelTravel World::take_travel() {
  const auto take = [this](Side& side) {
    const double ticks =
        std::floor((side.rolled_m - side.reported_m) / config_.encoder_tick_m + 0.5);
    const double travel_m = ticks * config_.encoder_tick_m;
    side.reported_m += travel_m;  // What was rounded off stays for the next report.
    return travel_m;
  };
  return {hal::Time(ticks_ * kTick), take(left_), take(right_)};
}

hal::ImuSample World::sample_imu() {
  return {hal::Time(ticks_ * kTick),
          yaw_rate_radps_ + gyro_bias_radps_ + gyro_.normal(config_.gyro_sigma_radps)};
}

hal::GnssFix World::sample_gnss() {
  const double elapsed_s = static_cast<double>(ticks_ - gnss_tick_) * kTick_s;
  gnss_tick_ = ticks_;
  const double white_m = config_.gnss_sigma_m * std::sqrt(1 - config_.gnss_wander_share);
  const double x_m = gnss_wander_x_.step(elapsed_s) + gnss_white_.normal(white_m);
  const double y_m = gnss_wander_y_.step(elapsed_s) + gnss_white_.normal(white_m);
  return {hal::Time(ticks_ * kTick), robot_.pose.position_m + Eigen::Vector2d(x_m, y_m),
          config_.gnss_sigma_m};
}

// Even and odd crossings of a line to the east.
bool World::gnss_hidden() const {
  const Eigen::Vector2d& at = robot_.pose.position_m;
  bool inside = false;
  for (const auto& outline : config_.gnss_outages)
    for (std::size_t i = 0; i < outline.size(); ++i) {
      const Eigen::Vector2d &a = outline[i], &b = outline[(i + 1) % outline.size()];
      if ((a.y() > at.y()) == (b.y() > at.y())) continue;
      const double x_m = a.x() + (at.y() - a.y()) / (b.y() - a.y()) * (b.x() - a.x());
      if (x_m > at.x()) inside = !inside;
    }
  return inside;
}

}  // namespace sim
