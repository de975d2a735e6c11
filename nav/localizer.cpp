#include "nav/localizer.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace nav {
namespace {

constexpr double kGyroGapMax_s = 0.25;  // Samples farther apart: the gyro was silent.
constexpr double kStill_m = 1e-6;       // Travel of a side that stands.
constexpr double kTurnOutlier = 5;      // Sigmas: a robot that turns although its wheels stand.
constexpr double kTurnFloor_radps = 0.002;
constexpr double kWheelTurnError = 0.05;  // Skid steering turns less than its wheels say.
constexpr double kFixLagMax_s = 0.5;
constexpr double kFixSigmaMin_m = 0.001;
constexpr double kTravelSigma_m = 0.001;  // Per square root of a metre: encoder ticks, bumps.

double wrapped(double angle_rad) {
  return std::remainder(angle_rad, 2 * std::numbers::pi);
}

}  // namespace

Localizer::Localizer(const LocalizerConfig& config, const hal::Pose2& start,
                     const Eigen::Matrix3d& covariance)
    : config_(config) {
  state_.head<2>() = start.position_m;
  state_[kHeading] = start.heading_rad;
  covariance_.topLeftCorner<3, 3>() = covariance;
  covariance_(kBias, kBias) = config.gyro_bias_sigma_radps * config.gyro_bias_sigma_radps;
  covariance_(kSlipLeft, kSlipLeft) = covariance_(kSlipRight, kSlipRight) =
      config.slip_sigma * config.slip_sigma;
  covariance_(kWanderX, kWanderX) = covariance_(kWanderY, kWanderY) = 1;
}

void Localizer::predict(const hal::ImuSample& sample) {
  const auto before = imu_time_;
  if (!std::isfinite(sample.yaw_rate_radps) || (before && sample.stamp <= *before)) return;
  imu_time_ = sample.stamp;
  if (!before) return;
  const double step_s = hal::seconds(sample.stamp - *before);
  if (step_s > kGyroGapMax_s) return;
  turn_.angle_rad += sample.yaw_rate_radps * step_s;
  turn_.span_s += step_s;
  turn_.variance += std::pow(config_.gyro_sigma_radps * step_s, 2);
}

void Localizer::predict(const hal::WheelTravel& travel) {
  if (!std::isfinite(travel.left_m) || !std::isfinite(travel.right_m)) return;
  const double span_s =
      travel_time_ ? std::max(0.0, hal::seconds(travel.stamp - *travel_time_)) : turn_.span_s;
  travel_time_ = travel.stamp;
  const Turn turn = turn_;
  turn_ = {};
  covariance_(kBias, kBias) += std::pow(config_.gyro_bias_walk, 2) * span_s;
  if (stands(travel, turn, span_s)) return learn_bias(turn);

  speed_mps_ = span_s > 0 ? (travel.left_m + travel.right_m) / 2 / span_s : 0;
  // The share of the time that the gyro did not cover is left to the wheels; less than half is a
  // sample that fell next door.
  const double silent = span_s > 0 ? std::clamp(1 - turn.span_s / span_s, 0.0, 1.0) : 1.0;
  move(travel, turn, silent > 0.5 ? silent : 0);
}

// Wheels at rest for a while, and a gyro that does not contradict them.
bool Localizer::stands(const hal::WheelTravel& travel, const Turn& turn, double span_s) {
  const bool rest = std::abs(travel.left_m) < kStill_m && std::abs(travel.right_m) < kStill_m;
  bool turning = false;
  if (rest && turn.span_s > 0) {
    const double rate = turn.angle_rad / turn.span_s - state_[kBias];
    const double variance = turn.variance / (turn.span_s * turn.span_s) + covariance_(kBias, kBias);
    turning = std::abs(rate) > kTurnOutlier * std::sqrt(variance) + kTurnFloor_radps;
  }
  still_s_ = rest && !turning ? still_s_ + span_s : 0;
  if (rest) speed_mps_ = 0;
  return standing();
}

