#include "mission/map_match.hpp"

#include <gmock/gmock.h>

#include "mission/site_model.hpp"
#include "nav/polygons.hpp"
#include "tests/support/scans.hpp"

namespace mission {
namespace {

using scans::kDeg;

// The walls of scans::yard() as a map draws them, or without its sheds.
nav::SiteMap map_of_yard(bool sheds) {
  const auto box = [](double x, double y, double w, double h) {
    return support::rectangle_mm(x, y, w, h);
  };
  std::vector<nav::Ring> rings{box(-21, -16, 42, 1), box(-21, 15, 42, 1), box(-21, -16, 1, 32),
                               box(20, -16, 1, 32)};
  if (sheds) rings.push_back(box(6, 5, 4, 5)), rings.push_back(box(-12, -9, 4, 5));
  nav::SiteMap map;
  map.obstacles = nav::normalise(rings);
  return map;
}

ScannerConfig scanner() {
  ScannerConfig config;
  config.height_m = 1.5;
  config.range_min_m = 0.5;
  return config;
}

TEST(MapMatch, HoldsTheRobotToTheWallsOfTheMap) {
  for (const bool sheds : {true, false}) {
    const MapMatcher matcher(map_of_yard(sheds), scanner());
    const hal::Pose2 truth{{3, -4}, 25 * kDeg};
    const nav::ScanMatch match =
        matcher.match(scans::seen_from(scans::yard(), scanner_pose(truth, 0, 1.5), 1, 0.01, 1),
                      {{3.4, -4.3}, 29 * kDeg});
    ASSERT_TRUE(match.good) << match.reason;
    EXPECT_LT((match.pose.position_m - truth.position_m).norm(), 0.05);
    EXPECT_NEAR(match.pose.heading_rad, truth.heading_rad, 0.3 * kDeg);
  }
}

TEST(MapMatch, SaysThatTheMapIsAnother) {
  const MapMatcher matcher(map_of_yard(true), scanner());
  const nav::ScanMatch match = matcher.match(
      scans::seen_from(scans::corridor(), scans::pose(0, 0, 1.5, 40), 1, 0.01, 2), {{0, 0}, 0});
  EXPECT_FALSE(match.good);
  EXPECT_FALSE(match.reason.empty());
}

TEST(MapMatch, AMapWithoutWallsMatchesNothing) {
  const MapMatcher matcher({}, scanner());
  EXPECT_FALSE(
      matcher.match(scans::seen_from(scans::yard(), scans::pose(0, 0, 1.5, 0), 2, 0.01, 3), {})
          .good);
}

}  // namespace
}  // namespace mission
