// The localizer against a small world of its own: what it claims must be what happens.
#include "nav/localizer.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <boost/random/normal_distribution.hpp>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

#include "hal/angles.hpp"

namespace {

using hal::kDeg;
constexpr double kTick_s = 0.05;

// The true errors of the devices; the filter is told the sigmas, not the values.
struct Errors {
  double gyro_sigma_radps = 0.05 * kDeg;
  double gyro_bias_radps = 0.02 * kDeg;
  double slip_sigma = 0.02;
  double slip_length_m = 5;
  double gnss_sigma_m = 0.03;
  double wander_share = 0.5;
  double wander_s = 60;
  int fix_every = 4;  // Steps: 5 Hz.
  bool gyro_works = true;
};

// A process that forgets itself over `length`.
class RandomDrive {
 public:
  RandomDrive(double sigma, double length) : sigma_(sigma), length_(length) {}
  double step(double by, std::mt19937_64& random) {
    const double kept = fresh_ ? 0 : std::exp(-by / length_);
    fresh_ = false;
    value_ = kept * value_ + std::sqrt(1 - kept * kept) * sigma_ * normal_(random);
    return value_;
  }

 private:
  double sigma_, length_, value_ = 0;
  bool fresh_ = true;
  boost::random::normal_distribution<double> normal_;
};

class World {
 public:
  World(const Errors& errors, std::uint64_t seed)
      : errors_(errors),
        random_(seed),
        left_slip_(errors.slip_sigma, errors.slip_length_m),
        right_slip_(errors.slip_sigma, errors.slip_length_m),
        wander_x_(errors.gnss_sigma_m * std::sqrt(errors.wander_share), errors.wander_s),
        wander_y_(wander_x_) {}

  // Drives (or stands) for a while; the hook may spoil a fix.
  void run(nav::Localizer& filter, double forward_mps, double turn_radps, double span_s,
           const std::function<void(hal::GnssFix&)>& spoil = {}) {
    const int steps = static_cast<int>(std::lround(span_s / kTick_s));
    for (int i = 0; i < steps; ++i) {
      step(filter, forward_mps, turn_radps);
      if (++count_ % errors_.fix_every == 0) fix(filter, spoil);
    }
  }

  double normal(double sigma) { return sigma * normal_(random_); }
  hal::Time now() const { return now_; }

  hal::Pose2 truth;
  std::vector<nav::Gate> gates;

 private:
  void step(nav::Localizer& filter, double forward_mps, double turn_radps) {
    now_ += hal::from_seconds(kTick_s);
    const double half_m = 0.3 * turn_radps * kTick_s;
    const double left_m = forward_mps * kTick_s - half_m, right_m = left_m + 2 * half_m;
    const double slip_left = left_slip_.step(std::abs(left_m), random_);
    const double slip_right = right_slip_.step(std::abs(right_m), random_);
    const double moved_left_m = left_m * (1 - slip_left),
                 moved_right_m = right_m * (1 - slip_right);
    const double turn_rad = (moved_right_m - moved_left_m) / 0.6;
    const double along = truth.heading_rad + turn_rad / 2;
    truth.position_m +=
        (moved_left_m + moved_right_m) / 2 * Eigen::Vector2d(std::cos(along), std::sin(along));
    truth.heading_rad += turn_rad;
    if (errors_.gyro_works)
      filter.predict(hal::ImuSample{
          now_, turn_rad / kTick_s + errors_.gyro_bias_radps + normal(errors_.gyro_sigma_radps)});
    filter.predict(hal::WheelTravel{now_, left_m, right_m});
  }

  void fix(nav::Localizer& filter, const std::function<void(hal::GnssFix&)>& spoil) {
    const double span_s = kTick_s * errors_.fix_every;
    const double white_m = errors_.gnss_sigma_m * std::sqrt(1 - errors_.wander_share);
    const Eigen::Vector2d error(wander_x_.step(span_s, random_) + normal(white_m),
                                wander_y_.step(span_s, random_) + normal(white_m));
    hal::GnssFix fix{now_, truth.position_m + error, errors_.gnss_sigma_m};
    if (spoil) spoil(fix);
    gates.push_back(filter.correct(fix));
  }

