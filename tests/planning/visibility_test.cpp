#include "planning/visibility.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <numeric>
#include <tuple>

#include "nav/polygons.hpp"
#include "tests/planning/visibility_oracle.hpp"
#include "tests/support/random_site.hpp"

namespace planning {
namespace {

using nav::PointMm;
using nav::Polygons;
using nav::Ring;
using support::Dice;
using testing::ElementsAre;

constexpr SensorLimits kNoLimits{
    .range_min_m = 0, .range_max_m = 1e5, .grazing_max_deg = 90, .fov_deg = 360};

std::vector<Wall> walls_of_rings(const std::vector<Ring>& rings) {
  std::vector<Wall> walls;
  for (const Ring& ring : rings)
    for (std::size_t i = 0; i < ring.size(); ++i)
      walls.push_back({ring[i], ring[(i + 1) % ring.size()]});
  return walls;
}

std::vector<Wall> walls_of_polygons(const Polygons& polygons) {
  std::vector<Wall> walls;
  for (const nav::SegmentMm& edge : nav::edges(polygons)) walls.push_back({edge.a, edge.b});
  return walls;
}

std::string text(const std::vector<WallPiece>& pieces) {
  std::string lines;
  for (const WallPiece& p : pieces)
    lines += "  " + std::to_string(p.wall) + ": " + testing::PrintToString(p.from_m) + " to " +
             testing::PrintToString(p.to_m) + "\n";
  return lines;
}

std::string text(const std::vector<Wall>& walls, PointMm v) {
  std::string lines = "from " + std::to_string(v.x) + "," + std::to_string(v.y) + "\n";
  for (const Wall& w : walls)
    lines += "  " + std::to_string(w.a.x) + "," + std::to_string(w.a.y) + " -> " +
             std::to_string(w.b.x) + "," + std::to_string(w.b.y) + "\n";
  return lines;
}

PointMm random_point(Dice& dice, int side) {
  return {dice.below(side), dice.below(side)};
}

Ring random_ring(Dice& dice, int side) {
  Ring ring;
  const int corners = 3 + dice.below(4);
  const PointMm at = random_point(dice, side);
  const int size = 2 + dice.below(side / 2);
  for (int i = 0; i < corners; ++i)
    ring.push_back(at + PointMm{dice.below(size), dice.below(size)});
  return ring;
}

// As people draw and as programs round.
enum class Dirt {
  as_drawn,      // Rings of any shape and orientation, crossing, spiked, repeated.
  united,        // Clean, but touching in points and edge-on to many viewpoints.
  nudged,        // Clean, then some vertices moved by 1 mm: crossings by a hair.
  shared_edges,  // Boxes side by side: the same edge twice, to and fro, whole and in part.
  split_edges,   // Clean, with extra vertices within edges, on them or 1 mm off, and repeated.
  drawn_twice,   // Clean, and some walls again.
};

void PrintTo(Dirt dirt, std::ostream* out) {
  constexpr const char* kNames[] = {"as drawn",     "united",      "nudged",
                                    "shared edges", "split edges", "drawn twice"};
  *out << kNames[static_cast<std::size_t>(dirt)];
}

std::vector<Ring> split_rings(Dice& dice, const Polygons& clean) {
  std::vector<Ring> rings;
  for (const nav::Polygon& polygon : clean) {
    Ring ring;
    for (std::size_t i = 0; i < polygon.outer.size(); ++i) {
      const PointMm a = polygon.outer[i], b = polygon.outer[(i + 1) % polygon.outer.size()];
      ring.push_back(a);
      if (dice.below(3) == 0) ring.push_back(a);
      if (dice.below(2) == 0) ring.push_back({(a.x + b.x) / 2, (a.y + b.y) / 2});
    }
    rings.push_back(ring);
  }
  return rings;
}

std::vector<Wall> dirty_walls(Dice& dice, Dirt dirt, int side) {
  if (dirt == Dirt::shared_edges) {
    std::vector<Ring> rings;
    const int unit = std::max(1, side / 8);
    for (int i = 0; i < 8; ++i) {
      const std::int64_t x = unit * dice.below(8), y = unit * dice.below(8);
      const std::int64_t w = unit * (1 + dice.below(3)), h = unit * (1 + dice.below(3));
      rings.push_back({{x, y}, {x + w, y}, {x + w, y + h}, {x, y + h}});
    }
    return walls_of_rings(rings);
  }
  std::vector<Ring> rings;
  const int count = 1 + dice.below(6);
  for (int i = 0; i < count; ++i) rings.push_back(random_ring(dice, side));
  if (dirt == Dirt::as_drawn) return walls_of_rings(rings);
  const Polygons clean = nav::normalise(rings);
  if (dirt == Dirt::split_edges) return walls_of_rings(split_rings(dice, clean));
  std::vector<Wall> walls = walls_of_polygons(clean);
  if (dirt == Dirt::nudged) {
    std::map<PointMm, PointMm> moved;
    for (const Wall& w : walls)
      if (dice.below(2) == 0) moved[w.a] = w.a + PointMm{dice.below(3) - 1, dice.below(3) - 1};
    for (Wall& w : walls) {
      if (moved.contains(w.a)) w.a = moved[w.a];
      if (moved.contains(w.b)) w.b = moved[w.b];
    }
  }
  if (dirt == Dirt::drawn_twice) {
    for (std::size_t i = 0, n = walls.size(); i < n; ++i)
      if (dice.below(3) == 0)
        walls.push_back(dice.below(2) == 0 ? walls[i] : Wall{walls[i].b, walls[i].a});
  }
  return walls;
}

// Anywhere, beside a wall, in line with one, or on one.
PointMm awkward_viewpoint(Dice& dice, const std::vector<Wall>& walls, int side) {
  if (walls.empty() || dice.below(2) == 0)
    return random_point(dice, 2 * side) - PointMm{side / 4, side / 4};
  const Wall& w = walls[static_cast<std::size_t>(dice.below(static_cast<int>(walls.size())))];
  switch (dice.below(3)) {
    case 0:
      return w.a + PointMm{dice.below(3) - 1, dice.below(3) - 1};
    case 1:
      return w.b + (w.b - w.a);  // In line with the wall.
    default:
      return PointMm{(w.a.x + w.b.x) / 2, (w.a.y + w.b.y) / 2} +
             PointMm{dice.below(3) - 1, dice.below(3) - 1};
  }
}

class DirtyMaps : public testing::TestWithParam<Dirt> {};

TEST_P(DirtyMaps, SweepAgreesBitForBitWithShadowsAndWithRayByRay) {
  Dice dice(static_cast<std::uint64_t>(GetParam()) + 1);
  int pieces = 0;
  for (int map = 0; map < 1500; ++map) {
    const int side = map % 3 == 0 ? 12 : map % 3 == 1 ? 60 : 80'000'000;
    const std::vector<Wall> walls = dirty_walls(dice, GetParam(), side);
    const Visibility visibility(walls, kNoLimits);
    for (int i = 0; i < 4; ++i) {
      const PointMm v = awkward_viewpoint(dice, walls, side);
      const auto fast = visibility.in_sight(v);
      const auto told = [&](const std::vector<WallPiece>& slow) {
        return text(walls, v) + "sees\n" + text(fast) + "but should see\n" + text(slow);
      };
      const auto by_shadows = oracle::sight_by_shadows(v, walls);
      ASSERT_TRUE(fast == by_shadows) << told(by_shadows);
      if (i == 0) {
        const auto by_cells = oracle::sight_by_cells(v, walls);
        ASSERT_TRUE(fast == by_cells) << told(by_cells);
      }
      pieces += static_cast<int>(fast.size());
    }
  }
  EXPECT_GT(pieces, 5000);
}

INSTANTIATE_TEST_SUITE_P(Visibility, DirtyMaps,
                         testing::Values(Dirt::as_drawn, Dirt::united, Dirt::nudged,
                                         Dirt::shared_edges, Dirt::split_edges, Dirt::drawn_twice));

TEST(Sight, CleanMapsHaveNoTangledWalls) {
  Dice dice(3);
  for (int i = 0; i < 200; ++i) {
    std::vector<Wall> walls = dirty_walls(dice, Dirt::united, 60);
    EXPECT_TRUE(Sight(walls).tangled().empty());
    if (walls.empty()) continue;
    walls.push_back({walls[0].b, walls[0].a});
    EXPECT_EQ(Sight(walls).tangled().size(), 1u);
  }
}

// The e of least length with cross(d, e) == 1, for coprime d in the first quadrant.
PointMm next_direction(PointMm d) {
  std::int64_t r0 = d.x, r1 = d.y, s0 = 1, s1 = 0, t0 = 0, t1 = 1;
  while (r1 != 0) {
    const std::int64_t q = r0 / r1;
    std::tie(r0, r1) = std::pair(r1, r0 - q * r1);
    std::tie(s0, s1) = std::pair(s1, s0 - q * s1);
    std::tie(t0, t1) = std::pair(t1, t0 - q * t1);
  }
  return {-t0, s0};
}

TEST(Sight, DirectionsLessThanARoundingErrorApartAreToldApart) {
  Dice dice(6);
  int pieces = 0;
  for (int round = 0; round < 3000; ++round) {
    PointMm d;
    do {
      d = random_point(dice, 80'000'000) + PointMm{1, 1};
    } while (std::gcd(d.x, d.y) != 1);
    const PointMm e = next_direction(d);
    ASSERT_EQ(nav::cross(d, e), 1);
    const PointMm ends[] = {d, d + e, d + e + e, d - e, d + d + e, d + d};
    std::vector<Wall> walls;
    for (int i = 0; i < 4; ++i) {
      const PointMm at = ends[dice.below(6)];
      const PointMm other =
          dice.below(4) == 0 ? ends[dice.below(6)]
                             : at + random_point(dice, 8'000'000) - PointMm{4'000'000, 4'000'000};
      walls.push_back(dice.below(2) == 0 ? Wall{at, other} : Wall{other, at});
    }
    const auto fast = Visibility(walls, kNoLimits).in_sight({0, 0});
    const auto slow = oracle::sight_by_shadows({0, 0}, walls);
    ASSERT_TRUE(fast == slow) << text(walls, {0, 0}) << text(fast) << text(slow);
    pieces += static_cast<int>(fast.size());
  }
  EXPECT_GT(pieces, 3000);
}

TEST(Sight, SharesAreRoundedCorrectlyHoweverTheyAreWritten) {
  Dice dice(5);
  for (int i = 0; i < 20000; ++i) {
    const std::int64_t den = 1 + (std::int64_t{dice.below(1 << 30)} << dice.below(14));
    const auto num = static_cast<std::int64_t>(dice.uniform(0, 1) * static_cast<double>(den));
    const std::int64_t k = 1 + dice.below(1 << 14);
    ASSERT_EQ(value({num, den}), oracle::nearest_double({num, den}));
    ASSERT_EQ(value({num * k, den * k}), value({num, den})) << num << "/" << den << " * " << k;
  }
  EXPECT_EQ(value({1, std::int64_t{1} << 60}), 0x1p-60);
  EXPECT_EQ(value({std::int64_t{1} << 60, std::int64_t{1} << 60}), 1);
}

std::vector<Wall> random_site(Dice& dice, int obstacles, double side_m) {
  const nav::FreeArea area = support::random_area(
      dice, {.side_m = side_m, .obstacles = obstacles, .obstacle_radius_m = 6, .corners_max = 9},
      0.3);
  std::vector<Wall> walls;  // The free area on the right of a -> b.
  for (const nav::SegmentMm& edge : nav::edges(area.drivable)) walls.push_back({edge.b, edge.a});
  for (std::size_t i = 0; i < walls.size(); i += 5) walls[i].target = false;
  return walls;
}

SensorLimits random_limits(Dice& dice) {
  return {.range_min_m = dice.uniform(0, 6),
          .range_max_m = dice.uniform(8, 60),
          .grazing_max_deg = dice.uniform(20, 90),
          .fov_deg = dice.below(3) == 0 ? 360 : dice.uniform(10, 360)};
}

TEST(Visibility, LeavingOutWhatIsOutOfRangeChangesNoBit) {
  Dice dice(11);
  for (int site = 0; site < 12; ++site) {
    const std::vector<Wall> walls = random_site(dice, 60, 120);
    for (int i = 0; i < 60; ++i) {
      const SensorLimits limits = random_limits(dice);
      const Visibility visibility(walls, limits);
      const Candidate at{random_point(dice, 120000), dice.uniform(-M_PI, M_PI)};
      std::vector<WallPiece> all_round;
      for (const Outcome& outcome : visibility.explain(at)) {
        const bool seen = !outcome.excluded;
        if (seen && outcome.piece.to_m - outcome.piece.from_m >= kPieceMinM)
          all_round.push_back(outcome.piece);
      }
      ASSERT_EQ(visibility.from(at), all_round);
      ASSERT_EQ(visibility.in_sight(at.position), oracle::sight_by_shadows(at.position, walls));
    }
  }
}

TEST(Visibility, EveryPointIsSeenOrExcludedAsAskingForItAloneSays) {
  Dice dice(12);
  int asked = 0, seen = 0;
  for (int site = 0; site < 10; ++site) {
    const std::vector<Wall> walls = random_site(dice, 20, 60);
    for (int i = 0; i < 40; ++i) {
      const SensorLimits limits = random_limits(dice);
      const Candidate at{random_point(dice, 60000), dice.uniform(-M_PI, M_PI)};
      for (const Outcome& outcome : Visibility(walls, limits).explain(at)) {
        const WallPiece& piece = outcome.piece;
        if (piece.to_m - piece.from_m < 0.01) continue;
        const Wall& wall = walls[static_cast<std::size_t>(piece.wall)];
        const double along_m = dice.uniform(piece.from_m + 0.001, piece.to_m - 0.001);
        const Eigen::Vector2d point_m =
            nav::to_m(wall.a) + along_m * (nav::to_m(wall.b) - nav::to_m(wall.a)).normalized();
        ASSERT_EQ(oracle::excluded_by(at, piece.wall, point_m, walls, limits), outcome.excluded)
            << text(walls, at.position) << piece.wall << " at " << along_m;
        ++asked;
        seen += outcome.excluded ? 0 : 1;
      }
    }
  }
  EXPECT_GT(asked, 20000);
  EXPECT_GT(seen, 1000);
}

TEST(Visibility, ExplanationCutsEveryTargetWallWithoutGapOrOverlap) {
  Dice dice(13);
  const std::vector<Wall> walls = random_site(dice, 20, 60);
  for (int i = 0; i < 100; ++i) {
    const auto outcomes = Visibility(walls, random_limits(dice))
                              .explain({random_point(dice, 60000), dice.uniform(-M_PI, M_PI)});
    std::size_t k = 0;
    for (std::size_t w = 0; w < walls.size(); ++w) {
      if (!walls[w].target) continue;
      double at_m = 0;
      for (; k < outcomes.size() && outcomes[k].piece.wall == static_cast<int>(w); ++k) {
        EXPECT_EQ(outcomes[k].piece.from_m, at_m);
        at_m = outcomes[k].piece.to_m;
      }
      EXPECT_EQ(at_m, walls[w].length_m());
    }
    EXPECT_EQ(k, outcomes.size());
  }
}

// A wall from x = -10 m to 10 m at y = 0, free towards +y, and the viewpoint above its middle.
const std::vector<Wall> kLongWall{{{10000, 0}, {-10000, 0}}};
Candidate above(double y_m, double heading_deg = 0) {
  return {nav::to_mm({0, y_m}), heading_deg * M_PI / 180};
}

void expect_pieces(const std::vector<WallPiece>& pieces,
                   const std::vector<std::pair<double, double>>& expected) {
  ASSERT_EQ(pieces.size(), expected.size()) << text(pieces);
  for (std::size_t i = 0; i < expected.size(); ++i) {
    EXPECT_NEAR(pieces[i].from_m, expected[i].first, 1e-6);
    EXPECT_NEAR(pieces[i].to_m, expected[i].second, 1e-6);
  }
}

TEST(Visibility, MaximumRangeClipsInThreeCases) {
  SensorLimits limits = kNoLimits;
  limits.range_max_m = 5;
  expect_pieces(visible_walls(above(3), kLongWall, limits), {{6, 14}});  // Both ends outside.
  expect_pieces(visible_walls(above(5.1), kLongWall, limits), {});       // And the line too.
  const std::vector<Wall> half{{{10000, 0}, {1000, 0}}};                 // One end inside.
  expect_pieces(visible_walls(above(3), half, limits), {{6, 9}});
  limits.range_max_m = 11;  // Both ends inside.
  expect_pieces(visible_walls(above(3), kLongWall, limits), {{0, 20}});
}

TEST(Visibility, MinimumRangeCutsTheNearPartOut) {
  SensorLimits limits = kNoLimits;
  limits.range_min_m = 5;
  expect_pieces(visible_walls(above(3), kLongWall, limits), {{0, 6}, {14, 20}});
  expect_pieces(visible_walls(above(5), kLongWall, limits), {{0, 20}});
}

TEST(Visibility, GrazingAngleKeepsWhatIsNearThePerpendicular) {
  SensorLimits limits = kNoLimits;
  limits.grazing_max_deg = 45;
  expect_pieces(visible_walls(above(3), kLongWall, limits), {{7, 13}});
}

TEST(Visibility, FieldOfViewIsCentredOnTheHeading) {
  SensorLimits limits = kNoLimits;
  limits.fov_deg = 90;
  expect_pieces(visible_walls(above(3, -90), kLongWall, limits), {{7, 13}});
  expect_pieces(visible_walls(above(3, 90), kLongWall, limits), {});
  expect_pieces(visible_walls(above(3, -45), kLongWall, limits), {{0, 10}});
  limits.fov_deg = 180;
  expect_pieces(visible_walls(above(3, 180), kLongWall, limits), {{10, 20}});
  limits.fov_deg = 270;
  expect_pieces(visible_walls(above(3, 90), kLongWall, limits), {{0, 7}, {13, 20}});
  limits.fov_deg = 360;
  expect_pieces(visible_walls(above(3, 90), kLongWall, limits), {{0, 20}});
}

TEST(Visibility, ExplanationNamesTheFirstConstraintThatExcludes) {
  const SensorLimits limits{
      .range_min_m = 3.25, .range_max_m = 8, .grazing_max_deg = 60, .fov_deg = 180};
  std::vector<Wall> walls = kLongWall;
  walls.push_back({{-4000, 1000}, {-4000, 1001}, false});  // A hair.
  std::vector<std::string> told;
  for (const Outcome& outcome : Visibility(walls, limits).explain(above(3, 0)))
    told.push_back(outcome.excluded ? std::string(name(*outcome.excluded)) : "seen");
  EXPECT_THAT(told, ElementsAre("range_max", "grazing", "seen", "range_min", "field_of_view",
                                "grazing", "occluded", "grazing", "range_max"));
}

TEST(Visibility, WallsAreSeenFromTheirFreeSideOnlyButHideFromBoth) {
  const std::vector<Wall> walls{{{-1000, 1000}, {1000, 1000}}, {{2000, 2000}, {-2000, 2000}}};
  // From below, the first wall shows its free side; the second shows its back.
  expect_pieces(visible_walls({{0, 0}, 0}, walls, kNoLimits), {{0, 2}});
  // From above, the second hides nothing; the first is seen from behind.
  expect_pieces(visible_walls({{0, 3000}, 0}, walls, kNoLimits), {{0, 4}});
}

TEST(Visibility, NothingIsSeenFromInsideAnObstacleOrFromOnAWall) {
  const std::vector<Wall> box = walls_of_rings({{{0, 0}, {4000, 0}, {4000, 4000}, {0, 4000}}});
  EXPECT_TRUE(visible_walls({{2000, 2000}, 0}, box, kNoLimits).empty());
  EXPECT_TRUE(visible_walls({{2000, 0}, 0}, box, kNoLimits).empty());
  EXPECT_TRUE(visible_walls({{4000, 0}, 0}, box, kNoLimits).empty());
  EXPECT_EQ(visible_walls({{2000, -1}, 0}, box, kNoLimits).size(), 1u);
}

TEST(Visibility, RefusesLimitsNoScannerHas) {
  const auto with = [](auto change) {
    SensorLimits limits;
    change(limits);
    return limits;
  };
  EXPECT_THROW(Visibility({}, with([](auto& l) { l.range_max_m = 0.5; })), std::invalid_argument);
  EXPECT_THROW(Visibility({}, with([](auto& l) { l.range_min_m = -1; })), std::invalid_argument);
  EXPECT_THROW(Visibility({}, with([](auto& l) { l.grazing_max_deg = 0; })), std::invalid_argument);
  EXPECT_THROW(Visibility({}, with([](auto& l) { l.fov_deg = 361; })), std::invalid_argument);
  EXPECT_THROW(Visibility({}, with([](auto& l) { l.range_max_m = NAN; })), std::invalid_argument);
}

}  // namespace
}  // namespace planning
