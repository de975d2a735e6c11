// Where one can walk to.
#include "sim/reachable.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace {

using Eigen::Vector2d;

// 10 x 10 m in cells of 0.25 m with a closed shed from (6, 3) to (9, 7), walls 0.5 m thick.
const sim::GroundCells kYard{{0, 0}, 0.25, 40, 40};

bool in_walls(const Vector2d& p) {
  const auto within = [&](double margin) {
    return p.x() > 6 + margin && p.x() < 9 - margin && p.y() > 3 + margin && p.y() < 7 - margin;
  };
  return within(0) && !within(0.5);
}

bool reached(const std::vector<std::uint8_t>& mask, double x, double y) {
  return mask[static_cast<std::size_t>(kYard.index_at({x, y}))] != 0;
}

TEST(Reachable, TheInsideOfAClosedShedIsNot) {
  const Vector2d seeds[] = {{1, 1}};
  const auto mask = sim::reachable(kYard, seeds, [](const Vector2d& p) { return !in_walls(p); });
  EXPECT_TRUE(reached(mask, 9.6, 9.6));
  EXPECT_TRUE(reached(mask, 9.6, 5));
  EXPECT_FALSE(reached(mask, 7.5, 5));
  EXPECT_FALSE(reached(mask, 6.1, 5));
}

TEST(Reachable, ADoorLetsIn) {
  const Vector2d seeds[] = {{1, 1}};
  const auto mask = sim::reachable(
      kYard, seeds, [](const Vector2d& p) { return !in_walls(p) || std::abs(p.y() - 5) < 0.2; });
  EXPECT_TRUE(reached(mask, 7.5, 6));
}

TEST(Reachable, SeedsCountAsTheyAreAndOutsideOnesAreIgnored) {
  const Vector2d seeds[] = {{7.5, 5}, {-3, 2}, {20, 2}};
  int calls = 0;
  const auto mask = sim::reachable(kYard, seeds, [&](const Vector2d& p) {
    ++calls;
    return !in_walls(p);
  });
  EXPECT_TRUE(reached(mask, 7.5, 5));
  EXPECT_FALSE(reached(mask, 1, 1));
  EXPECT_LT(calls, 40 * 40 / 4) << "asked beyond the walls";
  const auto none = sim::reachable(kYard, {}, [](const Vector2d&) { return true; });
  EXPECT_EQ(std::count(none.begin(), none.end(), 1), 0);
}

TEST(Reachable, AsksEachCellOnceAtItsCentre) {
  std::vector<int> asked(1600, 0);
  const Vector2d seeds[] = {{5, 5}};
  sim::reachable(kYard, seeds, [&](const Vector2d& p) {
    const auto index = kYard.index_at(p);
    EXPECT_EQ(kYard.center_m(index), p);
    ++asked[static_cast<std::size_t>(index)];
    return p.x() < 5.5;
  });
  for (const int n : asked) EXPECT_LE(n, 1);
}

}  // namespace
