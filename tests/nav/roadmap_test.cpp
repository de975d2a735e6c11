#include "nav/roadmap.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <boost/polygon/voronoi.hpp>
#include <map>
#include <set>

#include "nav/noding.hpp"
#include "nav/polygons.hpp"
#include "nav/shortcuts.hpp"
#include "tests/support/random_site.hpp"

namespace nav {
namespace {

using Eigen::Vector2d;
using support::Dice;
using support::random_area;
using support::random_point;
using support::rectangle_mm;

constexpr double kRadiusM = 0.5;

FreeArea area_of(const Polygons& drivable, double radius_m = kRadiusM) {
  FreeArea area;
  area.name = area.region = "test";
  area.drivable = drivable;
  area.standable = offset(drivable, -std::llround(radius_m * 1000));
  return area;
}

// 40 x 20 m with a wall across the middle that leaves a gate of gate_m at its south end.
FreeArea two_rooms(double gate_m) {
  return area_of(subtract({Polygon{rectangle_mm(0, 0, 40, 20), {}}},
                          {Polygon{rectangle_mm(19, gate_m, 2, 20 - gate_m), {}}}));
}

double brute_clearance_m(const FreeArea& area, const Vector2d& p) {
  double least_m = std::numeric_limits<double>::infinity();
  for (const SegmentMm& e : edges(area.drivable))
    least_m = std::min(least_m, distance(Segment2{to_m(e.a), to_m(e.b)}, p));
  return least_m;
}

double brute_clearance_m(const FreeArea& area, const std::vector<Vector2d>& line) {
  double least_m = std::numeric_limits<double>::infinity();
  for (const SegmentMm& e : edges(area.drivable))
    for (std::size_t i = 1; i < line.size(); ++i)
      least_m = std::min(least_m,
                         distance(Segment2{to_m(e.a), to_m(e.b)}, Segment2{line[i - 1], line[i]}));
  return least_m;
}

int polygon_at(const Polygons& polygons, const Vector2d& p) {
  for (std::size_t i = 0; i < polygons.size(); ++i)
    if (contains({polygons[i]}, to_mm(p))) return static_cast<int>(i);
  return -1;
}

TEST(Roadmap, RunsAlongTheMiddleOfACorridor) {
  const FreeArea corridor = area_of({Polygon{rectangle_mm(0, 0, 50, 4), {}}});
  const Roadmap roadmap = Roadmap::build(corridor, kRadiusM);
  double middle_m = 0;
  for (const auto& line : roadmap.polylines())
    for (std::size_t i = 1; i < line.size(); ++i)
      if (std::abs(line[i].y() - 2) < 1e-6 && std::abs(line[i - 1].y() - 2) < 1e-6)
        middle_m += (line[i] - line[i - 1]).norm();
  EXPECT_NEAR(middle_m, 46, 1e-6);
  // Four branches into the corners, cut where the robot no longer fits.
  EXPECT_NEAR(roadmap.length_m(), 46 + 4 * std::sqrt(2) * 1.5, 0.1);
}

TEST(Roadmap, EveryNodeIsEquallyFarFromTwoEdgesAndInside) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Dice dice(seed);
    const FreeArea area = random_area(dice, {}, kRadiusM);
    const Roadmap roadmap = Roadmap::build(area, kRadiusM);
    const MedialAxis& graph = roadmap.graph();
    ASSERT_GT(graph.nodes_m.size(), 50u);
    for (std::size_t i = 0; i < graph.nodes_m.size(); ++i) {
      const Vector2d& p = graph.nodes_m[i];
      EXPECT_TRUE(contains(area.drivable, to_mm(p))) << "seed " << seed << " at " << p.transpose();
      std::vector<std::pair<double, Vector2d>> feet;
      for (const SegmentMm& e : edges(area.drivable)) {
        const Vector2d foot = closest_point({to_m(e.a), to_m(e.b)}, p);
        feet.emplace_back((foot - p).norm(), foot);
      }
      std::sort(feet.begin(), feet.end(),
                [](const auto& l, const auto& r) { return l.first < r.first; });
      EXPECT_NEAR(feet[0].first, graph.clearance_m[i], 1e-5);
      EXPECT_GE(feet[0].first, kRadiusM - Roadmap::kSlackM);
      // Another edge as near, touched in another place (one shared corner is one obstacle).
      const bool second = std::any_of(feet.begin(), feet.end(), [&](const auto& f) {
        return f.first < feet[0].first + 1e-5 && (f.second - feet[0].second).norm() > 1e-4;
      });
      EXPECT_TRUE(second) << "seed " << seed << " at " << p.transpose();
    }
  }
}

