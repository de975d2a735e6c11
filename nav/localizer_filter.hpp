// The localizer's filter for events in their order: an error-state Kalman filter. A plain value, so
// that it can be kept and gone back to.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

#include "nav/error_covariance.hpp"
#include "nav/localizer_inputs.hpp"

namespace nav {

// One-sigma values of the devices.
struct LocalizerConfig {
  double track_m = 0.6;      // Between left and right wheels.
  double slip_sigma = 0.02;  // Of the travel of each side; wanders over slip_length_m.
  double slip_length_m = 5.0;
  double side_slip_sigma = 0.005;         // Sideways, metres per square root of a metre driven.
  double travel_sigma_m = 0.001;          // Per square root of a metre: encoder ticks, bumps.
  double wheel_turn_error = 0.05;         // Skid steering turns less than its wheels say: share.
  double gyro_sigma_radps = 0.00087;      // White noise of one sample (0.05 deg/s).
  double gyro_bias_sigma_radps = 0.0017;  // What the bias may be at the start (0.1 deg/s).
  double gyro_bias_walk = 1.0e-6;         // Drift of the bias, rad/s per square root of a second.
  // Slope of the ground where nothing measures it; wanders over tilt_length_m.
  double tilt_sigma_rad = 0.03;
  double tilt_length_m = 10.0;
  // Of the tilt that an accelerometer shows: its bias and bumps, which last for accel_wander_s.
  double accel_tilt_sigma_rad = 0.01;
  double accel_wander_s = 10.0;
  Eigen::Vector3d B_antenna_m{0, 0, 0};  // Where the GNSS antenna is on the body.
  // Of the variance that a fix claims, this share is an error that wanders over gnss_wander_s
  // seconds (atmosphere, multipath); the rest is white. Averaging removes only the white part.
  double gnss_wander_share = 0.5;
  double gnss_wander_s = 60.0;
  double gnss_velocity_floor_mps = 0.03;  // Wheels tell of the time between two reports.
  // The error of a landmark's sighting lasts: seen again while it does, it tells that much less.
  // 0: each sighting errs by itself.
  double landmark_wander_s = 0;
  // All beacons' ranges read long (or short) by the same share, which stays: 1 sigma.
  double beacon_scale_sigma = 0;
  // What is measured is refused when its squared normalised innovation exceeds this (chi-square,
  // 99.9 %) for one, two and three numbers.
  double gate1_chi2 = 10.8;
  double gate_chi2 = 13.8;
  double gate3_chi2 = 16.3;
  // When fixes that agree with each other were refused for this long and this far, the filter is
  // taken to be the one that is lost. Both must hold: no jump moves a robot that stands. And what
  // it would be off by must be what wheels may have missed: this share of the way since anything
  // agreed with it. Farther off, the fixes must have gone on for much longer: multipath does not
  // follow a robot so far. Nothing is lost that something else has confirmed meanwhile.
  double lost_after_s = 20.0;
  double lost_after_m = 10.0;
  double lost_share = 0.25;
  double lost_far_after_s = 60.0;
  double lost_far_after_m = 60.0;
  // So many refused poses in a row that move the localizer's by the same: it is the one that is
  // lost (carried, or its wheels were silent).
  int lost_poses = 3;
  // So many refusals in a row from one source, over so long, are a fault.
  int streak_fault = 10;
  double streak_fault_s = 2.0;
  // Late and out-of-order measurements are put where they belong if they are no older than this.
  double history_s = 2.0;
  std::size_t history_max = 1024;  // Events; then the oldest is final.
};

// What became of a measurement.
enum class Gate {
  accepted,
  rejected,  // Outlier, not finite, sigma below 0, older than the history: the pose did not change.
  reset      // Accepted after widening the covariance: the filter had been lost.
};

// Where measurements come from that are gated.
enum class Source { gnss_position, gnss_velocity, pose_fix, landmark, beacon };
inline constexpr std::size_t kSources = 5;

// Refusals in a row.
struct RefusalStreak {
  int count{};
  hal::Time first{}, last{};
};

// Where a filter has the robot, and how that goes on.
struct FilterPose {
  Eigen::Vector2d position_m{0, 0};
  Eigen::Vector2d along{1, 0};  // The body's x axis in W, as it lies in the plane: not of length 1.
  std::optional<hal::Time> moved_until;
  double speed_mps{}, turn_radps{};

  hal::Pose2 pose() const;  // Heading in (-pi, pi].
};

class LocalizerFilter {
 public:
  LocalizerFilter(const LocalizerConfig& config, const hal::Pose2& start,
                  const Eigen::Matrix3d& covariance);

  // Events come in the order of their stamps.
  // tape: where to add what the event did to the errors.
  Gate apply(const LocalizerConfig& config, const LocalizerEvent& event, ErrorTape* tape = nullptr);

  // As it would be, had it known at that time what came later.
  LocalizerFilter with(const Hindsight& later) const;

  FilterPose filter_pose() const;
  hal::Pose2 pose() const { return filter_pose().pose(); }
  Eigen::Isometry3d T_W_B() const;     // With slope and height above the start.
  Eigen::Matrix3d covariance() const;  // Of (x, y, heading), in W.
  Eigen::Vector3d gyro_bias_radps() const { return bias_radps_; }
  // Up to when the wheels have told: the pose is that of this time.
  std::optional<hal::Time> moved_until() const { return travel_time_; }
  bool standing() const { return still_s_ >= kStandingAfter_s; }
  double speed_mps() const { return speed_mps_; }
  double turn_radps() const { return turn_radps_; }
  double beacon_scale() const { return beacon_scale_; }
  // Squared normalised innovation of the last gated measurement, and of how many numbers.
  double last_nis() const { return last_nis_; }
  int last_dimension() const { return last_dimension_; }
  const RefusalStreak& refusals(Source source) const {
    return refusals_[static_cast<std::size_t>(source)];
  }

