// Ranges that read long, sightings whose errors last, and what a whole log tells of each pose.
#include "nav/smoother.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <variant>
#include <vector>

#include "hal/angles.hpp"
#include "nav/localizer.hpp"
#include "tests/support/random_site.hpp"

namespace {

using hal::kDeg;
constexpr double kWheelPeriod_s = 0.1;
const std::array<Eigen::Vector2d, 4> kMasts{{{-20, -15}, {25, -12}, {18, 22}, {-15, 25}}};

hal::Time moment(double time_s) {
  return hal::Time{} + hal::from_seconds(time_s);
}

// An error that forgets itself over `length`.
class Lasting {
 public:
  Lasting(double sigma, double length, support::Dice& dice)
      : sigma_(sigma), length_(length), value_(dice.gauss(sigma)) {}
  double after(double by, support::Dice& dice) {
    const double kept = std::exp(-by / length_);
    return value_ = kept * value_ + dice.gauss(sigma_ * std::sqrt(1 - kept * kept));
  }

 private:
  double sigma_, length_, value_;
};

// A drive in bends: what the wheels say, and where they were at each report.
struct BendyDrive {
  nav::LocalizerConfig config;
  hal::Pose2 start;
  Eigen::Matrix3d covariance = Eigen::Vector3d(0.01, 0.01, 1e-3).asDiagonal();
  std::vector<nav::LocalizerEvent> events;
  std::vector<hal::Pose2> truth;
};

BendyDrive bendy_drive(support::Dice& dice, int ticks) {
  BendyDrive drive;
  drive.config.wheel_turn_error = drive.config.tilt_sigma_rad = 0;
  Lasting left(drive.config.slip_sigma, drive.config.slip_length_m, dice),
      right(drive.config.slip_sigma, drive.config.slip_length_m, dice);
  hal::Pose2 truth;
  drive.start = {{dice.gauss(0.1), dice.gauss(0.1)}, dice.gauss(std::sqrt(1e-3))};
  for (int i = 1; i <= ticks; ++i) {
    const double turn_rad = 0.04 * std::sin(i * 0.013),
                 half_m = drive.config.track_m / 2 * turn_rad;
    const double left_m = 0.08 - half_m, right_m = 0.08 + half_m;
    const double moved_left_m = left_m * (1 - left.after(left_m, dice));
    const double moved_right_m = right_m * (1 - right.after(right_m, dice));
    const double turned_rad = (moved_right_m - moved_left_m) / drive.config.track_m;
    const double bumps_m = drive.config.travel_sigma_m * std::sqrt(0.08);
    const double slide_m = drive.config.side_slip_sigma * std::sqrt(0.08);
    truth.position_m += Eigen::Rotation2Dd(truth.heading_rad + turned_rad / 2) *
                        Eigen::Vector2d((moved_left_m + moved_right_m) / 2 + dice.gauss(bumps_m),
                                        dice.gauss(std::hypot(bumps_m, slide_m)));
    truth.heading_rad += turned_rad;
    drive.truth.push_back(truth);
    drive.events.emplace_back(hal::WheelTravel{moment(i * kWheelPeriod_s), left_m, right_m});
  }
  return drive;
}

// Mean squared normalised error over the second half of the drives, of poses and localizer.
struct Claims {
  double filter_nees{}, smoothed_nees{}, filter_m2{}, smoothed_m2{};
  int count{};
  double beacon_scale2{};
};

Eigen::Vector3d off_by(const hal::Pose2& pose, const hal::Pose2& truth) {
  Eigen::Vector3d error;
  error << pose.position_m - truth.position_m, hal::wrapped(pose.heading_rad - truth.heading_rad);
  return error;
}

void judge(const BendyDrive& drive, Claims& claims) {
  nav::Localizer localizer(drive.config, drive.start, drive.covariance);
  const auto log = nav::smooth(drive.config, drive.start, drive.covariance, drive.events);
  ASSERT_EQ(log.poses.size(), drive.truth.size());
  std::size_t tick = 0;
  for (const auto& event : drive.events) {
    localizer.add(event);
    if (!std::holds_alternative<hal::WheelTravel>(event)) continue;
    const std::size_t now = tick++;
    if (now < drive.truth.size() / 2 || now % 50 != 0) continue;
    const auto& smoothed = log.poses[now];
    const auto filter_off = off_by(localizer.pose(), drive.truth[now]);
    const auto smoothed_off = off_by(smoothed.pose, drive.truth[now]);
    claims.filter_nees += filter_off.dot(localizer.covariance().inverse() * filter_off);
    claims.smoothed_nees += smoothed_off.dot(smoothed.covariance.inverse() * smoothed_off);
    claims.filter_m2 += filter_off.head<2>().squaredNorm();
    claims.smoothed_m2 += smoothed_off.head<2>().squaredNorm();
    ++claims.count;
  }
  claims.beacon_scale2 += std::pow(log.last.beacon_scale() - 0.07, 2);
}

// Four beacons in turn, all 7 % long.
void add_ranges(BendyDrive& drive, support::Dice& dice) {
  std::vector<nav::LocalizerEvent> events;
  for (std::size_t i = 0; i < drive.truth.size(); ++i) {
    events.push_back(drive.events[i]);
    const Eigen::Vector2d& mast = kMasts[i / 5 % kMasts.size()];
    if (i % 5 == 0)
      events.emplace_back(nav::BeaconRange{
          nav::stamp_of(drive.events[i]), mast,
          1.07 * (mast - drive.truth[i].position_m).norm() + dice.gauss(0.5), 0.5});
  }
  drive.events = std::move(events);
}

TEST(Smoother, BeaconsThatReadLongAreSeenThroughAndLaterRangesCountForEarlierPoses) {
  support::Dice dice(5);
  Claims claims;
  constexpr int kRuns = 150;
  for (int run = 0; run < kRuns; ++run) {
    BendyDrive drive = bendy_drive(dice, 1500);
    drive.config.beacon_scale_sigma = 0.1;
    add_ranges(drive, dice);
    judge(drive, claims);
  }
  EXPECT_NEAR(claims.filter_nees / claims.count, 3, 0.4);
  EXPECT_NEAR(claims.smoothed_nees / claims.count, 3, 0.4);
  EXPECT_LT(claims.smoothed_m2, 0.7 * claims.filter_m2);
  EXPECT_LT(std::sqrt(claims.beacon_scale2 / kRuns), 0.004);
}

// Sightings of four marks whose errors last for 8 s.
Claims sightings_judged(double wander_s) {
  support::Dice dice(6);
  Claims claims;
  for (int run = 0; run < 20; ++run) {
    BendyDrive drive = bendy_drive(dice, 1500);
    drive.config.landmark_wander_s = wander_s;
    std::vector<nav::LocalizerEvent> events;
    std::vector<Lasting> ranges, bearings;
    for (std::size_t i = 0; i < kMasts.size(); ++i) {
      ranges.emplace_back(0.3, 8, dice);
      bearings.emplace_back(0.03, 8, dice);
    }
    for (std::size_t i = 0; i < drive.truth.size(); ++i) {
      events.push_back(drive.events[i]);
      for (std::size_t mast = 0; mast < kMasts.size() && i % 3 == 0; ++mast) {
        const Eigen::Vector2d way = kMasts[mast] - drive.truth[i].position_m;
        events.emplace_back(nav::LandmarkSighting{
            nav::stamp_of(drive.events[i]), kMasts[mast],
            way.norm() + ranges[mast].after(3 * kWheelPeriod_s, dice),
            hal::wrapped(std::atan2(way.y(), way.x()) - drive.truth[i].heading_rad +
                         bearings[mast].after(3 * kWheelPeriod_s, dice)),
            0.3, 0.03});
      }
    }
    drive.events = std::move(events);
    judge(drive, claims);
  }
  return claims;
}

TEST(Smoother, SightingsWhoseErrorsLastTellLess) {
  const Claims told = sightings_judged(8), not_told = sightings_judged(0);
  EXPECT_GT(told.filter_nees / told.count, 1.2);  // On the safe side.
  EXPECT_LT(told.filter_nees / told.count, 4);
  EXPECT_GT(told.smoothed_nees / told.count, 1.2);
  EXPECT_LT(told.smoothed_nees / told.count, 4.5);
  EXPECT_GT(not_told.filter_nees / not_told.count, 8);
}

// On a straight line, with nothing but bumps, the best estimate is that of least squares.
TEST(Smoother, IsTheLeastSquaresOfTheWholeLog) {
  nav::LocalizerConfig config;
  config.slip_sigma = config.side_slip_sigma = config.tilt_sigma_rad = 0;
  config.travel_sigma_m = 0.1;
  config.gnss_wander_share = 0;
  constexpr int kSteps = 700;  // More than are kept at a time.
  support::Dice dice(7);
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(kSteps + 1, kSteps + 1);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(kSteps + 1);
  information(0, 0) = 1 / 0.04;
  std::vector<nav::LocalizerEvent> events;
  for (int i = 1; i <= kSteps; ++i) {
    const double weight = 1 / (0.01 * 0.5);
    events.emplace_back(hal::WheelTravel{moment(i), 0.5, 0.5});
    information(i, i) += weight;
    information(i - 1, i - 1) += weight;
    information(i, i - 1) = information(i - 1, i) = -weight;
    right[i] += 0.5 * weight;
    right[i - 1] -= 0.5 * weight;
    if (i % 7 != 0) continue;
    const double fix_m = 0.5 * i + dice.gauss(0.3);
    events.emplace_back(
        nav::GnssPosition{moment(i), {fix_m, 0}, 0.09 * Eigen::Matrix2d::Identity()});
    information(i, i) += 1 / 0.09;
    right[i] += fix_m / 0.09;
  }
  const auto log = nav::smooth(config, {}, Eigen::Vector3d(0.04, 0.04, 0).asDiagonal(), events);
  ASSERT_EQ(log.poses.size(), static_cast<std::size_t>(kSteps));
  for (const auto& taken : log.taken) ASSERT_EQ(taken.gate, nav::Gate::accepted);
  const Eigen::MatrixXd covariance = information.inverse();
  const Eigen::VectorXd best = covariance * right;
  for (int i = 1; i <= kSteps; ++i) {
    const auto& pose = log.poses[static_cast<std::size_t>(i - 1)];
    ASSERT_NEAR(pose.pose.position_m.x(), best[i], 1e-6) << i;
    ASSERT_NEAR(pose.covariance(0, 0), covariance(i, i), 1e-7) << i;
  }
}

TEST(Smoother, WhatComesLateInTheFileCountsWhereItBelongs) {
  support::Dice dice(8);
  BendyDrive drive = bendy_drive(dice, 600);
  add_ranges(drive, dice);
  const auto in_order = nav::smooth(drive.config, drive.start, drive.covariance, drive.events);
  std::stable_partition(drive.events.begin(), drive.events.end(), [](const auto& event) {
    return std::holds_alternative<hal::WheelTravel>(event);
  });
  const auto late = nav::smooth(drive.config, drive.start, drive.covariance, drive.events);
  ASSERT_EQ(late.poses.size(), in_order.poses.size());
  for (std::size_t i = 0; i < late.poses.size(); ++i)
    ASSERT_EQ(late.poses[i].pose.position_m, in_order.poses[i].pose.position_m) << i;
}

}  // namespace