TEST(Roadmap, ChordsStayWithin20MillimetresOfTheDiagram) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    Dice dice(seed);
    const FreeArea area = random_area(dice, {}, kRadiusM);
    const Roadmap roadmap = Roadmap::build(area, kRadiusM);
    const MedialAxis& graph = roadmap.graph();
    const auto walls = edges(area.drivable);
    for (const MedialAxis::Edge& e : graph.edges) {
      const Vector2d a = graph.nodes_m[static_cast<std::size_t>(e.a)];
      const Vector2d b = graph.nodes_m[static_cast<std::size_t>(e.b)];
      EXPECT_LE((b - a).norm(), 1.0 + 1e-9);
      // On the diagram the two nearest walls are equally far: 20 mm off it, they differ by <= 40
      // mm.
      const Vector2d p = (a + b) / 2;
      double first = 1e9, second = 1e9;
      Vector2d first_foot(0, 0);
      for (const SegmentMm& w : walls) {
        const Vector2d foot = closest_point({to_m(w.a), to_m(w.b)}, p);
        const double d = (foot - p).norm();
        if (d < first) {
          if ((foot - first_foot).norm() > 1e-3) second = first;
          first = d;
          first_foot = foot;
        } else if (d < second && (foot - first_foot).norm() > 1e-3) {
          second = d;
        }
      }
      EXPECT_LE(second - first, 0.04) << p.transpose();
    }
  }
}

// The paper's way: points every step_m on the boundaries, their Voronoi diagram, and of that the
// edges whose ends lie inside the free space, farther from every wall than least_m.
std::vector<Segment2> point_diagram(const FreeArea& area, double step_m, double least_m) {
  std::vector<boost::polygon::point_data<std::int32_t>> points;
  for (const SegmentMm& e : edges(area.drivable)) {
    const int pieces = std::max(1, static_cast<int>(std::ceil(length_m(e.a, e.b) / step_m)));
    for (int k = 0; k < pieces; ++k) {
      const PointMm p = to_mm(to_m(e.a) + (to_m(e.b) - to_m(e.a)) * k / pieces);
      points.emplace_back(static_cast<std::int32_t>(p.x), static_cast<std::int32_t>(p.y));
    }
  }
  boost::polygon::voronoi_diagram<double> diagram;
  boost::polygon::construct_voronoi(points.begin(), points.end(), &diagram);
  std::vector<Segment2> kept;
  for (const auto& e : diagram.edges()) {
    if (!e.is_finite() || &e > e.twin()) continue;
    const Segment2 s{{e.vertex0()->x() / 1000, e.vertex0()->y() / 1000},
                     {e.vertex1()->x() / 1000, e.vertex1()->y() / 1000}};
    const auto good = [&](const Vector2d& p) {
      return contains(area.drivable, to_mm(p)) && brute_clearance_m(area, p) >= least_m;
    };
    if (good(s.a) && good(s.b)) kept.push_back(s);
  }
  return kept;
}

double distance_to_all(const std::vector<Segment2>& segments, const Vector2d& p) {
  double least_m = 1e9;
  for (const Segment2& s : segments) least_m = std::min(least_m, distance(s, p));
  return least_m;
}

// Whether the place is on the bisector of two walls that share a corner.
bool on_spur(const FreeArea& area, const Vector2d& p) {
  const double least_m = brute_clearance_m(area, p);
  std::vector<SegmentMm> touching;
  for (const SegmentMm& e : edges(area.drivable))
    if (distance(Segment2{to_m(e.a), to_m(e.b)}, p) < least_m + 1e-5) touching.push_back(e);
  return touching.size() == 2 && (touching[0].a == touching[1].b || touching[0].b == touching[1].a);
}

