#include "planning/cover.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <numeric>
#include <optional>
#include <set>
#include <utility>

#include "nav/polygons.hpp"
#include "planning/greedy.hpp"
#include "planning/spans.hpp"
#include "tests/planning/cover_problems.hpp"
#include "tests/planning/visibility_oracle.hpp"
#include "tests/support/random_site.hpp"

namespace planning {
namespace {

using nav::PointMm;
using nav::Polygons;
using nav::Ring;
using nav::SiteMap;
using support::Dice;

Polygons box(double x0, double y0, double x1, double y1) {
  return {{support::rectangle_mm(x0, y0, x1 - x0, y1 - y0), {}}};
}

SiteMap site(const Polygons& boundary, const Polygons& obstacles) {
  SiteMap map;
  map.boundary = boundary;
  map.obstacles = obstacles;
  map.regions = {{"site", boundary, 0}};
  return map;
}

std::vector<nav::FreeArea> areas_of(const SiteMap& map) {
  return nav::free_areas(map, 0.3, 1);
}

double target_m(const std::vector<Wall>& walls) {
  return std::accumulate(walls.begin(), walls.end(), 0.0, [](double sum, const Wall& w) {
    return sum + (w.target ? w.length_m() : 0);
  });
}

// --- Walls

TEST(WallsOf, BoxInAFieldCountsAllRoundWithItsFreeSideOnTheRight) {
  const SiteMap map = site(box(0, 0, 20, 20), box(8, 8, 12, 11));
  const auto walls = walls_of(map, areas_of(map)[0]);
  ASSERT_EQ(walls.size(), 4u);
  for (const Wall& w : walls) {
    EXPECT_TRUE(w.target);
    EXPECT_GT(nav::side(w.a, w.b, nav::to_mm({10, 9.5})), 0);  // The obstacle on the left.
  }
  EXPECT_NEAR(target_m(walls), 14, 1e-9);
}

TEST(WallsOf, WallIsCutWhereOneRegionEndsAndTheNextBegins) {
  SiteMap map = site(box(0, 0, 20, 10), box(0, 0, 20, 2));
  map.regions = {{"west", box(0, 0, 7.123, 10), 0}, {"east", box(7.123, 0, 20, 10), 0}};
  const auto areas = areas_of(map);
  ASSERT_EQ(areas.size(), 2u);
  const auto west = walls_of(map, areas[0]), east = walls_of(map, areas[1]);
  EXPECT_DOUBLE_EQ(target_m(west), 7.123);
  EXPECT_DOUBLE_EQ(target_m(east), 20 - 7.123);
  for (const auto& walls : {west, east}) {
    const bool cut = std::any_of(walls.begin(), walls.end(), [](const Wall& w) {
      return w.a == PointMm{7123, 2000};
    });
    EXPECT_TRUE(cut);
    EXPECT_EQ(walls.size(), 5u);
  }
}

TEST(WallsOf, SlantedWallIsCutToTheMillimetre) {
  const Polygons slanted{{{{0, 0}, {30001, 0}, {30001, 7013}, {0, 2003}}, {}}};
  SiteMap map = site(box(0, 0, 30, 20), slanted);
  map.regions = {{"west", box(0, 0, 11.777, 20), 0}, {"east", box(11.777, 0, 30, 20), 0}};
  const auto areas = areas_of(map);
  ASSERT_EQ(areas.size(), 2u);
  std::set<PointMm> cuts;
  double sum_m = 0;
  for (const auto& area : areas) {
    const auto walls = walls_of(map, area);
    sum_m += target_m(walls);
    for (const Wall& w : walls)
      if (std::abs(w.a.x - 11777) <= 3) cuts.insert(w.a);
  }
  EXPECT_LE(cuts.size(), 2u);
  const double all_m = std::hypot(30.0, 7.013 - 2.003);
  EXPECT_NEAR(sum_m, all_m, 0.01);
}

TEST(WallsOf, RegionThatLeavesTheWallAtAShallowAngleEndsWhereItLeaves) {
  SiteMap map = site(box(0, 0, 20, 10), box(0, 0, 20, 2));
  const Polygons yard{{{nav::to_mm({0, 2}), nav::to_mm({10, 2}), nav::to_mm({10.2, 2.04}),
                        nav::to_mm({20, 3.8}), nav::to_mm({20, 10}), nav::to_mm({0, 10})},
                       {}}};
  map.regions = {{"yard", yard, 0}};
  EXPECT_NEAR(target_m(walls_of(map, areas_of(map)[0])), 10, 0.002);
}

TEST(WallsOf, GroundDrawnAskewBordersTheWallAsFarAsItIsNear) {
  SiteMap map = site(box(0, 0, 20, 10), box(0, 0, 20, 2));
  const Polygons yard{
      {{nav::to_mm({0, 2.01}), nav::to_mm({20, 2.21}), nav::to_mm({20, 10}), nav::to_mm({0, 10})},
       {}}};
  map.regions = {{"yard", yard, 0}};  // 5 cm off after 4 m.
  EXPECT_NEAR(target_m(walls_of(map, areas_of(map)[0])), 4, 0.002);
}

TEST(WallsOf, ThinWallBetweenTwoAreasGivesEachItsOwnFace) {
  const SiteMap map = site(box(0, 0, 20, 10), box(9.98, 0, 10.02, 10));  // 4 cm thick.
  const auto areas = areas_of(map);
  ASSERT_EQ(areas.size(), 2u);
  for (const auto& area : areas) EXPECT_NEAR(target_m(walls_of(map, area)), 10, 1e-9);
}

TEST(WallsOf, GroundDrawnThreeCentimetresOffStillBordersTheWall) {
  SiteMap map = site(box(0, 0, 20, 10), box(0, 0, 20, 2));
  map.regions = {{"yard", box(0, 2.03, 20, 10), 0}};
  EXPECT_NEAR(target_m(walls_of(map, areas_of(map)[0])), 20, 1e-9);
  map.regions = {{"yard", box(0, 2.2, 20, 10), 0}};
  EXPECT_EQ(target_m(walls_of(map, areas_of(map)[0])), 0);
}

TEST(WallsOf, OnlyWhatTheMapsTargetLinesSelectCounts) {
  nav::RawSite raw;
  const auto ring = [](double x0, double y0, double x1, double y1) {
    return std::vector<Eigen::Vector2d>{{x0, y0}, {x1, y0}, {x1, y1}, {x0, y1}};
  };
  nav::RawFeature boundary, house, line;
  boundary.role = nav::Role::boundary;
  boundary.polygons_m = {{ring(0, 0, 30, 30)}};
  house.role = nav::Role::obstacle;
  house.polygons_m = {{ring(10, 10, 20, 20)}};
  line.role = nav::Role::target;
  line.lines_m = {{{12, 10}, {17, 10}}};
  raw.features = {boundary, house, line};
  const SiteMap map = nav::repair_site(raw, 10).map;
  // Within reach of the line's ends the wall runs along it still.
  EXPECT_NEAR(target_m(walls_of(map, areas_of(map)[0])), 5 + 2 * nav::kTargetReachM, 0.003);
}

TEST(WallsOf, AllWallsOfARandomSiteBorderItsAreas) {
  Dice dice(4);
  for (int i = 0; i < 20; ++i) {
    SiteMap map = site(box(0, 0, 60, 60), {});
    const nav::FreeArea all = support::random_area(dice, {}, 0.3);
    map.obstacles = nav::subtract(map.boundary, all.drivable);
    for (nav::FreeArea area : areas_of(map)) {
      const auto walls = walls_of(map, area);
      double border_m = 0;  // Of the ground, but for the edge of the map.
      for (const auto& e : nav::edges(area.drivable)) {
        const bool on_edge = (e.a.x == e.b.x && (e.a.x == 0 || e.a.x == 60000)) ||
                             (e.a.y == e.b.y && (e.a.y == 0 || e.a.y == 60000));
        if (!on_edge) border_m += nav::length_m(e.a, e.b);
      }
      EXPECT_NEAR(target_m(walls), border_m, 0.02);
    }
  }
}

// --- Candidates

TEST(Candidates, StandWhereTheScannerCanAndAreSpreadByArea) {
  // A ring of ground 2 m wide with 300 m to a side, and a yard of the same area.
  const Polygons moat = nav::subtract(box(0, 0, 300, 300), box(2, 2, 298, 298));
  const Polygons yard = box(100, 100, 100 + 47.36, 150.33);
  nav::FreeArea area;
  area.standable = nav::unite(moat, yard);
  const double share = nav::area_m2(yard) / nav::area_m2(area.standable);
  const auto candidates = draw_candidates(area, 4000, 360, 9);
  ASSERT_EQ(candidates.size(), 4000u);
  int in_yard = 0, in_left_third = 0;
  for (const Candidate& c : candidates) {
    ASSERT_TRUE(nav::contains(area.standable, c.position));
    EXPECT_EQ(c.heading_rad, 0);
    const bool inside = nav::contains(yard, c.position);
    in_yard += inside;
    in_left_third += inside && c.position.x < 100000 + 47360 / 3;
  }
  EXPECT_NEAR(in_yard / 4000.0, share, 0.03);
  EXPECT_NEAR(in_left_third / static_cast<double>(in_yard), 1 / 3.0, 0.04);
}

TEST(Candidates, TaperedGroundIsFilledByArea) {
  nav::FreeArea area;
  area.standable = {{{{0, 0}, {90000, 0}, {0, 60000}}, {}}};
  const auto candidates = draw_candidates(area, 20000, 90, 2);
  Eigen::Vector2d mean_m(0, 0);
  double heading = 0, heading_max = 0;
  for (const Candidate& c : candidates) {
    mean_m += nav::to_m(c.position) / 20000;
    heading += c.heading_rad / 20000;
    heading_max = std::max(heading_max, std::abs(c.heading_rad));
  }
  EXPECT_NEAR(mean_m.x(), 30, 0.5);
  EXPECT_NEAR(mean_m.y(), 20, 0.4);
  EXPECT_NEAR(heading, 0, 0.05);
  EXPECT_NEAR(heading_max, M_PI, 0.01);
}

TEST(Candidates, SameSeedSamePlacesAndNoneWithoutGround) {
  nav::FreeArea area;
  EXPECT_TRUE(draw_candidates(area, 10, 360, 1).empty());
  area.standable = box(0, 0, 10, 10);
  EXPECT_EQ(draw_candidates(area, 50, 90, 1), draw_candidates(area, 50, 90, 1));
  EXPECT_NE(draw_candidates(area, 50, 90, 1), draw_candidates(area, 50, 90, 2));
  // Nothing but points of the grid less than 1 mm apart: ends, with whatever it found.
  area.standable = {{{{0, 0}, {1, 0}, {1000, 1}, {999, 1}}, {}}};
  EXPECT_LE(draw_candidates(area, 50, 360, 1).size(), 50u);
}

// --- Spans

TEST(Spans, SetsAgreeWithBitmaps) {
  Dice dice(7);
  for (int round = 0; round < 300; ++round) {
    SpanSet sets[2] = {SpanSet(2), SpanSet(2)};
    bool bits[2][2][64] = {};
    for (int i = 0; i < 24; ++i) {
      const int which = dice.below(2), wall = dice.below(2);
      const int from = dice.below(60), to = from + dice.below(5);
      sets[which].add(Span{wall, 100 * from, 100 * to});
      for (int k = from; k < to; ++k) bits[which][wall][k] = true;
    }
    std::int64_t total = 0, rest = 0, common = 0;
    for (int wall = 0; wall < 2; ++wall) {
      for (int k = 0; k < 64; ++k) {
        total += 100 * bits[0][wall][k];
        rest += 100 * (bits[0][wall][k] && !bits[1][wall][k]);
        common += 100 * (bits[0][wall][k] && bits[1][wall][k]);
      }
    }
    EXPECT_EQ(sets[0].total_nm(), total);
    EXPECT_EQ(sets[0].minus(sets[1]).total_nm(), rest);
    EXPECT_EQ(sets[1].overlap_nm(sets[0].spans()), common);
    const auto spans = sets[0].spans();
    for (std::size_t i = 0; i + 1 < spans.size(); ++i)
      EXPECT_TRUE(spans[i].wall < spans[i + 1].wall || spans[i].to_nm < spans[i + 1].from_nm);
  }
}

TEST(Spans, GapsOfRoundingAreClosed) {
  SpanSet set(1);
  set.add(Span{0, 0, 100});
  set.add(Span{0, 101, 200});
  set.add(Span{0, 202, 300});
  EXPECT_EQ(set.spans(), (std::vector<Span>{{0, 0, 200}, {0, 202, 300}}));
}

// --- Greedy cover

TEST(GreedyCover, LazyPicksAreThoseOfPlainGreedy) {
  Dice dice(21);
  std::map<CoverEnd, int> ends;
  std::size_t picks = 0;
  for (int round = 0; round < 3000; ++round) {
    const auto [views, walls] = cover_problems::random_views(dice, dice.below(40), 1);
    SpanSet coverable(walls);
    for (const auto& view : views) coverable.add(view);
    const std::int64_t all = coverable.total_nm();
    const CoverRules rules{.goal_nm = all * (70 + dice.below(31)) / 100,
                           .gain_min_nm = dice.below(6),
                           .overlap_min = 0.1 * dice.below(7)};
    const GreedyCover lazy = greedy_cover(views, walls, rules);
    ASSERT_EQ(lazy.picks, cover_problems::plain_greedy(views, walls, rules)) << round;
    ++ends[lazy.end];
    picks += lazy.picks.size();
  }
  EXPECT_GT(picks, 9000u);
  EXPECT_EQ(ends.size(), 4u);  // Each way to end was met.
}

// --- Plans

struct Site {
  nav::FreeArea area;
  std::vector<Wall> walls;
};

Site random_site(std::uint64_t seed, int obstacles = 25) {
  Dice dice(seed);
  SiteMap map = site(box(0, 0, 60, 60), {});
  nav::FreeArea all = support::random_area(dice, {.obstacles = obstacles}, 0.3);
  map.obstacles = nav::subtract(map.boundary, all.drivable);
  Site result{areas_of(map)[0], {}};
  result.walls = walls_of(map, result.area);
  return result;
}

bool same(const CoverPlan& a, const CoverPlan& b) {
  const auto same_station = [](const Station& s, const Station& t) {
    return s.at == t.at && s.sees == t.sees && s.sees_m == t.sees_m && s.adds_m == t.adds_m &&
           s.overlaps_m == t.overlaps_m;
  };
  const auto same_piece = [](const UncoveredPiece& p, const UncoveredPiece& q) {
    return p.piece == q.piece && p.reason == q.reason;
  };
  return a.candidates == b.candidates && a.target_m == b.target_m &&
         a.coverable_m == b.coverable_m && a.covered_m == b.covered_m && a.end == b.end &&
         a.bound == b.bound && a.goal_m == b.goal_m && a.stations_greedy == b.stations_greedy &&
         weaknesses(a.overlap) == weaknesses(b.overlap) &&
         std::ranges::equal(a.stations, b.stations, same_station) &&
         std::ranges::equal(a.uncovered, b.uncovered, same_piece);
}

const SensorLimits kScanner{
    .range_min_m = 1, .range_max_m = 25, .grazing_max_deg = 70, .fov_deg = 360};

TEST(PlanCover, DoesNotDependOnTheNumberOfThreads) {
  const Site s = random_site(1);
  SensorLimits limits = kScanner;
  limits.fov_deg = 120;
  const CoverPlan one = plan_cover(s.area, s.walls, limits, {.candidates = 300}, 7, 1);
  for (const int threads : {2, 3, 8})
    EXPECT_TRUE(same(one, plan_cover(s.area, s.walls, limits, {.candidates = 300}, 7, threads)));
  EXPECT_FALSE(same(one, plan_cover(s.area, s.walls, limits, {.candidates = 300}, 8, 1)));
}

bool near_enough(const WallPiece& p, const WallPiece& q) {
  return p.wall == q.wall && std::abs(p.from_m - q.from_m) < 3e-9 &&
         std::abs(p.to_m - q.to_m) < 3e-9;
}

TEST(PlanCover, StationsObeyTheRulesAndLengthsAddUp) {
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    const Site s = random_site(seed);
    const CoverConfig config{.candidates = 300,
                             .coverage_goal = 0.97,
                             .gain_min = 0.004,
                             .overlap_min = 0.1 * static_cast<double>(seed % 4)};
    const CoverPlan plan = plan_cover(s.area, s.walls, kScanner, config, seed, 2);
    ASSERT_GE(plan.stations.size(), 3u);
    double adds_m = 0;
    for (std::size_t i = 0; i < plan.stations.size(); ++i) {
      const Station& station = plan.stations[i];
      EXPECT_NEAR(station.adds_m + station.overlaps_m, station.sees_m, 1e-8);
      EXPECT_GE(station.adds_m, config.gain_min * plan.target_m - 1e-8);
      const double overlap_min = i == 0 ? 0 : config.overlap_min;
      EXPECT_GE(station.overlaps_m, overlap_min * station.sees_m - 1e-8);
      EXPECT_TRUE(std::ranges::equal(station.sees, visible_walls(station.at, s.walls, kScanner),
                                     near_enough));
      adds_m += station.adds_m;
    }
    double uncovered_m = 0;
    for (const UncoveredPiece& u : plan.uncovered) uncovered_m += u.piece.to_m - u.piece.from_m;
    EXPECT_NEAR(adds_m, plan.covered_m, 1e-6);
    EXPECT_NEAR(plan.covered_m + uncovered_m, plan.target_m, 0.02);
    EXPECT_LE(plan.covered_m, plan.coverable_m);
    EXPECT_LE(plan.coverable_m, plan.target_m);
    EXPECT_FALSE(plan.end.empty());
  }
}

TEST(PlanCover, AStationThatAddsEnoughMetresIsTakenWhateverItsShare) {
  const Site s = random_site(3);
  CoverConfig config{.method = CoverMethod::greedy, .candidates = 300, .gain_min = 0.2};
  const CoverPlan by_share = plan_cover(s.area, s.walls, kScanner, config, 3, 2);
  config.gain_enough_m = 4;
  const CoverPlan by_metres = plan_cover(s.area, s.walls, kScanner, config, 3, 2);
  ASSERT_LT(config.gain_enough_m, config.gain_min * by_share.target_m);
  EXPECT_GT(by_metres.covered_m, by_share.covered_m + 4);
  for (const Station& station : by_metres.stations) EXPECT_GE(station.adds_m, 4 - 1e-8);
  config.gain_min = 0;  // The lesser of the two counts.
  const CoverPlan all = plan_cover(s.area, s.walls, kScanner, config, 3, 2);
  EXPECT_GE(all.covered_m, by_metres.covered_m);
}

TEST(PlanCover, RefinedTakesNoMoreStationsThanGreedyAndSaysHowFewCouldDo) {
  int fewer = 0;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    const Site s = random_site(seed);
    CoverConfig config{.candidates = 200, .coverage_goal = 0.95, .gain_min = 0};
    const CoverPlan refined = plan_cover(s.area, s.walls, kScanner, config, seed, 2);
    config.method = CoverMethod::greedy;
    const CoverPlan greedy = plan_cover(s.area, s.walls, kScanner, config, seed, 2);
    const auto stations = static_cast<int>(refined.stations.size());
    EXPECT_EQ(greedy.stations.size(), static_cast<std::size_t>(refined.stations_greedy));
    EXPECT_LE(stations, refined.stations_greedy);
    EXPECT_LE(refined.stations_at_least, stations);
    EXPECT_GT(refined.stations_at_least, stations / 2);
    EXPECT_EQ(refined.stations_at_least, greedy.stations_at_least);
    EXPECT_GE(refined.covered_m, refined.goal_m - 1e-9);
    EXPECT_EQ(refined.overlap.part_of_station.size(), refined.stations.size());
    EXPECT_EQ(refined.bound,
              std::to_string(stations) + " stations; provably " +
                  (stations == refined.stations_at_least
                       ? "no fewer will do."
                       : "at least " + std::to_string(refined.stations_at_least) + "."));
    const SetCover problem = cover_problem(refined, s.walls, kScanner, 2);
    EXPECT_EQ(nm_to_m(problem.goal), refined.goal_m);
    EXPECT_EQ(problem.sets.size(), refined.candidates.size());
    fewer += stations < refined.stations_greedy;
    // Spare stations are spent where that leaves no weak link.
    if (stations == refined.stations_greedy) {
      EXPECT_LE(refined.overlap.weak_links(), greedy.overlap.weak_links());
      EXPECT_LE(refined.overlap.parts, greedy.overlap.parts);
    }
  }
  EXPECT_GE(fewer, 2);
}

