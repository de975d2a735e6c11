// What the localizer can learn from, beyond the values of hal. All positions in W, all stamps of
// the robot's clock: when it was measured, not when it arrived.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <variant>

#include "hal/values.hpp"

namespace nav {

// All axes of an inertial sensor, in the body's frame (x forward, y left, z up).
struct InertialSample {
  hal::Time stamp{};
  Eigen::Vector3d rate_radps{0, 0, 0};
  // What an accelerometer shows: at rest (0, 0, 9.81) on level ground.
  std::optional<Eigen::Vector3d> specific_force_mps2 = {};
};

// Of the antenna. The covariance is the receiver's own claim.
struct GnssPosition {
  hal::Time stamp{};
  Eigen::Vector2d position_m{0, 0};
  Eigen::Matrix2d covariance_m2 = Eigen::Matrix2d::Identity();
};
struct GnssVelocity {
  hal::Time stamp{};
  Eigen::Vector2d velocity_mps{0, 0};
  double sigma_mps{};  // Per axis.
};

// A whole pose from elsewhere: a registered scan, a scan matched to the map.
struct PoseFix {
  hal::Time stamp{};
  hal::Pose2 pose;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity();  // Of (x m, y m, heading rad).
};

// A known point seen from the body's origin: bearing counter-clockwise from straight ahead.
struct LandmarkSighting {
  hal::Time stamp{};
  Eigen::Vector2d landmark_m{0, 0};
  double range_m{}, bearing_rad{};
  double range_sigma_m{}, bearing_sigma_rad{};
};

// The distance of the body's origin from a known point.
struct BeaconRange {
  hal::Time stamp{};
  Eigen::Vector2d beacon_m{0, 0};
  double range_m{}, sigma_m{};
};

// Events of one stamp take effect in this order.
using LocalizerEvent = std::variant<InertialSample, hal::WheelTravel, GnssPosition, GnssVelocity,
                                    PoseFix, LandmarkSighting, BeaconRange>;

// Whether it is held against the filter and may be refused as an outlier.
inline bool gated(const LocalizerEvent& event) {
  return !std::holds_alternative<InertialSample>(event) &&
         !std::holds_alternative<hal::WheelTravel>(event);
}

inline hal::Time stamp_of(const LocalizerEvent& event) {
  return std::visit([](const auto& one) { return one.stamp; }, event);
}

}  // namespace nav
