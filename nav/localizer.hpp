// Where the robot is: an error-state Kalman filter over wheel travel, inertial samples, satellite
// fixes and whatever else tells of the pose, with a covariance that can be believed, also after
// minutes at a standstill. Measurements may come late and in any order. Pure: values in, values
// out.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "hal/values.hpp"
#include "nav/localizer_history.hpp"

namespace nav {

std::string_view name(Source source);

// A source whose measurements are refused one after the other.
struct LocalizerFault {
  Source source{};
  int count{};
  double since_s{};  // Robot's clock.
  std::string text;  // What, and what to do.
};

class Localizer {
 public:
  // covariance: of (x m, y m, heading rad) at the start, in W.
  Localizer(const LocalizerConfig& config, const hal::Pose2& start,
            const Eigen::Matrix3d& covariance);

  // Each event takes effect where its stamp belongs, whenever it comes, up to config.history_s
  // late: what came after it is then done again. Same events, same result, in whatever order.
  Correction add(const LocalizerEvent& event);

  // Gyro samples count from the one before; they take effect with the next travel report.
  void predict(const hal::ImuSample& sample);
  // Heading comes from the gyro for the time that its samples cover, from the wheels otherwise.
  // Reports of no travel tell the gyro's bias and add no uncertainty.
  void predict(const hal::WheelTravel& travel) { add(travel); }
  Gate correct(const hal::GnssFix& fix);

  hal::Pose2 pose() const { return history_.filter().pose(); }  // Heading in (-pi, pi].
  // Of (x, y, heading), in W.
  Eigen::Matrix3d covariance() const { return history_.filter().covariance(); }
  Eigen::Isometry3d T_W_B() const { return history_.filter().T_W_B(); }  // With slope.
  // At a stamp within the history; before it the oldest pose known, after it the last speed goes
  // on for at most half a second.
  hal::Pose2 pose_at(hal::Time stamp) const { return history_.pose_at(stamp); }
  double gyro_bias_radps() const { return history_.filter().gyro_bias_radps().z(); }
  bool standing() const { return history_.filter().standing(); }

  std::vector<LocalizerFault> faults() const;

 private:
  LocalizerConfig config_;
  LocalizerHistory history_;
};

// Where something on the body is: T_W_B from the localizer, its mount on the pan axis and the pan
// angle. T_B_P: the pan axis (z) on the body at angle 0; T_P_S: the scanner on the turntable.
Eigen::Isometry3d mounted_pose(const Eigen::Isometry3d& T_W_B, const Eigen::Isometry3d& T_B_P,
                               double pan_rad, const Eigen::Isometry3d& T_P_S);

}  // namespace nav
