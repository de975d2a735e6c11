#include "planning/why_wall.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "tests/planning/visibility_oracle.hpp"
#include "tests/support/random_site.hpp"

namespace planning {
namespace {

using Eigen::Vector2d;
using support::Dice;

// Houses, their outlines counter-clockwise: the free side is outside. Every fifth wall no target.
std::vector<Wall> houses(Dice& dice, int count, double side_m) {
  std::vector<Wall> walls;
  for (int i = 0; i < count; ++i) {
    const nav::Ring ring =
        support::star_mm(dice, {dice.uniform(0, side_m), dice.uniform(0, side_m)}, 4, 6);
    for (std::size_t k = 0; k < ring.size(); ++k)
      walls.push_back({ring[k], ring[(k + 1) % ring.size()], walls.size() % 5 != 0});
  }
  return walls;
}

Vector2d place_on(const Wall& wall, double at_m) {
  return nav::to_m(wall.a) + at_m * (nav::to_m(wall.b) - nav::to_m(wall.a)).normalized();
}

// How many walls but `asked` the segment crosses.
int crossed(const std::vector<Wall>& walls, int asked, const Vector2d& from, const Vector2d& to) {
  const auto side = [](const Vector2d& a, const Vector2d& b, const Vector2d& c) {
    return (b - a).x() * (c - a).y() - (b - a).y() * (c - a).x() > 0;
  };
  int count = 0;
  for (int i = 0; i < static_cast<int>(walls.size()); ++i) {
    const Vector2d a = nav::to_m(walls[static_cast<std::size_t>(i)].a);
    const Vector2d b = nav::to_m(walls[static_cast<std::size_t>(i)].b);
    count +=
        i != asked && side(from, to, a) != side(from, to, b) && side(a, b, from) != side(a, b, to);
  }
  return count;
}

void expect_first(const std::vector<Wall>& walls, int asked, const Vector2d& station,
                  const Vector2d& place, const WhyWall& why) {
  const Vector2d way = (place - station).normalized();
  const double to_it_m = (why.W_occluder_m - station).norm();
  EXPECT_EQ(crossed(walls, asked, station, station + (to_it_m - 1e-6) * way), 0);
  const std::vector<Wall> it{walls[static_cast<std::size_t>(*why.occluder)]};
  EXPECT_EQ(crossed(it, -1, station, station + (to_it_m + 1e-6) * way), 1);
}

TEST(WhyWall, NamesTheConstraintThatAskingForTheOnePointNamesAndTheFirstWallInTheWay) {
  Dice dice(5);
  std::map<std::optional<Excluded>, int> told;
  int hidden_by_others = 0;
  for (int site = 0; site < 30; ++site) {
    const std::vector<Wall> walls = houses(dice, 12, 60);
    const SensorLimits limits{.range_min_m = dice.uniform(0, 6),
                              .range_max_m = dice.uniform(8, 50),
                              .grazing_max_deg = dice.uniform(20, 90),
                              .fov_deg = dice.below(3) == 0 ? 360 : dice.uniform(10, 360)};
    const Visibility visibility(walls, limits);
    for (int i = 0; i < 150; ++i) {
      const Candidate at{{dice.below(60000), dice.below(60000)}, dice.uniform(-M_PI, M_PI)};
      const int wall = dice.below(static_cast<int>(walls.size()));
      const Wall& asked = walls[static_cast<std::size_t>(wall)];
      if (!asked.target || oracle::on_any_wall(at.position, walls)) continue;
      const double at_m = dice.uniform(0, asked.length_m());
      const Vector2d station = nav::to_m(at.position), place = place_on(asked, at_m);
      const WhyWall why = why_wall(visibility, wall, at_m, at);
      ASSERT_EQ(why.excluded, oracle::excluded_by(at, wall, place, walls, limits));
      ASSERT_NEAR(why.distance_m, (place - station).norm(), 1e-9);
      if (why.excluded == Excluded::occluded) {
        ASSERT_TRUE(why.behind || why.occluder);
        ASSERT_EQ(why.behind, !oracle::faces(asked, at.position));
      }
      if (why.occluder) {
        expect_first(walls, wall, station, place, why);
        ++hidden_by_others;
      }
      ++told[why.excluded];
    }
  }
  EXPECT_GT(hidden_by_others, 500);
  for (const auto reason :
       {Excluded::range_max, Excluded::range_min, Excluded::grazing, Excluded::field_of_view})
    EXPECT_GT(told[reason], 10) << name(reason);
  EXPECT_GT(told[std::nullopt], 10);
}

TEST(WhyWall, GivesTheNumbersInWordsForAnOperator) {
  // A wall along x from (0, 0) to (10, 0), its free side to the south; a screen before its end.
  const std::vector<Wall> walls{{{0, 0}, {10000, 0}}, {{7000, -2000}, {9000, -2000}, false}};
  const Visibility visibility(
      walls, {.range_min_m = 1, .range_max_m = 8, .grazing_max_deg = 60, .fov_deg = 90});
  const auto words = [&](double at_m, Candidate from) {
    return text(why_wall(visibility, 0, at_m, from));
  };
  const double north = M_PI / 2;
  EXPECT_EQ(words(2, {{2000, -4000}, north}),
            "imaged: 4.00 m away, 0.0 deg from the wall's normal");
  EXPECT_EQ(words(8, {{8000, -4000}, north}), "hidden by wall 1 at (8.00, -2.00)");
  EXPECT_EQ(words(2, {{2000, 4000}, -north}), "hidden: the station is behind this wall");
  EXPECT_EQ(words(2, {{2000, -9000}, north}),
            "out of range: 9.00 m away, the scanner reaches 8.00 m");
  EXPECT_EQ(words(2, {{2000, -500}, north}),
            "too near: 0.50 m away, the scanner measures from 1.00 m on");
  EXPECT_EQ(words(1, {{5000, -1000}, M_PI}),
            "too flat: the beam meets the wall 76.0 deg from the wall's normal, the limit is 60.0 "
            "deg");
  EXPECT_EQ(
      words(2, {{2000, -4000}, 0}),
      "outside the field of view: 90.0 deg to the left of the heading, the limit is 45.0 deg");
}

TEST(WhyWall, RefusesPlacesThatAreNoTarget) {
  const std::vector<Wall> walls{{{0, 0}, {10000, 0}}, {{7000, -2000}, {9000, -2000}, false}};
  const Visibility visibility(walls, {});
  const Candidate from{{2000, -4000}, 0};
  EXPECT_THROW(why_wall(visibility, 2, 0, from), std::invalid_argument);
  EXPECT_THROW(why_wall(visibility, 1, 0, from), std::invalid_argument);
  EXPECT_THROW(why_wall(visibility, 0, 10.1, from), std::invalid_argument);
  EXPECT_THROW(why_wall(visibility, 0, std::nan(""), from), std::invalid_argument);
}

}  // namespace
}  // namespace planning