 private:
  // Errors: position (W), attitude (turns about W's axes), gyro bias, slip of each side (share of
  // its travel), the wandering error of the fixes in units of its own sigma, and by which share
  // beacons' ranges read long.
  enum {
    kP = 0,
    kTheta = 3,
    kHeading = 5,
    kBias = 6,
    kSlipLeft = 9,
    kSlipRight,
    kWander,
    kBeaconScale = 13,
    kSize
  };
  static_assert(kSize == kErrors);
  using State = Errors;
  using Matrix = ErrorMatrix;
  template <int N>
  using Rows = Eigen::Matrix<double, N, kSize>;

  static constexpr double kStandingAfter_s = 0.5;

  // Told by wheels, and how it depends on their slip.
  struct WheelTurn {
    double angle_rad{};
    Eigen::Vector2d by_slip{0, 0};
  };

  // Inertial samples since the last travel report.
  struct Turn {
    Eigen::Vector3d angle_rad{0, 0, 0};
    WheelTurn told;  // Of it, by the wheels before these samples came.
    Eigen::Vector3d force_sum{0, 0, 0};
    int forces{};
    double span_s{};
    double variance{};  // Of angle_rad per axis, from white noise.
  };
  // Refused fixes in a row that agree with each other.
  struct Agreeing {
    hal::Time first{};
    Eigen::Vector2d position_m{0, 0};
    double odometer_m{};  // Where the last one came.
    double first_odometer_m{};
  };

  struct Seen {
    Eigen::Vector2d landmark_m{0, 0};
    std::optional<hal::Time> last;
  };

  // By how much refused poses in a row would move the pose: turned, then shifted.
  struct Move {
    double turn_rad{};
    Eigen::Vector2d shift_m{0, 0};
    int count{};
  };

  Gate take(const LocalizerConfig& config, const InertialSample& sample);
  Gate take(const LocalizerConfig& config, const hal::WheelTravel& travel);
  Gate take(const LocalizerConfig& config, const GnssPosition& fix);
  Gate take(const LocalizerConfig& config, const GnssVelocity& fix);
  Gate take(const LocalizerConfig& config, const PoseFix& fix);
  Gate take(const LocalizerConfig& config, const LandmarkSighting& sighting);
  Gate take(const LocalizerConfig& config, const BeaconRange& range);

  bool stands(const hal::WheelTravel& travel, const Turn& turn, double span_s);
  void learn_bias(const Turn& turn);
  void move(const LocalizerConfig& config, const hal::WheelTravel& travel, const Turn& turn,
            double by_wheels, double untold);
  void add_travel_noise(const LocalizerConfig& config, const hal::WheelTravel& travel,
                        double forward_m, const Eigen::Matrix3d& R_mid);
  void forget(int error, double kept);
  void forget_slip(const LocalizerConfig& config, int side, double travel_m);
  void forget_tilt(const LocalizerConfig& config, double way_m);
  void level(const LocalizerConfig& config, const Turn& turn, double span_s, double accel_mps2);
  void wander(const LocalizerConfig& config, hal::Time now);
  bool lost(const LocalizerConfig& config, const GnssPosition& fix, double sigma_m, double off_m);
  bool lost(const LocalizerConfig& config, const PoseFix& fix);
  Eigen::Vector2d ahead_m(hal::Time stamp) const;
  void correct(const State& error);
  // stale: the error that it has in common with what was measured before takes away from what it
  // tells as if its covariance were so many times larger.
  template <int N>
  Gate update(const LocalizerConfig& config, Source source, hal::Time stamp,
              const Measurement<N>& m, double stale = 1);
  template <int N>
  void absorb(const Measurement<N>& m, const Expected<N>& expected);
  template <int N>
  void absorb(const Measurement<N>& m) {
    absorb(m, expected<N>(covariance_, m.Ht));
  }
  void note(Source source, hal::Time stamp, bool refused);
  double stale(const LocalizerConfig& config, const LandmarkSighting& sighting) const;
  void remember(const LandmarkSighting& sighting);

  Eigen::Vector3d position_m_{0, 0, 0};
  Eigen::Matrix3d R_W_B_ = Eigen::Matrix3d::Identity();
  Eigen::Vector3d bias_radps_{0, 0, 0};
  Eigen::Vector2d slip_{0, 0};
  Eigen::Vector2d wander_{0, 0};
  double beacon_scale_{};
  Matrix covariance_ = Matrix::Zero();
  Turn turn_;
  WheelTurn told_;  // Since the last inertial sample: the next one tells it again.
  Eigen::Vector3d rate_radps_{0, 0, 0};  // Of that sample.
  bool knows_tilt_{};                    // All axes of the gyro are there.
  std::optional<hal::Time> imu_time_, travel_time_, fix_time_;
  std::optional<Agreeing> agreeing_;
  Move move_;
  // The landmarks last seen; of more than these the one not seen for longest is forgotten.
  std::array<Seen, 16> seen_{};
  std::array<RefusalStreak, kSources> refusals_{};
  double speed_mps_{}, turn_radps_{};  // Of the last travel report.
  Eigen::Vector2d side_speed_mps_{0, 0};
  double odometer_m_{};   // All travel, forward or backward.
  double agreed_at_m_{};  // The same when anything last told where it is and was accepted,
  std::optional<hal::Time> confirmed_;  // and when that was anything but satellites.
  double still_s_{};
  double last_nis_{};
  int last_dimension_{};
  ErrorTape* tape_{};  // Only while an event is applied.
};

}  // namespace nav
