#include "sim/placement.hpp"

#include <cmath>
#include <numbers>

namespace sim {
namespace {

using boost::system::errc::make_error_code;

enum Source : std::uint64_t { kPlacementOffset = 101, kPlacementSurvey };

}  // namespace

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