  Errors errors_;
  std::mt19937_64 random_;
  boost::random::normal_distribution<double> normal_;
  RandomDrive left_slip_, right_slip_, wander_x_, wander_y_;
  hal::Time now_{};
  int count_ = 0;
};

Eigen::Matrix3d start_covariance() {
  return Eigen::Vector3d(0.05 * 0.05, 0.05 * 0.05, std::pow(1 * kDeg, 2)).asDiagonal();
}

// A filter whose start pose is wrong by as much as its covariance says.
nav::Localizer filter_for(World& world, const nav::LocalizerConfig& config = {}) {
  hal::Pose2 start = world.truth;
  start.position_m += Eigen::Vector2d(world.normal(0.05), world.normal(0.05));
  start.heading_rad += world.normal(1 * kDeg);
  return {config, start, start_covariance()};
}

Eigen::Vector3d error_of(const nav::Localizer& filter, const World& world) {
  const auto pose = filter.pose();
  Eigen::Vector3d error;
  error << pose.position_m - world.truth.position_m,
      std::remainder(pose.heading_rad - world.truth.heading_rad, 2 * std::numbers::pi);
  return error;
}

double nees(const nav::Localizer& filter, const World& world) {
  const auto error = error_of(filter, world);
  return error.dot(filter.covariance().inverse() * error);
}

struct Figures {
  double nees_mean{};
  double nees_last_mean{};
  double position_rms_m{}, position_p95_m{};
  double heading_rms_rad{}, heading_p95_rad{};
  int rejected{}, fixes{};
};

// Drives of 15-25 m with turns, each followed by a stop of 300 s: a tour of stations.
Figures monte_carlo(const Errors& errors, const nav::LocalizerConfig& config, int runs) {
  Figures figures;
  std::vector<double> position, heading;
  int samples = 0;
  for (int run = 0; run < runs; ++run) {
    World world(errors, 1000 + static_cast<std::uint64_t>(run));
    auto filter = filter_for(world, config);
    for (int leg = 0; leg < 4; ++leg) {
      const double way_m = 15 + 2.5 * ((run + leg) % 5);
      world.run(filter, 0, (leg % 2 ? 1 : -1) * 45 * kDeg, 1.0 + leg % 3);
      world.run(filter, 1, 0.05, way_m / 2);
      world.run(filter, 1, -0.1, way_m / 2);
      figures.nees_mean += nees(filter, world);
      world.run(filter, 0, 0, 300);
      figures.nees_mean += nees(filter, world);
      samples += 2;
    }
    figures.nees_last_mean += nees(filter, world) / runs;
    const auto error = error_of(filter, world);
    position.push_back(error.head<2>().norm());
    heading.push_back(std::abs(error[2]));
    for (const auto gate : world.gates) figures.rejected += gate != nav::Gate::accepted;
    figures.fixes += static_cast<int>(world.gates.size());
  }
  const auto rms = [](const std::vector<double>& values) {
    double sum = 0;
    for (const double value : values) sum += value * value;
    return std::sqrt(sum / static_cast<double>(values.size()));
  };
  const auto p95 = [](std::vector<double> values) {
    std::sort(values.begin(), values.end());
    return values[values.size() * 95 / 100];
  };
  figures.nees_mean /= samples;
  figures.position_rms_m = rms(position);
  figures.position_p95_m = p95(position);
  figures.heading_rms_rad = rms(heading);
  figures.heading_p95_rad = p95(heading);
  testing::Test::RecordProperty("nees_mean", std::to_string(figures.nees_mean));
  testing::Test::RecordProperty("position_rms_m", std::to_string(figures.position_rms_m));
  testing::Test::RecordProperty("heading_rms_deg", std::to_string(figures.heading_rms_rad / kDeg));
  return figures;
}

TEST(Localizer, ClaimsWhatHappensOver200ToursWithStopsOf300Seconds) {
  const auto figures = monte_carlo({}, {}, 200);
  EXPECT_GT(figures.nees_mean, 2);
  EXPECT_LT(figures.nees_mean, 4);
  EXPECT_GT(figures.nees_last_mean, 2);
  EXPECT_LT(figures.nees_last_mean, 4);
  EXPECT_LT(figures.position_p95_m, 0.1);
  EXPECT_LT(figures.heading_rms_rad, 0.5 * kDeg);
  EXPECT_LT(figures.rejected, figures.fixes / 100);
}

TEST(Localizer, StaysHonestWhenTheFixesWanderFasterOrSlowerThanItBelieves) {
  for (const double wander_s : {20.0, 180.0}) {
    Errors errors;
    errors.wander_s = wander_s;
    const auto figures = monte_carlo(errors, {}, 60);
    EXPECT_GT(figures.nees_mean, 1) << wander_s;
    EXPECT_LT(figures.nees_mean, 6) << wander_s;
  }
}

TEST(Localizer, StaysHonestWhenSlipChangesFasterOrSlowerThanItBelieves) {
  for (const double slip_length_m : {0.1, 50.0}) {
    Errors errors;
    errors.slip_length_m = slip_length_m;
    const auto figures = monte_carlo(errors, {}, 60);
    EXPECT_GT(figures.nees_mean, 1.5) << slip_length_m;
    EXPECT_LT(figures.nees_mean, 4.5) << slip_length_m;
  }
}

TEST(Localizer, ASilentGyroLeavesHeadingToWheelsAndFixes) {
  Errors errors;
  errors.gyro_works = false;
  const auto figures = monte_carlo(errors, {}, 60);
  EXPECT_LT(figures.position_p95_m, 0.15);
  EXPECT_LT(figures.heading_rms_rad, 2 * kDeg);
  EXPECT_GT(figures.nees_mean, 1);
  EXPECT_LT(figures.nees_mean, 5);
}

// A turn on the spot, whose wheels are told 50 times a second. Where no sample of the gyro falls
// between two of their reports, the wheels tell the turn, and the next sample tells it again.
TEST(Localizer, TurnsOnceHoweverSeldomItsGyroSpeaks) {
  for (const int every_ms : {20, 25, 30, 45, 60, 75, 100, 150, 200, 250}) {
    SCOPED_TRACE(every_ms);
    const nav::LocalizerConfig config;
    nav::Localizer localizer(config, {}, 1e-8 * Eigen::Matrix3d::Identity());
    double heading_rad = 0, told_rad = 0;
    for (int now_ms = 0; now_ms <= 6000; ++now_ms) {
      const hal::Time now{std::chrono::milliseconds(now_ms)};
      const double rate_radps =
          45 * kDeg * std::clamp(std::min(now_ms - 1000, 5000 - now_ms) / 200.0, 0.0, 1.0);
      heading_rad += 0.001 * rate_radps;
      if (now_ms % every_ms == 0) localizer.predict(hal::ImuSample{now, rate_radps});
      if (now_ms % 20 != 0) continue;
      const double side_m =
          (heading_rad - std::exchange(told_rad, heading_rad)) * config.track_m / 2;
      localizer.predict(hal::WheelTravel{now, -side_m, side_m});
    }
    const double sigma_rad = std::sqrt(localizer.covariance()(2, 2));
    const double off_rad =
        std::remainder(localizer.pose().heading_rad - heading_rad, 2 * std::numbers::pi);
    EXPECT_LT(std::abs(off_rad), 3 * sigma_rad + 1.0 * kDeg);
    EXPECT_LT(std::abs(off_rad), 8 * kDeg);
    EXPECT_LT(sigma_rad, 8 * kDeg);
    EXPECT_LT(localizer.pose().position_m.norm(), 0.02);
  }
}

TEST(Localizer, StandingStillAddsNoUncertaintyAndNoTurn) {
  Errors errors;
  errors.fix_every = 1 << 30;  // No fixes.
  World world(errors, 5);
  auto filter = filter_for(world);
  world.run(filter, 1, 0.1, 10);
  world.run(filter, 0, 0, 1);
  const auto before = filter.covariance();
  const auto pose = filter.pose();
  EXPECT_TRUE(filter.standing());
  world.run(filter, 0, 0, 300);
  EXPECT_LE(filter.covariance()(2, 2), before(2, 2) * (1 + 1e-9));
  EXPECT_NEAR(filter.covariance()(0, 0), before(0, 0), before(0, 0) * 0.1);
  // What the bias turned on the way is taken back now that the bias is known: no more than that.
  EXPECT_LT(std::abs(filter.pose().heading_rad - pose.heading_rad), 1 * kDeg);
  EXPECT_NEAR(filter.gyro_bias_radps(), 0.02 * kDeg, 0.003 * kDeg);
}

TEST(Localizer, FiveMinutesOfFixesDoNotMakeItOverconfident) {
  World world({}, 7);
  auto filter = filter_for(world);
  world.run(filter, 1, 0, 20);
  world.run(filter, 0, 0, 300);
  const double sigma_m = std::sqrt(filter.covariance()(0, 0));
  // 1500 independent fixes of 0.03 m would claim under 0.001 m.
  EXPECT_GT(sigma_m, 0.004);
  EXPECT_LT(sigma_m, 0.03);
}

TEST(Localizer, HeadingIsFoundByDrivingStraightWithFixes) {
  World world({}, 9);
  hal::Pose2 start = world.truth;
  start.heading_rad += 10 * kDeg;
  Eigen::Matrix3d covariance = start_covariance();
  covariance(2, 2) = std::pow(10 * kDeg, 2);
  nav::Localizer filter({}, start, covariance);
  world.run(filter, 1, 0, 40);
  EXPECT_LT(std::abs(error_of(filter, world)[2]), 0.5 * kDeg);
  EXPECT_LT(std::sqrt(filter.covariance()(2, 2)), 0.5 * kDeg);
}

TEST(Localizer, JumpsOf20MetresDoNotMoveIt) {
  World world({}, 11);
  auto filter = filter_for(world);
  world.run(filter, 1, 0.05, 30);
  const auto jump = [](hal::GnssFix& fix) { fix.position_m.x() += 20; };
  for (const double speed_mps : {0.0, 1.0}) {
    world.gates.clear();
    world.run(filter, speed_mps, 0, speed_mps > 0 ? 8 : 120, jump);
    for (const auto gate : world.gates) ASSERT_EQ(gate, nav::Gate::rejected);
    EXPECT_LT(error_of(filter, world).head<2>().norm(), 0.25);
  }
  world.gates.clear();
  world.run(filter, 1, 0, 5);
  EXPECT_EQ(std::count(world.gates.begin(), world.gates.end(), nav::Gate::accepted), 25);
}

TEST(Localizer, ScatteredOutliersWhileDrivingNeverAddUpToAReset) {
  World world({}, 13);
  auto filter = filter_for(world);
  const auto scatter = [&](hal::GnssFix& fix) {
    fix.position_m += Eigen::Vector2d(world.normal(20), 20 + std::abs(world.normal(5)));
  };
  world.run(filter, 1, 0, 40, scatter);
  for (const auto gate : world.gates) ASSERT_EQ(gate, nav::Gate::rejected);
}

// All fixes 40 m off, all alike, for longer than it takes to be lost otherwise.
TEST(Localizer, MultipathThatLastsDoesNotMoveItWhileItsWheelsDisagree) {
  World world({}, 19);
  auto filter = filter_for(world);
  world.run(filter, 1, 0.05, 30);
  const auto jump = [](hal::GnssFix& fix) { fix.position_m += Eigen::Vector2d(25, -30); };
  world.gates.clear();
  world.run(filter, 1, 0.02, 45, jump);
  for (const auto gate : world.gates) ASSERT_EQ(gate, nav::Gate::rejected);
  EXPECT_LT(error_of(filter, world).head<2>().norm(), 1.5);
  EXPECT_LT(nees(filter, world), 16);
  EXPECT_FALSE(filter.faults().empty());
  world.gates.clear();
  world.run(filter, 1, 0.02, 10);
  EXPECT_EQ(std::count(world.gates.begin(), world.gates.end(), nav::Gate::reset), 0);
  EXPECT_GE(std::count(world.gates.begin(), world.gates.end(), nav::Gate::accepted), 45);
  EXPECT_LT(error_of(filter, world).head<2>().norm(), 0.15);
}

// However long it lasts, when scans say that the robot is where it thinks.
TEST(Localizer, MultipathNeverMovesItWhileScansConfirmWhereItIs) {
  World world({}, 21);
  auto filter = filter_for(world);
  world.run(filter, 1, 0.05, 30);
  const auto jump = [](hal::GnssFix& fix) { fix.position_m += Eigen::Vector2d(25, -30); };
  world.gates.clear();
  for (int leg = 0; leg < 10; ++leg) {
    world.run(filter, 1, 0.03, 25, jump);
    const Eigen::Matrix3d covariance =
        Eigen::Vector3d(0.01, 0.01, 0.1 * kDeg).cwiseAbs2().asDiagonal();
    const auto fix = filter.add(nav::PoseFix{world.now(), world.truth, covariance});
    ASSERT_EQ(fix.gate, nav::Gate::accepted) << leg;
    ASSERT_LT(error_of(filter, world).head<2>().norm(), 0.1) << leg;
  }
  for (const auto gate : world.gates) ASSERT_EQ(gate, nav::Gate::rejected);
  world.gates.clear();
  world.run(filter, 1, 0, 10);
  EXPECT_GE(std::count(world.gates.begin(), world.gates.end(), nav::Gate::accepted), 45);
}

TEST(Localizer, FindsItsWayBackWhenItWasCarriedAway) {
  World world({}, 15);
  auto filter = filter_for(world);
  world.run(filter, 1, 0, 20);
  world.truth.position_m.y() += 15;
  world.run(filter, 1, 0, 50);
  for (const auto gate : world.gates) ASSERT_NE(gate, nav::Gate::reset);  // Might be multipath.
  world.run(filter, 1, 0, 40);
  EXPECT_EQ(std::count(world.gates.begin(), world.gates.end(), nav::Gate::reset), 1);
  EXPECT_LT(error_of(filter, world).head<2>().norm(), 0.1);
  EXPECT_LT(nees(filter, world), 16);
}

TEST(Localizer, UselessReportsChangeNothing) {
  nav::Localizer filter({}, {}, start_covariance());
  const double nan = std::nan("");
  const hal::Time at{std::chrono::seconds(1)};
  EXPECT_EQ(filter.correct({at, {nan, 0}, 0.03}), nav::Gate::rejected);
  EXPECT_EQ(filter.correct({at, {0, 0}, -0.03}), nav::Gate::rejected);
  EXPECT_EQ(filter.correct({at, {0, 0}, nan}), nav::Gate::rejected);
  filter.predict(hal::ImuSample{at, nan});
  filter.predict(hal::WheelTravel{at, nan, 1});
  EXPECT_EQ(filter.pose().position_m, Eigen::Vector2d(0, 0));
  EXPECT_TRUE(filter.covariance().isApprox(start_covariance()));
}

TEST(Localizer, PerfectDevicesGiveAPerfectPose) {
  Errors errors;
  errors.gyro_sigma_radps = errors.slip_sigma = errors.gnss_sigma_m = 0;
  nav::LocalizerConfig config;
  config.gyro_sigma_radps = config.slip_sigma = 0;
  const auto figures = monte_carlo(errors, config, 5);
  EXPECT_LT(figures.position_p95_m, 0.01);
  EXPECT_LT(figures.heading_rms_rad, 0.1 * kDeg);
  EXPECT_LT(figures.nees_mean, 10);
  EXPECT_EQ(figures.rejected, 0);
}

TEST(Localizer, CovarianceStaysSymmetricAndPositive) {
  World world({}, 17);
  auto filter = filter_for(world);
  for (int i = 0; i < 20; ++i) {
    world.run(filter, i % 3 == 0 ? 0 : 1, 0.3 * (i % 5 - 2), 10);
    const Eigen::Matrix3d P = filter.covariance();
    EXPECT_TRUE(P.isApprox(P.transpose()));
    EXPECT_GT(P.determinant(), 0);
    EXPECT_GT((P.topLeftCorner<2, 2>().determinant()), 0);
  }
}

TEST(Localizer, PoseFollowsExactTravelOnAnArc) {
  nav::Localizer filter({}, {}, Eigen::Matrix3d::Identity() * 1e-6);
  const double radius_m = 5, step_rad = 0.01;
  hal::Time now{};
  for (int i = 0; i < 157; ++i) {
    now += hal::from_seconds(0.05);
    filter.predict(hal::ImuSample{now, step_rad / 0.05});
    filter.predict(hal::WheelTravel{now, (radius_m - 0.3) * step_rad, (radius_m + 0.3) * step_rad});
  }
  const double angle = 157 * step_rad;
  EXPECT_NEAR(filter.pose().position_m.x(), radius_m * std::sin(angle), 1e-3);
  EXPECT_NEAR(filter.pose().position_m.y(), radius_m * (1 - std::cos(angle)), 1e-3);
  EXPECT_NEAR(filter.pose().heading_rad, angle, 1e-9);
}

}  // namespace