// With so few candidates every subset of them is asked.
TEST(PlanCover, SaysOfGivenStationsHowFewCoverAsMuch) {
  int spared = 0;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    const Site s = random_site(seed);
    CoverConfig config{.candidates = 8, .gain_min = 0, .overlap_min = 0};
    config.given = draw_candidates(s.area, static_cast<int>(seed), kScanner.fov_deg, 100 + seed);
    const CoverPlan plan = plan_cover(s.area, s.walls, kScanner, config, seed, 2);
    ASSERT_EQ(plan.stations.size(), config.given->size());
    for (std::size_t i = 0; i < plan.stations.size(); ++i)
      EXPECT_EQ(plan.stations[i].at, (*config.given)[i]);
    EXPECT_NEAR(plan.goal_m, plan.covered_m, 1e-8);
    EXPECT_GT(plan.stations_at_least, 0);
    const int optimum = cover_problems::optimum(cover_problem(plan, s.walls, kScanner, 1));
    EXPECT_LE(plan.stations_at_least, optimum);
    EXPECT_LE(optimum, static_cast<int>(plan.stations.size()));
    spared += optimum < static_cast<int>(plan.stations.size());
    EXPECT_EQ(plan.overlap.part_of_station.size(), plan.stations.size());
  }
  EXPECT_GE(spared, 1);  // Else the given stations would show nothing.
}

