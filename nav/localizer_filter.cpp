#include "nav/localizer_filter.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <utility>

#include "hal/angles.hpp"
#include "nav/registration/rigid.hpp"

namespace nav {
namespace {

constexpr double kGyroGapMax_s = 0.25;  // Samples farther apart: the gyro was silent.
constexpr double kGyroDense_s = 0.05;   // Farther apart: the rate in between is not known.
constexpr double kStill_m = 1e-6;       // Travel of a side that stands.
constexpr double kTurnOutlier = 5;      // Sigmas: a robot that turns although its wheels stand.
constexpr double kTurnFloor_radps = 0.002;
constexpr double kFixLagMax_s = 0.5;
constexpr double kFixSigmaMin_m = 0.001;
constexpr double kGravity_mps2 = 9.80665;

double heading_of(const Eigen::Matrix3d& R) {
  return std::atan2(R(1, 0), R(0, 0));
}

bool usable(double sigma) {
  return std::isfinite(sigma) && sigma >= 0;
}

double gate_of(const LocalizerConfig& config, int numbers) {
  return numbers == 1 ? config.gate1_chi2 : numbers == 2 ? config.gate_chi2 : config.gate3_chi2;
}

// Products of these sizes are the plain sums anyway: lazyProduct says so at once, where operator*
// makes the compiler weigh every way there is (three quarters of this file's time).

using UpTo3 = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 3, 1>;
using UpTo3x3 = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 3, 3>;

UpTo3x3 inverse(const UpTo3x3& S) {
  Eigen::Matrix3d full = Eigen::Matrix3d::Identity();
  full.topLeftCorner(S.rows(), S.cols()) = S;
  return full.inverse().topLeftCorner(S.rows(), S.cols());
}

}  // namespace

LocalizerFilter::LocalizerFilter(const LocalizerConfig& config, const hal::Pose2& start,
                                 const Eigen::Matrix3d& covariance) {
  position_m_.head<2>() = start.position_m;
  R_W_B_ = Eigen::AngleAxisd(start.heading_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  covariance_.block<2, 2>(kP, kP) = covariance.topLeftCorner<2, 2>();
  covariance_.block<2, 1>(kP, kHeading) = covariance.topRightCorner<2, 1>();
  covariance_.block<1, 2>(kHeading, kP) = covariance.bottomLeftCorner<1, 2>();
  covariance_(kHeading, kHeading) = covariance(2, 2);
  covariance_(kTheta, kTheta) = covariance_(kTheta + 1, kTheta + 1) =
      std::pow(config.tilt_sigma_rad, 2);
  for (int axis = 0; axis < 3; ++axis)
    covariance_(kBias + axis, kBias + axis) = std::pow(config.gyro_bias_sigma_radps, 2);
  covariance_(kSlipLeft, kSlipLeft) = covariance_(kSlipRight, kSlipRight) =
      std::pow(config.slip_sigma, 2);
  covariance_(kWander, kWander) = covariance_(kWander + 1, kWander + 1) = 1;
}

Gate LocalizerFilter::apply(const LocalizerConfig& config, const LocalizerEvent& event) {
  return std::visit([&](const auto& one) { return take(config, one); }, event);
}

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
    correct(column * ((turn.angle_rad[axis] / turn.span_s - bias_radps_[axis]) / total));
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
  // How the turn (in the body) and the step depend on the state.
  Rows<3> turn_by = Rows<3>::Zero();
  turn_by(2, kBias + 2) = -turn.span_s;
  if (knows_tilt_) turn_by(0, kBias) = turn_by(1, kBias + 1) = -turn.span_s;
  turn_by(2, kSlipLeft) = by_slip[0] - turn.told.by_slip[0];
  turn_by(2, kSlipRight) = by_slip[1] - turn.told.by_slip[1];
  const Rows<3> W_turn_by = R_mid.lazyProduct(turn_by);
  Rows<3> step_by = (swings / 2).lazyProduct(W_turn_by);
  step_by.middleCols<3>(kTheta) += swings;
  step_by.col(kSlipLeft) -= travel.left_m / 2 * R_mid.col(0);
  step_by.col(kSlipRight) -= travel.right_m / 2 * R_mid.col(0);

  position_m_ += W_step_m;
  R_W_B_ = Eigen::Quaterniond(R_W_B_ * rotation_of(turned)).normalized().toRotationMatrix();
  // F is the identity but for these six rows.
  Matrix FP = covariance_;
  FP.middleRows<3>(kP) += step_by.lazyProduct(covariance_);
  FP.middleRows<3>(kTheta) += W_turn_by.lazyProduct(covariance_);
  covariance_ = FP;
  covariance_.middleCols<3>(kP) += FP.lazyProduct(step_by.transpose());
  covariance_.middleCols<3>(kTheta) += FP.lazyProduct(W_turn_by.transpose());

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

// Over slip_length_m the ground changes and slip with it (an Ornstein-Uhlenbeck process).
void LocalizerFilter::forget_slip(const LocalizerConfig& config, int side, double travel_m) {
  const double kept = std::exp(-std::abs(travel_m) / config.slip_length_m);
  slip_[side - kSlipLeft] *= kept;
  covariance_.col(side) *= kept;
  covariance_.row(side) *= kept;
  covariance_(side, side) += (1 - kept * kept) * std::pow(config.slip_sigma, 2);
}

// The same for the slope, where no gyro follows it: it is level again after a while.
void LocalizerFilter::forget_tilt(const LocalizerConfig& config, double way_m) {
  const double kept = std::exp(-std::abs(way_m) / config.tilt_length_m);
  const Eigen::Vector3d up = R_W_B_.col(2);
  const Eigen::Vector3d tilt(-up.y(), up.x(), 0);  // The small turn that tilted it.
  R_W_B_ = rotation_of(-(1 - kept) * tilt) * R_W_B_;
  for (int axis = kTheta; axis < kHeading; ++axis) {
    covariance_.col(axis) *= kept;
    covariance_.row(axis) *= kept;
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
  absorb({H.transpose(), innovation, variance * Eigen::Matrix2d::Identity()});
}

// The wandering error forgets itself: an Ornstein-Uhlenbeck process of unit variance.
void LocalizerFilter::wander(const LocalizerConfig& config, hal::Time now) {
  const double span_s = fix_time_ ? std::max(0.0, hal::seconds(now - *fix_time_)) : 0;
  fix_time_ = now;
  const double kept = std::exp(-span_s / config.gnss_wander_s);
  wander_ *= kept;
  covariance_.middleCols<2>(kWander) *= kept;
  covariance_.middleRows<2>(kWander) *= kept;
  covariance_.block<2, 2>(kWander, kWander) += (1 - kept * kept) * Eigen::Matrix2d::Identity();
}

// How far the robot went since the last travel report, or had not yet gone.
Eigen::Vector2d LocalizerFilter::ahead_m(hal::Time stamp) const {
  const double lag_s = travel_time_ ? hal::seconds(stamp - *travel_time_) : 0;
  if (std::abs(lag_s) >= kFixLagMax_s) return {0, 0};
  return speed_mps_ * lag_s * R_W_B_.col(0).head<2>();
}

Gate LocalizerFilter::take(const LocalizerConfig& config, const GnssPosition& fix) {
  const bool fine = fix.position_m.allFinite() && fix.covariance_m2.allFinite() &&
                    fix.covariance_m2(0, 0) >= 0 && fix.covariance_m2(1, 1) >= 0 &&
                    fix.covariance_m2.determinant() >= 0;
  if (!fine || (fix_time_ && fix.stamp < *fix_time_)) return Gate::rejected;
  wander(config, fix.stamp);

  Eigen::Matrix2d claimed = (fix.covariance_m2 + fix.covariance_m2.transpose()) / 2;
  claimed.diagonal() = claimed.diagonal().cwiseMax(kFixSigmaMin_m * kFixSigmaMin_m);
  const Eigen::Matrix2d white = (1 - config.gnss_wander_share) * claimed;
  const Eigen::Vector2d wanders = (config.gnss_wander_share * claimed.diagonal()).cwiseSqrt();
  const Eigen::Vector3d W_arm = R_W_B_ * config.B_antenna_m;
  Rows<2> H = Rows<2>::Zero();
  H(0, kP) = H(1, kP + 1) = 1;
  H.middleCols<3>(kTheta) = -cross_matrix(W_arm).topRows<2>();
  H(0, kWander) = wanders[0];
  H(1, kWander + 1) = wanders[1];
  const Eigen::Vector2d innovation = fix.position_m - (position_m_ + W_arm).head<2>() -
                                     wanders.cwiseProduct(wander_) - ahead_m(fix.stamp);

  Gate gate = update(config, Source::gnss_position, fix.stamp, {H.transpose(), innovation, white});
  if (gate == Gate::accepted) {
    agreeing_.reset();
    return gate;
  }
  const double sigma_m = std::sqrt(claimed.diagonal().maxCoeff());
  if (!lost(config, fix, sigma_m, innovation.norm())) return Gate::rejected;
  const double off_m2 = innovation.squaredNorm();
  covariance_.topLeftCorner<2, 2>() += off_m2 * Eigen::Matrix2d::Identity();
  // It went astray over the way of the streak: so may have its heading.
  covariance_(kHeading, kHeading) += std::min(off_m2 / std::pow(config.lost_after_m, 2), 1.0);
  absorb({H.transpose(), innovation, white});
  agreeing_.reset();
  note(Source::gnss_position, fix.stamp, false);
  return Gate::reset;
}

bool LocalizerFilter::lost(const LocalizerConfig& config, const GnssPosition& fix, double sigma_m,
                           double off_m) {
  const double way_m = agreeing_ ? odometer_m_ - agreeing_->odometer_m : 0;
  const bool agrees =
      agreeing_ && (fix.position_m - agreeing_->position_m).norm() <= 6 * sigma_m + 1.5 * way_m;
  if (!agrees) agreeing_ = Agreeing{fix.stamp, fix.position_m, odometer_m_, odometer_m_};
  agreeing_->position_m = fix.position_m;
  agreeing_->odometer_m = odometer_m_;
  if (confirmed_ && *confirmed_ >= agreeing_->first) return false;
  const bool far = off_m > config.lost_share * (odometer_m_ - agreed_at_m_) + 6 * sigma_m;
  const double after_s = far ? config.lost_far_after_s : config.lost_after_s;
  const double after_m = far ? config.lost_far_after_m : config.lost_after_m;
  return hal::seconds(fix.stamp - agreeing_->first) >= after_s &&
         odometer_m_ - agreeing_->first_odometer_m >= after_m;
}

Gate LocalizerFilter::take(const LocalizerConfig& config, const GnssVelocity& fix) {
  if (!fix.velocity_mps.allFinite() || !usable(fix.sigma_mps)) return Gate::rejected;
  const Eigen::Vector2d sides = side_speed_mps_.cwiseProduct(Eigen::Vector2d(1, 1) - slip_);
  const Eigen::Vector3d W_speed = sides.mean() * R_W_B_.col(0);
  const Eigen::Vector3d W_arm = R_W_B_ * config.B_antenna_m;
  const Eigen::Vector3d W_swing = turn_radps_ * R_W_B_.col(2).cross(W_arm);
  Rows<2> H = Rows<2>::Zero();
  H.middleCols<3>(kTheta) = -cross_matrix(W_speed + W_swing).topRows<2>();
  H.col(kSlipLeft) = -side_speed_mps_[0] / 2 * R_W_B_.col(0).head<2>();
  H.col(kSlipRight) = -side_speed_mps_[1] / 2 * R_W_B_.col(0).head<2>();
  const double variance = std::pow(fix.sigma_mps, 2) + std::pow(config.gnss_velocity_floor_mps, 2);
  return update(config, Source::gnss_velocity, fix.stamp,
                {H.transpose(), fix.velocity_mps - (W_speed + W_swing).head<2>(),
                 variance * Eigen::Matrix2d::Identity()});
}

Gate LocalizerFilter::take(const LocalizerConfig& config, const PoseFix& fix) {
  const bool fine = fix.pose.position_m.allFinite() && std::isfinite(fix.pose.heading_rad) &&
                    fix.covariance.allFinite() && fix.covariance.diagonal().minCoeff() >= 0;
  if (!fine) return Gate::rejected;
  Rows<3> H = Rows<3>::Zero();
  H(0, kP) = H(1, kP + 1) = H(2, kHeading) = 1;
  Eigen::Vector3d innovation;
  innovation << fix.pose.position_m - position_m_.head<2>() - ahead_m(fix.stamp),
      hal::wrapped(fix.pose.heading_rad - heading_of(R_W_B_));
  const Gate gate =
      update(config, Source::pose_fix, fix.stamp, {H.transpose(), innovation, fix.covariance});
  if (gate == Gate::accepted) {
    move_ = {};
    return gate;
  }
  if (!lost(config, fix)) return Gate::rejected;
  covariance_.topLeftCorner<2, 2>() +=
      innovation.head<2>().squaredNorm() * Eigen::Matrix2d::Identity();
  covariance_(kHeading, kHeading) += innovation[2] * innovation[2];
  absorb({H.transpose(), innovation, fix.covariance});
  move_ = {};
  note(Source::pose_fix, fix.stamp, false);
  return Gate::reset;
}

// Poses that are right all move the localizer's by the same, however it drives on.
bool LocalizerFilter::lost(const LocalizerConfig& config, const PoseFix& fix) {
  constexpr double kSame_m = 0.5, kSameRad = 0.15;
  const double turn_rad = hal::wrapped(fix.pose.heading_rad - heading_of(R_W_B_));
  const Eigen::Vector2d here = position_m_.head<2>();
  const Eigen::Vector2d shift_m = fix.pose.position_m - Eigen::Rotation2Dd(turn_rad) * here;
  const Eigen::Vector2d expected = Eigen::Rotation2Dd(move_.turn_rad) * here + move_.shift_m;
  const bool same = move_.count > 0 && (expected - fix.pose.position_m).norm() < kSame_m &&
                    std::abs(hal::wrapped(turn_rad - move_.turn_rad)) < kSameRad;
  move_ = {turn_rad, shift_m, same ? move_.count + 1 : 1};
  return move_.count >= config.lost_poses;
}

Gate LocalizerFilter::take(const LocalizerConfig& config, const LandmarkSighting& sighting) {
  const bool fine = sighting.landmark_m.allFinite() && std::isfinite(sighting.range_m) &&
                    std::isfinite(sighting.bearing_rad) && usable(sighting.range_sigma_m) &&
                    usable(sighting.bearing_sigma_rad);
  if (!fine) return Gate::rejected;
  const Eigen::Vector2d way = sighting.landmark_m - position_m_.head<2>() - ahead_m(sighting.stamp);
  const double range_m = std::max(way.norm(), 0.01);
  Rows<2> H = Rows<2>::Zero();
  H.block<1, 2>(0, kP) = -way.transpose() / range_m;
  H.block<1, 2>(1, kP) << way.y() / (range_m * range_m), -way.x() / (range_m * range_m);
  H(1, kHeading) = -1;
  const Eigen::Vector2d innovation(
      sighting.range_m - range_m,
      hal::wrapped(sighting.bearing_rad - std::atan2(way.y(), way.x()) + heading_of(R_W_B_)));
  const Eigen::Vector2d sigmas(sighting.range_sigma_m, sighting.bearing_sigma_rad);
  return update(config, Source::landmark, sighting.stamp,
                {H.transpose(), innovation, sigmas.cwiseAbs2().asDiagonal()});
}

Gate LocalizerFilter::take(const LocalizerConfig& config, const BeaconRange& range) {
  if (!range.beacon_m.allFinite() || !std::isfinite(range.range_m) || !usable(range.sigma_m))
    return Gate::rejected;
  const Eigen::Vector2d way = position_m_.head<2>() + ahead_m(range.stamp) - range.beacon_m;
  const double range_m = std::max(way.norm(), 0.01);
  Rows<1> H = Rows<1>::Zero();
  H.middleCols<2>(kP) = way.transpose() / range_m;
  return update(config, Source::beacon, range.stamp,
                {H.transpose(), Eigen::Matrix<double, 1, 1>(range.range_m - range_m),
                 Eigen::Matrix<double, 1, 1>(range.sigma_m * range.sigma_m)});
}

Gate LocalizerFilter::update(const LocalizerConfig& config, Source source, hal::Time stamp,
                             const Measured& m) {
  const UpTo3x3 S = m.Ht.transpose().lazyProduct(Tall(covariance_.lazyProduct(m.Ht))) + m.R;
  last_nis_ = m.innovation.dot(UpTo3(inverse(S).lazyProduct(m.innovation)));
  last_dimension_ = static_cast<int>(m.innovation.size());
  const bool refused = !(last_nis_ <= gate_of(config, last_dimension_));
  note(source, stamp, refused);
  if (refused) return Gate::rejected;
  absorb(m);
  return Gate::accepted;
}

// Joseph's form: stays symmetric and positive.
void LocalizerFilter::absorb(const Measured& m) {
  const Tall PHt = covariance_.lazyProduct(m.Ht);
  const UpTo3x3 S = m.Ht.transpose().lazyProduct(PHt) + m.R;
  const Tall K = PHt.lazyProduct(inverse(S));
  correct(K.lazyProduct(m.innovation));
  // (I - K H) P (I - K H)' + K R K', with the products that are small.
  Matrix A = covariance_;
  A -= K.lazyProduct(PHt.transpose());
  const Tall B = K.lazyProduct(m.R) - Tall(A.lazyProduct(m.Ht));
  A += B.lazyProduct(K.transpose());
  covariance_ = (A + A.transpose()) / 2;
}

// Moves the error into the state.
void LocalizerFilter::correct(const State& error) {
  position_m_ += error.segment<3>(kP);
  R_W_B_ = Eigen::Quaterniond(rotation_of(error.segment<3>(kTheta)) * R_W_B_)
               .normalized()
               .toRotationMatrix();
  bias_radps_ += error.segment<3>(kBias);
  slip_ += error.segment<2>(kSlipLeft);
  wander_ += error.segment<2>(kWander);
}

void LocalizerFilter::note(Source source, hal::Time stamp, bool refused) {
  RefusalStreak& streak = refusals_[static_cast<std::size_t>(source)];
  if (!refused) {
    streak = {};
    if (source == Source::gnss_velocity) return;  // Tells of no place.
    agreed_at_m_ = odometer_m_;
    if (source != Source::gnss_position) confirmed_ = stamp;
    return;
  }
  if (streak.count++ == 0) streak.first = stamp;
  streak.last = stamp;
}

hal::Pose2 LocalizerFilter::pose() const {
  return {position_m_.head<2>(), heading_of(R_W_B_)};
}

Eigen::Isometry3d LocalizerFilter::T_W_B() const {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() = R_W_B_;
  T.translation() = position_m_;
  return T;
}

Eigen::Matrix3d LocalizerFilter::covariance() const {
  Eigen::Matrix3d P;
  P << covariance_.topLeftCorner<2, 2>(), covariance_.block<2, 1>(kP, kHeading),
      covariance_.block<1, 2>(kHeading, kP), covariance_(kHeading, kHeading);
  return (P + P.transpose()) / 2;
}

}  // namespace nav
