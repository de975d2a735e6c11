#include "nav/scan_match.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "tests/support/random_site.hpp"

namespace nav {
namespace {

using testing::HasSubstr;

constexpr double kDeg = std::numbers::pi / 180;
using Segments = std::vector<WallSegment>;

hal::Pose2 at(double x_m, double y_m, double heading_deg) {
  return {{x_m, y_m}, heading_deg * kDeg};
}

Segments outline(double x_m, double y_m, double width_m, double depth_m) {
  const Eigen::Vector2d a(x_m, y_m), b(x_m + width_m, y_m), c(x_m + width_m, y_m + depth_m),
      d(x_m, y_m + depth_m);
  return {{a, b}, {b, c}, {c, d}, {d, a}};
}

// A room of 20 x 12 m with a cupboard.
Segments room() {
  Segments walls = outline(0, 0, 20, 12);
  for (const WallSegment& wall : outline(4, 7, 2, 1.5)) walls.push_back(wall);
  return walls;
}

Segments corridor() {
  return {{{-60, -2}, {60, -2}}, {{-60, 2}, {60, 2}}};
}

// Where beams of 1 deg end, as the body has it; those longer than 40 m do not come back.
std::vector<Eigen::Vector2d> seen(const Segments& walls, const hal::Pose2& from, double sigma_m,
                                  std::uint64_t seed) {
  support::Dice dice(seed);
  std::vector<Eigen::Vector2d> points;
  for (int i = 0; i < 360; ++i) {
    const Eigen::Vector2d B_beam(std::cos(i * kDeg), std::sin(i * kDeg));
    const Eigen::Vector2d beam = Eigen::Rotation2Dd(from.heading_rad) * B_beam;
    double range_m = 40;
    for (const WallSegment& wall : walls) {
      Eigen::Matrix2d A;
      A << beam, wall.from_m - wall.to_m;
      if (std::abs(A.determinant()) < 1e-9) continue;
      const Eigen::Vector2d hit = A.inverse() * (wall.from_m - from.position_m);
      if (hit.x() > 0 && hit.x() < range_m && hit.y() >= 0 && hit.y() <= 1) range_m = hit.x();
    }
    if (range_m < 40) points.push_back((range_m + dice.gauss(sigma_m)) * B_beam);
  }
  return points;
}

double off_m(const hal::Pose2& a, const hal::Pose2& b) {
  return (a.position_m - b.position_m).norm();
}
double off_deg(const hal::Pose2& a, const hal::Pose2& b) {
  return std::abs(std::remainder(a.heading_rad - b.heading_rad, 2 * std::numbers::pi)) / kDeg;
}

TEST(ScanMatch, FindsWhereTheRobotStandsFromGuessesAround) {
  const WallMap map(room(), {});
  support::Dice dice(1);
  for (int i = 0; i < 40; ++i) {
    const hal::Pose2 truth = at(dice.uniform(8, 18), dice.uniform(2, 10), dice.uniform(-180, 180));
    const hal::Pose2 guess{
        truth.position_m + Eigen::Vector2d(dice.uniform(-0.4, 0.4), dice.uniform(-0.4, 0.4)),
        truth.heading_rad + dice.uniform(-6, 6) * kDeg};
    const ScanMatch match =
        match_scan(map, seen(room(), truth, 0.01, 100 + static_cast<std::uint64_t>(i)), guess);
    ASSERT_TRUE(match.good) << i << ": " << match.reason;
    EXPECT_FALSE(match.free) << i;
    EXPECT_LT(off_m(match.pose, truth), 0.03) << i;
    EXPECT_LT(off_deg(match.pose, truth), 0.2) << i;
    EXPECT_GT(match.fit, 0.9) << i;
    EXPECT_LT(match.rms_m, 0.04) << i;
  }
}

TEST(ScanMatch, ClaimsNoLessThanItIsOff) {
  const WallMap map(room(), {});
  double chi2 = 0;
  for (std::uint64_t i = 0; i < 50; ++i) {
    const hal::Pose2 truth = at(12, 5, 3.0 * static_cast<double>(i));
    const ScanMatch match = match_scan(map, seen(room(), truth, 0.03, i), truth);
    ASSERT_TRUE(match.good);
    Eigen::Vector3d error;
    error << match.pose.position_m - truth.position_m, match.pose.heading_rad - truth.heading_rad;
    error.z() = std::remainder(error.z(), 2 * std::numbers::pi);
    chi2 += error.dot(match.covariance.inverse() * error) / 50;
    // The map itself is not better than that.
    EXPECT_GE(match.covariance(0, 0), 0.03 * 0.03);
    EXPECT_LT(match.covariance(0, 0), 0.06 * 0.06);
  }
  EXPECT_LT(chi2, 4);
}

// Nothing in it tells how far along the corridor it is: there the guess stands, and says so.
TEST(ScanMatch, ACorridorLeavesTheWayAlongItFree) {
  const WallMap map(corridor(), {});
  const hal::Pose2 truth = at(3, 0.5, 4), guess = at(3.6, 0.2, 0);
  const ScanMatch match = match_scan(map, seen(corridor(), truth, 0.01, 3), guess);
  ASSERT_TRUE(match.good) << match.reason;
  EXPECT_TRUE(match.free);
  EXPECT_NEAR(match.pose.position_m.x(), 3.6, 0.1);
  EXPECT_NEAR(match.pose.position_m.y(), 0.5, 0.02);
  EXPECT_LT(off_deg(match.pose, truth), 0.2);
  EXPECT_GT(std::sqrt(match.covariance(0, 0)), 1);
  EXPECT_LT(std::sqrt(match.covariance(1, 1)), 0.1);
}

TEST(ScanMatch, IsNotPulledByWhatTheMapLacks) {
  Segments real = room();
  for (const WallSegment& wall : outline(13, 4, 3, 2)) real.push_back(wall);
  const WallMap map(room(), {});
  const hal::Pose2 truth = at(10, 6, 30);
  const ScanMatch match = match_scan(map, seen(real, truth, 0.01, 4), at(10.2, 5.9, 32));
  ASSERT_TRUE(match.good) << match.reason;
  EXPECT_LT(off_m(match.pose, truth), 0.03);
  EXPECT_LT(match.fit, 0.95);
}

TEST(ScanMatch, RefusesAnotherRoom) {
  const WallMap map(room(), {});
  const Segments other = outline(0, 0, 5, 31);
  const ScanMatch match = match_scan(map, seen(other, at(2, 15, 0), 0.01, 5), at(10, 6, 0));
  EXPECT_FALSE(match.good);
  EXPECT_THAT(match.reason, HasSubstr("of the beams lie on walls of the map"));
}

TEST(ScanMatch, SaysThatNoWallIsNear) {
  const WallMap map(room(), {});
  const ScanMatch match = match_scan(map, seen(room(), at(10, 6, 0), 0.01, 6), at(500, 500, 0));
  EXPECT_FALSE(match.good);
  EXPECT_THAT(match.reason, HasSubstr("end near walls of the map"));
  EXPECT_EQ(match.pose.position_m, Eigen::Vector2d(500, 500));
}

TEST(ScanMatch, SaysThatTooFewBeamsCameBack) {
  const WallMap map(room(), {});
  std::vector<Eigen::Vector2d> few = seen(room(), at(10, 6, 0), 0.01, 7);
  few.resize(29);
  const ScanMatch match = match_scan(map, few, at(10, 6, 0));
  EXPECT_FALSE(match.good);
  EXPECT_EQ(match.reason, "only 29 beams came back");
}

// Its own walls as they were seen before serve as a map too.
TEST(ScanMatch, MatchesAgainstWhatScansHaveShown) {
  std::vector<Eigen::Vector2d> W_points;
  for (const hal::Pose2& from : {at(9, 3, 0), at(16, 9, 90), at(2, 2, 0)})
    for (const Eigen::Vector2d& B_point : seen(room(), from, 0.01, 8))
      W_points.push_back(from.position_m + Eigen::Rotation2Dd(from.heading_rad) * B_point);
  const WallMap map(W_points, {});
  const hal::Pose2 truth = at(12, 6, -70);
  const ScanMatch match = match_scan(map, seen(room(), truth, 0.01, 9), at(12.2, 5.8, -67));
  ASSERT_TRUE(match.good) << match.reason;
  EXPECT_LT(off_m(match.pose, truth), 0.05);
  EXPECT_LT(off_deg(match.pose, truth), 0.4);
}

TEST(ScanMatch, FindsTheHeadingAllAroundWhenItIsLost) {
  const WallMap map(room(), {});
  const hal::Pose2 truth = at(7, 4, 100);
  const ScanMatch match = match_scan(map, seen(room(), truth, 0.01, 10), at(7.2, 4.1, 10));
  ASSERT_TRUE(match.good) << match.reason;
  EXPECT_LT(off_m(match.pose, truth), 0.05);
  EXPECT_LT(off_deg(match.pose, truth), 0.5);
}

TEST(WallMap, GivesTheNearestWallAndItsNormal) {
  const WallMap map(room(), {});
  support::Dice dice(11);
  for (int i = 0; i < 500; ++i) {
    const Eigen::Vector2d p(dice.uniform(-1, 21), dice.uniform(-1, 13));
    double nearest_m = 1e9;
    for (const auto& wall : map.walls()) nearest_m = std::min(nearest_m, (wall.point_m - p).norm());
    const WallMap::Wall* found = map.nearest(p);
    if (found == nullptr) {
      EXPECT_GT(nearest_m, 1.4);
      continue;
    }
    EXPECT_LT((found->point_m - p).norm(), nearest_m + 0.1) << p.transpose();
  }
  const WallMap::Wall* south = map.nearest({10, 0.3});
  ASSERT_NE(south, nullptr);
  EXPECT_NEAR(std::abs(south->normal.y()), 1, 1e-6);
  EXPECT_EQ(map.nearest({100, 100}), nullptr);
}

TEST(WallMap, LeavesOutPointsThatAreNone) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<Eigen::Vector2d> points{{1, 1}, {nan, 2}, {2, 1}};
  EXPECT_EQ(WallMap(points, {}).walls().size(), 2U);
  EXPECT_EQ(WallMap(std::vector<Eigen::Vector2d>{}, {}).nearest({0, 0}), nullptr);
}

TEST(WallMap, RefusesWallsThatSpanTooMuch) {
  WallMapConfig config;
  config.cells_max = 10'000;
  EXPECT_THROW(WallMap(corridor(), config), std::invalid_argument);
}

TEST(ProfilePoints, AreInTheBodysFrameAndWithinTheRanges) {
  hal::Profile profile;
  profile.angle_first_rad = 0;
  profile.angle_step_rad = std::numbers::pi / 2;
  profile.ranges_m = {2, 0, 0.1F, 50, std::numeric_limits<float>::quiet_NaN()};
  const auto points = profile_points(profile, at(1, 0.5, 90), 0.5, 30);
  ASSERT_EQ(points.size(), 1U);
  EXPECT_NEAR((points[0] - Eigen::Vector2d(1, 2.5)).norm(), 0, 1e-9);
}

}  // namespace
}  // namespace nav
