#include "nav/obstacle_map.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/random_site.hpp"

namespace nav {
namespace {

using Eigen::Vector2d;
using hal::Time;
using std::chrono::milliseconds;

struct Disc {
  Vector2d center_m;
  double radius_m;
};

// What a scanner that looks all round ahead (270 deg) sees of some discs.
hal::Profile look(const hal::Pose2& at, const std::vector<Disc>& discs, double nowhere_m = 20) {
  hal::Profile profile;
  profile.angle_first_rad = -0.75 * M_PI;
  profile.angle_step_rad = 1.5 * M_PI / 540;
  for (int i = 0; i <= 540; ++i) {
    const double angle = at.heading_rad + profile.angle_first_rad + i * profile.angle_step_rad;
    const Vector2d way(std::cos(angle), std::sin(angle));
    double range_m = nowhere_m;
    for (const Disc& disc : discs) {
      const Vector2d to = disc.center_m - at.position_m;
      const double along = way.dot(to);
      const double root = disc.radius_m * disc.radius_m - (to.squaredNorm() - along * along);
      if (along > 0 && root >= 0) range_m = std::min(range_m, along - std::sqrt(root));
    }
    profile.ranges_m.push_back(static_cast<float>(range_m));
  }
  return profile;
}

Time at_ms(int ms) {
  return Time(milliseconds(ms));
}

const hal::Pose2 kHere{{0, 0}, 0};
const Disc kPole{{3, 0.5}, 0.15};

TEST(ObstacleMap, HoldsWhatItSawTwice) {
  ObstacleMap map;
  map.add(look(kHere, {kPole}), kHere, at_ms(0));
  map.add(look(kHere, {kPole}), kHere, at_ms(100));
  ASSERT_FALSE(map.points_m().empty());
  for (const Vector2d& point : map.points_m())
    EXPECT_NEAR((point - kPole.center_m).norm(), kPole.radius_m, 1e-3);
}

TEST(ObstacleMap, DoesNotBelieveOneGlint) {
  ObstacleMap map;
  hal::Profile glint = look(kHere, {});
  glint.ranges_m[270] = 2;
  map.add(glint, kHere, at_ms(0));
  EXPECT_TRUE(map.points_m().empty());
}

TEST(ObstacleMap, IsEmptyAgainWhereSomebodyWalkedAway) {
  for (const double behind_m : {20.0, 0.0}) {  // A wall far behind, or nothing.
    ObstacleMap map;
    map.add(look(kHere, {kPole}, behind_m), kHere, at_ms(0));
    map.add(look(kHere, {kPole}, behind_m), kHere, at_ms(100));
    for (int i = 2; i < 8; ++i) map.add(look(kHere, {}, behind_m), kHere, at_ms(100 * i));
    if (behind_m > 0) {
      EXPECT_TRUE(map.points_m().empty());
    }
    map.add(look(kHere, {}, behind_m), kHere, at_ms(800));
    EXPECT_TRUE(map.points_m().empty()) << behind_m;
  }
}

TEST(ObstacleMap, RemembersForAWhileWhatIsBehindOutOfSight) {
  ObstacleMap map;
  map.add(look(kHere, {kPole}), kHere, at_ms(0));
  map.add(look(kHere, {kPole}), kHere, at_ms(100));
  const hal::Pose2 turned{{0, 0}, M_PI};
  map.add(look(turned, {kPole}), turned, at_ms(5000));
  EXPECT_FALSE(map.points_m().empty());
  map.add(look(turned, {kPole}), turned, at_ms(12000));
  EXPECT_TRUE(map.points_m().empty());
}

TEST(ObstacleMap, SaysNothingWhereNothingIsKnown) {
  ObstacleMap map;
  map.add(look(kHere, {kPole}), kHere, at_ms(0));
  map.add(look(kHere, {kPole}), kHere, at_ms(100));
  hal::Profile lost = look(kHere, {});
  for (float& range_m : lost.ranges_m) range_m = NAN;
  for (int i = 2; i < 20; ++i) map.add(lost, kHere, at_ms(100 * i));
  EXPECT_FALSE(map.points_m().empty());
}

const ZoneConfig kZone;
const Path kStraight{{{0, 0}, {10, 0}}, {}, std::nullopt};

Zones ahead_of(const std::vector<Vector2d>& points, double speed_mps = 0.5) {
  return look_ahead(kZone, points, kStraight, 0, kHere, {speed_mps, 0});
}

TEST(Zones, LeaveTheSpeedAloneWhereNothingIsNear) {
  EXPECT_TRUE(std::isinf(ahead_of({{2, 2}, {-1, 0}, {8, 0}}).cap_mps));
}

TEST(Zones, SlowDownTheNearerItIs) {
  double before_mps = 2;
  for (double x = 2.9; x > 0.9; x -= 0.1) {
    const double cap_mps = ahead_of({{x, 0}}).cap_mps;
    EXPECT_LE(cap_mps, before_mps) << x;
    before_mps = cap_mps;
  }
  EXPECT_LT(before_mps, 0.25);
  EXPECT_TRUE(ahead_of({{0.8, 0}}).stop);
}

TEST(Zones, LookOnlyAtWhatTheRobotTouches) {
  EXPECT_FALSE(ahead_of({{0.8, 0.56}}).W_in_way_m);
  EXPECT_TRUE(ahead_of({{0.8, 0.45}}).W_in_way_m);
}

TEST(Zones, LetTheRobotDriveAwayFromWhatItTouches) {
  EXPECT_FALSE(ahead_of({{-0.5, 0.05}}).stop);
  EXPECT_FALSE(ahead_of({{0, 0.51}}).stop);
  EXPECT_TRUE(ahead_of({{0.5, 0.05}}).stop);
}

TEST(Zones, FollowThePathRoundACorner) {
  const Path corner{{{0, 0}, {1, 0}, {1, 5}}, {}, std::nullopt};
  const Vector2d beyond(1.9, 0), round(1, 1.5);
  EXPECT_FALSE(look_ahead(kZone, std::vector{beyond}, corner, 0, kHere, {0.2, 0}).W_in_way_m);
  EXPECT_TRUE(look_ahead(kZone, std::vector{round}, corner, 0, kHere, {0.2, 0}).W_in_way_m);
}

// A goal beside a wall: what the robot would touch only behind the goal is not in the way.
TEST(Zones, EndWithThePath) {
  EXPECT_FALSE(ahead_of({{10.6, 0}}).stop);
  const hal::Pose2 near{{9.7, 0}, 0};
  const Path path{{{0, 0}, {10, 0}}, {}, std::nullopt};
  EXPECT_FALSE(look_ahead(kZone, std::vector{Vector2d(10.51, 0)}, path, 9.7, near, {0.1, 0}).stop);
}

// Whatever the speed, the robot that heeds the cap stops before it touches.
TEST(Zones, StopInTimeWhateverTheReaction) {
  support::Dice dice(1);
  double nearest_m = 1;
  for (int run = 0; run < 300; ++run) {
    const Vector2d wall(dice.uniform(1.2, 5), dice.uniform(-0.5, 0.5));
    const double late_s = dice.uniform(0.05, kZone.reaction_s - 0.05);
    hal::Pose2 pose;
    double v = dice.uniform(0, 0.3), asked_mps = v, age_s = 0;
    for (double t = 0; t < 60; t += 0.01, age_s += 0.01) {
      if (age_s >= late_s) {
        asked_mps = std::min(
            1.0, look_ahead(kZone, std::vector{wall}, kStraight, pose.position_m.x(), pose, {v, 0})
                     .cap_mps);
        age_s = 0;
      }
      v = std::clamp(asked_mps, v - 0.01 * kZone.brake_max_mps2, v + 0.01 * 0.5);
      pose.position_m.x() += v * 0.01;
      nearest_m = std::min(nearest_m, (wall - pose.position_m).norm() - kZone.robot_radius_m);
    }
  }
  EXPECT_GT(nearest_m, 0.0);
  std::printf("nearest %.3f m\n", nearest_m);
}

}  // namespace
}  // namespace nav
