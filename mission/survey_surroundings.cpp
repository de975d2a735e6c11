// What the gate learns from a survey: whether the robot knows where it is, and how fast it may be
// there.
#include <cmath>
#include <limits>

#include "hal/angles.hpp"
#include "mission/survey.hpp"
#include "nav/polygons.hpp"

namespace mission {
namespace {

// The believed pose may be that far outside of what the robot can drive on.
constexpr double kOutsideMaxM = 0.5;
constexpr double kLookAgainM = 0.05;

// Along the worse axis.
double sigma_m(const Eigen::Matrix3d& covariance) {
  const double mean = (covariance(0, 0) + covariance(1, 1)) / 2;
  const double half = (covariance(0, 0) - covariance(1, 1)) / 2;
  return std::sqrt(mean + std::hypot(half, covariance(0, 1)));
}

double speed_max_mps(const nav::Polygons& drivable, const Eigen::Vector2d& at_m) {
  const nav::PointMm at = nav::to_mm(at_m);
  const bool known =
      nav::contains(drivable, at) || nav::border_distance_m(drivable, at) <= kOutsideMaxM;
  return known ? std::numeric_limits<double>::infinity() : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace

Surroundings Survey::surroundings() {
  Surroundings is;
  if (tasks_.start_area < 0) return is;
  const Eigen::Matrix3d covariance = pilot_.covariance();
  // Not a number is uncertain, too.
  const bool certain = sigma_m(covariance) <= config_.localize.sigma_max_m &&
                       std::sqrt(covariance(2, 2)) <= kHeadingSigmaMaxRad;
  is.pose_uncertain = !certain;
  is.battery_reserve = battery_low_ || goes_home_for_disk();
  is.range_at = pilot_.range_at();
  const Eigen::Vector2d at_m = pilot_.pose().position_m;
  if (!zone_speed_mps_ || !((at_m - zone_at_m_).norm() <= kLookAgainM)) {
    zone_speed_mps_ = at_m.allFinite() ? speed_max_mps(task(tasks_.start_area).area.drivable, at_m)
                                       : std::numeric_limits<double>::quiet_NaN();
    zone_at_m_ = at_m;
  }
  is.zone_speed_max_mps = *zone_speed_mps_;
  return is;
}

}  // namespace mission
