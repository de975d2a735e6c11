#include "nav/follow.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/support/random_site.hpp"

namespace nav {
namespace {

using Eigen::Vector2d;
using hal::Pose2;
using hal::Twist;
using support::Dice;

double wrapped(double angle_rad) {
  return std::remainder(angle_rad, 2 * M_PI);
}

// A unicycle that answers late and inexactly, and a localizer that is a little off.
struct Rig {
  explicit Rig(std::uint64_t seed, bool noisy = true)
      : dice(seed),
        noise(noisy ? 1 : 0),
        forward_scale(1 + noise * dice.uniform(-0.03, 0.03)),
        turn_scale(1 + noise * dice.uniform(-0.05, 0.05)) {}

  void drive(const Twist& command, double period_s) {
    const double lag_s = 0.1;
    for (int i = 0; i < 5; ++i) {
      const double dt = period_s / 5;
      moving.forward_mps += (command.forward_mps - moving.forward_mps) * dt / lag_s;
      moving.turn_radps += (command.turn_radps - moving.turn_radps) * dt / lag_s;
      const double v = moving.forward_mps * forward_scale * (1 + noise * dice.gauss(0.05));
      const double w = moving.turn_radps * turn_scale + noise * v * dice.gauss(0.05);
      truth.heading_rad += w * dt;
      truth.position_m +=
          v * dt * Vector2d(std::cos(truth.heading_rad), std::sin(truth.heading_rad));
    }
  }

  Pose2 believed() {
    return {truth.position_m + noise * Vector2d(dice.gauss(0.005), dice.gauss(0.005)),
            truth.heading_rad + noise * dice.gauss(0.002)};
  }

