#include "sim/devices.hpp"

#include <cmath>
#include <numbers>

namespace sim {
namespace {

using boost::system::errc::make_error_code;

enum Source : std::uint64_t { kPlacementOffset = 101, kPlacementSurvey };

constexpr hal::Duration kTravelPeriod = std::chrono::milliseconds(20);
constexpr hal::Duration kImuPeriod = std::chrono::milliseconds(20);
constexpr hal::Duration kGnssPeriod = std::chrono::milliseconds(200);
constexpr double kMoved_m = 0.005;
constexpr double kTurned_rad = 0.001;

hal::Time next_multiple(hal::Time now, hal::Duration period) {
  return hal::Time((now.time_since_epoch() / period + 1) * period);
}

bool has_moved(const hal::Pose2& a, const hal::Pose2& b) {
  return (a.position_m - b.position_m).norm() > kMoved_m ||
         std::abs(std::remainder(a.heading_rad - b.heading_rad, 2 * std::numbers::pi)) >
             kTurned_rad;
}

}  // namespace

hal::Task<hal::Result<void>> SimDrive::command(hal::Twist twist) {
  world_.advance(clock_.now());
  co_return world_.command(twist);
}

hal::Task<hal::Result<hal::WheelTravel>> SimDrive::next_travel() {
  co_await clock_.sleep_until(next_multiple(clock_.now(), kTravelPeriod));
  world_.advance(clock_.now());
  co_return world_.take_travel();
}

hal::Task<hal::Result<hal::ImuSample>> SimImu::next_sample() {
  co_await clock_.sleep_until(next_multiple(clock_.now(), kImuPeriod));
  world_.advance(clock_.now());
  co_return world_.sample_imu();
}

hal::Task<hal::Result<hal::GnssFix>> SimGnss::next_fix() {
  co_await clock_.sleep_until(next_multiple(clock_.now(), kGnssPeriod));
  world_.advance(clock_.now());
  co_return world_.sample_gnss();
}

hal::Task<hal::Result<hal::ScanCloud>> SimScanner::scan() {
  const WorldConfig& config = world_.config();
  world_.advance(clock_.now());
  if (world_.moving()) co_return make_error_code(boost::system::errc::device_or_resource_busy);
  const bool by_hand = world_.placed_scanner().has_value();
  const StandingPose at = by_hand ? *world_.placed_scanner() : world_.robot();
  const StandingPose robot = world_.robot();
  co_await clock_.sleep_for(hal::from_seconds(config.scanner.scan_s));
  world_.advance(clock_.now());
  if (has_moved(robot.pose, world_.robot().pose) || by_hand != world_.placed_scanner().has_value())
    co_return make_error_code(boost::system::errc::device_or_resource_busy);
  hal::ScanCloud cloud{clock_.now(), pattern_, {}};
  cloud.ranges_m =
      cast_scan(world_.scene(), at.T_W_S(config.scanner.height_m), pattern_, config.scanner,
                config.seed, world_.next_scan_number(), config.threads);
  world_.record_scan({cloud.stamp, at, by_hand});
  co_return cloud;
}

SimPlacement::SimPlacement(World& world, hal::Clock& clock)
    : world_(world),
      clock_(clock),
      offset_(world.config().seed, kPlacementOffset),
      survey_(world.config().seed, kPlacementSurvey) {}

hal::Task<hal::Result<hal::SurveyedPose>> SimPlacement::place(std::string_view region,
                                                              hal::Pose2 wanted) {
  const std::string name(region);  // The caller's text may be gone after the wait.
  co_await clock_.sleep_for(hal::from_seconds(world_.config().placement_s));
  world_.advance(clock_.now());
  co_return set_up(name, wanted);
}

hal::Result<hal::SurveyedPose> SimPlacement::set_up(const std::string& region,
                                                    const hal::Pose2& wanted) {
  const WorldConfig& config = world_.config();
  const auto known = config.region_ground_z_m.find(region);
  if (known == config.region_ground_z_m.end() && !config.region_ground_z_m.empty())
    return make_error_code(boost::system::errc::invalid_argument);
  const double expected_m =
      known == config.region_ground_z_m.end() ? config.ground_z_m : known->second;
  auto at = world_.standing(wanted, expected_m, config.tripod_radius_m);
  if (!at) return at.error();
  const auto nudged = [&](hal::Pose2 pose, NoiseStream& noise, double sigma_m, double sigma_rad) {
    pose.position_m.x() += noise.normal(sigma_m);
    pose.position_m.y() += noise.normal(sigma_m);
    pose.heading_rad =
        std::remainder(pose.heading_rad + noise.normal(sigma_rad), 2 * std::numbers::pi);
    return pose;
  };
  const hal::Pose2 rough = nudged(wanted, offset_, config.placement_offset_sigma_m,
                                  config.placement_offset_heading_sigma_rad);
  // Between tight walls a person sets it down exactly.
  if (const auto there = world_.standing(rough, at->ground_z_m, config.tripod_radius_m)) at = there;
  world_.place_scanner(*at);
  return hal::SurveyedPose{
      nudged(at->pose, survey_, config.placement_sigma_m, config.placement_heading_sigma_rad),
      at->ground_z_m, config.placement_sigma_m, config.placement_heading_sigma_rad};
}

}  // namespace sim