TEST(PlanCover, NoStationGivenIsNoStation) {
  const Site s = random_site(1);
  const CoverPlan plan =
      plan_cover(s.area, s.walls, kScanner, {.candidates = 8, .given = {{}}}, 1, 1);
  EXPECT_TRUE(plan.stations.empty());
  EXPECT_EQ(plan.covered_m, 0);
  EXPECT_EQ(plan.stations_at_least, 0);
  EXPECT_EQ(plan.bound, "");
}

// What stopped the candidate that came furthest, asked point by point.
std::optional<Excluded> furthest(const std::vector<Candidate>& candidates, const WallPiece& piece,
                                 const std::vector<Wall>& walls, const SensorLimits& limits) {
  const Wall& wall = walls[static_cast<std::size_t>(piece.wall)];
  const Eigen::Vector2d point_m =
      nav::to_m(wall.a) +
      (piece.from_m + piece.to_m) / 2 * (nav::to_m(wall.b) - nav::to_m(wall.a)).normalized();
  Excluded most = Excluded::occluded;
  for (const Candidate& c : candidates) {
    const auto why = oracle::excluded_by(c, piece.wall, point_m, walls, limits);
    if (!why) return std::nullopt;
    most = std::max(most, *why);
  }
  return most;
}

TEST(PlanCover, UncoveredPiecesNameWhatExcludedThem) {
  std::map<Excluded, int> told;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    const Site s = random_site(seed);
    const SensorLimits limits{.range_min_m = seed % 2 ? 4.0 : 1.0,
                              .range_max_m = seed % 3 ? 12.0 : 60.0,
                              .grazing_max_deg = 60,
                              .fov_deg = seed % 4 ? 360.0 : 60.0};
    const CoverConfig config{.candidates = 60,
                             .coverage_goal = seed % 3 ? 1.0 : 0.8,
                             .gain_min = seed % 2 ? 0 : 0.02,
                             .overlap_min = seed % 2 ? 0.5 : 0};
    const CoverPlan plan = plan_cover(s.area, s.walls, limits, config, seed, 2);
    for (const UncoveredPiece& u : plan.uncovered) {
      if (u.piece.to_m - u.piece.from_m < 0.01) continue;
      ++told[u.reason];
      const auto why = furthest(plan.candidates, u.piece, s.walls, limits);
      if (u.reason < Excluded::overlap) {
        EXPECT_EQ(why, u.reason) << name(u.reason);
      } else {
        EXPECT_EQ(why, std::nullopt) << name(u.reason);
      }
    }
  }
  for (const Excluded reason :
       {Excluded::occluded, Excluded::range_max, Excluded::range_min, Excluded::grazing,
        Excluded::field_of_view, Excluded::overlap, Excluded::gain, Excluded::goal})
    EXPECT_GT(told[reason], 0) << name(reason);
}

