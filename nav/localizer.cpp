#include "nav/localizer.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <utility>

namespace nav {
namespace {

std::string_view remedy(Source source) {
  switch (source) {
    case Source::gnss_position:
      return "expect multipath near high walls; if it lasts in the open, check the antenna's mount "
             "and the site's anchor";
    case Source::gnss_velocity:
      return "check the wheels for slip and the antenna's mount";
    case Source::pose_fix:
      return "check the map against the site, or the scanner's mount";
    case Source::landmark:
      return "check the marks' positions and names";
    case Source::beacon:
      break;
  }
  return "check the beacons' positions, and for walls in between";
}

}  // namespace

std::string_view name(Source source) {
  switch (source) {
    case Source::gnss_position:
      return "satellite positions";
    case Source::gnss_velocity:
      return "satellite velocities";
    case Source::pose_fix:
      return "poses from scans";
    case Source::landmark:
      return "landmarks";
    case Source::beacon:
      break;
  }
  return "beacon ranges";
}

Localizer::Localizer(const LocalizerConfig& config, const hal::Pose2& start,
                     const Eigen::Matrix3d& covariance)
    : config_(config), history_(config, start, covariance) {}

void Localizer::predict(const hal::ImuSample& sample) {
  add(InertialSample{sample.stamp, {0, 0, sample.yaw_rate_radps}, {}});
}

Gate Localizer::correct(const hal::GnssFix& fix) {
  if (!(fix.sigma_m >= 0)) return Gate::rejected;
  return add(GnssPosition{fix.stamp, fix.position_m,
                          fix.sigma_m * fix.sigma_m * Eigen::Matrix2d::Identity()})
      .gate;
}

Correction Localizer::add(const LocalizerEvent& event) {
  return history_.add(event);
}

std::vector<LocalizerFault> Localizer::faults() const {
  std::vector<LocalizerFault> faults;
  for (std::size_t i = 0; i < kSources; ++i) {
    const auto source = static_cast<Source>(i);
    const RefusalStreak& streak = history_.filter().refusals(source);
    if (streak.count < config_.streak_fault ||
        hal::seconds(streak.last - streak.first) < config_.streak_fault_s)
      continue;
    faults.push_back({source, streak.count, hal::seconds(streak.first),
                      fmt::format("{} {} in a row disagree with the localizer and were refused: {}",
                                  streak.count, name(source), remedy(source))});
  }
  return faults;
}

Eigen::Isometry3d mounted_pose(const Eigen::Isometry3d& T_W_B, const Eigen::Isometry3d& T_B_P,
                               double pan_rad, const Eigen::Isometry3d& T_P_S) {
  return T_W_B * T_B_P * Eigen::AngleAxisd(pan_rad, Eigen::Vector3d::UnitZ()) * T_P_S;
}

}  // namespace nav
