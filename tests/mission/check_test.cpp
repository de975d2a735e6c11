// What keeps a mission from starting on a site, and how it is told.
#include "mission/check.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "nav/polygons.hpp"

namespace {

using testing::HasSubstr;

nav::Ring square(double x_m, double y_m, double side_m) {
  return {nav::to_mm({x_m, y_m}), nav::to_mm({x_m + side_m, y_m}),
          nav::to_mm({x_m + side_m, y_m + side_m}), nav::to_mm({x_m, y_m + side_m})};
}

// A yard of 100 m with a court of 20 m and a closet of 0.6 m inside.
nav::RepairedSite yard() {
  nav::RepairedSite site;
  site.map.name = "yard";
  site.map.boundary = {{square(0, 0, 100), {}}};
  site.map.obstacles = {{square(40, 40, 5), {}}};
  site.map.regions = {{"outer yard", {{square(0, 0, 50), {}}}, 0},
                      {"court", {{square(60, 60, 20), {}}}, 0},
                      {"closet", {{square(90, 90, 0.6), {}}}, 0}};
  return site;
}

mission::MissionConfig config_of(std::string_view text) {
  auto loaded = mission::parse_mission(text, "m.toml", "", "");
  EXPECT_TRUE(loaded.errors.empty());
  loaded.config.site_folder = "sites/yard";
  return loaded.config;
}

std::vector<std::string> check(const mission::MissionConfig& config,
                               const nav::RepairedSite& site) {
  const auto areas = nav::free_areas(site.map, config.robot.body.radius_m, mission::kFreeAreaMinM2);
  std::vector<std::string> texts;
  for (const auto& error : mission::check_site(config, site, areas)) texts.push_back(error.text());
  return texts;
}

TEST(CheckSite, FindsNothingWrongWithAGoodMission) {
  auto site = yard();
  site.map.start = hal::Pose2{{10, 10}, 0};
  EXPECT_THAT(check(config_of("[regions]\ncourt = 'manual'\ncloset = 'skip'\n"), site),
              testing::IsEmpty());
}

TEST(CheckSite, NamesARegionThatTheMapLacksAndTheOneThatWasMeant) {
  const auto texts = check(config_of("[regions]\ncort = 'manual'\nmoat = 'skip'\n"), yard());
  ASSERT_EQ(texts.size(), 2u);
  EXPECT_EQ(texts[0], "m.toml:2:1: the map has no region 'cort'; did you mean 'court'?");
  EXPECT_EQ(texts[1],
            "m.toml:3:1: the map has no region 'moat'; it has: outer yard, court, closet");
}

TEST(CheckSite, NamesARegionWhereTheRobotCannotStand) {
  for (const std::string mode : {"robot", "manual"}) {
    const auto texts = check(config_of("[regions]\ncloset = '" + mode + "'\n"), yard());
    ASSERT_EQ(texts.size(), 1u);
    EXPECT_THAT(texts[0], HasSubstr("m.toml:2:1: region 'closet' has no room to stand for a robot "
                                    "of radius 0.5 m"));
  }
}

TEST(CheckSite, RefusesAStartOutsideTheFreeSpace) {
  auto site = yard();
  for (const Eigen::Vector2d& at :
       std::vector<Eigen::Vector2d>{{42, 42}, {39.8, 42}, {0.2, 10}, {-5, 0}}) {
    site.map.start = hal::Pose2{at, 0};
    const auto texts = check(config_of("site = 'yard'\n"), site);
    ASSERT_EQ(texts.size(), 1u) << at;
    EXPECT_THAT(texts[0], HasSubstr("m.toml:1:1: the map's start ("));
  }
}

TEST(CheckSite, RefusesASiteWithoutRoom) {
  auto site = yard();
  site.map.obstacles = {{square(-1, -1, 102), {}}};
  EXPECT_THAT(check(config_of(""), site), testing::ElementsAre(HasSubstr("the site has no room")));
}

TEST(CheckSite, RefusesMoreThan400MillionVoxelsAndSaysWhatWouldDo) {
  const auto texts = check(config_of("[phase2]\nvoxel_m = 0.05\n"), yard());
  ASSERT_EQ(texts.size(), 1u);
  EXPECT_EQ(texts[0],
            "m.toml:2:1: the site's box of 100 x 100 x 30 m has 2409 million voxels of 0.05 m, "
            "more than 400 million; write voxel_m = 0.10 or more, or make 'height_m' smaller");
  EXPECT_THAT(check(config_of("[phase2]\nvoxel_m = 0.10\n"), yard()), testing::IsEmpty());
}

TEST(CheckSite, ABrokenMapIsToldAsItIs) {
  nav::RepairedSite site;
  site.errors = {"footprint.geojson:3:1 (feature 1): the outline crosses itself"};
  EXPECT_THAT(
      check(config_of("[regions]\nmoat = 'skip'\n"), site),
      testing::ElementsAre("footprint.geojson:3:1: (feature 1): the outline crosses itself"));
}

TEST(CheckSite, ASiteErrorKeepsItsPlaceAndGetsTheFolderWithoutOne) {
  const auto placed = mission::site_error("s/footprint.geojson:12:5: feature 3: too small", "s");
  EXPECT_EQ(placed.file, "s/footprint.geojson");
  EXPECT_EQ(placed.line, 12);
  EXPECT_EQ(placed.column, 5);
  EXPECT_EQ(placed.message, "feature 3: too small");
  EXPECT_EQ(mission::site_error("no boundary: draw one", "s").text(), "s: no boundary: draw one");
}

}  // namespace
