// The localizer's richer inputs: late, out of order, with lever arms, slopes and outliers.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "hal/angles.hpp"
#include "nav/localizer.hpp"
#include "nav/start_finder.hpp"
#include "tests/support/random_site.hpp"

namespace {

using nav::Gate;
using nav::LocalizerEvent;

using hal::kDeg;
constexpr double kStep_s = 0.05;
constexpr double kGravity = 9.80665;

hal::Time at(double time_s) {
  return hal::Time{} + hal::from_seconds(time_s);
}

// A value that forgets itself over `length`.
class Wander {
 public:
  Wander(double sigma, double length, support::Dice& dice)
      : sigma_(sigma), length_(length), value_(dice.gauss(sigma)) {}
  double step(double by, support::Dice& dice) {
    const double kept = std::exp(-by / length_);
    return value_ = kept * value_ + dice.gauss(sigma_ * std::sqrt(1 - kept * kept));
  }

 private:
  double sigma_, length_, value_;
};

// A robot with all sensors, on ground that is level; what arrives, in the order of arrival.
class Drive {
 public:
  Drive(const nav::LocalizerConfig& config, std::uint64_t seed)
      : config_(config),
        dice_(seed),
        left_(config.slip_sigma, config.slip_length_m, dice_),
        right_(config.slip_sigma, config.slip_length_m, dice_),
        wander_x_(0.02 * std::sqrt(config.gnss_wander_share), config.gnss_wander_s, dice_),
        wander_y_(0.02 * std::sqrt(config.gnss_wander_share), config.gnss_wander_s, dice_),
        bias_(dice_.gauss(config.gyro_bias_sigma_radps)) {}

  // One step of 50 ms.
  void step(double forward_mps, double turn_radps) {
    const double half_m = config_.track_m / 2 * turn_radps * kStep_s;
    const double left_m = forward_mps * kStep_s - half_m, right_m = left_m + 2 * half_m;
    const double moved_left_m = left_m * (1 - left_.step(std::abs(left_m), dice_));
    const double moved_right_m = right_m * (1 - right_.step(std::abs(right_m), dice_));
    const double turn_rad = (moved_right_m - moved_left_m) / config_.track_m;
    const double way_m = (moved_left_m + moved_right_m) / 2;
    const double along = truth.heading_rad + turn_rad / 2;
    for (int half = 1; half <= 2; ++half) {
      nav::InertialSample sample{at(time_s + half * kStep_s / 2)};
      for (int axis = 0; axis < 3; ++axis)
        sample.rate_radps[axis] = bias_ + dice_.gauss(config_.gyro_sigma_radps);
      sample.rate_radps.z() += turn_rad / kStep_s;
      sample.specific_force_mps2 =
          Eigen::Vector3d((way_m - way_before_m_) / (kStep_s * kStep_s),
                          way_m * turn_rad / (kStep_s * kStep_s), kGravity);
      events.push_back(sample);
    }
    way_before_m_ = way_m;
    time_s += kStep_s;
    const double spread = std::sqrt(std::abs(way_m));
    const double bumps_m = dice_.gauss(config_.travel_sigma_m * spread);
    const double aside_m =
        dice_.gauss(std::hypot(config_.side_slip_sigma, config_.travel_sigma_m) * spread);
    truth.position_m += Eigen::Rotation2Dd(along) * Eigen::Vector2d(way_m + bumps_m, aside_m);
    truth.heading_rad = std::remainder(truth.heading_rad + turn_rad, 2 * std::numbers::pi);
    events.push_back(hal::WheelTravel{at(time_s), left_m, right_m});
    if (++steps_ % 4 == 0) fix(way_m / kStep_s, turn_rad / kStep_s);
  }

  Eigen::Vector2d offset_m{0, 0};  // Multipath.
  bool velocities = true;
  hal::Pose2 truth;
  double time_s = 0;
  std::vector<LocalizerEvent> events;

  void start_at(double gnss_sigma_m) { gnss_sigma_m_ = gnss_sigma_m; }
  support::Dice& dice() { return dice_; }