// The paper drops every edge that begins in an obstacle, and with it most spurs into corners: where
// two walls share a corner only ours has a road.
TEST(Roadmap, AgreesWithThePapersDiagramOfPoints) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    Dice dice(seed);
    const FreeArea area = random_area(dice, {30, 8, 5, 6}, kRadiusM);
    const Roadmap roadmap = Roadmap::build(area, kRadiusM);
    const MedialAxis& graph = roadmap.graph();
    std::vector<Segment2> ours;
    for (const MedialAxis::Edge& e : graph.edges)
      ours.push_back({graph.nodes_m[static_cast<std::size_t>(e.a)],
                      graph.nodes_m[static_cast<std::size_t>(e.b)]});
    const std::vector<Segment2> paper = point_diagram(area, 0.1, 0);
    ASSERT_GT(ours.size(), 40u);
    ASSERT_GT(paper.size(), 40u);
    for (const Segment2& s : ours) {
      if (on_spur(area, s.a)) continue;
      EXPECT_LE(distance_to_all(paper, s.a), 0.12) << "seed " << seed << " " << s.a.transpose();
    }
    for (const Segment2& s : point_diagram(area, 0.1, kRadiusM + 0.15))
      EXPECT_LE(distance_to_all(ours, s.a), 0.12) << "seed " << seed << " " << s.a.transpose();
  }
}

TEST(Roadmap, ReachesEveryStandablePointOfTheSamePart) {
  int pairs = 0;
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    Dice dice(seed);
    const FreeArea area = random_area(dice, {}, kRadiusM);
    const Roadmap roadmap = Roadmap::build(area, kRadiusM);
    for (int i = 0; i < 40; ++i) {
      const Vector2d from = random_point(dice, area.standable, 60);
      const Vector2d to = random_point(dice, area.standable, 60);
      const int part = polygon_at(area.standable, from);
      if (part < 0 || part != polygon_at(area.standable, to)) continue;
      ++pairs;
      NoRoute why{};
      const auto route = roadmap.route(from, to, &why);
      ASSERT_TRUE(route) << "seed " << seed << ": " << name(why) << " from " << from.transpose()
                         << " to " << to.transpose();
      EXPECT_EQ(why, NoRoute::none);
      EXPECT_EQ(route->points_m.front(), from);
      EXPECT_EQ(route->points_m.back(), to);
      EXPECT_NEAR(route->length_m, polyline_length_m(route->points_m), 1e-9);
      EXPECT_NEAR(route->clearance_min_m, brute_clearance_m(area, route->points_m), 1e-9);
      EXPECT_GE(route->clearance_min_m, kRadiusM - Roadmap::kSlackM - 1e-9)
          << "seed " << seed << " from " << from.transpose() << " to " << to.transpose();
      EXPECT_GE(route->length_m, (to - from).norm() - 1e-9);
    }
  }
  EXPECT_GT(pairs, 1000);
}

TEST(Roadmap, NeverJoinsPartsBetweenWhichTheRobotDoesNotFit) {
  int pairs = 0;
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    Dice dice(seed);
    const FreeArea area = random_area(dice, {60, 120, 6, 9}, kRadiusM);
    const Polygons generous = offset(area.drivable, -std::llround((kRadiusM - 0.04) * 1000));
    const Roadmap roadmap = Roadmap::build(area, kRadiusM);
    for (int i = 0; i < 30; ++i) {
      const Vector2d from = random_point(dice, area.standable, 60);
      const Vector2d to = random_point(dice, area.standable, 60);
      if (polygon_at(generous, from) == polygon_at(generous, to)) continue;
      ++pairs;
      NoRoute why{};
      EXPECT_FALSE(roadmap.route(from, to, &why));
      EXPECT_EQ(why, NoRoute::not_connected);
    }
  }
  EXPECT_GT(pairs, 50);
}

// From standable points to any, also outside and in other parts; without and with blocks.
TEST(Roadmap, KnowsOfManyGoalsAtOnceWhyNoWayLeadsThere) {
  std::set<NoRoute> told;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Dice dice(seed);
    const FreeArea area = random_area(dice, {60, 120, 6, 9}, kRadiusM);
    Roadmap roadmap = Roadmap::build(area, kRadiusM);
    for (const bool blocks : {false, true}) {
      if (blocks) roadmap.block(random_point(dice, area.standable, 60), 4);
      const Vector2d from = random_point(dice, area.standable, 60);
      std::vector<Vector2d> goals;
      for (int i = 0; i < 20; ++i) goals.emplace_back(dice.uniform(0, 60), dice.uniform(0, 60));
      for (int i = 0; i < 10; ++i) goals.push_back(random_point(dice, area.standable, 60));
      const std::vector<NoRoute> whys = roadmap.why_not(from, goals);
      ASSERT_EQ(whys.size(), goals.size());
      for (std::size_t i = 0; i < goals.size(); ++i) {
        NoRoute why{};
        (void)roadmap.route(from, goals[i], &why);
        EXPECT_EQ(whys[i], why) << "seed " << seed << " to " << goals[i].transpose();
        told.insert(why);
      }
    }
  }
  EXPECT_GE(told.size(), 5U);
}