  Dice dice;
  double noise;
  double forward_scale, turn_scale;
  Pose2 truth;
  Twist moving;
};

struct Drive {
  FollowState state;
  double time_s{};
  double worst_m{};         // Farthest from the path ...
  double worst_corner_m{};  // ... and near its corners.
  double goal_m{};
  double heading_rad{};
  bool limits_kept = true;
  bool changes_kept = true;  // From step to step.
  bool monotone = true;
};

bool change_is_kept(const FollowConfig& config, const Twist& before, const Twist& twist) {
  const double most_mps =
      std::max(config.accel_max_mps2, config.brake_max_mps2) * config.period_s + 1e-9;
  const double faster_mps = config.accel_max_mps2 * config.period_s + 1e-9;
  return std::abs(twist.forward_mps - before.forward_mps) <= most_mps &&
         std::abs(twist.forward_mps) - std::abs(before.forward_mps) <= faster_mps &&
         std::abs(twist.turn_radps - before.turn_radps) <=
             config.turn_accel_max_radps2 * config.period_s + 1e-9;
}

double distance_to_path(const Path& path, const Vector2d& p) {
  double least_m = (path.points_m.front() - p).norm();
  for (std::size_t i = 1; i < path.points_m.size(); ++i)
    least_m = std::min(least_m, distance({path.points_m[i - 1], path.points_m[i]}, p));
  return least_m;
}

bool near_corner(const Path& path, const Vector2d& p) {
  for (std::size_t i = 1; i + 1 < path.points_m.size(); ++i) {
    const Vector2d in = path.points_m[i] - path.points_m[i - 1];
    const Vector2d out = path.points_m[i + 1] - path.points_m[i];
    const double turn = std::abs(std::atan2(cross2(in, out), in.dot(out)));
    if (turn > 0.2 && (path.points_m[i] - p).norm() < 1.0) return true;
  }
  return false;
}

Drive drive(const FollowConfig& config, const Path& path, Rig& rig, double time_max_s) {
  Drive run;
  Twist before;
  while (run.time_s < time_max_s && !done(run.state)) {
    const double progress_m = run.state.progress_m;
    const Twist twist = follow(config, run.state, path, rig.believed());
    run.monotone = run.monotone && run.state.progress_m >= progress_m;
    run.limits_kept = run.limits_kept && std::abs(twist.forward_mps) <= config.speed_max_mps &&
                      std::abs(twist.turn_radps) <= config.turn_max_radps &&
                      twist.forward_mps >= -config.crawl_mps;
    run.changes_kept =
        run.changes_kept && (done(run.state) || change_is_kept(config, before, twist));
    before = twist;
    rig.drive(twist, config.period_s);
    const double off_m = distance_to_path(path, rig.truth.position_m);
    double& worst_m = near_corner(path, rig.truth.position_m) ? run.worst_corner_m : run.worst_m;
    worst_m = std::max(worst_m, off_m);
    run.time_s += config.period_s;
  }
  run.goal_m = (path.points_m.back() - rig.truth.position_m).norm();
  if (path.final_heading_rad)
    run.heading_rad = std::abs(wrapped(*path.final_heading_rad - rig.truth.heading_rad));
  return run;
}

double length_m(const Path& path) {
  double total_m = 0;
  for (std::size_t i = 1; i < path.points_m.size(); ++i)
    total_m += (path.points_m[i] - path.points_m[i - 1]).norm();
  return total_m;
}

// Straights of 0.5 to 25 m that turn by anything up to a half turn.
Path random_path(Dice& dice, double wanted_m) {
  Path path;
  path.points_m.push_back({0, 0});
  double heading = dice.uniform(-M_PI, M_PI);
  for (double total_m = 0; total_m < wanted_m;) {
    const double piece_m = dice.below(3) == 0 ? dice.uniform(0.5, 2) : dice.uniform(2, 25);
    path.points_m.push_back(path.points_m.back() +
                            piece_m * Vector2d(std::cos(heading), std::sin(heading)));
    total_m += piece_m;
    heading += dice.below(3) == 0 ? dice.uniform(-M_PI, M_PI) : dice.uniform(-0.8, 0.8);
  }
  path.final_heading_rad = dice.uniform(-M_PI, M_PI);
  return path;
}

void expect_arrived(const Drive& run, const FollowConfig& config, std::uint64_t seed) {
  EXPECT_EQ(run.state.phase, FollowPhase::arrived) << "seed " << seed << " " << run.time_s << " s";
  EXPECT_TRUE(run.state.arrived);
  EXPECT_TRUE(run.state.in_tolerance) << "seed " << seed;
  EXPECT_LE(run.goal_m, config.position_tolerance_m + 0.015) << "seed " << seed;
  EXPECT_LE(run.heading_rad, config.heading_tolerance_rad + 0.008) << "seed " << seed;
  EXPECT_TRUE(run.limits_kept) << "seed " << seed;
  EXPECT_TRUE(run.changes_kept) << "seed " << seed;
  // What it says of how near it came is what it believed: centimetres from the truth.
  EXPECT_NEAR(run.state.goal_distance_m, run.goal_m, 0.03) << "seed " << seed;
  EXPECT_NEAR(run.state.goal_heading_off_rad, run.heading_rad, 0.012) << "seed " << seed;
  EXPECT_TRUE(run.monotone) << "seed " << seed;
}

TEST(Follow, StaysOnRandomPathsAndArrivesInTime) {
  double worst_m = 0, worst_corner_m = 0, slowest = 0;
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    Rig rig(seed);
    FollowConfig config;
    config.period_s = seed % 3 == 0 ? 0.02 : seed % 3 == 1 ? 0.05 : 0.1;
    const Path path = random_path(rig.dice, rig.dice.uniform(50, 300));
    rig.truth.heading_rad = rig.dice.uniform(-M_PI, M_PI);
    const double corners = static_cast<double>(path.points_m.size());
    const double time_max_s = length_m(path) / 0.7 + 9 * corners + 30;
    const Drive run = drive(config, path, rig, time_max_s);
    expect_arrived(run, config, seed);
    EXPECT_LE(run.worst_m, 0.15) << "seed " << seed;
    EXPECT_LE(run.worst_corner_m, 0.3) << "seed " << seed;
    worst_m = std::max(worst_m, run.worst_m);
    worst_corner_m = std::max(worst_corner_m, run.worst_corner_m);
    slowest = std::max(slowest, run.time_s / time_max_s);
  }
  std::printf("worst %.3f m, at corners %.3f m, slowest %.2f of the time allowed\n", worst_m,
              worst_corner_m, slowest);
}

TEST(Follow, StaysOnTheRoutesOfARoadmap) {
  int runs = 0;
  double worst_m = 0, metres = 0, seconds = 0;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    Rig rig(seed);
    const FreeArea area = support::random_area(rig.dice, {150, 60, 12, 9}, 0.5);
    const Roadmap roadmap = Roadmap::build(area, 0.5);
    for (int i = 0; i < 4; ++i) {
      const auto to = support::random_point(rig.dice, area.standable, 150);
      const auto route = roadmap.route(support::random_point(rig.dice, area.standable, 150), to);
      if (!route || route->length_m < 50) continue;
      FollowConfig config;
      const double heading = rig.dice.uniform(-M_PI, M_PI);
      rig.truth = {route->points_m.front(), 0};
      const Path path = path_along(*route, heading);
      const double corners = static_cast<double>(path.points_m.size());
      const Drive run = drive(config, path, rig, route->length_m / 0.4 + 9 * corners + 30);
      expect_arrived(run, config, seed);
      EXPECT_LE(run.worst_m, 0.15) << "seed " << seed;
      EXPECT_LE(run.worst_corner_m, 0.3) << "seed " << seed;
      worst_m = std::max({worst_m, run.worst_m, run.worst_corner_m});
      metres += route->length_m;
      seconds += run.time_s;
      ++runs;
    }
  }
  EXPECT_GT(runs, 25);
  std::printf("%d routes, worst %.3f m, mean speed %.2f m/s\n", runs, worst_m, metres / seconds);
}