TEST(PlanCover, SaysSoWhenThereIsNothingToPlan) {
  const SiteMap open = site(box(0, 0, 20, 20), {});
  const nav::FreeArea area = areas_of(open)[0];
  CoverPlan plan = plan_cover(area, walls_of(open, area), kScanner, {}, 1, 2);
  EXPECT_TRUE(plan.stations.empty());
  EXPECT_EQ(plan.end, "No wall that counts borders this area.");
  plan = plan_cover({}, {{{0, 0}, {1000, 0}}}, kScanner, {}, 1, 2);
  EXPECT_EQ(plan.end, "The scanner can stand nowhere in this area.");
  ASSERT_EQ(plan.uncovered.size(), 1u);
  EXPECT_EQ(plan.uncovered[0].reason, Excluded::occluded);
}

// Two views that share no wall: the second is refused for want of overlap.
TEST(PlanCover, OverlapConstraintKeepsRoomsApart) {
  const Polygons walls = nav::subtract(
      box(0, 0, 40, 10), nav::unite(box(0.5, 0.5, 19.5, 9.5), box(20.5, 0.5, 39.5, 9.5)));
  const SiteMap map = site(box(0, 0, 40, 10), walls);
  const auto rooms = areas_of(map);
  ASSERT_EQ(rooms.size(), 2u);
  nav::FreeArea both = rooms[0];
  both.standable.push_back(rooms[1].standable[0]);
  both.drivable.push_back(rooms[1].drivable[0]);
  CoverConfig config{.candidates = 200, .coverage_goal = 1, .gain_min = 0.001};
  const auto faces = walls_of(map, both);
  CoverPlan plan = plan_cover(both, faces, kScanner, config, 1, 2);
  EXPECT_THAT(plan.end, testing::HasSubstr("overlap_min"));
  EXPECT_LT(plan.covered_m, 0.6 * plan.coverable_m);
  config.overlap_min = 0;
  plan = plan_cover(both, faces, kScanner, config, 1, 2);
  EXPECT_GT(plan.covered_m, 0.99 * plan.coverable_m);
}