TEST(Roadmap, DijkstraAndAStarFindTheSameLengths) {
  for (std::uint64_t seed = 1; seed <= 15; ++seed) {
    Dice dice(seed);
    const FreeArea area = random_area(dice, {}, kRadiusM);
    const Roadmap roadmap = Roadmap::build(area, kRadiusM);
    std::vector<Vector2d> points;
    for (int i = 0; i < 8; ++i) points.push_back(random_point(dice, area.standable, 60));
    const Eigen::MatrixXd lengths = roadmap.lengths_m(points, Smoothing::none);
    const Eigen::MatrixXd smooth = roadmap.lengths_m(points);
    for (int i = 0; i < 8; ++i) {
      EXPECT_EQ(lengths(i, i), 0);
      for (int j = 0; j < 8; ++j) {
        const auto from = points[static_cast<std::size_t>(i)];
        const auto to = points[static_cast<std::size_t>(j)];
        const auto route = roadmap.route(from, to, nullptr, Smoothing::none);
        ASSERT_EQ(route.has_value(), std::isfinite(lengths(i, j)));
        if (!route) continue;
        EXPECT_NEAR(route->length_m, lengths(i, j), 1e-6);
        EXPECT_EQ(lengths(j, i), lengths(i, j));
        EXPECT_LE(smooth(i, j), lengths(i, j) + 1e-9);
        EXPECT_GE(smooth(i, j), (to - from).norm() - 1e-9);
      }
    }
  }
}

TEST(Roadmap, ShortcutsNeverLengthenNorComeTooClose) {
  double raw_m = 0, smooth_m = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Dice dice(seed);
    const FreeArea area = random_area(dice, {}, kRadiusM);
    const Roadmap roadmap = Roadmap::build(area, kRadiusM);
    for (int i = 0; i < 20; ++i) {
      const Vector2d from = random_point(dice, area.standable, 60);
      const Vector2d to = random_point(dice, area.standable, 60);
      const auto raw = roadmap.route(from, to, nullptr, Smoothing::none);
      const auto smooth = roadmap.route(from, to);
      ASSERT_EQ(raw.has_value(), smooth.has_value());
      if (!raw) continue;
      EXPECT_LE(smooth->length_m, raw->length_m + 1e-9);
      EXPECT_GE(smooth->clearance_min_m,
                std::min(raw->clearance_min_m, kRadiusM + Roadmap::kComfortM) - 1e-6);
      raw_m += raw->length_m;
      smooth_m += smooth->length_m;
    }
  }
  EXPECT_LT(smooth_m, raw_m * 0.97);
  RecordProperty("shortened_percent", std::to_string(100 * (1 - smooth_m / raw_m)));
}

TEST(Roadmap, DrivesStraightWhereStartAndGoalSeeEachOther) {
  const Roadmap roadmap = Roadmap::build(two_rooms(3), kRadiusM);
  const auto route = roadmap.route({2, 2}, {15, 17}, nullptr, Smoothing::none);
  ASSERT_TRUE(route);
  EXPECT_EQ(route->points_m.size(), 2u);
  EXPECT_NEAR(route->length_m, std::hypot(13, 15), 1e-9);
}

TEST(Roadmap, GoesRoundThroughTheGate) {
  const Roadmap roadmap = Roadmap::build(two_rooms(3), kRadiusM);
  const auto route = roadmap.route({10, 15}, {30, 15});
  ASSERT_TRUE(route);
  const double taut_m = 2 * std::hypot(9, 12) + 2;  // Round the very corners of the gate.
  EXPECT_GT(route->length_m, taut_m);
  EXPECT_LT(route->length_m, taut_m * 1.1);
  EXPECT_GE(route->clearance_min_m, kRadiusM + Roadmap::kComfortM - 1e-6);
}

TEST(Roadmap, FitsThroughAGateAsWideAsTheRobotButNotNarrower) {
  const Roadmap fits = Roadmap::build(two_rooms(1.0), kRadiusM);
  EXPECT_TRUE(fits.route({10, 15}, {30, 15}));
  NoRoute why{};
  const Roadmap narrow = Roadmap::build(two_rooms(0.94), kRadiusM);
  EXPECT_FALSE(narrow.route({10, 15}, {30, 15}, &why));
  EXPECT_EQ(why, NoRoute::not_connected);
}

