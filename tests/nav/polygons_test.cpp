// Set operations against brute force: winding numbers of the raw rings at sample points.
#include "nav/polygons.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>
#include <stdexcept>

#include "nav/rings.hpp"

namespace nav {
namespace {

using Random = std::mt19937_64;

std::int64_t below(Random& random, std::int64_t n) {
  return static_cast<std::int64_t>(random() % static_cast<std::uint64_t>(n));
}

Ring box_mm(std::int64_t x0, std::int64_t y0, std::int64_t x1, std::int64_t y1) {
  return {{x0, y0}, {x1, y0}, {x1, y1}, {x0, y1}};
}

Polygons box_polygon(std::int64_t x0, std::int64_t y0, std::int64_t x1, std::int64_t y1) {
  return {{box_mm(x0, y0, x1, y1), {}}};
}

// Vertices on a coarse grid, so that they coincide, touch and align often; with repeated vertices
// and zero-width spikes.
Ring dirty_ring(Random& random, std::int64_t step_mm) {
  Ring ring;
  const auto count = 3 + below(random, 10);
  for (std::int64_t i = 0; i < count; ++i) {
    const PointMm p{below(random, 12) * step_mm, below(random, 12) * step_mm};
    ring.push_back(p);
    if (below(random, 4) == 0) ring.push_back(p);
    if (below(random, 4) == 0) {
      ring.push_back({below(random, 12) * step_mm, below(random, 12) * step_mm});
      ring.push_back(p);
    }
  }
  return ring;
}

std::vector<Ring> dirty_rings(Random& random) {
  const std::int64_t step_mm = below(random, 2) == 0 ? 100 : 97 + below(random, 40);
  std::vector<Ring> rings;
  const auto count = 1 + below(random, 3);
  for (std::int64_t i = 0; i < count; ++i) rings.push_back(dirty_ring(random, step_mm));
  return rings;
}

int winding(const Ring& ring, PointMm p) {
  int turns = 0;
  for (std::size_t i = 0; i < ring.size(); ++i) {
    const PointMm a = ring[i];
    const PointMm b = ring[(i + 1) % ring.size()];
    if (a.y <= p.y && b.y > p.y && side(a, b, p) > 0) ++turns;
    if (a.y > p.y && b.y <= p.y && side(a, b, p) < 0) --turns;
  }
  return turns;
}

// What normalise() promises: non-zero per ring, even-odd between the rings.
bool inside_by_hand(const std::vector<Ring>& rings, PointMm p) {
  bool inside = false;
  for (const Ring& ring : rings) inside ^= winding(ring, p) != 0;
  return inside;
}

double distance_to_rings_m(const std::vector<Ring>& rings, PointMm p) {
  double nearest = 1e9;
  for (const Ring& ring : rings) {
    for (std::size_t i = 0; i < ring.size(); ++i) {
      nearest = std::min(nearest, distance_m({ring[i], ring[(i + 1) % ring.size()]}, p));
    }
  }
  return nearest;
}

// The promises of polygons.hpp on every result.
void expect_clean(const Polygons& polygons) {
  EXPECT_TRUE(contacts(edges(polygons)).empty());
  std::set<SegmentMm> seen;
  for (const SegmentMm& e : edges(polygons)) {
    EXPECT_NE(e.a, e.b);
    EXPECT_TRUE(seen.insert(e).second);
    EXPECT_FALSE(seen.count({e.b, e.a}));
  }
  const auto expect_simple = [](Ring ring) {
    std::sort(ring.begin(), ring.end());
    EXPECT_EQ(std::adjacent_find(ring.begin(), ring.end()), ring.end());
  };
  for (const Polygon& polygon : polygons) {
    EXPECT_GT(twice_area_mm2(polygon.outer), 0);
    expect_simple(polygon.outer);
    for (const Ring& hole : polygon.holes) {
      EXPECT_LT(twice_area_mm2(hole), 0);
      expect_simple(hole);
      for (const PointMm p : hole) EXPECT_GE(locate(polygon.outer, p), 0);
    }
  }
}

constexpr double kRoundingM = 0.003;
constexpr int kSamples = 150;

template <class Expected>
void expect_samples(Random& random, const Polygons& actual, const std::vector<Ring>& borders,
                    Expected expected) {
  for (int i = 0; i < kSamples; ++i) {
    const PointMm p{below(random, 1700) - 100, below(random, 1700) - 100};
    if (distance_to_rings_m(borders, p) < kRoundingM) continue;
    ASSERT_EQ(contains(actual, p), expected(p)) << p.x << ", " << p.y;
  }
}

TEST(Polygons, NormaliseAgreesWithWindingNumbersOnDirtyRings) {
  for (std::uint64_t seed = 1; seed <= 2000; ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    const auto rings = dirty_rings(random);
    const Polygons clean = normalise(rings);
    expect_clean(clean);
    expect_samples(random, clean, rings, [&](PointMm p) { return inside_by_hand(rings, p); });
    if (HasFailure()) return;
  }
}

TEST(Polygons, FillRulesDifferExactlyOnDoublyWoundParts) {
  for (std::uint64_t seed = 1; seed <= 1000; ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    const Ring ring = dirty_ring(random, 100);
    expect_samples(random, fill(ring, FillRule::non_zero), {ring},
                   [&](PointMm p) { return winding(ring, p) != 0; });
    expect_samples(random, fill(ring, FillRule::even_odd), {ring},
                   [&](PointMm p) { return winding(ring, p) % 2 != 0; });
    if (HasFailure()) return;
  }
}

TEST(Polygons, SetOperationsAgreeWithPointSampling) {
  for (std::uint64_t seed = 1; seed <= 1000; ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    const auto rings_a = dirty_rings(random);
    const auto rings_b = dirty_rings(random);
    const Polygons a = normalise(rings_a);
    const Polygons b = normalise(rings_b);
    auto borders = rings_a;
    borders.insert(borders.end(), rings_b.begin(), rings_b.end());
    const auto in_a = [&](PointMm p) { return inside_by_hand(rings_a, p); };
    const auto in_b = [&](PointMm p) { return inside_by_hand(rings_b, p); };
    const Polygons united = unite(a, b);
    const Polygons common = intersect(a, b);
    const Polygons rest = subtract(a, b);
    for (const Polygons* result : {&united, &common, &rest}) expect_clean(*result);
    expect_samples(random, united, borders, [&](PointMm p) { return in_a(p) || in_b(p); });
    expect_samples(random, common, borders, [&](PointMm p) { return in_a(p) && in_b(p); });
    expect_samples(random, rest, borders, [&](PointMm p) { return in_a(p) && !in_b(p); });
    const double rounding_m2 = 0.002 * (perimeter_m(a) + perimeter_m(b));
    EXPECT_NEAR(area_m2(united) + area_m2(common), area_m2(a) + area_m2(b), rounding_m2);
    EXPECT_NEAR(area_m2(rest) + area_m2(common), area_m2(a), rounding_m2);
    if (HasFailure()) return;
  }
}

TEST(Polygons, OffsetKeepsExactlyThePointsFartherOrNearerThanTheDistance) {
  for (std::uint64_t seed = 1; seed <= 400; ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    const Polygons a = normalise(dirty_rings(random));
    const std::int64_t distance_mm = 20 + below(random, 100);
    const double d = static_cast<double>(distance_mm) / 1000;
    const Polygons grown = offset(a, distance_mm);
    const Polygons shrunk = offset(a, -distance_mm);
    expect_clean(grown);
    expect_clean(shrunk);
    for (int i = 0; i < kSamples; ++i) {
      const PointMm p{below(random, 1700) - 100, below(random, 1700) - 100};
      const double border_m = border_distance_m(a, p);
      const bool inside = contains(a, p);
      if (border_m < d - 0.003) {
        ASSERT_TRUE(contains(grown, p)) << p.x << ", " << p.y;
        ASSERT_FALSE(contains(shrunk, p)) << p.x << ", " << p.y;
      }
      if (border_m > d + 0.013) {
        ASSERT_EQ(contains(grown, p), inside) << p.x << ", " << p.y;
        ASSERT_EQ(contains(shrunk, p), inside) << p.x << ", " << p.y;
      }
    }
    if (HasFailure()) return;
  }
}

TEST(Polygons, ResultDoesNotDependOnTheOrderOfTheInput) {
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    const Polygons clean = normalise(dirty_rings(random));
    Polygons shuffled(clean.rbegin(), clean.rend());
    for (Polygon& polygon : shuffled) {
      std::reverse(polygon.outer.begin(), polygon.outer.end());
      std::reverse(polygon.holes.begin(), polygon.holes.end());
      for (Ring& hole : polygon.holes) std::rotate(hole.begin(), hole.begin() + 1, hole.end());
    }
    EXPECT_EQ(edges(unite(shuffled, {})), edges(clean));
  }
}

TEST(Polygons, NeighboursThatShareAWallBecomeOne) {
  const Polygons united = unite(box_polygon(0, 0, 10, 10), box_polygon(10, 0, 20, 10));
  ASSERT_EQ(united.size(), 1u);
  EXPECT_EQ(united[0].outer, (Ring{{0, 0}, {20, 0}, {20, 10}, {0, 10}}));
}

TEST(Polygons, CornersThatTouchKeepTwoPolygons) {
  const Polygons united = unite(box_polygon(0, 0, 10, 10), box_polygon(10, 10, 20, 20));
  ASSERT_EQ(united.size(), 2u);
  expect_clean(united);
}

TEST(Polygons, HoleThatTouchesItsOutlineStaysAHole) {
  const Polygons shape =
      subtract(box_polygon(0, 0, 100, 100), {{{{0, 50}, {40, 30}, {40, 70}}, {}}});
  ASSERT_EQ(shape.size(), 1u);
  ASSERT_EQ(shape[0].holes.size(), 1u);
  expect_clean(shape);
}

TEST(Polygons, IslandInAHoleIsAPolygonOfItsOwn) {
  const Polygons shape = normalise({box_mm(0, 0, 90, 90), box_mm(10, 10, 80, 80),
                                    box_mm(20, 20, 70, 70), box_mm(30, 30, 60, 60)});
  ASSERT_EQ(shape.size(), 2u);
  EXPECT_EQ(shape[0].holes.size(), 1u);
  EXPECT_EQ(shape[1].holes.size(), 1u);
  EXPECT_DOUBLE_EQ(area_m2(shape), (8100 - 4900 + 2500 - 900) * 1e-6);
  EXPECT_TRUE(contains(shape, {10, 10}));
  EXPECT_FALSE(contains(shape, {15, 15}));
  EXPECT_TRUE(contains(shape, {25, 25}));
  EXPECT_FALSE(contains(shape, {45, 45}));
}

TEST(Polygons, InsideIsOnTheLeftOfEveryEdge) {
  const Polygons shape = normalise({box_mm(0, 0, 90, 90), box_mm(10, 10, 80, 80)});
  for (const SegmentMm& e : edges(shape)) {
    const PointMm d = e.b - e.a;
    const std::int64_t length = std::abs(d.x) + std::abs(d.y);  // Axis-parallel.
    const PointMm middle{(e.a.x + e.b.x) / 2, (e.a.y + e.b.y) / 2};
    EXPECT_TRUE(contains(shape, middle + PointMm{-d.y / length, d.x / length}));
    EXPECT_FALSE(contains(shape, middle - PointMm{-d.y / length, d.x / length}));
  }
}

TEST(Polygons, SliversAreDropped) {
  EXPECT_TRUE(normalise({box_mm(0, 0, 1000, 1)}).empty());
  EXPECT_EQ(normalise({box_mm(0, 0, 1000, 3)}).size(), 1u);
}

TEST(Polygons, WithVerticesCutsAnEdgeAtThePoint) {
  const Polygons cut = with_vertices(box_polygon(0, 0, 100, 100), {{40, 0}, {50, 50}, {100, 30}});
  ASSERT_EQ(cut.size(), 1u);
  EXPECT_EQ(cut[0].outer, (Ring{{0, 0}, {40, 0}, {100, 0}, {100, 30}, {100, 100}, {0, 100}}));
}

TEST(Polygons, ThickenedLineIsAWall) {
  const Polygons wall = thicken({{{0, 0}, {1000, 0}, {1000, 500}}}, 50);
  expect_clean(wall);
  EXPECT_DOUBLE_EQ(area_m2(wall), 0.1 * (1.1 + 0.5));
}

TEST(Polygons, CoordinatesBeyondTheLimitAreRefused) {
  const auto limit = kCoordinateMax;
  EXPECT_NO_THROW(unite(box_polygon(-limit, -limit, limit, limit), {}));
  EXPECT_THROW(unite(box_polygon(0, 0, limit + 1, 10), {}), std::out_of_range);
  EXPECT_THROW(intersect({}, box_polygon(0, -limit - 1, 10, 10)), std::out_of_range);
  const double side_m = 2.0 * static_cast<double>(limit) / 1000;
  EXPECT_DOUBLE_EQ(area_m2(box_polygon(-limit, -limit, limit, limit)), side_m * side_m);
}

TEST(Polygons, EmptyArgumentsAreFine) {
  const Polygons some = box_polygon(0, 0, 10, 10);
  EXPECT_TRUE(unite({}, {}).empty());
  EXPECT_EQ(edges(unite(some, {})), edges(some));
  EXPECT_TRUE(intersect(some, {}).empty());
  EXPECT_EQ(edges(subtract(some, {})), edges(some));
  EXPECT_TRUE(offset(some, -6).empty());
  EXPECT_TRUE(normalise({{}, {{1, 1}}, {{1, 1}, {5, 5}}}).empty());
  EXPECT_FALSE(contains({}, {0, 0}));
}

}  // namespace
}  // namespace nav