 private:
  void fix(double speed_mps, double turn_radps) {
    const Eigen::Rotation2Dd R(truth.heading_rad);
    const Eigen::Vector2d arm = config_.B_antenna_m.head<2>();
    const double white_m = gnss_sigma_m_ * std::sqrt(1 - config_.gnss_wander_share);
    const Eigen::Vector2d error(wander_x_.step(4 * kStep_s, dice_) + dice_.gauss(white_m),
                                wander_y_.step(4 * kStep_s, dice_) + dice_.gauss(white_m));
    events.push_back(
        nav::GnssPosition{at(time_s), truth.position_m + R * arm + error + offset_m,
                          gnss_sigma_m_ * gnss_sigma_m_ * Eigen::Matrix2d::Identity()});
    if (!velocities) return;
    // What the receiver claims, and what wheels leave open of the time between two reports.
    const double sigma_mps = std::hypot(0.05, config_.gnss_velocity_floor_mps);
    const Eigen::Vector2d B_speed(speed_mps - turn_radps * arm.y(), turn_radps * arm.x());
    events.push_back(nav::GnssVelocity{
        at(time_s), R * B_speed + Eigen::Vector2d(dice_.gauss(sigma_mps), dice_.gauss(sigma_mps)),
        0.05});
  }

  nav::LocalizerConfig config_;
  support::Dice dice_;
  Wander left_, right_, wander_x_, wander_y_;
  double bias_;
  double gnss_sigma_m_ = 0.02;
  double way_before_m_ = 0;
  int steps_ = 0;
};

nav::LocalizerConfig with_antenna() {
  nav::LocalizerConfig config;
  config.B_antenna_m = {0.4, -0.2, 1.1};
  return config;
}

nav::Localizer started(Drive& drive, const nav::LocalizerConfig& config) {
  hal::Pose2 start = drive.truth;
  start.position_m += Eigen::Vector2d(drive.dice().gauss(0.05), drive.dice().gauss(0.05));
  start.heading_rad += drive.dice().gauss(1 * kDeg);
  return {config, start, Eigen::Vector3d(0.0025, 0.0025, std::pow(1 * kDeg, 2)).asDiagonal()};
}

Eigen::Vector3d error_of(const nav::Localizer& localizer, const Drive& drive) {
  Eigen::Vector3d error;
  error << localizer.pose().position_m - drive.truth.position_m,
      std::remainder(localizer.pose().heading_rad - drive.truth.heading_rad, 2 * std::numbers::pi);
  return error;
}

// A way with turns and stops.
void drive_about(Drive& drive, double span_s) {
  const int steps = static_cast<int>(span_s / kStep_s);
  for (int i = 0; i < steps; ++i) {
    const double phase = i * kStep_s;
    if (std::fmod(phase, 12) < 3)
      drive.step(0, 0);
    else
      drive.step(0.8, 0.3 * std::sin(phase / 3));
  }
}

void feed(nav::Localizer& localizer, Drive& drive) {
  for (const auto& event : drive.events) localizer.add(event);
  drive.events.clear();
}

TEST(LocalizerEvents, ClaimsWhatHappensOver1000Runs) {
  const auto config = with_antenna();
  double nees = 0, nis = 0;
  int corrections = 0, outside = 0, refused = 0;
  constexpr int kRuns = 1000;
  for (int run = 0; run < kRuns; ++run) {
    Drive drive(config, 7000 + static_cast<std::uint64_t>(run));
    auto localizer = started(drive, config);
    drive_about(drive, 15);
    for (const auto& event : drive.events) {
      const auto correction = localizer.add(event);
      if (correction.dimension == 0) continue;
      nis += correction.nis / correction.dimension;
      ++corrections;
      refused += correction.gate == Gate::rejected;
    }
    const auto error = error_of(localizer, drive);
    const double one = error.dot(localizer.covariance().inverse() * error);
    nees += one / kRuns;
    outside += one > 7.81;  // Chi-square, 3 degrees of freedom, 95 %.
  }
  RecordProperty("nees_mean", std::to_string(nees));
  RecordProperty("nis_mean", std::to_string(nis / corrections));
  RecordProperty("outside_95_percent", std::to_string(outside));
  EXPECT_GT(nees, 2.4);
  EXPECT_LT(nees, 3.6);
  EXPECT_LT(outside, kRuns / 10);
  EXPECT_GT(outside, kRuns / 100);
  EXPECT_GT(nis / corrections, 0.7);
  EXPECT_LT(nis / corrections, 1.2);
  EXPECT_LT(refused, corrections / 100);
}

TEST(LocalizerEvents, TheSameBitsInWhateverOrderTheyArrive) {
  const auto config = with_antenna();
  Drive drive(config, 1);
  const auto fresh = started(drive, config);
  drive_about(drive, 20);
  const auto in_order = drive.events;
  auto straight = fresh;
  for (const auto& event : in_order) straight.add(event);
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    // Each is late by up to 0.8 s.
    support::Dice dice(seed);
    std::vector<std::pair<double, LocalizerEvent>> arrivals;
    for (const auto& event : in_order)
      arrivals.emplace_back(hal::seconds(nav::stamp_of(event)) + dice.uniform(0, 0.8), event);
    std::stable_sort(arrivals.begin(), arrivals.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    auto shuffled = fresh;
    for (const auto& [when_s, event] : arrivals) EXPECT_FALSE(shuffled.add(event).too_late);
    EXPECT_EQ(shuffled.pose().position_m, straight.pose().position_m);
    EXPECT_EQ(shuffled.pose().heading_rad, straight.pose().heading_rad);
    EXPECT_EQ(shuffled.covariance(), straight.covariance());
  }
}

TEST(LocalizerEvents, AFixThatComesLateCountsForWhenItWasMeasured) {
  nav::LocalizerConfig config;
  config.gnss_wander_share = 0;
  nav::Localizer localizer(config, {}, Eigen::Matrix3d::Identity());
  const auto drive = [&](double from_s, double to_s) {
    for (double t = from_s; t < to_s - 1e-9; t += kStep_s) {
      localizer.add(nav::InertialSample{at(t + kStep_s)});
      localizer.add(hal::WheelTravel{at(t + kStep_s), 0.05, 0.05});
    }
  };
  drive(0, 10);
  // Measured half a second ago, when it had driven 9.5 m.
  const nav::GnssPosition fix{at(9.5), {9.5, 2}, Eigen::Matrix2d::Identity() * 1e-6};
  EXPECT_EQ(localizer.add(fix).gate, Gate::accepted);
  EXPECT_NEAR(localizer.pose().position_m.x(), 10, 0.02);
  EXPECT_NEAR(localizer.pose_at(at(9.5)).position_m.y(), 2, 0.01);
}

TEST(LocalizerEvents, WhatIsOlderThanTheHistoryIsRefusedAndSaidSo) {
  nav::LocalizerConfig config;
  nav::Localizer localizer(config, {}, Eigen::Matrix3d::Identity());
  for (int i = 1; i <= 200; ++i) localizer.add(hal::WheelTravel{at(i * kStep_s), 0.05, 0.05});
  const auto before = localizer.pose();
  const auto late =
      localizer.add(nav::GnssPosition{at(7), {3, 3}, Eigen::Matrix2d::Identity() * 1e-4});
  EXPECT_TRUE(late.too_late);
  EXPECT_EQ(late.gate, Gate::rejected);
  EXPECT_EQ(localizer.pose().position_m, before.position_m);
}

TEST(LocalizerEvents, TheHistoryIsBoundedHoweverManyEventsComeAtOnce) {
  nav::LocalizerConfig config;
  config.history_max = 50;
  nav::Localizer localizer(config, {}, Eigen::Matrix3d::Identity());
  for (int i = 1; i <= 200; ++i) localizer.add(hal::WheelTravel{at(i * 0.001), 0.001, 0.001});
  EXPECT_TRUE(localizer.add(nav::InertialSample{at(0.14)}).too_late);
  EXPECT_FALSE(localizer.add(nav::InertialSample{at(0.16)}).too_late);
}

TEST(LocalizerEvents, MultipathOf40MetresForAMinuteMovesNothingIsNamedAndEnds) {
  const auto config = with_antenna();
  Drive drive(config, 3);
  auto localizer = started(drive, config);
  drive_about(drive, 30);
  feed(localizer, drive);
  EXPECT_TRUE(localizer.faults().empty());
  // The canyon throws the fixes about by tens of metres, another way every two seconds.
  support::Dice dice(9);
  for (int k = 0; k < 30; ++k) {
    const double angle = dice.uniform(0, 2 * std::numbers::pi);
    drive.offset_m = dice.uniform(15, 40) * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    drive_about(drive, 2);
    for (const auto& event : drive.events)
      if (std::holds_alternative<nav::GnssPosition>(event)) {
        ASSERT_EQ(localizer.add(event).gate, Gate::rejected);
      } else {
        localizer.add(event);
      }
    drive.events.clear();
  }
  EXPECT_LT(error_of(localizer, drive).head<2>().norm(), 0.8);  // A minute of dead reckoning.
  ASSERT_EQ(localizer.faults().size(), 1U);
  const auto fault = localizer.faults()[0];
  EXPECT_EQ(fault.source, nav::Source::gnss_position);
  EXPECT_NEAR(fault.since_s, 30, 0.5);
  EXPECT_NE(fault.text.find("multipath"), std::string::npos) << fault.text;
  drive.offset_m = {0, 0};
  drive_about(drive, 5);
  feed(localizer, drive);
  EXPECT_TRUE(localizer.faults().empty());
  EXPECT_LT(error_of(localizer, drive).head<2>().norm(), 0.06);
}

TEST(LocalizerEvents, ALeverArmThatIsKnownLeavesNoCircle) {
  nav::LocalizerConfig config = with_antenna();
  Drive drive(config, 4);
  auto localizer = started(drive, config);
  nav::LocalizerConfig without = config;
  without.B_antenna_m.setZero();
  auto ignorant = localizer;
  ignorant = nav::Localizer(without, localizer.pose(), localizer.covariance());
  for (int i = 0; i < 400; ++i) drive.step(0.5, 0.4);
  int refused = 0, refused_ignorant = 0;
  for (const auto& event : drive.events) {
    const bool fix = std::holds_alternative<nav::GnssPosition>(event);
    refused += localizer.add(event).gate == Gate::rejected && fix;
    refused_ignorant += ignorant.add(event).gate == Gate::rejected && fix;
  }
  EXPECT_LE(refused, 1);
  EXPECT_GT(refused_ignorant, 20);
  EXPECT_LT(error_of(localizer, drive).head<2>().norm(), 0.06);
}

TEST(LocalizerEvents, AnAccelerometerShowsTheSlopeAndTheSlopeShortensTheWay) {
  nav::LocalizerConfig config;
  nav::Localizer localizer(config, {}, Eigen::Matrix3d::Identity() * 1e-6);
  const double slope = 10 * kDeg;  // Nose up.
  const Eigen::Vector3d force(kGravity * std::sin(slope), 0, kGravity * std::cos(slope));
  double t = 0;
  const auto run = [&](double span_s, double way_m) {
    for (const double end_s = t + span_s; t < end_s - 1e-9;) {
      t += kStep_s;
      localizer.add(nav::InertialSample{at(t), {0, 0, 0}, force});
      localizer.add(hal::WheelTravel{at(t), way_m, way_m});
    }
  };
  run(60, 0);
  const Eigen::Vector3d start = localizer.T_W_B().translation();
  run(20, 0.05);
  const Eigen::Vector3d way = localizer.T_W_B().translation() - start;
  EXPECT_NEAR(std::asin(localizer.T_W_B().linear()(2, 0)), slope, 0.3 * kDeg);
  EXPECT_NEAR(way.x(), 20 * std::cos(slope), 0.05);
  EXPECT_NEAR(way.z(), 20 * std::sin(slope), 0.15);
}

TEST(LocalizerEvents, PosesBetweenReportsLieOnTheWay) {
  nav::Localizer localizer({}, {}, Eigen::Matrix3d::Identity() * 1e-6);
  for (int i = 1; i <= 20; ++i) {
    localizer.add(nav::InertialSample{at(i * kStep_s), {0, 0, 0.2}});
    localizer.add(hal::WheelTravel{at(i * kStep_s), 0.05, 0.05});
  }
  const auto half = localizer.pose_at(at(0.525)), before = localizer.pose_at(at(0.5)),
             after = localizer.pose_at(at(0.55));
  EXPECT_LT((half.position_m - (before.position_m + after.position_m) / 2).norm(), 1e-4);
  EXPECT_NEAR(half.heading_rad, (before.heading_rad + after.heading_rad) / 2, 1e-6);
  EXPECT_NEAR(localizer.pose_at(at(1.2)).position_m.x(), localizer.pose().position_m.x() + 0.2,
              0.02);
  EXPECT_EQ(localizer.pose_at(at(9)).position_m, localizer.pose_at(at(1.5)).position_m);
}

TEST(LocalizerEvents, SlipThatLastsIsLearntFromVelocities) {
  nav::LocalizerConfig config;
  config.slip_length_m = 200;
  nav::Localizer localizer(config, {}, Eigen::Matrix3d::Identity() * 1e-4);
  support::Dice dice(5);
  for (int i = 1; i <= 600; ++i) {  // 3 % slip, without positions.
    localizer.add(nav::InertialSample{at(i * kStep_s)});
    localizer.add(hal::WheelTravel{at(i * kStep_s), 0.05, 0.05});
    localizer.add(
        nav::GnssVelocity{at(i * kStep_s), {0.97 + dice.gauss(0.03), dice.gauss(0.03)}, 0.03});
  }
  EXPECT_NEAR(localizer.pose().position_m.x(), 0.97 * 30, 0.25);
}

TEST(LocalizerEvents, StartsFromFixesWhileDrivingAndIsHonest) {
  const auto config = with_antenna();
  double nees = 0;
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    Drive drive(config, seed);
    drive.truth = {{120, -40}, 2.1};
    nav::StartFinder finder(config, {});
    std::optional<nav::FoundStart> start;
    for (int i = 0; i < 1200 && !start; ++i) {
      drive.step(1, 0.15 * std::sin(i * 0.01));
      for (const auto& event : drive.events) finder.add(event);
      drive.events.clear();
      if (i % 20 == 0) start = finder.found();
    }
    ASSERT_TRUE(start) << finder.waiting_for();
    Eigen::Vector3d error;
    error << start->pose.position_m - drive.truth.position_m,
        std::remainder(start->pose.heading_rad - drive.truth.heading_rad, 2 * std::numbers::pi);
    EXPECT_LT(error.head<2>().norm(), 0.5) << seed;
    EXPECT_LT(std::abs(error[2]), 4 * kDeg) << seed;
    nees += error.dot(start->covariance.inverse() * error) / 100;
  }
  RecordProperty("nees_mean", std::to_string(nees));
  EXPECT_LT(nees, 4.5);
  EXPECT_GT(nees, 0.3);
}

TEST(LocalizerEvents, AStartIsNotFoundFromAStandAndOutliersDoNotSpoilIt) {
  const nav::LocalizerConfig config;
  Drive drive(config, 8);
  nav::StartFinder finder(config, {});
  const auto feed_finder = [&] {
    for (const auto& event : drive.events) finder.add(event);
    drive.events.clear();
  };
  EXPECT_EQ(finder.waiting_for(), "0 of 10 satellite fixes");
  for (int i = 0; i < 200; ++i) drive.step(0, 0);
  feed_finder();
  EXPECT_FALSE(finder.found());
  EXPECT_NE(finder.waiting_for().find("drive on"), std::string::npos) << finder.waiting_for();
  for (int i = 0; i < 600; ++i) {
    drive.offset_m = i % 50 < 8 ? Eigen::Vector2d(25, 10) : Eigen::Vector2d(0, 0);
    drive.step(1, 0.1);
  }
  feed_finder();
  const auto start = finder.found();
  ASSERT_TRUE(start) << finder.waiting_for();
  EXPECT_GT(start->fixes_refused, 5U);
  EXPECT_LT((start->pose.position_m - drive.truth.position_m).norm(), 0.5);
}

}  // namespace
