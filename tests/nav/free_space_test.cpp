#include "nav/free_space.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "nav/polygons.hpp"

namespace nav {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

Polygons box(double x0, double y0, double x1, double y1) {
  return {{{to_mm({x0, y0}), to_mm({x1, y0}), to_mm({x1, y1}), to_mm({x0, y1})}, {}}};
}

SiteMap site(const Polygons& boundary, const Polygons& obstacles) {
  SiteMap map;
  map.boundary = boundary;
  map.obstacles = obstacles;
  map.regions = {{"site", boundary, 1.5}};
  return map;
}

TEST(FreeAreas, OpenFieldLosesTheRadiusAllRound) {
  const auto areas = free_areas(site(box(0, 0, 20, 10), {}), 0.5, 1);
  ASSERT_EQ(areas.size(), 1u);
  EXPECT_EQ(areas[0].name, "site");
  EXPECT_EQ(areas[0].region, "site");
  EXPECT_DOUBLE_EQ(areas[0].ground_z_m, 1.5);
  EXPECT_DOUBLE_EQ(area_m2(areas[0].drivable), 200);
  EXPECT_DOUBLE_EQ(area_m2(areas[0].standable), 19 * 9);
}

TEST(FreeAreas, PartsAreNamedLargestFirstAndKeepTheirOwnDrivable) {
  // A wall splits the field in 6 m and 13 m.
  const auto areas = free_areas(site(box(0, 0, 20, 10), box(6, 0, 7, 10)), 0.5, 1);
  ASSERT_EQ(areas.size(), 2u);
  EXPECT_EQ(areas[0].name, "site");
  EXPECT_EQ(areas[1].name, "site/2");
  EXPECT_EQ(areas[1].region, "site");
  EXPECT_DOUBLE_EQ(area_m2(areas[0].drivable), 130);
  EXPECT_DOUBLE_EQ(area_m2(areas[1].drivable), 60);
  EXPECT_EQ(area_at(areas, to_mm({15, 5})), 0);
  EXPECT_EQ(area_at(areas, to_mm({3, 5})), 1);
  EXPECT_EQ(area_at(areas, to_mm({6.5, 5})), -1);
  EXPECT_EQ(area_at(areas, to_mm({5.8, 5})), -1);  // Drivable, but the robot does not fit.
}

TEST(FreeAreas, DoorNarrowerThanTheRobotSplitsStandableButNotDrivable) {
  const Polygons wall = unite(box(9, 0, 10, 4.6), box(9, 5.4, 10, 10));  // Door of 0.8 m.
  EXPECT_EQ(free_areas(site(box(0, 0, 20, 10), wall), 0.39, 1).size(), 1u);
  const auto areas = free_areas(site(box(0, 0, 20, 10), wall), 0.41, 1);
  ASSERT_EQ(areas.size(), 2u);
  EXPECT_DOUBLE_EQ(area_m2(areas[0].drivable), area_m2(areas[1].drivable));
}

TEST(FreeAreas, KeepOutsBlockTheRobotAndRegionsBoundIt) {
  SiteMap map = site(box(0, 0, 20, 10), {});
  map.keep_out = box(0, 0, 5, 10);
  map.regions = {{"west", box(0, 0, 10, 10), 0}, {"east", box(10, 0, 30, 10), 0}};
  const auto areas = free_areas(map, 0.5, 1);
  ASSERT_EQ(areas.size(), 2u);
  EXPECT_DOUBLE_EQ(area_m2(areas[0].drivable), 50);
  EXPECT_DOUBLE_EQ(area_m2(areas[1].drivable), 100);  // Cut to the boundary.
}

TEST(FreeAreas, SmallPartsAreLeftOutAndRegionsWithoutAnyAreNamed) {
  SiteMap map = site(box(0, 0, 20, 10), {});
  map.regions = {{"yard", box(0, 0, 10, 10), 0}, {"closet", box(10, 0, 11, 0.8), 0}};
  const auto areas = free_areas(map, 0.5, 1);
  ASSERT_EQ(areas.size(), 1u);
  EXPECT_THAT(regions_without_area(map, areas), ElementsAre("closet"));
  EXPECT_THAT(regions_without_area(map, free_areas(map, 0.1, 0.1)), IsEmpty());
  EXPECT_THAT(free_areas(map, 0.5, 1000), IsEmpty());
}

TEST(FreeAreas, CourtyardOfABuildingIsAPartOfItsOwn) {
  const auto areas = free_areas(
      site(box(0, 0, 40, 40), subtract(box(10, 10, 30, 30), box(15, 15, 25, 25))), 0.5, 1);
  ASSERT_EQ(areas.size(), 2u);
  EXPECT_DOUBLE_EQ(area_m2(areas[0].drivable), 1600 - 400);
  EXPECT_DOUBLE_EQ(area_m2(areas[1].drivable), 100);
}

// The definition, point by point: stand where nothing forbidden is nearer than the radius.
TEST(FreeAreas, EveryStandablePointKeepsTheRadiusFromEverything) {
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937_64 random(seed);
    const auto coordinate = [&] { return static_cast<double>(random() % 20000) / 1000; };
    std::vector<Polygons> houses;
    for (int i = 0; i < 8; ++i) {
      const double x = coordinate();
      const double y = coordinate();
      houses.push_back(normalise({{to_mm({x, y}), to_mm({x + coordinate() / 5, y + 1}),
                                   to_mm({x + 1, y + coordinate() / 5})}}));
    }
    const SiteMap map = site(box(0, 0, 20, 20), unite(houses));
    const auto areas = free_areas(map, 0.6, 0);
    int standing = 0;
    for (int i = 0; i < 300; ++i) {
      const PointMm p = to_mm({coordinate(), coordinate()});
      const double clear_m =
          contains(map.obstacles, p)
              ? 0
              : std::min(border_distance_m(map.obstacles, p), border_distance_m(map.boundary, p));
      const int area = area_at(areas, p);
      if (clear_m < 0.598) {
        EXPECT_EQ(area, -1);
      }
      if (clear_m > 0.613) {
        EXPECT_GE(area, 0);
      }
      if (area < 0) continue;
      ++standing;
      EXPECT_TRUE(contains(areas[static_cast<std::size_t>(area)].drivable, p));
    }
    EXPECT_GT(standing, 30);
  }
}

}  // namespace
}  // namespace nav