TEST(Follow, IsFastOnAStraight) {
  Rig rig(1, false);
  const Path path{{{0, 0}, {100, 0}}, {}, 0.0};
  const Drive run = drive({}, path, rig, 200);
  expect_arrived(run, {}, 1);
  EXPECT_LT(run.time_s, 108);
  EXPECT_LT(run.worst_m, 0.01);
}

TEST(Follow, TurnsInPlaceBeforeASharpCorner) {
  Rig rig(1, false);
  const Path path{{{0, 0}, {10, 0}, {10, 10}}, {}, std::nullopt};
  FollowState state;
  double turned_rad = 0;
  const FollowConfig config;
  for (int tick = 0; tick < 2000 && !done(state); ++tick) {
    const Twist twist = follow(config, state, path, rig.believed());
    if (twist.forward_mps == 0) turned_rad += twist.turn_radps * config.period_s;
    rig.drive(twist, config.period_s);
  }
  EXPECT_EQ(state.phase, FollowPhase::arrived);
  EXPECT_NEAR(turned_rad, M_PI / 2, 0.2);
}

TEST(Follow, GoesSlowlyWhereItIsNarrow) {
  const FollowConfig config;
  const Path path{{{0, 0}, {10, 0}, {20, 0}, {30, 0}}, {2.0, 0.52, 2.0}, std::nullopt};
  Rig rig(1, false);
  FollowState state;
  double fastest_narrow = 0, fastest = 0;
  for (int tick = 0; tick < 5000 && !done(state); ++tick) {
    const Twist twist = follow(config, state, path, rig.believed());
    double& most =
        rig.truth.position_m.x() > 10 && rig.truth.position_m.x() < 19.9 ? fastest_narrow : fastest;
    most = std::max(most, twist.forward_mps);
    rig.drive(twist, config.period_s);
  }
  EXPECT_EQ(state.phase, FollowPhase::arrived);
  EXPECT_GT(fastest, 0.95);
  EXPECT_LT(fastest_narrow, 0.3);
}

TEST(Follow, BrakesInTimeAtTheGoal) {
  Rig rig(1, false);
  const Path path{{{0, 0}, {20, 0}}, {}, std::nullopt};
  FollowState state;
  const FollowConfig config;
  double overshoot_m = 0, before_mps = 0;
  for (int tick = 0; tick < 2000 && !done(state); ++tick) {
    const Twist twist = follow(config, state, path, rig.believed());
    EXPECT_LE(before_mps - twist.forward_mps, 2 * config.accel_max_mps2 * config.period_s + 1e-9);
    EXPECT_LE(twist.forward_mps - before_mps, config.accel_max_mps2 * config.period_s + 1e-9);
    before_mps = twist.forward_mps;
    rig.drive(twist, config.period_s);
    overshoot_m = std::max(overshoot_m, rig.truth.position_m.x() - 20);
  }
  EXPECT_EQ(state.phase, FollowPhase::arrived);
  EXPECT_LT(overshoot_m, 0.03);
}