// Zero angular rate as a measurement: what the gyro says is its bias. Corrects through the
// correlations also the heading, which the same bias turned on the way here.
void Localizer::learn_bias(const Turn& turn) {
  if (turn.span_s <= 0) return;
  const double variance = turn.variance / (turn.span_s * turn.span_s);
  const State column = covariance_.col(kBias);
  const double total = column[kBias] + variance;
  if (total <= 0) return;
  state_ += column * ((turn.angle_rad / turn.span_s - state_[kBias]) / total);
  covariance_ -= column * column.transpose() / total;
}

// by_wheels: the share of the turn that the wheels must tell.
void Localizer::move(const hal::WheelTravel& travel, const Turn& turn, double by_wheels) {
  // Slip is what a wheel turned without moving the robot.
  const double left_m = travel.left_m * (1 - state_[kSlipLeft]);
  const double right_m = travel.right_m * (1 - state_[kSlipRight]);
  const double forward_m = (left_m + right_m) / 2;
  const double wheel_turn_rad = by_wheels * (right_m - left_m) / config_.track_m;
  const double turn_rad = turn.angle_rad - state_[kBias] * turn.span_s + wheel_turn_rad;
  const double along = state_[kHeading] + turn_rad / 2;
  const double c = std::cos(along), s = std::sin(along);

  // How the step forward and the turn depend on the state.
  RowState forward_by = RowState::Zero(), turn_by = RowState::Zero();
  forward_by[kSlipLeft] = -travel.left_m / 2;
  forward_by[kSlipRight] = -travel.right_m / 2;
  turn_by[kBias] = -turn.span_s;
  turn_by[kSlipLeft] = by_wheels * travel.left_m / config_.track_m;
  turn_by[kSlipRight] = -by_wheels * travel.right_m / config_.track_m;
  RowState along_by = turn_by / 2;
  along_by[kHeading] += 1;
  Matrix F = Matrix::Identity();
  F.row(kX) += c * forward_by - forward_m * s * along_by;
  F.row(kY) += s * forward_by + forward_m * c * along_by;
  F.row(kHeading) += turn_by;

  state_.head<3>() += Eigen::Vector3d(forward_m * c, forward_m * s, turn_rad);
  covariance_ = F * covariance_ * F.transpose();
  covariance_(kHeading, kHeading) += turn.variance + std::pow(kWheelTurnError * wheel_turn_rad, 2);
  const Eigen::Vector2d sideways(-s, c);
  covariance_.topLeftCorner<2, 2>() +=
      std::pow(config_.side_slip_sigma, 2) * std::abs(forward_m) * sideways * sideways.transpose();
  covariance_.topLeftCorner<2, 2>() += std::pow(kTravelSigma_m, 2) *
                                       (std::abs(travel.left_m) + std::abs(travel.right_m)) / 2 *
                                       Eigen::Matrix2d::Identity();
  odometer_m_ += std::abs(forward_m);
  forget_slip(kSlipLeft, travel.left_m);
  forget_slip(kSlipRight, travel.right_m);
}

// Over slip_length_m the ground changes and slip with it (an Ornstein-Uhlenbeck process).
void Localizer::forget_slip(int side, double travel_m) {
  const double kept = std::exp(-std::abs(travel_m) / config_.slip_length_m);
  state_[side] *= kept;
  covariance_.col(side) *= kept;
  covariance_.row(side) *= kept;
  covariance_(side, side) += (1 - kept * kept) * std::pow(config_.slip_sigma, 2);
}

// The wandering error forgets itself: an Ornstein-Uhlenbeck process of unit variance.
void Localizer::wander(hal::Time now) {
  const double span_s = fix_time_ ? std::max(0.0, hal::seconds(now - *fix_time_)) : 0;
  fix_time_ = now;
  const double kept = std::exp(-span_s / config_.gnss_wander_s);
  state_.tail<2>() *= kept;
  covariance_.rightCols<2>() *= kept;
  covariance_.bottomRows<2>() *= kept;
  covariance_.bottomRightCorner<2, 2>() += (1 - kept * kept) * Eigen::Matrix2d::Identity();
}

