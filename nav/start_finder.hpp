// Where the robot starts, when nobody has surveyed it: from satellite fixes while it drives. The
// shape of the way, told by wheels and gyro, is laid over the fixes.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "nav/localizer_filter.hpp"

namespace nav {

struct StartFinderConfig {
  double reach_min_m = 10;  // Between the two fixes farthest apart.
  std::size_t fixes_min = 10;
  std::size_t fixes_max = 400;          // Then every other one is dropped.
  double heading_sigma_max_rad = 0.05;  // Not better: drive on.
  double drift_share = 0.02;            // What wheels and gyro may bend the way, of its length.
};

struct FoundStart {
  hal::Time stamp{};
  hal::Pose2 pose;             // Now, in W.
  Eigen::Matrix3d covariance;  // Of (x m, y m, heading rad).
  std::size_t fixes_refused{};
};

class StartFinder {
 public:
  StartFinder(const LocalizerConfig& localizer, const StartFinderConfig& config);

  // In the order of their stamps. What is no such event is passed over.
  void add(const LocalizerEvent& event);

  // Nothing until it is sure; waiting_for() then says what is missing.
  std::optional<FoundStart> found() const;
  std::string waiting_for() const;

 private:
  struct Sight {
    Eigen::Vector2d O_antenna_m, W_fix_m;
    double sigma_m, way_m;
  };

  std::optional<FoundStart> fit(std::string& missing) const;

  LocalizerConfig localizer_;
  StartFinderConfig config_;
  LocalizerFilter odometry_;  // In O: where the robot stood at first.
  std::vector<Sight> sights_;
  double way_m_{};
  std::size_t keep_every_ = 1, seen_ = 0;
};

}  // namespace nav
