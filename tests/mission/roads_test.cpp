// Roads that obstacles close, and who opens them again.
#include "mission/roads.hpp"

#include <gtest/gtest.h>

#include "nav/polygons.hpp"
#include "tests/support/random_site.hpp"

namespace {

constexpr double kRadiusM = 0.4, kSideM = 0.25;
const Eigen::Vector2d kWest{1, 1}, kEast{19, 1};

// A lane of 20 m x 2 m.
nav::FreeArea lane() {
  nav::FreeArea area;
  area.name = area.region = "lane";
  area.drivable = nav::normalise({support::rectangle_mm(0, 0, 20, 2)});
  area.standable = nav::offset(area.drivable, -400);
  return area;
}

// A wall across it.
std::vector<Eigen::Vector2d> wall(double x_m) {
  std::vector<Eigen::Vector2d> centers_m;
  for (double y_m = kSideM / 2; y_m < 2; y_m += kSideM) centers_m.emplace_back(x_m, y_m);
  return centers_m;
}

bool leads_through(const mission::Roads& roads) {
  return roads.roadmap().route(kWest, kEast).has_value();
}

TEST(Roads, AreOpenAgainWhereTheScanThatClosedThemStoodElsewhere) {
  mission::Roads roads(lane(), kRadiusM);
  const double open_m2 = nav::area_m2(roads.area().drivable);
  ASSERT_TRUE(leads_through(roads));
  roads.close(wall(6), kSideM, 1);
  ASSERT_FALSE(leads_through(roads));
  // Its pose corrected, what it shows is beside the lane.
  roads.close_anew({{1, {}}}, kSideM);
  EXPECT_TRUE(leads_through(roads));
  EXPECT_EQ(nav::area_m2(roads.area().drivable), open_m2);
}

TEST(Roads, StayClosedByWhatOtherScansStillShow) {
  mission::Roads roads(lane(), kRadiusM);
  roads.close(wall(6), kSideM, 1);
  roads.close(wall(12), kSideM, 2);
  roads.close_anew({{1, {}}, {2, wall(12.1)}}, kSideM);
  EXPECT_FALSE(leads_through(roads));
  EXPECT_TRUE(nav::contains(roads.area().drivable, nav::to_mm({6, 1})));
  EXPECT_FALSE(nav::contains(roads.area().drivable, nav::to_mm({12.1, 1})));
  // One that is refused shows nothing at all any more.
  roads.close_anew({{1, {}}}, kSideM);
  EXPECT_TRUE(leads_through(roads));
}

TEST(Roads, StayClosedWhereTheRobotTouchedSomething) {
  mission::Roads roads(lane(), kRadiusM);
  roads.close(wall(6), kSideM);
  roads.close(wall(12), kSideM, 1);
  roads.close_anew({}, kSideM);
  EXPECT_FALSE(leads_through(roads));
  EXPECT_TRUE(nav::contains(roads.area().drivable, nav::to_mm({12, 1})));
}

TEST(Roads, SayWhenSomethingIsOpenAgain) {
  mission::Roads roads(lane(), kRadiusM);
  EXPECT_FALSE(roads.reopen());
  roads.close(wall(6), kSideM, 1);
  roads.close_anew({{1, wall(6)}}, kSideM);
  EXPECT_EQ(roads.openings(), 0);
  roads.close_anew({}, kSideM);
  EXPECT_EQ(roads.openings(), 1);
  roads.close_for_now(wall(12), kSideM);
  EXPECT_TRUE(roads.is_closed_for_now());
  EXPECT_EQ(roads.openings(), 1);
  EXPECT_TRUE(roads.reopen());
  EXPECT_FALSE(roads.is_closed_for_now());
  EXPECT_EQ(roads.openings(), 2);
}

TEST(Roads, KeepWhatIsClosedForNow) {
  mission::Roads roads(lane(), kRadiusM);
  roads.close(wall(6), kSideM, 1);
  roads.close_for_now(wall(12), kSideM);
  roads.close_anew({}, kSideM);
  EXPECT_FALSE(leads_through(roads));
  EXPECT_TRUE(roads.reopen());
  EXPECT_TRUE(leads_through(roads));
  EXPECT_FALSE(roads.reopen());
}

}  // namespace
