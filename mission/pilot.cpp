#include "mission/pilot.hpp"

#include <fmt/format.h>

#include <boost/asio/experimental/awaitable_operators.hpp>
#include <numbers>

#include "hal/angles.hpp"
#include "hal/together.hpp"
#include "mission/look.hpp"
#include "nav/polygons.hpp"

namespace mission {
namespace {

constexpr hal::Duration kControlPeriod = std::chrono::milliseconds(50);
constexpr hal::Duration kHaltWait = std::chrono::seconds(2);
constexpr double kObstacleAheadM = 0.35;  // Beyond the bumper, when something was touched.
constexpr double kBackOffM = 0.5;
// How long a drive may not obey: a cable or a restart takes less, a person at an e-stop more.
constexpr hal::Duration kLostPatience = std::chrono::minutes(2);
constexpr hal::Duration kHeldPatience = std::chrono::minutes(10);
constexpr hal::Duration kBlindPatience = std::chrono::seconds(30);
constexpr hal::Duration kBlindAfter = std::chrono::milliseconds(350);  // Without a profile.
// What was closed for now is taken to be open again after so long: it is seen anew if it is there.
constexpr hal::Duration kClosedForNow = std::chrono::minutes(2);
constexpr double kKeepM = 0.04;         // From what it drives past: what profiles are sure of.
constexpr double kSeenSideM = 0.2;      // Square that is closed around a point that was seen,
constexpr double kWallSideM = 0.12;     // the same before a wall of the map,
constexpr double kSeenAroundM = 3.0;    // so far around what is in the way,
constexpr double kKnownWallM = 0.15;    // but not along the walls of the map.
constexpr double kBlindSlackM = 0.1;    // Beyond a scanner's least range: its cells and its noise.
constexpr double kAboveScannerM = 0.1;  // The robot is so much higher than its scanner,
constexpr double kWallsAboveScannerM = 0.7;  // and walls are looked at up to so much above it.
constexpr double kNearEnoughM = 0.25;        // Of a goal that cannot be reached.
constexpr hal::Duration kAskAgain = std::chrono::milliseconds(200);
// Profiles are laid over walls so far apart, or turned by so much; and so far where it stands.
constexpr double kLaidEveryM = 1, kLaidEveryRad = 0.35, kLaidStandingM = 0.2;
// Fixes that claim more tell less than walls do; and so long after the last one.
constexpr double kGoodFixM = 0.15;
constexpr hal::Duration kGnssPoorAfter = std::chrono::seconds(2);

namespace errc = boost::system::errc;

nav::LocalizerConfig localizer_config(const RobotConfig& robot) {
  nav::LocalizerConfig config;
  config.track_m = robot.body.track_m;
  config.slip_sigma = robot.sim.slip_sigma;
  config.gyro_sigma_radps = hal::radians(robot.sim.gyro_sigma_degps);
  return config;
}

// Three times what the way should take, and a minute.
hal::Duration time_allowed(const BodyConfig& body, const nav::Route& route) {
  return hal::from_seconds(60 + 3 * route.length_m / body.speed_max_mps +
                           static_cast<double>(route.points_m.size()) * 2 * std::numbers::pi /
                               hal::radians(body.turn_max_degps));
}

bool is_held(boost::system::error_code why) {
  return why == errc::operation_not_permitted;
}

// Why the drive does not obey, in words; what the devices say of themselves is added.
std::string drive_reason(boost::system::error_code why, hal::Duration waited,
                         const hal::Devices& devices) {
  std::string reason =
      is_held(why) ? "the drive is held by its e-stop, a remote control or a fault of its own"
      : why == errc::not_connected ? "the drive does not answer or is not in command"
                                   : "the drive fails: " + why.message();
  reason += fmt::format(", for {:.0f} s", hal::seconds(waited));
  const std::string said = devices.troubles ? devices.troubles() : "";
  return said.empty() ? reason : reason + " (" + said + ")";
}

}  // namespace

nav::ZoneConfig zone_config(const BodyConfig& body) {
  nav::ZoneConfig config;
  config.robot_radius_m = body.radius_m;
  config.keep_m = kKeepM;
  config.horizon_m = 1.5 + body.speed_max_mps *
                               (config.reaction_s + body.speed_max_mps / 2 / config.brake_max_mps2);
  return config;
}

nav::ObstacleMapConfig obstacle_config(const RobotConfig& robot) {
  nav::ObstacleMapConfig config;
  if (!looks_with_scanner(robot)) return config;
  config.blind_m = robot.scanner.range_min_m + kBlindSlackM;
  config.top_m = robot.scanner.height_m + kAboveScannerM;
  return config;
}

nav::FollowConfig follow_config(const BodyConfig& body) {
  nav::FollowConfig config;
  config.speed_max_mps = body.speed_max_mps;
  config.turn_max_radps = hal::radians(body.turn_max_degps);
  config.robot_radius_m = body.radius_m;
  config.period_s = hal::seconds(kControlPeriod);
  return config;
}

double drive_time_s(const BodyConfig& body, const nav::Route& route, hal::Pose2 from,
                    hal::Pose2 to) {
  const nav::FollowConfig config = follow_config(body);
  const nav::Path path = nav::path_along(route, to.heading_rad);
  const double late_s = hal::seconds(time_allowed(body, route));
  nav::FollowState state;
  double time_s = 0;
  for (; time_s < late_s; time_s += config.period_s) {
    const hal::Twist twist = nav::follow(config, state, path, from);
    if (nav::done(state)) break;
    from.heading_rad += twist.turn_radps * config.period_s;
    from.position_m += twist.forward_mps * config.period_s *
                       Eigen::Vector2d(std::cos(from.heading_rad), std::sin(from.heading_rad));
  }
  return time_s + hal::seconds(kHaltWait);
}

Eigen::Matrix3d Pilot::start_covariance() {
  return Eigen::Vector3d{0.05 * 0.05, 0.05 * 0.05, hal::radians(1) * hal::radians(1)}.asDiagonal();
}

Pilot::Pilot(const RobotConfig& config, hal::Clock& clock, hal::Devices& devices, hal::Pose2 start,
             const Eigen::Matrix3d& covariance)
    : config_(config),
      clock_(clock),
      devices_(devices),
      localizer_(localizer_config(config), start, covariance),
      alone_(localizer_),
      sensors_(clock.now()),
      obstacles_(obstacle_config(config)) {}

hal::Task<void> Pilot::track() {
  using boost::asio::experimental::awaitable_operators::operator&&;
  co_await (track_travel() && track_imu() && track_gnss() && track_obstacles() && track_walls());
}

hal::Task<void> Pilot::track_travel() {
  for (;;) {
    const hal::WheelTravel travel = (co_await devices_.drive.next_travel()).value();
    localizer_.predict(travel);
    alone_.predict(travel);
    travelled_m_ += std::abs(travel.left_m + travel.right_m) / 2;
  }
}

hal::Task<void> Pilot::track_imu() {
  for (;;) {
    const auto sample = co_await devices_.imu.next_sample();
    if (!sample) {  // The wheels tell the turns meanwhile.
      co_await clock_.sleep_for(kAskAgain);
      continue;
    }
    sensors_.heard(SensorLog::Sensor::imu, clock_.now());
    localizer_.predict(*sample);
    alone_.predict(*sample);
  }
}

hal::Task<void> Pilot::track_gnss() {
  for (;;) {
    const auto fix = co_await devices_.gnss.next_fix();
    if (!fix) {
      co_await clock_.sleep_for(kAskAgain);
      continue;
    }
    const nav::Gate gate = localizer_.correct(*fix);
    if (gate != nav::Gate::rejected) {
      alone_.correct(*fix);
      if (fix->sigma_m <= kGoodFixM) told_by_gnss_at_ = clock_.now();
    }
    sensors_.heard(SensorLog::Sensor::gnss, clock_.now());
    sensors_.judged(gate, clock_.now());
  }
}

nav::Correction Pilot::correct(const hal::Pose2& pose, const Eigen::Matrix3d& covariance) {
  return localizer_.add(nav::PoseFix{clock_.now(), pose, covariance});
}

nav::Correction Pilot::correct_by_map(const hal::Pose2& pose, const Eigen::Matrix3d& covariance) {
  alone_.add(nav::PoseFix{clock_.now(), pose, covariance});
  return correct(pose, covariance);
}

hal::Task<void> Pilot::track_obstacles() {
  auto* turning = dynamic_cast<hal::TurnScanner*>(devices_.obstacles);
  if (turning != nullptr && looks_with_scanner(config_)) co_await track_turns(*turning);
  while (devices_.obstacles) {
    const auto profile = co_await devices_.obstacles->next_profile();
    if (!profile) {
      co_await clock_.sleep_for(kAskAgain);
      continue;
    }
    hal::Pose2 looks_from = pose();
    looks_from.position_m +=
        config_.obstacles.offset_x_m *
        Eigen::Vector2d(std::cos(looks_from.heading_rad), std::sin(looks_from.heading_rad));
    looked_at_ = clock_.now();
    obstacles_.add(*profile, looks_from, clock_.now());
    if (walls_) profile_ = std::move(*profile);
  }
}

hal::Task<void> Pilot::track_turns(hal::TurnScanner& scanner) {
  for (;;) {
    auto turn = co_await scanner.next_turn();
    if (!turn) {
      co_await clock_.sleep_for(kAskAgain);
      continue;
    }
    looked_at_ = clock_.now();
    if (walls_) profile_ = hal::level_profile(*turn);
    const hal::Pose2 W_first = localizer_.pose_at(turn->stamp);
    const hal::Pose2 W_last = localizer_.pose_at(turn->last_at());
    obstacles_.add({std::move(*turn), look_height_m(config_), W_first, W_last}, clock_.now());
  }
}

void Pilot::know_walls(hal::Compute& compute, std::shared_ptr<const nav::WallMap> walls) {
  compute_ = &compute;
  walls_ = std::move(walls);
}

hal::Task<void> Pilot::track_walls() {
  while (devices_.obstacles) {
    co_await clock_.sleep_for(kAskAgain);
    if (wants_walls()) co_await lay_over_walls();
  }
}

bool Pilot::has_good_gnss() const {
  return told_by_gnss_at_ && clock_.now() - *told_by_gnss_at_ <= kGnssPoorAfter;
}

// The same place is not asked twice: it would say the same, and count as if it were news.
bool Pilot::wants_walls() const {
  if (!walls_ || !profile_ || has_good_gnss()) return false;
  const double way_m = travelled_m_ - laid_at_m_;
  const double turned_rad = std::abs(hal::wrapped(pose().heading_rad - laid_at_rad_));
  return way_m >= kLaidEveryM || turned_rad >= kLaidEveryRad ||
         (localizer_.standing() && way_m >= kLaidStandingM);
}

// Beside the loop: profiles go on to be looked at for obstacles meanwhile.
hal::Task<void> Pilot::lay_over_walls() {
  nav::MovingProfile seen;
  seen.profile = std::move(*profile_);
  profile_.reset();
  laid_at_m_ = travelled_m_;
  laid_at_rad_ = pose().heading_rad;
  const auto beams = static_cast<double>(seen.profile.ranges_m.size());
  const hal::Time last =
      seen.profile.stamp + hal::from_seconds(std::max(0.0, beams - 1) * seen.profile.beam_period_s);
  seen.T_B_L = {{look_offset_x_m(config_), 0}, 0};
  seen.height_m = look_height_m(config_);
  seen.R_level = Eigen::AngleAxisd(-pose().heading_rad, Eigen::Vector3d::UnitZ()) *
                 localizer_.T_W_B().linear();
  seen.W_first = localizer_.pose_at(seen.profile.stamp);
  seen.W_last = localizer_.pose_at(last);
  nav::ProfileMatchConfig how;
  if (looks_with_scanner(config_)) how.high_m = seen.height_m + kWallsAboveScannerM;
  nav::ProfileMatch found;
  const std::function<void()> lay = [&found, &seen, &how, walls = walls_, sigmas = covariance()] {
    found = nav::match_profile(*walls, seen, sigmas, how);
  };
  co_await compute_->run(lay);
  if (!found.match.good) {
    ++(found.refused ? profiles_.refused : profiles_.unlike);
    co_return;
  }
  const nav::Correction done =
      localizer_.add(nav::PoseFix{last, found.match.pose, found.match.covariance});
  ++(done.gate == nav::Gate::rejected ? profiles_.refused : profiles_.used);
}

hal::Task<LegEnd> Pilot::drive_to(Roads& roads, hal::Pose2 goal) {
  if (closed_for_now_at_ && clock_.now() - *closed_for_now_at_ > kClosedForNow) {
    roads.reopen();
    closed_for_now_at_.reset();
  }
  looked_at_.reset();
  // One that does not start leaves the robot blind: the way ends with that reason.
  if (devices_.obstacles) (void)co_await devices_.obstacles->start();
  if (devices_.obstacles) looks_since_ = clock_.now();
  const double before_m = travelled_m_;
  LegEnd leg = co_await drive_on(roads, goal);
  looks_since_.reset();
  if (devices_.obstacles) (void)co_await devices_.obstacles->stop();
  profile_.reset();
  obstacles_.clear_but_hidden();  // By the next leg the world has moved on.
  leg.driven_m = travelled_m_ - before_m;
  leg.short_of_goal_m = (goal.position_m - pose().position_m).norm();
  if (leg.arrived) leg.reason.clear();
  co_return leg;
}

hal::Task<LegEnd> Pilot::drive_on(Roads& roads, hal::Pose2 goal) {
  LegEnd leg;
  int touched = 0;
  bool reopened = false;
  std::string met;
  for (int tries = 0; tries < kRoutesMax && touched < kTouchesMax && !leg.arrived; ++tries) {
    nav::NoRoute why{};
    const auto route = roads.roadmap().route(pose().position_m, goal.position_m, &why);
    if (!route && !reopened && roads.reopen()) {
      reopened = true;
      continue;
    }
    if (!route) {
      leg.reason = std::string(nav::name(why)) + met;
      break;
    }
    const RouteEnd end = co_await follow_route(*route, goal, leg);
    leg.arrived = end == RouteEnd::arrived || end == RouteEnd::near;
    leg.drive_lost = end == RouteEnd::drive_lost;
    if (leg.drive_lost || end == RouteEnd::blind) break;
    if (end != RouteEnd::touched && end != RouteEnd::in_the_way) continue;  // There, or once more.
    touched += end == RouteEnd::touched;
    ++leg.obstacles_met;
    leg.reason = fmt::format("the way was blocked {} times", leg.obstacles_met);
    const Eigen::Vector2d at_m = end == RouteEnd::touched ? pose().position_m : W_in_way_m_;
    met = fmt::format("; something was in the way at ({:.1f}, {:.1f}) m", at_m.x(), at_m.y());
    if (end == RouteEnd::touched)
      co_await close_touched(roads, leg);
    else
      close_seen(roads, W_in_way_m_);
    if (end == RouteEnd::in_the_way) closed_for_now_at_ = clock_.now();
  }
  co_return leg;
}

hal::Task<void> Pilot::close_touched(Roads& roads, LegEnd& leg) {
  const hal::Pose2 here = pose();
  const Eigen::Vector2d ahead{std::cos(here.heading_rad), std::sin(here.heading_rad)};
  co_await back_off();
  leg.touched_m.emplace_back(here.position_m + (config_.body.radius_m + kObstacleAheadM) * ahead);
  roads.close({leg.touched_m.back()}, kTouchedSideM);
}

// All that is seen around it, so that the new way does not lead along its other end at once. Walls
// of the map count only where one of them is in the way: there the roads run too close to it.
void Pilot::close_seen(Roads& roads, const Eigen::Vector2d& W_in_way_m) const {
  const nav::Polygons& mapped = roads.mapped();
  const auto is_wall = [&](const Eigen::Vector2d& point_m) {
    const nav::PointMm point = nav::to_mm(point_m);
    return !nav::contains(mapped, point) || nav::border_distance_m(mapped, point) <= kKnownWallM;
  };
  const bool before_wall = is_wall(W_in_way_m);
  std::vector<Eigen::Vector2d> seen_m;
  for (const Eigen::Vector2d& point_m : obstacles_.points_m())
    if ((point_m - W_in_way_m).norm() <= kSeenAroundM && (before_wall || !is_wall(point_m)))
      seen_m.push_back(point_m);
  seen_m.push_back(W_in_way_m);
  roads.close_for_now(seen_m, before_wall ? kWallSideM : kSeenSideM);
}

bool Pilot::is_blind() const {
  return devices_.obstacles && (!looked_at_ || clock_.now() - *looked_at_ > kBlindAfter);
}

// `state` is a copy: where the follower would go if nothing were in the way.
nav::Zones Pilot::zones(const nav::FollowConfig& config, nav::FollowState state,
                        const nav::Path& path) const {
  if (!devices_.obstacles) return {};
  if (is_blind()) return {.cap_mps = 0, .stop = true, .W_in_way_m = std::nullopt};
  const hal::Twist wanted = nav::follow(config, state, path, pose());
  return nav::look_ahead(zone_config(config_.body), obstacles_.points_m(), path, state.progress_m,
                         pose(), wanted);
}

// False: what is in the way has been there for too long.
bool Pilot::has_patience(const nav::Zones& zones, Hold& hold, LegEnd& leg) const {
  if (!zones.stop) {
    hold.since.reset();
    return true;
  }
  if (!hold.since) hold.since = clock_.now();
  hold.W_in_way_m = zones.W_in_way_m.value_or(pose().position_m);
  if (!is_blind()) leg.waited_s += hal::seconds(kControlPeriod);
  const hal::Duration patience =
      is_blind() ? kBlindPatience : hal::from_seconds(config_.obstacles.patience_s);
  return clock_.now() - *hold.since <= patience;
}

hal::Task<Pilot::RouteEnd> Pilot::follow_route(const nav::Route& route, hal::Pose2 goal,
                                               LegEnd& leg) {
  const nav::FollowConfig config = follow_config(config_.body);
  const nav::Path path = nav::path_along(route, goal.heading_rad);
  nav::FollowState state;
  Hold hold;
  hal::Time late = clock_.now() + time_allowed(config_.body, route);
  RouteEnd end = RouteEnd::given_up;
  leg.reason = "the robot did not get there in the time allowed";
  while (clock_.now() < late) {
    note_track(leg);
    const nav::Zones seen = zones(config, state, path);
    if (!has_patience(seen, hold, leg)) {
      end = end_of(hold, goal, leg);
      break;
    }
    const hal::Twist twist = nav::follow(config, state, path, pose(), seen.cap_mps);
    if (nav::done(state)) {
      if (state.phase == nav::FollowPhase::arrived) end = RouteEnd::arrived;
      leg.reason = nav::name(state.phase);
      break;
    }
    const hal::Time told_at = clock_.now();
    const auto failed = co_await tell_drive(twist, leg);
    if (failed) {
      end = failed == errc::io_error ? RouteEnd::touched : RouteEnd::drive_lost;
      break;
    }
    late += clock_.now() - told_at;  // What it waited for the drive.
    co_await clock_.sleep_for(kControlPeriod);
  }
  co_await halt();
  co_return end;
}

// A way that ends before something: as good as there, or to be gone round.
Pilot::RouteEnd Pilot::end_of(const Hold& hold, const hal::Pose2& goal, LegEnd& leg) {
  if (is_blind()) {
    leg.reason = "the scanner that looks for obstacles says nothing";
    return RouteEnd::blind;
  }
  W_in_way_m_ = hold.W_in_way_m;
  return (goal.position_m - pose().position_m).norm() <= kNearEnoughM ? RouteEnd::near
                                                                      : RouteEnd::in_the_way;
}

// errc::io_error: the way is blocked. Any other error: the drive did not come back in time, and the
// leg has the reason.
hal::Task<boost::system::error_code> Pilot::tell_drive(hal::Twist twist, LegEnd& leg) {
  const auto told = co_await devices_.drive.command(twist);
  if (told) co_return boost::system::error_code{};
  if (told.error() == errc::io_error) co_return told.error();
  // It stands for want of a look ahead: how long it does so here is not the drive's matter.
  if (told.error() == errc::resource_unavailable_try_again) co_return boost::system::error_code{};
  co_return co_await wait_for_drive(told.error(), leg);
}

// Until it obeys again, standing. What holds it may change on the way: each has its own patience.
hal::Task<boost::system::error_code> Pilot::wait_for_drive(boost::system::error_code why,
                                                           LegEnd& leg) {
  const hal::Time began = clock_.now();
  for (;;) {
    const hal::Duration waited = clock_.now() - began;
    if (waited >= (is_held(why) ? kHeldPatience : kLostPatience)) {
      leg.reason = drive_reason(why, waited, devices_);
      co_return why;
    }
    co_await clock_.sleep_for(kAskAgain);
    const auto told = co_await devices_.drive.command({});
    if (told || told.error() == errc::resource_unavailable_try_again)
      co_return boost::system::error_code{};
    why = told.error();
  }
}

// Stops, and waits until the robot stands still. A drive that does not hear this stops by itself.
hal::Task<void> Pilot::halt() {
  (void)co_await devices_.drive.command({});
  co_await clock_.sleep_for(kHaltWait);
}

// A drive that is held may let a command wait for as long as it is.
hal::Task<void> Pilot::abandon() {
  looks_since_.reset();
  co_await hal::first_of(halt(), clock_.sleep_for(kHaltWait));
  if (devices_.obstacles) (void)co_await devices_.obstacles->stop();
  profile_.reset();
  obstacles_.clear_but_hidden();
}

hal::Task<void> Pilot::back_off() {
  const double until_m = travelled_m_ + kBackOffM;
  const hal::Time late = clock_.now() + std::chrono::seconds(5);
  while (travelled_m_ < until_m && clock_.now() < late) {
    if (!co_await devices_.drive.command({.forward_mps = -0.2, .turn_radps = 0})) break;
    co_await clock_.sleep_for(kControlPeriod);
  }
  co_await halt();
}

void Pilot::note_track(LegEnd& leg) const {
  const Eigen::Vector2d here_m = pose().position_m;
  if (leg.track_m.empty() || (leg.track_m.back() - here_m).norm() >= 1.0)
    leg.track_m.push_back(here_m);
}

}  // namespace mission
