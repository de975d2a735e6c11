#include "sim/witnessed_scanner.hpp"

#include <cmath>
#include <numbers>

namespace sim {
namespace {

using boost::system::errc::make_error_code;

constexpr double kMoved_m = 0.005;
constexpr double kTurned_rad = 0.001;

bool has_moved(const hal::Pose2& a, const hal::Pose2& b) {
  return (a.position_m - b.position_m).norm() > kMoved_m ||
         std::abs(std::remainder(a.heading_rad - b.heading_rad, 2 * std::numbers::pi)) >
             kTurned_rad;
}

}  // namespace

hal::Task<hal::Result<hal::ScanCloud>> WitnessedScanner::scan() {
  world_.advance(clock_.now());
  if (world_.moving()) co_return make_error_code(boost::system::errc::device_or_resource_busy);
  const bool by_hand = world_.placed_scanner().has_value();
  const StandingPose robot = world_.robot();
  const StandingPose at = by_hand ? *world_.placed_scanner() : robot;
  auto cloud = co_await scanner_.scan();
  if (!cloud) co_return cloud.error();
  world_.advance(clock_.now());
  if (has_moved(robot.pose, world_.robot().pose) || by_hand != world_.placed_scanner().has_value())
    co_return make_error_code(boost::system::errc::device_or_resource_busy);
  world_.record_scan({cloud->stamp, at, by_hand});
  co_return cloud;
}

}  // namespace sim
