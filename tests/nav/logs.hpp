// Logs that other people recorded: their files, and what the localizer made of them.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>

#include "hal/values.hpp"

namespace recorded {

inline std::filesystem::path folder(const std::string& log) {
  return std::filesystem::path(VANTAGE_SOURCE_DIR) / "../shared/data/logs" / log;
}
#define LOG_OR_SKIP(name) \
  if (!std::filesystem::exists(recorded::folder(name))) GTEST_SKIP() << "no log " << (name)

inline hal::Time at(double time_s, double first_s) {
  return hal::Time{} + hal::from_seconds(time_s - first_s);
}

struct Score {
  double squares{}, nees{}, worst_m{};
  int count{};
  void add(const Eigen::Vector2d& error_m, double one_nees) {
    squares += error_m.squaredNorm();
    worst_m = std::max(worst_m, error_m.norm());
    nees += one_nees;
    ++count;
  }
  double rms_m() const { return std::sqrt(squares / count); }
  double nees_mean() const { return nees / count; }
};

inline hal::WheelTravel travel_of(hal::Time stamp, double way_m, double turn_rad, double track_m) {
  return {stamp, way_m - turn_rad * track_m / 2, way_m + turn_rad * track_m / 2};
}

inline void step_by(hal::Pose2& pose, double way_m, double turn_rad) {
  const double along = pose.heading_rad + turn_rad / 2;
  pose.position_m += way_m * Eigen::Vector2d(std::cos(along), std::sin(along));
  pose.heading_rad += turn_rad;
}

}  // namespace recorded
