// The triangles that caps of solids and the ground are made of.
#include <gtest/gtest.h>

#include <boost/random/uniform_int_distribution.hpp>
#include <cmath>
#include <map>
#include <numeric>
#include <random>
#include <utility>

#include "tools/make_sites_triangulate.hpp"

namespace {

using nav::PointMm;
using nav::Polygon;
using nav::Ring;

std::int64_t twice_area(const std::vector<PointMm>& points,
                        const std::vector<sites::Triangle>& triangles) {
  std::int64_t sum = 0;
  for (const auto& t : triangles) {
    const auto at = [&](int i) { return points[static_cast<std::size_t>(i)]; };
    const std::int64_t area = nav::side(at(t[0]), at(t[1]), at(t[2]));
    EXPECT_GT(area, 0) << "a triangle is flat or clockwise";
    sum += area;
  }
  return sum;
}

std::vector<PointMm> flat(const Polygon& polygon) {
  std::vector<PointMm> points = polygon.outer;
  for (const Ring& hole : polygon.holes) points.insert(points.end(), hole.begin(), hole.end());
  return points;
}

// Directed edges of the triangles that no neighbour shares: must be the polygon's own edges.
std::map<std::pair<int, int>, int> border(const std::vector<sites::Triangle>& triangles) {
  std::map<std::pair<int, int>, int> open;
  for (const auto& t : triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      const int a = t[k], b = t[(k + 1) % 3];
      if (const auto back = open.find({b, a}); back != open.end()) {
        open.erase(back);
      } else {
        ++open[{a, b}];
      }
    }
  return open;
}

std::map<std::pair<int, int>, int> edges_of(const Polygon& polygon) {
  std::map<std::pair<int, int>, int> edges;
  int first = 0;
  const auto add = [&](const Ring& ring) {
    const int n = static_cast<int>(ring.size());
    for (int i = 0; i < n; ++i) ++edges[{first + i, first + (i + 1) % n}];
    first += n;
  };
  add(polygon.outer);
  for (const Ring& hole : polygon.holes) add(hole);
  return edges;
}

// A star-shaped ring of random radii.
Ring random_ring(std::mt19937_64& random, PointMm center, int corners, std::int64_t low,
                 std::int64_t high) {
  boost::random::uniform_int_distribution<std::int64_t> radius(low, high);
  Ring ring;
  for (int i = 0; i < corners; ++i) {
    const double angle = 2 * std::acos(-1.0) * i / corners;
    const auto r = static_cast<double>(radius(random));
    ring.push_back({center.x + std::llround(r * std::cos(angle)),
                    center.y + std::llround(r * std::sin(angle))});
  }
  return ring;
}

Ring reversed(Ring ring) {
  std::reverse(ring.begin(), ring.end());
  return ring;
}

std::int64_t twice_area(const Polygon& polygon) {
  std::int64_t sum = sites::twice_area_mm2(polygon.outer);
  for (const Ring& hole : polygon.holes) sum += sites::twice_area_mm2(hole);
  return sum;
}

TEST(Triangulate, CoversRandomPolygonsWithHolesExactly) {
  std::mt19937_64 random(7);
  boost::random::uniform_int_distribution<int> corners(3, 40);
  for (int round = 0; round < 200; ++round) {
    Polygon polygon{random_ring(random, {0, 0}, 4 + corners(random), 20'000, 60'000), {}};
    for (const PointMm center : {PointMm{5000, 5000}, PointMm{-5000, 5000}, PointMm{0, -6000}})
      polygon.holes.push_back(reversed(random_ring(random, center, corners(random), 500, 3'000)));
    if (round % 4 == 0) polygon.holes.clear();
    const auto triangles = sites::triangulate(polygon);
    EXPECT_EQ(twice_area(flat(polygon), triangles), twice_area(polygon)) << "round " << round;
    EXPECT_EQ(border(triangles), edges_of(polygon)) << "round " << round;
  }
}

TEST(Triangulate, KeepsVerticesThatLieOnAStraightEdge) {
  const Polygon polygon{{{0, 0}, {1000, 0}, {2000, 0}, {2000, 2000}, {1000, 2000}, {0, 2000}}, {}};
  const auto triangles = sites::triangulate(polygon);
  EXPECT_EQ(triangles.size(), 4u);
  EXPECT_EQ(border(triangles), edges_of(polygon));
}

TEST(Triangulate, RefusesAClockwiseOutline) {
  EXPECT_THROW(sites::triangulate({{{0, 0}, {0, 1000}, {1000, 1000}, {1000, 0}}, {}}),
               std::logic_error);
}

TEST(Triangulate, RefusesAnOutlineThatCrossesItself) {
  EXPECT_THROW(sites::triangulate({{{0, 0}, {4000, 0}, {4000, 4000}, {1000, -1000}}, {}}),
               std::logic_error);
}

}  // namespace
