// Stations in place of one that cannot be reached, against a slow search on a ruler with marks.
#include "planning/replacement.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "nav/polygons.hpp"
#include "planning/spans.hpp"
#include "tests/support/random_site.hpp"

namespace replacement_tests {
namespace {

using planning::Candidate;
using planning::WallPiece;
using support::Dice;

// A house in a yard, and walls of a few more.
nav::SiteMap random_map(Dice& dice) {
  nav::SiteMap map;
  map.boundary = nav::normalise({support::rectangle_mm(0, 0, 40, 30)});
  for (int i = 2 + dice.below(4); i > 0; --i)
    map.obstacles =
        nav::unite(map.obstacles,
                   nav::normalise({support::rectangle_mm(dice.uniform(3, 30), dice.uniform(3, 20),
                                                         dice.uniform(1, 8), dice.uniform(1, 8))}));
  map.regions = {{"yard", map.boundary, 0}};
  return map;
}

// Walls as rows of marks 1 cm apart.
class Ruler {
 public:
  explicit Ruler(const std::vector<planning::Wall>& walls) {
    for (const planning::Wall& wall : walls)
      marks_.emplace_back(static_cast<std::size_t>(wall.length_m() * 100), 0);
  }
  void mark(const std::vector<WallPiece>& pieces) {
    each(pieces, [](char& at) { at = 1; });
  }
  double marked_m(const std::vector<WallPiece>& pieces) {
    int count = 0;
    each(pieces, [&](char at) { count += at; });
    return 0.01 * count;
  }
  double all_m(const std::vector<WallPiece>& pieces) {
    int count = 0;
    each(pieces, [&](char) { ++count; });
    return 0.01 * count;
  }

 private:
  template <class Do>
  void each(const std::vector<WallPiece>& pieces, Do&& act) {
    for (const WallPiece& piece : pieces) {
      auto& wall = marks_[static_cast<std::size_t>(piece.wall)];
      for (std::size_t i = 0; i < wall.size(); ++i) {
        const double at_m = 0.01 * (static_cast<double>(i) + 0.5);
        if (at_m >= piece.from_m && at_m < piece.to_m) act(wall[i]);
      }
    }
  }
  std::vector<std::vector<char>> marks_;
};

struct Case {
  std::vector<planning::Wall> walls;
  planning::SensorLimits limits{.range_min_m = 0.5, .range_max_m = 25};
  planning::LostStation lost;

  explicit Case(Dice& dice, std::uint64_t seed) {
    const nav::SiteMap map = random_map(dice);
    const nav::FreeArea area = nav::free_areas(map, 0.5, 1).at(0);
    walls = planning::walls_of(map, area);
    lost.candidates = planning::draw_candidates(area, 80, 360, seed);
    const auto view = [&] {
      return planning::visible_walls(lost.candidates[static_cast<std::size_t>(dice.below(80))],
                                     walls, limits);
    };
    lost.sees = view();
    for (int i = dice.below(4); i > 0; --i) lost.kept.push_back(view());
    const std::int64_t reach_mm = 1000 * (20 + dice.below(25));
    lost.can_be_reached = [reach_mm](const Candidate& at) { return at.position.x < reach_mm; };
    lost.overlap_min = 0.2;
  }
};

TEST(Replacement, SeesWhatASearchOnARulerSaysThatItCan) {
  int chosen = 0, none = 0;
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    Dice dice(seed);
    const Case made(dice, seed);
    const planning::Replacements found =
        planning::replace_station(made.lost, made.walls, made.limits, 1);
    Ruler kept(made.walls);
    for (const auto& sees : made.lost.kept) kept.mark(sees);
    double left_m = kept.all_m(made.lost.sees) - kept.marked_m(made.lost.sees);
    EXPECT_NEAR(found.lost_m, left_m, 0.15) << "seed " << seed;
    const double worth_m = std::max(planning::kWorthM, planning::kWorthShare * found.lost_m);

    // What a place adds: what the lost station sees, nothing kept sees, and it does.
    const auto adds_m = [&](const std::vector<WallPiece>& sees) {
      Ruler mine(made.walls);
      mine.mark(sees);
      Ruler both = kept;
      both.mark(sees);
      return both.marked_m(made.lost.sees) - kept.marked_m(made.lost.sees);
    };
    const auto best_m = [&](double slack) {
      double most_m = 0;
      for (const Candidate& at : made.lost.candidates) {
        if (!made.lost.can_be_reached(at)) continue;
        const auto sees = planning::visible_walls(at, made.walls, made.limits);
        const bool fits =
            made.lost.kept.empty() || kept.marked_m(sees) >= (0.2 + slack) * kept.all_m(sees);
        if (fits) most_m = std::max(most_m, adds_m(sees));
      }
      return most_m;
    };
    for (const planning::Station& station : found.stations) {
      EXPECT_TRUE(made.lost.can_be_reached(station.at)) << "seed " << seed;
      EXPECT_EQ(planning::spans_of(station.sees),
                planning::spans_of(planning::visible_walls(station.at, made.walls, made.limits)));
      EXPECT_NEAR(station.adds_m, adds_m(station.sees), 0.15) << "seed " << seed;
      EXPECT_GE(station.adds_m, worth_m - 1e-6) << "seed " << seed;
      EXPECT_GE(station.adds_m, best_m(0.01) - 0.15) << "seed " << seed;
      EXPECT_LE(station.adds_m, best_m(-0.01) + 0.15) << "seed " << seed;
      kept.mark(station.sees);
      left_m -= station.adds_m;
      ++chosen;
    }
    EXPECT_NEAR(found.left_m, left_m, 0.3) << "seed " << seed;
    EXPECT_LT(best_m(0.01), worth_m + 0.15) << "seed " << seed << ": another was worth it";
    none += found.stations.empty();
  }
  EXPECT_GE(chosen, 20);
  EXPECT_GE(none, 5);
}

TEST(Replacement, AsksForNothingWhereOthersSeeAll) {
  Dice dice(3);
  Case made(dice, 3);
  made.lost.kept = {made.lost.sees};
  const planning::Replacements found =
      planning::replace_station(made.lost, made.walls, made.limits, 1);
  EXPECT_EQ(found.lost_m, 0);
  EXPECT_TRUE(found.stations.empty());
}

TEST(Replacement, DoesNotDependOnTheNumberOfThreads) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    Dice dice(seed);
    const Case made(dice, seed);
    const auto one = planning::replace_station(made.lost, made.walls, made.limits, 1);
    const auto four = planning::replace_station(made.lost, made.walls, made.limits, 4);
    ASSERT_EQ(one.stations.size(), four.stations.size());
    for (std::size_t i = 0; i < one.stations.size(); ++i)
      EXPECT_EQ(one.stations[i].at, four.stations[i].at);
  }
}

}  // namespace
}  // namespace replacement_tests