Gate Localizer::correct(const hal::GnssFix& fix) {
  const bool usable = fix.position_m.allFinite() && std::isfinite(fix.sigma_m) && fix.sigma_m >= 0;
  if (!usable || (fix_time_ && fix.stamp < *fix_time_)) return Gate::rejected;
  wander(fix.stamp);

  const double variance = std::pow(std::max(fix.sigma_m, kFixSigmaMin_m), 2);
  const double white = (1 - config_.gnss_wander_share) * variance;
  Eigen::Matrix<double, 2, kSize> H = Eigen::Matrix<double, 2, kSize>::Zero();
  H(0, kX) = H(1, kY) = 1;
  H(0, kWanderX) = H(1, kWanderY) = std::sqrt(config_.gnss_wander_share * variance);
  // The fix may be a little younger or older than the last travel report.
  const double lag_s = travel_time_ ? hal::seconds(fix.stamp - *travel_time_) : 0;
  const double ahead_m = std::abs(lag_s) < kFixLagMax_s ? speed_mps_ * lag_s : 0;
  const Eigen::Vector2d ahead(std::cos(state_[kHeading]), std::sin(state_[kHeading]));
  const Eigen::Vector2d innovation = fix.position_m - H * state_ - ahead_m * ahead;

  Eigen::Matrix2d S = H * covariance_ * H.transpose() + white * Eigen::Matrix2d::Identity();
  Gate gate = Gate::accepted;
  if (innovation.dot(S.inverse() * innovation) > config_.gate_chi2) {
    if (!lost(fix)) return Gate::rejected;
    gate = Gate::reset;
    const double off_m2 = innovation.squaredNorm();
    covariance_.topLeftCorner<2, 2>() += off_m2 * Eigen::Matrix2d::Identity();
    // It went astray over the way of the streak: so may have its heading.
    covariance_(kHeading, kHeading) += std::min(off_m2 / std::pow(config_.lost_after_m, 2), 1.0);
    S = H * covariance_ * H.transpose() + white * Eigen::Matrix2d::Identity();
  }
  streak_.reset();
  update(H, innovation, S, white);
  return gate;
}

bool Localizer::lost(const hal::GnssFix& fix) {
  const double way_m = streak_ ? odometer_m_ - streak_->odometer_m : 0;
  const bool agrees =
      streak_ && (fix.position_m - streak_->position_m).norm() <= 6 * fix.sigma_m + 1.5 * way_m;
  if (!agrees) streak_ = Streak{fix.stamp, fix.position_m, odometer_m_, odometer_m_};
  streak_->position_m = fix.position_m;
  streak_->odometer_m = odometer_m_;
  return hal::seconds(fix.stamp - streak_->first) >= config_.lost_after_s &&
         odometer_m_ - streak_->first_odometer_m >= config_.lost_after_m;
}

// Joseph's form: stays symmetric and positive.
void Localizer::update(const Eigen::Matrix<double, 2, kSize>& H, const Eigen::Vector2d& innovation,
                       const Eigen::Matrix2d& S, double white_variance) {
  const Eigen::Matrix<double, kSize, 2> K = covariance_ * H.transpose() * S.inverse();
  state_ += K * innovation;
  const Matrix I_KH = Matrix::Identity() - K * H;
  covariance_ = I_KH * covariance_ * I_KH.transpose() + white_variance * K * K.transpose();
}

hal::Pose2 Localizer::pose() const {
  return {state_.head<2>(), wrapped(state_[kHeading])};
}

Eigen::Matrix3d Localizer::covariance() const {
  const Eigen::Matrix3d P = covariance_.topLeftCorner<3, 3>();
  return (P + P.transpose()) / 2;
}

}  // namespace nav
