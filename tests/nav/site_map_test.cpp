// The map as drawn, with everything real outlines do, and the map to plan on.
#include "nav/site_map.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "nav/free_space.hpp"
#include "nav/polygons.hpp"
#include "nav/rings.hpp"

namespace nav {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using Metres = std::vector<Eigen::Vector2d>;

constexpr double kMarginM = 30;

// Closed, counter-clockwise.
Metres rectangle(double x0, double y0, double x1, double y1) {
  return {{x0, y0}, {x1, y0}, {x1, y1}, {x0, y1}, {x0, y0}};
}

Metres reversed(Metres ring) {
  return {ring.rbegin(), ring.rend()};
}

RawFeature feature(Role role, std::string name, std::vector<Metres> rings) {
  RawFeature raw;
  raw.role = role;
  raw.where = "feature '" + name + "'";
  raw.name = std::move(name);
  if (!rings.empty()) raw.polygons_m = {std::move(rings)};
  return raw;
}

RawFeature line(Role role, std::string name, Metres points) {
  RawFeature raw = feature(role, std::move(name), {});
  raw.lines_m = {std::move(points)};
  return raw;
}

RawFeature start(double x, double y) {
  RawFeature raw = feature(Role::start, "start", {});
  raw.point_m = Eigen::Vector2d(x, y);
  raw.heading_deg = 90;
  return raw;
}

RepairedSite repair(std::vector<RawFeature> features) {
  RawSite raw;
  raw.name = "test";
  raw.features = std::move(features);
  return repair_site(raw, kMarginM);
}

std::vector<std::string> texts(const RepairedSite& site) {
  std::vector<std::string> all;
  for (const Repair& r : site.repairs) all.push_back(r.where + ": " + r.what);
  return all;
}

RawFeature house() {
  return feature(Role::obstacle, "house", {rectangle(10, 10, 20, 20)});
}
RawFeature fence() {
  return feature(Role::boundary, "fence", {rectangle(0, 0, 100, 100)});
}

TEST(RepairSite, CleanMapNeedsNoRepair) {
  const RepairedSite site = repair({fence(), house()});
  EXPECT_THAT(texts(site), IsEmpty());
  EXPECT_THAT(site.errors, IsEmpty());
  EXPECT_EQ(site.map.name, "test");
  EXPECT_DOUBLE_EQ(area_m2(site.map.boundary), 10000);
  EXPECT_DOUBLE_EQ(area_m2(site.map.obstacles), 100);
  ASSERT_EQ(site.map.regions.size(), 1u);
  EXPECT_EQ(site.map.regions[0].name, "site");
  EXPECT_DOUBLE_EQ(area_m2(site.map.regions[0].area), 10000);
  EXPECT_FALSE(site.map.start);
}

// Each way of drawing the same 10 m house badly, and what is said about it.
struct Slip {
  const char* name;
  std::vector<Metres> rings;
  std::vector<std::string> said;
};

class RepairSiteSlips : public ::testing::TestWithParam<Slip> {};

TEST_P(RepairSiteSlips, GivesTheSameHouseAndSaysWhatWasRepaired) {
  const RepairedSite site = repair({fence(), feature(Role::obstacle, "house", GetParam().rings)});
  EXPECT_THAT(site.errors, IsEmpty());
  EXPECT_NEAR(area_m2(site.map.obstacles), 100, 0.011);
  const std::vector<std::string> said = texts(site);
  ASSERT_EQ(said.size(), GetParam().said.size()) << ::testing::PrintToString(said);
  for (std::size_t i = 0; i < said.size(); ++i) {
    EXPECT_EQ(said[i], "feature 'house': " + GetParam().said[i]);
  }
}

INSTANTIATE_TEST_SUITE_P(
    All, RepairSiteSlips,
    ::testing::Values(
        Slip{"open",
             {{{10, 10}, {20, 10}, {20, 20}, {10, 20}, {10, 12.31}}},
             {"ring 0 was left open by 2.31 m; closed"}},
        Slip{"repeated",
             {{{10, 10}, {20, 10}, {20, 10}, {20, 10}, {20, 20}, {20, 20}, {10, 20}, {10, 10}}},
             {"ring 0 has 3 repeated vertices; dropped"}},
        Slip{"repeated_end",
             {{{10, 10}, {20, 10}, {20, 20}, {10, 20}, {10, 10}, {10, 10}}},
             {"ring 0 has 1 repeated vertex; dropped"}},
        Slip{"clockwise",
             {reversed(rectangle(10, 10, 20, 20))},
             {"ring 0 is an outline but runs clockwise; reversed"}},
        Slip{"spike",
             {{{10, 10}, {20, 10}, {20, 15}, {25, 15}, {20, 15}, {20, 20}, {10, 20}, {10, 10}}},
             {"ring 0 has 1 zero-width spike at (25.00, 15.00); cut off"}},
        Slip{"spike_first",
             {{{-5, 15}, {10, 15}, {10, 10}, {20, 10}, {20, 20}, {10, 20}, {10, 15}, {-5, 15}}},
             {"ring 0 has 1 zero-width spike at (-5.00, 15.00); cut off"}},
        Slip{"bent_spike",
             {{{10, 10},
               {20, 10},
               {20, 15},
               {25, 15},
               {25, 18},
               {25, 15},
               {20, 15},
               {20, 20},
               {10, 20},
               {10, 10}}},
             {"ring 0 has 2 zero-width spikes, the last at (25.00, 15.00); cut off"}},
        Slip{"keyhole",
             {{{10, 10},
               {20, 10},
               {20, 20},
               {15, 20},
               {15, 14.9},
               {15.1, 14.9},
               {15.1, 15},
               {15, 15},
               {15, 20},
               {10, 20},
               {10, 10}}},
             {"ring 0 touches itself at (15.00, 15.00) and 1 other point; split there"}},
        Slip{"wiggle",
             {{{10, 10},
               {20, 10},
               {20, 20},
               {15, 20},
               {14.95, 20.03},
               {14.95, 19.97},
               {15, 20.003},
               {10, 20},
               {10, 10}}},
             {"ring 0 crosses itself at (14.99, 20.00), a matter of 0.0008 m2; the loop was "
              "filled"}},
        Slip{"degenerate_hole",
             {rectangle(10, 10, 20, 20), {{12, 12}, {13, 13}, {12, 12}}},
             {"ring 1 has only 2 distinct vertices; dropped"}},
        Slip{"flat_hole",
             {rectangle(10, 10, 20, 20), {{12, 12}, {13, 12}, {14, 12}, {12, 12}}},
             {"ring 1 encloses no area; dropped"}}),
    [](const auto& slip) { return std::string(slip.param.name); });

TEST(RepairSite, HolesAreCutOutWhicheverWayTheyRun) {
  const RepairedSite site =
      repair({fence(), feature(Role::obstacle, "court",
                               {rectangle(10, 10, 20, 20), rectangle(12, 12, 18, 18)})});
  EXPECT_DOUBLE_EQ(area_m2(site.map.obstacles), 64);
  EXPECT_THAT(texts(site),
              ElementsAre(HasSubstr("ring 1 is a hole but runs counter-clockwise; reversed")));
}

TEST(RepairSite, MapThatRunsTheOtherWayRoundIsSaidOnce) {
  std::vector<RawFeature> features{fence()};
  for (int i = 0; i < 6; ++i) {
    features.push_back(feature(Role::obstacle, std::to_string(i),
                               {reversed(rectangle(10 * i + 1, 1, 10 * i + 6, 6))}));
  }
  const RepairedSite site = repair(features);
  EXPECT_DOUBLE_EQ(area_m2(site.map.obstacles), 150);
  EXPECT_THAT(texts(site), ElementsAre(AllOf(HasSubstr("test: 6 rings run the wrong way round"),
                                             HasSubstr("first in feature '0'; reversed"))));
}

TEST(RepairSite, LinesWithoutLengthAreDroppedAndCounted) {
  RawFeature wall = line(Role::obstacle, "wall", {{10, 10}, {20, 10}});
  wall.lines_m.push_back({{5, 5}, {5, 5}});
  wall.lines_m.push_back({{6, 6}});
  const RepairedSite site = repair({fence(), wall});
  EXPECT_THAT(texts(site), ElementsAre(HasSubstr("2 lines without length; dropped"),
                                       HasSubstr("taken as a wall")));
}

TEST(RepairSite, HoleThatLeavesItsOutlineIsCutAndMeasured) {
  const RepairedSite site =
      repair({fence(), feature(Role::obstacle, "court",
                               {rectangle(10, 10, 20, 20), reversed(rectangle(18, 12, 22, 14))})});
  EXPECT_DOUBLE_EQ(area_m2(site.map.obstacles), 96);
  EXPECT_THAT(texts(site), ElementsAre(HasSubstr("ring 1 is a hole but reaches 4.00 m2 outside")));
}

TEST(RepairSite, BowTieIsAnError) {
  const RepairedSite site =
      repair({fence(), feature(Role::obstacle, "bow",
                               {{{10, 10}, {20, 20}, {20, 10}, {10, 20}, {10, 10}}})});
  EXPECT_THAT(site.errors,
              ElementsAre(AllOf(HasSubstr("feature 'bow': ring 0: self-intersecting outline"),
                                HasSubstr("(15.00, 15.00)"), HasSubstr("50.00 m2"))));
}

TEST(RepairSite, LoopDrawnTwiceOverIsAnError) {
  Metres twice = rectangle(10, 10, 20, 20);
  const Metres inner = rectangle(10, 10, 15, 15);
  twice.insert(twice.end(), inner.begin() + 1, inner.end());
  EXPECT_THAT(repair({fence(), feature(Role::obstacle, "x", {twice})}).errors,
              ElementsAre(HasSubstr("25.00 m2 of 100.00 m2 in doubt")));
}

TEST(RepairSite, SelfCrossingToleranceIsHalfAPercentWithinLimits) {
  EXPECT_DOUBLE_EQ(self_crossing_allowed_m2(100), 0.5);
  EXPECT_DOUBLE_EQ(self_crossing_allowed_m2(1), 0.01);
  EXPECT_DOUBLE_EQ(self_crossing_allowed_m2(1e6), 1);
  // A loop at the corner of a house of 100 m^2; it may or may not belong to it, so the doubt is
  // twice its area: 0.4 m^2, then 0.6 m^2.
  for (const bool allowed : {true, false}) {
    const double loop_m = std::sqrt(allowed ? 0.4 : 0.6);
    const Metres ring = {{10, 10}, {20 + loop_m, 10}, {20, 10 - loop_m},
                         {20, 20}, {10, 20},          {10, 10}};
    const RepairedSite site = repair({fence(), feature(Role::obstacle, "x", {ring})});
    EXPECT_EQ(site.errors.empty(), allowed);
  }
}

TEST(RepairSite, OverlappingTouchingAndDoubledObstaclesAreUnitedAndSaid) {
  const RepairedSite site =
      repair({fence(), house(), feature(Role::obstacle, "overlapping", {rectangle(19, 10, 30, 20)}),
              feature(Role::obstacle, "touching", {rectangle(10, 20, 20, 25)}),
              feature(Role::obstacle, "doubled", {rectangle(10, 10, 20, 20)})});
  EXPECT_THAT(site.errors, IsEmpty());
  EXPECT_EQ(site.map.obstacles.size(), 1u);
  EXPECT_DOUBLE_EQ(area_m2(site.map.obstacles), 250);
  EXPECT_THAT(texts(site),
              ElementsAre("feature 'overlapping': overlaps feature 'house' by 10.00 m2; united",
                          "feature 'touching': touches feature 'house' along 10.00 m; united",
                          HasSubstr("'touching': touches feature 'overlapping' along 1.00 m"),
                          "feature 'doubled': is the same as feature 'house'; dropped",
                          HasSubstr("'doubled': overlaps feature 'overlapping'"),
                          HasSubstr("'doubled': touches feature 'touching'")));
}

TEST(RepairSite, PartsOfOneFeatureThatOverlapAreUnited) {
  RawFeature two = house();
  two.polygons_m.push_back({rectangle(15, 10, 25, 20)});
  const RepairedSite site = repair({fence(), two});
  EXPECT_DOUBLE_EQ(area_m2(site.map.obstacles), 150);
  EXPECT_THAT(texts(site), ElementsAre(HasSubstr("its own polygons overlap by 50.00 m2; united")));
}

TEST(RepairSite, ObstacleDrawnAsALineIsAThinWall) {
  const RepairedSite site = repair({fence(), line(Role::obstacle, "wall", {{10, 10}, {20, 10}})});
  EXPECT_THAT(site.errors, IsEmpty());
  EXPECT_NEAR(area_m2(site.map.obstacles), 10.1 * 0.1, 1e-9);
  EXPECT_THAT(texts(site), ElementsAre(HasSubstr("drawn as a line; taken as a wall 0.10 m thick")));
}

TEST(RepairSite, WithoutABoundaryABoxAroundTheObstaclesIsAssumed) {
  const RepairedSite site = repair({house()});
  EXPECT_THAT(site.errors, IsEmpty());
  EXPECT_DOUBLE_EQ(area_m2(site.map.boundary), 70 * 70);
  EXPECT_THAT(texts(site), ElementsAre(AllOf(HasSubstr("test: draws no boundary"),
                                             HasSubstr("(-20.00, -20.00) to (50.00, 50.00)"),
                                             HasSubstr("30.00 m"))));
}

TEST(RepairSite, WalledBoundaryFacesInwardsAndCounts) {
  RawFeature walled = fence();
  walled.wall = true;
  const RepairedSite site = repair({walled});
  EXPECT_THAT(site.errors, IsEmpty());
  EXPECT_TRUE(contains(site.map.obstacles, to_mm({50, -0.3})));
  EXPECT_FALSE(contains(site.map.obstacles, to_mm({50, 0.001})));
  double counts_m = 0;
  for (const SegmentMm& e : edges(site.map.obstacles)) {
    if (on_target(site.map, e)) counts_m += length_m(e.a, e.b);
  }
  EXPECT_DOUBLE_EQ(counts_m, 400);  // The inside of the wall; not its outside.
}

TEST(RepairSite, WallsOutsideTheBoundaryDoNotCount) {
  const RepairedSite site =
      repair({fence(), feature(Role::obstacle, "across", {rectangle(90, 10, 120, 20)})});
  double counts_m = 0;
  double all_m = 0;
  for (const SegmentMm& e : edges(site.map.obstacles)) {
    all_m += length_m(e.a, e.b);
    if (on_target(site.map, e)) counts_m += length_m(e.a, e.b);
  }
  EXPECT_DOUBLE_EQ(all_m, 80);
  EXPECT_DOUBLE_EQ(counts_m, 30);
}

TEST(RepairSite, TargetLinesSelectExactlyThePartOfTheWallTheyRunAlong) {
  const RepairedSite site = repair(
      {fence(), house(), line(Role::target, "front", {{12, 9.97}, {20.02, 9.99}, {20.03, 14}})});
  EXPECT_THAT(site.errors, IsEmpty());
  EXPECT_THAT(texts(site), IsEmpty());
  EXPECT_EQ(site.map.targets.size(), 2u);
  double counts_m = 0;
  for (const SegmentMm& e : edges(site.map.obstacles)) {
    if (on_target(site.map, e)) counts_m += length_m(e.a, e.b);
  }
  EXPECT_NEAR(counts_m, 8 + 4, 0.2);
  EXPECT_TRUE(on_target(site.map, {to_mm({13, 10}), to_mm({19, 10})}));
  EXPECT_FALSE(on_target(site.map, {to_mm({11, 10}), to_mm({19, 10})}));
  EXPECT_FALSE(on_target(site.map, {to_mm({20, 20}), to_mm({10, 20})}));
}

TEST(RepairSite, TargetDrawnAsAPolygonMeansItsBorder) {
  const RepairedSite site =
      repair({fence(), house(), feature(Role::obstacle, "shed", {rectangle(40, 40, 45, 45)}),
              feature(Role::target, "all of the house", {rectangle(10, 10, 20, 20)})});
  double counts_m = 0;
  for (const SegmentMm& e : edges(site.map.obstacles)) {
    if (on_target(site.map, e)) counts_m += length_m(e.a, e.b);
  }
  EXPECT_DOUBLE_EQ(counts_m, 40);
}

TEST(RepairSite, TargetPartlyOffTheWallsIsSaidAndWhollyOffIsAnError) {
  RepairedSite site = repair({fence(), house(), line(Role::target, "t", {{5, 10}, {20, 10}})});
  EXPECT_THAT(site.errors, IsEmpty());
  EXPECT_THAT(texts(site), ElementsAre(HasSubstr("5.00 m of its 15.00 m run along no wall")));
  site = repair({fence(), house(), line(Role::target, "t", {{5, 50}, {20, 50}})});
  EXPECT_THAT(site.errors, ElementsAre(HasSubstr("no target line runs along a wall")));
}

TEST(RepairSite, RegionsAreCutToTheBoundaryAndToEachOther) {
  RawFeature moat = feature(Role::region, "moat", {rectangle(-10, 0, 50, 100)});
  moat.ground_z_m = -4;
  const RepairedSite site =
      repair({fence(), house(), moat, feature(Role::region, "yard", {rectangle(40, 0, 100, 100)})});
  EXPECT_THAT(site.errors, IsEmpty());
  ASSERT_EQ(site.map.regions.size(), 2u);
  EXPECT_DOUBLE_EQ(area_m2(site.map.regions[0].area), 5000);
  EXPECT_DOUBLE_EQ(site.map.regions[0].ground_z_m, -4);
  EXPECT_DOUBLE_EQ(area_m2(site.map.regions[1].area), 5000);
  EXPECT_DOUBLE_EQ(site.map.regions[1].ground_z_m, 0);
  EXPECT_THAT(texts(site),
              ElementsAre(HasSubstr("'moat': region reaches 1000.00 m2 outside"),
                          HasSubstr("'yard': region overlaps region 'moat', drawn "
                                    "before it, by 1000.00 m2; the earlier keeps it")));
}

TEST(RepairSite, RegionNamesAreUniqueAndNeverEmpty) {
  const RepairedSite site =
      repair({fence(), house(), feature(Role::region, "a", {rectangle(0, 0, 5, 5)}),
              feature(Role::region, "a", {rectangle(50, 0, 60, 5)}),
              feature(Role::region, "", {rectangle(70, 0, 80, 5)})});
  EXPECT_THAT(site.errors, IsEmpty());
  ASSERT_EQ(site.map.regions.size(), 2u);
  EXPECT_DOUBLE_EQ(area_m2(site.map.regions[0].area), 75);
  EXPECT_EQ(site.map.regions[1].name, "region 1");
  EXPECT_THAT(texts(site), ElementsAre(HasSubstr("region 'a' is drawn twice; united"),
                                       HasSubstr("region has no name; called 'region 1'")));
}

TEST(RepairSite, GroundHeightsComeFromTheNearestWord) {
  RawSite raw;
  raw.features = {fence(), house()};
  raw.ground_z_m = 2;
  EXPECT_DOUBLE_EQ(repair_site(raw, kMarginM).map.ground_z_m, 2);
  raw.features[0].ground_z_m = 3;
  const SiteMap map = repair_site(raw, kMarginM).map;
  EXPECT_DOUBLE_EQ(map.ground_z_m, 3);
  EXPECT_DOUBLE_EQ(map.regions[0].ground_z_m, 3);
}

TEST(RepairSite, StartKeepsItsHeadingInRadians) {
  const RepairedSite site = repair({fence(), house(), start(5, 6)});
  ASSERT_TRUE(site.map.start);
  EXPECT_EQ(site.map.start->position_m, Eigen::Vector2d(5, 6));
  EXPECT_DOUBLE_EQ(site.map.start->heading_rad, std::numbers::pi / 2);
}

struct Broken {
  const char* name;
  std::vector<RawFeature> features;
  std::string said;
};

class RepairSiteErrors : public ::testing::TestWithParam<Broken> {};

TEST_P(RepairSiteErrors, AreNamedWithTheirFeature) {
  const RepairedSite site = repair(GetParam().features);
  ASSERT_EQ(site.errors.size(), 1u) << ::testing::PrintToString(site.errors);
  EXPECT_THAT(site.errors[0], HasSubstr(GetParam().said));
}

RawFeature region_at_height(double ground_z_m, double x) {
  RawFeature region = feature(Role::region, "r", {rectangle(x, 0, x + 5, 5)});
  region.ground_z_m = ground_z_m;
  return region;
}

INSTANTIATE_TEST_SUITE_P(
    All, RepairSiteErrors,
    ::testing::Values(
        Broken{"empty", {}, "neither an obstacle nor a boundary"},
        Broken{"nothing_to_model", {fence()}, "neither an obstacle nor a boundary"},
        Broken{"flat_boundary",
               {house(), feature(Role::boundary, "b", {{{0, 0}, {9, 9}}})},
               "boundary encloses no area"},
        Broken{"flat_region",
               {fence(), house(), feature(Role::region, "r", {{{0, 0}, {9, 9}}})},
               "feature 'r': region has no ground"},
        Broken{"region_outside",
               {fence(), house(), feature(Role::region, "r", {rectangle(200, 0, 210, 9)})},
               "feature 'r': region has no ground"},
        Broken{"region_hidden",
               {fence(), house(), feature(Role::region, "a", {rectangle(0, 0, 9, 9)}),
                feature(Role::region, "b", {rectangle(1, 1, 8, 8)})},
               "feature 'b': region has no ground of its own"},
        Broken{"region_slash",
               {fence(), house(), feature(Role::region, "a/2", {rectangle(0, 0, 9, 9)})},
               "contains '/'"},
        Broken{"region_two_heights",
               {fence(), house(), region_at_height(1, 0), region_at_height(2, 9)},
               "with ground_z_m 2.00 and 1.00"},
        Broken{"boundary_two_heights",
               {[] {
                  RawFeature f = fence();
                  f.ground_z_m = 1;
                  return f;
                }(),
                [] {
                  RawFeature f = fence();
                  f.ground_z_m = 2;
                  return f;
                }(),
                house()},
               "differs from the 1.00 of another boundary"},
        Broken{"far",
               {fence(), feature(Role::obstacle, "far", {rectangle(3e5, 0, 3.1e5, 9)})},
               "feature 'far': ring 0: coordinate (300000, 0) m lies more than 200 km"},
        Broken{"absurd",
               {fence(), feature(Role::obstacle, "far", {rectangle(0, 0, 1e300, 9)})},
               "1e+300"},
        Broken{"not_a_number",
               {fence(), feature(Role::obstacle, "nan", {rectangle(0, 0, std::nan(""), 9)})},
               "feature 'nan': ring 0: coordinate (nan"},
        Broken{"far_line",
               {fence(), house(), line(Role::target, "t", {{0, 0}, {-1e9, 0}})},
               "feature 't': coordinate (-1000000000, 0)"},
        Broken{"start_outside", {fence(), house(), start(-5, 5)}, "outside the boundary; move it"},
        Broken{"start_in_house", {fence(), house(), start(15, 15)}, "in an obstacle; move it"},
        Broken{"start_in_keep_out",
               {fence(), house(), feature(Role::keep_out, "k", {rectangle(50, 50, 60, 60)}),
                start(55, 55)},
               "in a keep-out; move it"},
        Broken{"two_starts", {fence(), house(), start(5, 5), start(6, 6)}, "is a second start"},
        Broken{
            "start_without_point", {fence(), house(), feature(Role::start, "s", {})}, "one Point"},
        Broken{"boundary_line",
               {house(), fence(), line(Role::boundary, "b", {{0, 0}, {9, 9}})},
               "a boundary is drawn as a line; draw a polygon"}),
    [](const auto& slip) { return std::string(slip.param.name); });

TEST(RepairSite, EveryErrorIsReportedAtOnce) {
  const RepairedSite site =
      repair({fence(), feature(Role::obstacle, "a", {{{10, 10}, {20, 20}, {20, 10}, {10, 20}}}),
              feature(Role::obstacle, "b", {rectangle(0, 0, 1e9, 9)})});
  EXPECT_EQ(site.errors.size(), 2u);
}

// Random scribbles: never throws, and what comes out without errors is clean.
TEST(RepairSite, SurvivesRandomScribbles) {
  int usable = 0;
  for (std::uint64_t seed = 1; seed <= 500; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937_64 random(seed);
    const auto coordinate = [&] { return static_cast<double>(random() % 40) / 4; };
    const auto at = [&] {
      const double x = coordinate();
      return Eigen::Vector2d(x, coordinate());
    };
    std::vector<RawFeature> features;
    const std::uint64_t count = 1 + random() % 6;
    for (std::uint64_t i = 0; i < count; ++i) {
      // Mostly triangles, which cannot cross themselves; with repeated vertices all the same.
      Metres ring(random() % 8 == 0 ? random() % 7 : 3);
      for (Eigen::Vector2d& p : ring) p = at();
      if (!ring.empty()) ring.insert(ring.end(), random() % 3, ring.back());
      constexpr Role kRoles[]{Role::obstacle, Role::boundary, Role::keep_out, Role::region};
      RawFeature raw = feature(i == 0 ? Role::obstacle : kRoles[random() % 4],
                               std::to_string(random() % 3), {ring});
      raw.wall = random() % 2 == 0;
      if (raw.role == Role::obstacle && random() % 4 == 0) raw.lines_m = {{at(), at(), at()}};
      features.push_back(raw);
    }
    const RepairedSite site = repair(features);
    if (!site.errors.empty()) continue;
    ++usable;
    EXPECT_TRUE(contacts(edges(site.map.obstacles)).empty());
    EXPECT_FALSE(site.map.regions.empty());
    free_areas(site.map, 0.3, 0.1);
  }
  EXPECT_GT(usable, 200);
}

}  // namespace
}  // namespace nav
