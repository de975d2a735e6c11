// The point with most room against every point of a fine grid.
#include "nav/innermost.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "nav/polygons.hpp"

namespace nav {
namespace {

Polygons block(double x0, double y0, double x1, double y1) {
  return {{{to_mm({x0, y0}), to_mm({x1, y0}), to_mm({x1, y1}), to_mm({x0, y1})}, {}}};
}

TEST(Innermost, IsTheMiddleOfASquare) {
  const PointMm middle = innermost(block(0, 0, 20, 20), 0.01);
  EXPECT_NEAR(middle.x, 10000, 11);
  EXPECT_NEAR(middle.y, 10000, 11);
}

TEST(Innermost, LiesInTheRoomierOfTwoParts) {
  const PointMm middle = innermost(unite(block(0, 0, 4, 100), block(10, 0, 18, 9)), 0.01);
  EXPECT_GT(middle.x, 10000);
}

TEST(Innermost, NoPointOfAGridHasMoreRoom) {
  for (unsigned seed = 1; seed <= 30; ++seed) {
    std::mt19937 random(seed);
    const auto coordinate = [&] { return static_cast<double>(random() % 20000) / 1000; };
    std::vector<Polygons> houses;
    for (unsigned i = 0; i < 2 + seed % 9; ++i) {
      const double x = coordinate(), y = coordinate();
      houses.push_back(block(x, y, x + 0.5 + coordinate() / 5, y + 0.5 + coordinate() / 5));
    }
    const Polygons free = subtract(block(0, 0, 20, 20), unite(houses));
    double most_m = 0;
    for (double x = 0; x < 20; x += 0.1)
      for (double y = 0; y < 20; y += 0.1)
        if (const PointMm p = to_mm({x, y}); contains(free, p))
          most_m = std::max(most_m, border_distance_m(free, p));
    const PointMm found = innermost(free, 0.05);
    EXPECT_TRUE(contains(free, found)) << "seed " << seed;
    EXPECT_GE(border_distance_m(free, found), most_m - 0.05) << "seed " << seed;
  }
}

}  // namespace
}  // namespace nav