// --- How good, judged by a dense grid of stations that the planner does not know

double dense_coverable_m(const Site& s, const SensorLimits& limits, double step_m) {
  const Visibility visibility(s.walls, limits);
  SpanSet seen(s.walls.size());
  for (double x = -150; x <= 150; x += step_m)
    for (double y = -150; y <= 150; y += step_m) {
      const PointMm at = nav::to_mm({x, y});
      if (nav::contains(s.area.standable, at)) seen.add(spans_of(visibility.from({at, 0})));
    }
  return nm_to_m(seen.total_nm());
}

Site courtyard() {
  const Polygons yard{{{nav::to_mm({-30, -30}), nav::to_mm({30, -30}), nav::to_mm({30, -5}),
                        nav::to_mm({0, -5}), nav::to_mm({0, 35}), nav::to_mm({-30, 35})},
                       {}}};
  SiteMap map = site(box(-40, -40, 40, 45), nav::subtract(box(-40, -40, 40, 45), yard));
  map.obstacles =
      nav::unite(map.obstacles, nav::unite(box(-20, -20, -17, -16), box(10, -12, 11, -11)));
  Site s{areas_of(map)[0], {}};
  s.walls = walls_of(map, s.area);
  return s;
}

// A star of eight bastions and two houses; the robot is outside.
Site star_fort() {
  Ring star;
  for (int i = 0; i < 16; ++i) {
    const double r = i % 2 ? 55 : 95, angle = M_PI * i / 8;
    star.push_back(nav::to_mm(r * Eigen::Vector2d(std::cos(angle), std::sin(angle))));
  }
  SiteMap map = site(box(-130, -130, 130, 130), {{star, {}}});
  map.obstacles =
      nav::unite(map.obstacles, nav::unite(box(100, 20, 112, 40), box(-90, 90, -70, 99)));
  Site s{areas_of(map)[0], {}};
  s.walls = walls_of(map, s.area);
  return s;
}

