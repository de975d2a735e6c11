// Angles, as everybody means them.
#pragma once

#include <cmath>
#include <numbers>

namespace hal {

// 3 * kDeg is three degrees in radians.
inline constexpr double kDeg = std::numbers::pi / 180;

constexpr double radians(double angle_deg) {
  return angle_deg * std::numbers::pi / 180;
}
constexpr double degrees(double angle_rad) {
  return angle_rad * 180 / std::numbers::pi;
}

// The same direction in [-pi, pi].
inline double wrapped(double angle_rad) {
  return std::remainder(angle_rad, 2 * std::numbers::pi);
}

}  // namespace hal
