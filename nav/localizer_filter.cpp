#include "nav/localizer_filter.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "hal/angles.hpp"
#include "nav/registration/rigid.hpp"

namespace nav {
namespace {

constexpr double kFixLagMax_s = 0.5;
constexpr double kFixSigmaMin_m = 0.001;

double heading_of(const Eigen::Matrix3d& R) {
  return std::atan2(R(1, 0), R(0, 0));
}

bool usable(double sigma) {
  return std::isfinite(sigma) && sigma >= 0;
}

double gate_of(const LocalizerConfig& config, int numbers) {
  return numbers == 1 ? config.gate1_chi2 : numbers == 2 ? config.gate_chi2 : config.gate3_chi2;
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
  covariance_(kBeaconScale, kBeaconScale) = std::pow(config.beacon_scale_sigma, 2);
}

Gate LocalizerFilter::apply(const LocalizerConfig& config, const LocalizerEvent& event,
                            ErrorTape* tape) {
  tape_ = tape;
  const Gate gate = std::visit([&](const auto& one) { return take(config, one); }, event);
  tape_ = nullptr;
  return gate;
}

// lazyProduct is the plain sums at once, where operator* makes the compiler weigh every way there
// is.
LocalizerFilter LocalizerFilter::with(const Hindsight& later) const {
  LocalizerFilter known = *this;
  known.correct(-covariance_.lazyProduct(later.pull()));
  known.covariance_ -= covariance_.lazyProduct(ErrorMatrix(later.known().lazyProduct(covariance_)));
  return known;
}

// The wandering error forgets itself: an Ornstein-Uhlenbeck process of unit variance.
void LocalizerFilter::wander(const LocalizerConfig& config, hal::Time now) {
  const double span_s = fix_time_ ? std::max(0.0, hal::seconds(now - *fix_time_)) : 0;
  fix_time_ = now;
  const double kept = std::exp(-span_s / config.gnss_wander_s);
  wander_ *= kept;
  forget(kWander, kept);
  forget(kWander + 1, kept);
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

  const Measurement<2> measured{H.transpose(), innovation, white};
  const Gate gate = update(config, Source::gnss_position, fix.stamp, measured);
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
  absorb(measured);
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
  return update<2>(config, Source::gnss_velocity, fix.stamp,
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
  const Measurement<3> measured{H.transpose(), innovation, fix.covariance};
  const Gate gate = update(config, Source::pose_fix, fix.stamp, measured);
  if (gate == Gate::accepted) {
    move_ = {};
    return gate;
  }
  if (!lost(config, fix)) return Gate::rejected;
  covariance_.topLeftCorner<2, 2>() +=
      innovation.head<2>().squaredNorm() * Eigen::Matrix2d::Identity();
  covariance_(kHeading, kHeading) += innovation[2] * innovation[2];
  absorb(measured);
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
  const Gate gate = update<2>(config, Source::landmark, sighting.stamp,
                              {H.transpose(), innovation, sigmas.cwiseAbs2().asDiagonal()},
                              stale(config, sighting));
  if (gate == Gate::accepted && config.landmark_wander_s > 0) remember(sighting);
  return gate;
}

// An error that forgets itself over landmark_wander_s (an Ornstein-Uhlenbeck process) is averaged
// by sightings over a span no better than by one in each two of these times.
double LocalizerFilter::stale(const LocalizerConfig& config,
                              const LandmarkSighting& sighting) const {
  if (config.landmark_wander_s <= 0) return 1;
  for (const Seen& seen : seen_) {
    if (!seen.last || seen.landmark_m != sighting.landmark_m) continue;
    const double span_s = std::max(1e-3, hal::seconds(sighting.stamp - *seen.last));
    return std::max(1.0, 2 * config.landmark_wander_s / span_s);
  }
  return 1;
}

void LocalizerFilter::remember(const LandmarkSighting& sighting) {
  const auto same = std::find_if(seen_.begin(), seen_.end(), [&](const Seen& seen) {
    return seen.last && seen.landmark_m == sighting.landmark_m;
  });
  const auto oldest = std::min_element(
      seen_.begin(), seen_.end(), [](const Seen& a, const Seen& b) { return a.last < b.last; });
  *(same != seen_.end() ? same : oldest) = {sighting.landmark_m, sighting.stamp};
}

Gate LocalizerFilter::take(const LocalizerConfig& config, const BeaconRange& range) {
  if (!range.beacon_m.allFinite() || !std::isfinite(range.range_m) || !usable(range.sigma_m))
    return Gate::rejected;
  const Eigen::Vector2d way = position_m_.head<2>() + ahead_m(range.stamp) - range.beacon_m;
  const double range_m = std::max(way.norm(), 0.01);
  const double reads = 1 + beacon_scale_;
  Rows<1> H = Rows<1>::Zero();
  H.middleCols<2>(kP) = reads * way.transpose() / range_m;
  H(0, kBeaconScale) = range_m;
  return update<1>(config, Source::beacon, range.stamp,
                   {H.transpose(), Eigen::Matrix<double, 1, 1>(range.range_m - reads * range_m),
                    Eigen::Matrix<double, 1, 1>(range.sigma_m * range.sigma_m)});
}

template <int N>
Gate LocalizerFilter::update(const LocalizerConfig& config, Source source, hal::Time stamp,
                             const Measurement<N>& m, double stale) {
  const Expected<N> expected = nav::expected<N>(covariance_, m.Ht);
  last_nis_ = squared(m, expected);
  last_dimension_ = N;
  const bool refused = !(last_nis_ <= gate_of(config, N));
  note(source, stamp, refused);
  if (refused) return Gate::rejected;
  absorb<N>({m.Ht, m.innovation, stale * m.R}, expected);
  return Gate::accepted;
}

template <int N>
void LocalizerFilter::absorb(const Measurement<N>& m, const Expected<N>& expected) {
  const Learnt<N> learnt = learn(covariance_, m, expected);
  if (tape_) tape_->measured(m.Ht, m.innovation, learnt.S_inverse, learnt.K);
  correct(learnt.error);
}
template void LocalizerFilter::absorb(const Measurement<2>& m, const Expected<2>& expected);

// Moves the error into the state.
void LocalizerFilter::correct(const State& error) {
  position_m_ += error.segment<3>(kP);
  R_W_B_ = Eigen::Quaterniond(rotation_of(error.segment<3>(kTheta)) * R_W_B_)
               .normalized()
               .toRotationMatrix();
  bias_radps_ += error.segment<3>(kBias);
  slip_ += error.segment<2>(kSlipLeft);
  wander_ += error.segment<2>(kWander);
  beacon_scale_ += error[kBeaconScale];
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

hal::Pose2 FilterPose::pose() const {
  return {position_m, std::atan2(along.y(), along.x())};
}

FilterPose LocalizerFilter::filter_pose() const {
  return {position_m_.head<2>(), R_W_B_.col(0).head<2>(), travel_time_, speed_mps_, turn_radps_};
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