TEST(Roadmap, SaysWhyThereIsNoRoute) {
  const Roadmap roadmap = Roadmap::build(two_rooms(3), kRadiusM);
  NoRoute why{};
  EXPECT_FALSE(roadmap.route({-1, 5}, {10, 10}, &why));
  EXPECT_EQ(why, NoRoute::from_outside);
  EXPECT_FALSE(roadmap.route({10, 10}, {20, 10}, &why));
  EXPECT_EQ(why, NoRoute::to_outside);
  EXPECT_FALSE(roadmap.route({10, 10}, {10, 0.3}, &why));
  EXPECT_EQ(why, NoRoute::to_too_close);
  EXPECT_EQ(name(why), "the goal is closer to an obstacle than the robot's radius");
}

TEST(Roadmap, LeavesAPlaceThatIsTooCloseToAWall) {
  const Roadmap roadmap = Roadmap::build(two_rooms(3), kRadiusM);
  const auto route = roadmap.route({18.8, 15}, {30, 15});
  ASSERT_TRUE(route);
  for (std::size_t i = 1; i < route->points_m.size(); ++i)
    EXPECT_GE(route->clearance_m[i - 1], 0.2 - 1e-9);
}

TEST(Roadmap, TakesTheOtherWayWhenOneIsBlocked) {
  // A block in the middle of a yard: a short way round it in the south, a long one in the north.
  const FreeArea yard = area_of(subtract({Polygon{rectangle_mm(0, 0, 40, 60), {}}},
                                         {Polygon{rectangle_mm(10, 5, 20, 50), {}}}));
  Roadmap roadmap = Roadmap::build(yard, kRadiusM);
  const Vector2d west(5, 20), east(35, 20);
  const auto south = roadmap.route(west, east);
  ASSERT_TRUE(south);
  for (int i = 0; i < 5; ++i) roadmap.block_cell({20, i}, {21, i + 1});
  const auto north = roadmap.route(west, east);
  ASSERT_TRUE(north);
  EXPECT_GT(north->length_m, south->length_m + 10);
  EXPECT_TRUE(roadmap.blocked({20.5, 2.5}));
  EXPECT_FALSE(roadmap.blocked({25, 2.5}));

  roadmap.block({20, 57.5}, 2.4);
  NoRoute why{};
  EXPECT_FALSE(roadmap.route(west, east, &why));
  EXPECT_EQ(why, NoRoute::blocked);
  EXPECT_FALSE(roadmap.route(west, {20.5, 2.5}, &why));
  EXPECT_EQ(why, NoRoute::to_too_close);

  roadmap.unblock_all();
  const auto again = roadmap.route(west, east);
  ASSERT_TRUE(again);
  EXPECT_EQ(again->length_m, south->length_m);
}

TEST(Roadmap, KeepsItsRadiusFromEveryBlock) {
  int routes = 0;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    Dice dice(seed);
    const FreeArea area = random_area(dice, {60, 12, 6, 9}, kRadiusM);
    Roadmap roadmap = Roadmap::build(area, kRadiusM);
    std::vector<Vector2d> discs, cells;
    for (int i = 0; i < 60; ++i) {
      discs.push_back(random_point(dice, area.drivable, 60));
      cells.push_back(random_point(dice, area.drivable, 60));
      roadmap.block(discs.back(), 0.3);
      roadmap.block_cell(cells.back(), cells.back() + Vector2d(0.5, 0.5));
    }
    for (int i = 0; i < 20; ++i) {
      const Vector2d from = random_point(dice, area.standable, 60);
      const Vector2d to = random_point(dice, area.standable, 60);
      if (roadmap.blocked(from)) continue;
      const auto route = roadmap.route(from, to);
      if (!route) continue;
      ++routes;
      double least_m = 1e9;
      for (std::size_t k = 1; k < route->points_m.size(); ++k) {
        const Segment2 piece{route->points_m[k - 1], route->points_m[k]};
        for (const Vector2d& c : discs) least_m = std::min(least_m, distance(piece, c) - 0.3);
        for (const Vector2d& c : cells)
          least_m = std::min(least_m, distance_to_box(piece, c, c + Vector2d(0.5, 0.5)));
      }
      EXPECT_GE(least_m, kRadiusM - Roadmap::kSlackM - 1e-9);
      EXPECT_LE(route->clearance_min_m, least_m + 1e-9);
    }
  }
  EXPECT_GT(routes, 40);
}

