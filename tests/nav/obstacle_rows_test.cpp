// The map of obstacles from turns with rows of beams, as a VLP-16 has them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "nav/moving.hpp"
#include "nav/obstacle_map.hpp"

namespace nav {
namespace {

using Eigen::Vector2d;
using hal::Time;
using std::chrono::milliseconds;

constexpr double kScannerM = 1.4;
constexpr int kColumns = 1800;

struct Post {
  Vector2d center_m;
  double radius_m, low_m, high_m;
};

struct Slope {
  double rise = 0;  // So much a metre, to the east.
};

double range_m(const std::vector<Post>& posts, const Slope& ground, const Vector2d& from_m,
               const Vector2d& way, double tip_m, double elevation_rad) {
  const double slope = std::tan(elevation_rad), share = std::cos(elevation_rad);
  double nearest_m = 1e9;
  const double sinks = ground.rise * way.x() - slope;  // The beam towards the ground, a metre.
  if (sinks > 0) nearest_m = (tip_m - ground.rise * from_m.x()) / sinks;
  for (const Post& post : posts) {
    const Vector2d to = post.center_m - from_m;
    const double along_m = way.dot(to);
    const double root = post.radius_m * post.radius_m - (to.squaredNorm() - along_m * along_m);
    if (along_m < 0 || root < 0) continue;
    const double away_m = along_m - std::sqrt(root), z_m = tip_m + away_m * slope;
    if (z_m >= post.low_m && z_m <= post.high_m) nearest_m = std::min(nearest_m, away_m);
  }
  return nearest_m > 40 || nearest_m < 0.9 ? 0 : nearest_m / share;
}

MovingTurn turn(const std::vector<Post>& posts, const hal::Pose2& first, const hal::Pose2& last,
                const Slope& ground = {}) {
  MovingTurn seen;
  seen.height_m = kScannerM;
  seen.W_first = first;
  seen.W_last = last;
  seen.turn.angle_first_rad = -M_PI / 2;
  seen.turn.angle_step_rad = -2 * M_PI / kColumns;
  for (int degrees = -15; degrees <= 1; degrees += 2) {
    hal::BeamRow row{degrees * M_PI / 180, 0, {}};
    for (int i = 0; i < kColumns; ++i) {
      const Eigen::Isometry2d T = on_the_way(first, last, share_of_turn(std::size_t(i), kColumns));
      const double angle = seen.turn.angle_first_rad + i * seen.turn.angle_step_rad;
      row.ranges_m.push_back(static_cast<float>(range_m(
          posts, ground, T.translation(), T.linear() * Vector2d(std::cos(angle), std::sin(angle)),
          kScannerM, row.elevation_rad)));
    }
    seen.turn.level = seen.turn.rows.size();
    seen.turn.rows.push_back(row);
  }
  return seen;
}

MovingTurn turn(const std::vector<Post>& posts, const hal::Pose2& at, const Slope& ground = {}) {
  return turn(posts, at, at, ground);
}

ObstacleMap map_of_vlp16() {
  ObstacleMapConfig config;
  config.blind_m = 1.0;
  config.top_m = kScannerM + 0.1;
  return ObstacleMap(config);
}

Time rows_at_ms(int ms) {
  return Time(milliseconds(ms));
}

const hal::Pose2 kRobotHere{{0, 0}, 0};
const Post kPerson{{3, 0.5}, 0.25, 0, 1.75};

TEST(ObstacleRows, HoldAPersonAndNotTheGround) {
  ObstacleMap map = map_of_vlp16();
  map.add(turn({kPerson}, kRobotHere), rows_at_ms(0));
  ASSERT_FALSE(map.points_m().empty());
  for (const Vector2d& point : map.points_m())
    EXPECT_NEAR((point - kPerson.center_m).norm(), kPerson.radius_m, 0.002);
}

// 5 % uphill is ground still; a wall is not.
TEST(ObstacleRows, LetTheGroundRiseALittle) {
  ObstacleMap map = map_of_vlp16();
  map.add(turn({}, kRobotHere, {0.05}), rows_at_ms(0));
  EXPECT_TRUE(map.points_m().empty());
  map.add(turn({}, kRobotHere, {0.3}), rows_at_ms(100));
  EXPECT_FALSE(map.points_m().empty());
}

// Turning by 9 deg and going 0.1 m within the turn: what is seen stands where it stands.
TEST(ObstacleRows, PlaceEachBeamWhereTheRobotWas) {
  ObstacleMap map = map_of_vlp16();
  const hal::Pose2 last{{0.1, 0.02}, 0.157};
  map.add(turn({kPerson}, kRobotHere, last), rows_at_ms(0));
  map.add(turn({kPerson}, last, {{0.2, 0.06}, 0.314}), rows_at_ms(100));
  ASSERT_FALSE(map.points_m().empty());
  for (const Vector2d& point : map.points_m())
    EXPECT_NEAR((point - kPerson.center_m).norm(), kPerson.radius_m, 0.002);
  // And it is found empty where it was, though the robot turns on.
  const Post backdrop{{24, 0.5}, 16, 0, 5};
  map.add(turn({backdrop}, {{0.2, 0.06}, 0.314}, {{0.3, 0.1}, 0.47}), rows_at_ms(200));
  EXPECT_TRUE(map.points_m().empty());
}

TEST(ObstacleRows, AreEmptyAgainWhereSomebodyWalkedAway) {
  ObstacleMap map = map_of_vlp16();
  map.add(turn({kPerson}, kRobotHere), rows_at_ms(0));
  map.add(turn({kPerson}, kRobotHere), rows_at_ms(100));
  for (int i = 2; i < 9; ++i) map.add(turn({}, kRobotHere), rows_at_ms(100 * i));
  EXPECT_TRUE(map.points_m().empty());
}

// A crate of half a metre is under all beams when the robot stands before it: it is not forgotten,
// nor at the end of the leg, until it is far away.
TEST(ObstacleRows, KeepALowCrateThatTheRobotHasComeTooNearToSee) {
  const Post crate{{4.5, 0}, 0.4, 0, 0.5};
  ObstacleMap map = map_of_vlp16();
  int ms = 0;
  for (double x = 0; x < 3; x += 0.1, ms += 100)
    map.add(turn({crate}, {{x, 0}, 0}), rows_at_ms(ms));
  const std::size_t before = map.points_m().size();
  EXPECT_GT(before, 3U);
  for (int i = 0; i < 400; ++i) map.add(turn({crate}, {{3, 0}, 0}), rows_at_ms(ms += 100));
  EXPECT_EQ(map.points_m().size(), before);
  map.clear_but_hidden();
  EXPECT_EQ(map.points_m().size(), before);
  for (int i = 0; i < 100; ++i) map.add(turn({}, {{3, 0}, 0}), rows_at_ms(ms += 1000));
  EXPECT_TRUE(map.points_m().empty()) << "nothing was heard of it for two minutes";
}

// What beams pass over, or under, may be there still.
TEST(ObstacleRows, AreNotTakenOutByBeamsThatPassOverThem) {
  const Post bar{{3, 0}, 0.05, 0.98, 1.02}, backdrop{{24, 0.5}, 16, 0, 5};
  ObstacleMap map = map_of_vlp16();
  int ms = 0;
  bool seen = false;
  for (double x = 0; x < 1.4; x += 0.02, ms += 20) {
    map.add(turn({bar, backdrop}, {{x, 0}, 0}), rows_at_ms(ms));
    seen = seen || !map.points_m().empty();
    EXPECT_EQ(map.points_m().empty(), !seen) << x;
  }
  EXPECT_TRUE(seen);
  for (const Vector2d& point : map.points_m())
    EXPECT_NEAR((point - bar.center_m).norm(), bar.radius_m, 0.002);
}

// Nobody can tell what goes on nearer than the scanner measures.
TEST(ObstacleRows, KeepWhatIsNearerThanTheScannerMeasures) {
  const Post near{{1.05, 0}, 0.2, 0, 1.75};
  ObstacleMap map = map_of_vlp16();
  const auto in_the_middle = [&map] {
    return std::ranges::count_if(map.points_m(),
                                 [](const Vector2d& point) { return std::abs(point.y()) < 0.05; });
  };
  map.add(turn({near}, {{-0.2, 0}, 0}), rows_at_ms(0));
  ASSERT_GT(in_the_middle(), 0);
  for (int i = 1; i < 50; ++i) map.add(turn({near}, kRobotHere), rows_at_ms(100 * i));
  EXPECT_GT(in_the_middle(), 0);
}

TEST(ObstacleRows, SayNothingWhereNothingIsKnown) {
  ObstacleMap map = map_of_vlp16();
  map.add(turn({kPerson}, kRobotHere), rows_at_ms(0));
  MovingTurn lost = turn({}, kRobotHere);
  for (hal::BeamRow& row : lost.turn.rows)
    for (float& range : row.ranges_m) range = NAN;
  for (int i = 1; i < 50; ++i) map.add(lost, rows_at_ms(100 * i));
  EXPECT_FALSE(map.points_m().empty());
}

}  // namespace
}  // namespace nav
