// Where the robot is: an extended Kalman filter over wheel travel, gyro and satellite fixes whose
// covariance can be believed, also after minutes at a standstill. Pure: values in, values out.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "hal/values.hpp"

namespace nav {

// One-sigma values of the devices.
struct LocalizerConfig {
  double track_m = 0.6;      // Between left and right wheels.
  double slip_sigma = 0.02;  // Of the travel of each side; wanders over slip_length_m.
  double slip_length_m = 5.0;
  double side_slip_sigma = 0.005;         // Sideways, metres per square root of a metre driven.
  double gyro_sigma_radps = 0.00087;      // White noise of one sample (0.05 deg/s).
  double gyro_bias_sigma_radps = 0.0017;  // What the bias may be at the start (0.1 deg/s).
  double gyro_bias_walk = 1.0e-6;         // Drift of the bias, rad/s per square root of a second.
  // Of the variance that a fix claims, this share is an error that wanders over gnss_wander_s
  // seconds (atmosphere, multipath); the rest is white. Averaging removes only the white part.
  double gnss_wander_share = 0.5;
  double gnss_wander_s = 60.0;
  // A fix is refused when its squared normalised innovation exceeds this (chi-square, 2 degrees of
  // freedom, 99.9 %).
  double gate_chi2 = 13.8;
  // When fixes that agree with each other were refused for this long and this far, the filter is
  // taken to be the one that is lost. Both must hold: no jump moves a robot that stands.
  double lost_after_s = 20.0;
  double lost_after_m = 10.0;
};

// What became of a fix.
enum class Gate {
  accepted,
  rejected,  // Outlier, older than the last, not finite, sigma below 0: the pose did not change.
  reset      // Accepted after widening the covariance: the filter had been lost.
};

class Localizer {
 public:
  // covariance: of (x m, y m, heading rad) at the start, in W.
  Localizer(const LocalizerConfig& config, const hal::Pose2& start,
            const Eigen::Matrix3d& covariance);

  // Gyro samples count from the one before; they take effect with the next travel report.
  void predict(const hal::ImuSample& sample);
  // Heading comes from the gyro for the time that its samples cover, from the wheels otherwise.
  // Reports of no travel tell the gyro's bias and add no uncertainty.
  void predict(const hal::WheelTravel& travel);
  Gate correct(const hal::GnssFix& fix);

  hal::Pose2 pose() const;             // Heading in (-pi, pi].
  Eigen::Matrix3d covariance() const;  // Of (x, y, heading), in W.
  double gyro_bias_radps() const { return state_[kBias]; }
  bool standing() const { return still_s_ >= kStandingAfter_s; }

 private:
  // x, y, heading, gyro bias, slip of each side (share of its travel), and the wandering error of
  // the fixes in units of its own sigma.
  enum { kX, kY, kHeading, kBias, kSlipLeft, kSlipRight, kWanderX, kWanderY, kSize };
  using State = Eigen::Matrix<double, kSize, 1>;
  using RowState = Eigen::Matrix<double, 1, kSize>;
  using Matrix = Eigen::Matrix<double, kSize, kSize>;

  static constexpr double kStandingAfter_s = 0.5;

  // Gyro samples since the last travel report.
  struct Turn {
    double angle_rad{};
    double span_s{};
    double variance{};  // Of angle_rad, from white noise.
  };
  // Refused fixes in a row that agree with each other.
  struct Streak {
    hal::Time first{};
    Eigen::Vector2d position_m{0, 0};
    double odometer_m{};  // Where the last one came.
    double first_odometer_m{};
  };

  bool stands(const hal::WheelTravel& travel, const Turn& turn, double span_s);
  void learn_bias(const Turn& turn);
  void move(const hal::WheelTravel& travel, const Turn& turn, double by_wheels);
  void forget_slip(int side, double travel_m);
  void wander(hal::Time now);
  bool lost(const hal::GnssFix& fix);
  void update(const Eigen::Matrix<double, 2, kSize>& H, const Eigen::Vector2d& innovation,
              const Eigen::Matrix2d& S, double white_variance);

  LocalizerConfig config_;
  State state_ = State::Zero();
  Matrix covariance_ = Matrix::Zero();
  Turn turn_;
  std::optional<hal::Time> imu_time_;
  std::optional<hal::Time> travel_time_;
  std::optional<hal::Time> fix_time_;
  std::optional<Streak> streak_;
  double speed_mps_{};   // Of the last travel report.
  double odometer_m_{};  // All travel, forward or backward.
  double still_s_{};
};

}  // namespace nav
