// The localizer's filter: wheels and inertial sensors.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include "nav/localizer_filter.hpp"
#include "nav/registration/rigid.hpp"

namespace nav {
namespace {

constexpr double kGyroGapMax_s = 0.25;  // Samples farther apart: the gyro was silent.
constexpr double kGyroDense_s = 0.05;   // Farther apart: the rate in between is not known.
constexpr double kStill_m = 1e-6;       // Travel of a side that stands.
constexpr double kTurnOutlier = 5;      // Sigmas: a robot that turns although its wheels stand.
constexpr double kTurnFloor_radps = 0.002;
constexpr double kGravity_mps2 = 9.80665;

}  // namespace

Gate LocalizerFilter::take(const LocalizerConfig& config, const InertialSample& sample) {
  const auto before = imu_time_;
  if (!sample.rate_radps.allFinite() || (before && sample.stamp <= *before)) return Gate::rejected;
  imu_time_ = sample.stamp;
  const WheelTurn told = std::exchange(told_, {});
  const double change_radps =
      (sample.rate_radps - std::exchange(rate_radps_, sample.rate_radps)).norm();
  if (!before) return Gate::accepted;
  const double step_s = hal::seconds(sample.stamp - *before);
  if (step_s > kGyroGapMax_s) return Gate::accepted;
  turn_.angle_rad += sample.rate_radps * step_s;
  turn_.told.angle_rad += told.angle_rad;
  turn_.told.by_slip += told.by_slip;
  turn_.span_s += step_s;
  turn_.variance += std::pow(config.gyro_sigma_radps * step_s, 2);
  if (step_s > kGyroDense_s) turn_.variance += std::pow(change_radps * step_s / 2, 2);
  knows_tilt_ = sample.specific_force_mps2.has_value();
  if (knows_tilt_ && sample.specific_force_mps2->allFinite()) {
    turn_.force_sum += *sample.specific_force_mps2;
    ++turn_.forces;
  }
  return Gate::accepted;
}

Gate LocalizerFilter::take(const LocalizerConfig& config, const hal::WheelTravel& travel) {
  const bool backwards = travel_time_ && travel.stamp < *travel_time_;
  if (backwards || !std::isfinite(travel.left_m) || !std::isfinite(travel.right_m))
    return Gate::rejected;
  const double span_s =
      travel_time_ ? std::max(0.0, hal::seconds(travel.stamp - *travel_time_)) : turn_.span_s;
  travel_time_ = travel.stamp;
  const Turn turn = turn_;
  turn_ = {};
  for (int axis = 0; axis < 3; ++axis)
    covariance_(kBias + axis, kBias + axis) += std::pow(config.gyro_bias_walk, 2) * span_s;
  const double speed_before_mps = speed_mps_;
  if (stands(travel, turn, span_s)) {
    side_speed_mps_.setZero();
    turn_radps_ = 0;
    learn_bias(turn);
    level(config, turn, span_s, 0);
    return Gate::accepted;
  }
  speed_mps_ = span_s > 0 ? (travel.left_m + travel.right_m) / 2 / span_s : 0;
  if (span_s > 0) side_speed_mps_ = Eigen::Vector2d(travel.left_m, travel.right_m) / span_s;
  // The share of the time that the gyro did not cover is left to the wheels; less than half is a
  // sample that fell next door.
  const double silent = span_s > 0 ? std::clamp(1 - turn.span_s / span_s, 0.0, 1.0) : 1.0;
  const double since_sample_s = imu_time_ ? hal::seconds(travel.stamp - *imu_time_) : 0;
  const double untold = span_s > 0 ? std::clamp(since_sample_s / span_s, 0.0, 1.0) : 0;
  move(config, travel, turn, silent > 0.5 ? silent : 0, untold);
  level(config, turn, span_s, span_s > 0 ? (speed_mps_ - speed_before_mps) / span_s : 0);
  return Gate::accepted;
}

// Wheels at rest for a while, and a gyro that does not contradict them.
bool LocalizerFilter::stands(const hal::WheelTravel& travel, const Turn& turn, double span_s) {
  const bool rest = std::abs(travel.left_m) < kStill_m && std::abs(travel.right_m) < kStill_m;
  bool turning = false;
  if (rest && turn.span_s > 0) {
    const double rate = turn.angle_rad.z() / turn.span_s - bias_radps_.z();
    const double variance =
        turn.variance / (turn.span_s * turn.span_s) + covariance_(kBias + 2, kBias + 2);
    turning = std::abs(rate) > kTurnOutlier * std::sqrt(variance) + kTurnFloor_radps;
  }
  still_s_ = rest && !turning ? still_s_ + span_s : 0;
  if (rest) speed_mps_ = 0;
  return standing();
}

// Zero angular rate as a measurement: what the gyro says is its bias. Corrects through the
// correlations also the heading, which the same bias turned on the way here.
void LocalizerFilter::learn_bias(const Turn& turn) {
  if (turn.span_s <= 0) return;
  const double variance = turn.variance / (turn.span_s * turn.span_s);
  for (int axis = knows_tilt_ ? 0 : 2; axis < 3; ++axis) {
    const State column = covariance_.col(kBias + axis);
    const double total = column[kBias + axis] + variance;
    if (total <= 0) continue;
    const double innovation = turn.angle_rad[axis] / turn.span_s - bias_radps_[axis];
    if (tape_)
      tape_->measured(State::Unit(kBias + axis), ErrorTape::Numbers::Constant(1, innovation),
                      ErrorTape::Square::Constant(1, 1, 1 / total), column / total);
    correct(column * (innovation / total));
    covariance_ -= column.lazyProduct((column / total).transpose());
  }
}

// by_wheels: the share of the turn that the wheels must tell; untold: the share of the time that
// the gyro may tell later. What wheels told of a time that it tells now is taken back.
void LocalizerFilter::move(const LocalizerConfig& config, const hal::WheelTravel& travel,
                           const Turn& turn, double by_wheels, double untold) {
  // Slip is what a wheel turned without moving the robot.
  const double left_m = travel.left_m * (1 - slip_[0]);
  const double right_m = travel.right_m * (1 - slip_[1]);
  const double forward_m = (left_m + right_m) / 2;
  const double wheel_turn_rad = by_wheels * (right_m - left_m) / config.track_m;
  Eigen::Vector3d turned = turn.angle_rad - bias_radps_ * turn.span_s;
  if (!knows_tilt_) turned.head<2>().setZero();
  const double wheels_s = travel.left_m == travel.right_m ? 0.0 : 1.0;
  turn_radps_ =
      turn.span_s > 0 ? (turned.z() + wheel_turn_rad) / turn.span_s : wheels_s * turn_radps_;
  turned.z() += wheel_turn_rad - turn.told.angle_rad;
  const Eigen::Vector2d by_slip =
      by_wheels / config.track_m * Eigen::Vector2d(travel.left_m, -travel.right_m);
  told_.angle_rad += untold * wheel_turn_rad;
  told_.by_slip += untold * by_slip;

  const Eigen::Matrix3d R_mid = R_W_B_ * rotation_of(turned / 2);
  const Eigen::Vector3d W_step_m = forward_m * R_mid.col(0);
  const Eigen::Matrix3d swings = -cross_matrix(W_step_m);
  const Eigen::Vector2d slip_turns = by_slip - turn.told.by_slip;
  // How the turn and the step depend on the state.
  Motion motion = Motion::Zero();
  auto W_turn_by = motion.bottomRows<3>();
  for (int axis = knows_tilt_ ? 0 : 2; axis < 3; ++axis)
    W_turn_by.col(kBias + axis - kMotionFrom) = R_mid.col(axis) * -turn.span_s;
  W_turn_by.col(kSlipLeft - kMotionFrom) = R_mid.col(2) * slip_turns[0];
  W_turn_by.col(kSlipRight - kMotionFrom) = R_mid.col(2) * slip_turns[1];
  auto step_by = motion.topRows<3>();
  step_by = (swings / 2).lazyProduct(Eigen::Matrix<double, 3, 8>(W_turn_by));
  step_by.leftCols<3>() = swings;
  step_by.col(kSlipLeft - kMotionFrom) -= travel.left_m / 2 * R_mid.col(0);
  step_by.col(kSlipRight - kMotionFrom) -= travel.right_m / 2 * R_mid.col(0);

  position_m_ += W_step_m;
  R_W_B_ = Eigen::Quaterniond(R_W_B_ * rotation_of(turned)).normalized().toRotationMatrix();
  if (tape_) {
    Matrix F = Matrix::Identity();
    F.block<6, 8>(kP, kMotionFrom) += motion;
    tape_->moved(F);
  }
  carry(covariance_, motion, knows_tilt_);

  covariance_(kHeading, kHeading) +=
      turn.variance + std::pow(config.wheel_turn_error * wheel_turn_rad, 2);
  if (knows_tilt_) {
    covariance_(kTheta, kTheta) += turn.variance;
    covariance_(kTheta + 1, kTheta + 1) += turn.variance;
  }
  add_travel_noise(config, travel, forward_m, R_mid);
  odometer_m_ += std::abs(forward_m);
  forget_slip(config, kSlipLeft, travel.left_m);
  forget_slip(config, kSlipRight, travel.right_m);
  if (!knows_tilt_) forget_tilt(config, forward_m);
}

void LocalizerFilter::add_travel_noise(const LocalizerConfig& config,
                                       const hal::WheelTravel& travel, double forward_m,
                                       const Eigen::Matrix3d& R_mid) {
  const Eigen::Vector3d sideways = R_mid.col(1);
  covariance_.topLeftCorner<3, 3>() +=
      std::pow(config.side_slip_sigma, 2) * std::abs(forward_m) * sideways * sideways.transpose();
  covariance_.topLeftCorner<3, 3>() += std::pow(config.travel_sigma_m, 2) *
                                       (std::abs(travel.left_m) + std::abs(travel.right_m)) / 2 *
                                       Eigen::Matrix3d::Identity();
}

void LocalizerFilter::forget(int error, double kept) {
  covariance_.col(error) *= kept;
  covariance_.row(error) *= kept;
  if (tape_) tape_->forgot(error, kept);
}

// Over slip_length_m the ground changes and slip with it (an Ornstein-Uhlenbeck process).
void LocalizerFilter::forget_slip(const LocalizerConfig& config, int side, double travel_m) {
  const double kept = std::exp(-std::abs(travel_m) / config.slip_length_m);
  slip_[side - kSlipLeft] *= kept;
  forget(side, kept);
  covariance_(side, side) += (1 - kept * kept) * std::pow(config.slip_sigma, 2);
}

// The same for the slope, where no gyro follows it: it is level again after a while.
void LocalizerFilter::forget_tilt(const LocalizerConfig& config, double way_m) {
  const double kept = std::exp(-std::abs(way_m) / config.tilt_length_m);
  const Eigen::Vector3d up = R_W_B_.col(2);
  const Eigen::Vector3d tilt(-up.y(), up.x(), 0);  // The small turn that tilted it.
  R_W_B_ = rotation_of(-(1 - kept) * tilt) * R_W_B_;
  for (int axis = kTheta; axis < kHeading; ++axis) {
    forget(axis, kept);
    covariance_(axis, axis) += (1 - kept * kept) * std::pow(config.tilt_sigma_rad, 2);
  }
}

// Gravity shows the slope; what the robot's own motion adds is known from the wheels.
void LocalizerFilter::level(const LocalizerConfig& config, const Turn& turn, double span_s,
                            double accel_mps2) {
  if (turn.forces == 0 || span_s <= 0) return;
  Eigen::Vector3d force = turn.force_sum / turn.forces;
  force.x() -= accel_mps2;
  force.y() -= speed_mps_ * turn_radps_;
  const Eigen::Vector3d W_up(0, 0, 1);
  const Eigen::Vector3d B_up = R_W_B_.transpose() * W_up;
  Rows<2> H = Rows<2>::Zero();
  H.middleCols<3>(kTheta) = (R_W_B_.transpose() * cross_matrix(W_up)).topRows<2>();
  const Eigen::Vector2d innovation = (force / kGravity_mps2 - B_up).head<2>();
  // An error that lasts is no new information each time: spread over the time that it lasts.
  const double variance =
      std::pow(config.accel_tilt_sigma_rad, 2) * std::max(1.0, config.accel_wander_s / span_s) +
      std::pow(0.1 * accel_mps2 / kGravity_mps2, 2);
  absorb<2>({H.transpose(), innovation, variance * Eigen::Matrix2d::Identity()});
}

}  // namespace nav