// Somebody who sees obstacles caps the speed, at random and down to a stand.
TEST(Follow, KeepsBelowTheCapAndArrivesWhenItIsLifted) {
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    Rig rig(seed);
    const FollowConfig config;
    const Path path = random_path(rig.dice, 40);
    FollowState state;
    Twist before;
    double cap_mps = 1, time_s = 0;
    for (; time_s < 900 && !done(state); time_s += config.period_s) {
      if (rig.dice.below(100) == 0) cap_mps = std::max(0.0, rig.dice.uniform(-0.3, 1));
      if (time_s > 300) cap_mps = 1;
      const Twist twist = follow(config, state, path, rig.believed(), cap_mps);
      const double braked_mps =
          std::max(cap_mps, std::abs(before.forward_mps) - config.brake_max_mps2 * config.period_s);
      EXPECT_LE(std::abs(twist.forward_mps), braked_mps + 1e-9) << "seed " << seed;
      EXPECT_TRUE(done(state) || change_is_kept(config, before, twist)) << "seed " << seed;
      before = twist;
      rig.drive(twist, config.period_s);
    }
    EXPECT_EQ(state.phase, FollowPhase::arrived) << "seed " << seed << " " << name(state.phase);
  }
}

TEST(Follow, WaitsWithoutEndWhileItIsHeld) {
  FollowState state;
  const Path path{{{0, 0}, {20, 0}}, {}, std::nullopt};
  for (int ticks = 0; ticks < 10000; ++ticks)
    EXPECT_EQ(follow({}, state, path, {{0, 0}, 0}, 0).forward_mps, 0);
  EXPECT_FALSE(done(state));
}

// The last half metre is out of reach: the wheels turn, the robot stays.
TEST(Follow, SaysHowNearItCameWhereTheGoalCannotBeReached) {
  Rig rig(3, false);
  const Path path{{{0, 0}, {10, 0}}, {}, 0.0};
  FollowState state;
  for (int ticks = 0; ticks < 10000 && !done(state); ++ticks) {
    rig.drive(follow({}, state, path, rig.believed()), FollowConfig{}.period_s);
    rig.truth.position_m.x() = std::min(rig.truth.position_m.x(), 9.9);
  }
  EXPECT_TRUE(done(state));
  EXPECT_FALSE(state.in_tolerance);
  EXPECT_NEAR(state.goal_distance_m, 0.1, 0.01);
}

TEST(Follow, OnlyTurnsWhenItStandsAtTheGoal) {
  Rig rig(1, false);
  const Path path{{{0, 0}}, {}, 2.0};
  const Drive run = drive({}, path, rig, 30);
  expect_arrived(run, {}, 1);
  EXPECT_LT(run.goal_m, 1e-9);
}

TEST(Follow, GivesUpFarFromThePath) {
  FollowState state;
  const Path path{{{0, 0}, {20, 0}}, {}, std::nullopt};
  const Twist twist = follow({}, state, path, {{5, 3}, 0});
  EXPECT_EQ(state.phase, FollowPhase::off_path);
  EXPECT_EQ(twist.forward_mps, 0);
  EXPECT_EQ(follow({}, state, path, {{0, 0}, 0}).forward_mps, 0);  // For good.
}

TEST(Follow, GivesUpWhenTheWheelsSpin) {
  FollowState state;
  const Path path{{{0, 0}, {20, 0}}, {}, std::nullopt};
  int ticks = 0;
  for (; ticks < 10000 && !done(state); ++ticks) follow({}, state, path, {{0, 0}, 0});
  EXPECT_EQ(state.phase, FollowPhase::stalled);
  EXPECT_LT(ticks * FollowConfig{}.period_s, 30);
}

TEST(Follow, DoesNotMindRepeatedPointsAndFullReversals) {
  Rig rig(5);
  const Path path{{{0, 0}, {0, 0}, {5, 0}, {5, 0}, {1, 0}, {1, 0}}, {1, 1, 1, 1, 1}, 1.0};
  const Drive run = drive({}, path, rig, 120);
  expect_arrived(run, {}, 5);
  EXPECT_LE(run.worst_m, 0.15);
}

}  // namespace
}  // namespace nav