TEST(Roadmap, IsTheSameWhereverTheOutlineStarts) {
  Dice dice(7);
  const FreeArea area = random_area(dice, {}, kRadiusM);
  FreeArea turned = area;
  for (Polygon& p : turned.drivable) {
    std::rotate(p.outer.begin(), p.outer.begin() + 1, p.outer.end());
    std::reverse(p.holes.begin(), p.holes.end());
  }
  std::reverse(turned.drivable.begin(), turned.drivable.end());
  const Roadmap a = Roadmap::build(area, kRadiusM);
  const Roadmap b = Roadmap::build(turned, kRadiusM);
  EXPECT_EQ(a.graph().nodes_m, b.graph().nodes_m);
  EXPECT_EQ(a.graph().clearance_m, b.graph().clearance_m);
}

TEST(Roadmap, IsEmptyWhereTheRobotFitsNowhere) {
  const FreeArea slit = area_of({Polygon{rectangle_mm(0, 0, 30, 0.8), {}}});
  const Roadmap roadmap = Roadmap::build(slit, kRadiusM);
  EXPECT_TRUE(roadmap.polylines().empty());
  EXPECT_TRUE(Roadmap::build(area_of({}), kRadiusM).polylines().empty());
  NoRoute why{};
  EXPECT_FALSE(roadmap.route({1, 0.4}, {20, 0.4}, &why));
  EXPECT_EQ(why, NoRoute::to_too_close);
}

TEST(Roadmap, DrawsEveryRoadOnce) {
  Dice dice(3);
  const FreeArea area = random_area(dice, {}, kRadiusM);
  const Roadmap roadmap = Roadmap::build(area, kRadiusM);
  std::size_t pieces = 0;
  double drawn_m = 0;
  for (const auto& line : roadmap.polylines()) {
    pieces += line.size() - 1;
    drawn_m += polyline_length_m(line);
  }
  EXPECT_EQ(pieces, roadmap.graph().edges.size());
  EXPECT_NEAR(drawn_m, roadmap.length_m(), 1e-6);
}

TEST(Roadmap, SurvivesOutlinesThatCrossByRounding) {
  // A long obstacle so thin that its tip turned inside out, and a corner on the boundary's edge.
  Polygon yard{rectangle_mm(0, 0, 60, 20), {}};
  yard.holes.push_back({{10000, 10000}, {30000, 10004}, {50000, 10001}, {30000, 10002}});
  yard.holes.push_back({{55000, 0}, {54000, 3000}, {56000, 3000}});
  const FreeArea area = area_of({yard});
  const Roadmap roadmap = Roadmap::build(area, kRadiusM);
  const auto route = roadmap.route({30, 15}, {30, 5});
  ASSERT_TRUE(route);
  EXPECT_GT(route->length_m, 2 * std::hypot(20, 5));
  EXPECT_LT(route->length_m, 60);
  const auto far = roadmap.route({30, 5}, {59, 1});
  ASSERT_TRUE(far);
  EXPECT_GE(far->clearance_min_m, kRadiusM - Roadmap::kSlackM);
}

TEST(Noding, LeavesPiecesThatMeetOnlyInTheirEnds) {
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    Dice dice(seed);
    std::vector<SegmentMm> segments;
    const int spread = seed % 2 == 0 ? 20 : 5000;  // A tight one is all touches and overlaps.
    for (int i = 0; i < 25; ++i)
      segments.push_back(
          {{dice.below(spread), dice.below(spread)}, {dice.below(spread), dice.below(spread)}});
    const auto pieces = node_outlines(segments);
    for (std::size_t i = 0; i < pieces.size(); ++i) {
      EXPECT_NE(pieces[i].a, pieces[i].b);
      for (std::size_t j = i + 1; j < pieces.size(); ++j) {
        const auto& s = pieces[i];
        const auto& t = pieces[j];
        const auto inner = [](const OutlinePiece& p, PointMm q) {
          return side(p.a, p.b, q) == 0 && dot(q - p.a, p.b - p.a) > 0 &&
                 dot(q - p.b, p.a - p.b) > 0;
        };
        EXPECT_FALSE(inner(s, t.a) || inner(s, t.b) || inner(t, s.a) || inner(t, s.b));
        const auto opposite = [](std::int64_t a, std::int64_t b) {
          return (a < 0 && b > 0) || (a > 0 && b < 0);
        };
        EXPECT_FALSE(opposite(side(s.a, s.b, t.a), side(s.a, s.b, t.b)) &&
                     opposite(side(t.a, t.b, s.a), side(t.a, t.b, s.b)));
        EXPECT_FALSE(std::minmax(s.a, s.b) == std::minmax(t.a, t.b));
      }
    }
  }
}

}  // namespace
}  // namespace nav