struct DenseCase {
  const char* name;
  Site (*site)();
  double range_max_m;
};

void PrintTo(const DenseCase& c, std::ostream* out) {
  *out << c.name;
}

class ByDenseGrid : public testing::TestWithParam<DenseCase> {};

TEST_P(ByDenseGrid, PlanCoversNinetyEightPercentOfWhatAnyStationCould) {
  const Site s = GetParam().site();
  SensorLimits limits = kScanner;
  limits.range_max_m = GetParam().range_max_m;
  const double could_m = dense_coverable_m(s, limits, 1.0);
  const CoverConfig config{.candidates = 1000, .coverage_goal = 0.99, .gain_min = 0.002};
  const CoverPlan plan = plan_cover(s.area, s.walls, limits, config, 1, 2);
  EXPECT_GE(plan.covered_m, 0.98 * could_m) << plan.stations.size() << " stations; " << plan.end;
  EXPECT_LE(plan.stations.size(), 40u);
  RecordProperty("stations", static_cast<int>(plan.stations.size()));
}

INSTANTIATE_TEST_SUITE_P(PlanCover, ByDenseGrid,
                         testing::Values(DenseCase{"courtyard, 25 m", &courtyard, 25},
                                         DenseCase{"courtyard, 100 m", &courtyard, 100},
                                         DenseCase{"star fort, 40 m", &star_fort, 40},
                                         DenseCase{"star fort, 100 m", &star_fort, 100}));

}  // namespace
}  // namespace planning
