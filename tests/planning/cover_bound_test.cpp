#include "planning/cover_bound.hpp"

#include <gtest/gtest.h>

#include "tests/planning/cover_problems.hpp"
#include "tools/cover_cbc.hpp"

namespace planning {
namespace {

using cover_problems::optimum;
using cover_problems::random_cover;
using support::Dice;

TEST(StationsAtLeast, NeverExceedsTheSmallestCover) {
  Dice dice(1);
  int tight = 0;
  for (int round = 0; round < 400; ++round) {
    const SetCover problem = random_cover(dice, 12, 4 + dice.below(30), dice.uniform(0.05, 0.5));
    const int smallest = optimum(problem);
    for (const int known : {1, smallest, smallest + 3, 100})  // Also when it is told nonsense.
      for (const int rounds : {0, 1, 60, 1200})
        EXPECT_LE(stations_at_least(problem, known, rounds), smallest);
    tight += stations_at_least(problem, smallest) == smallest;
  }
  EXPECT_GT(tight, 240);
}

TEST(StationsAtLeast, IsTightWhereSetsShareNothing) {
  SetCover problem;
  for (int i = 0; i < 9; ++i) {
    problem.weight.push_back(1'000'000'000'000);
    problem.sets.push_back({i});
  }
  for (int n = 0; n <= 9; ++n) {
    problem.goal = 1'000'000'000'000 * n;
    EXPECT_EQ(stations_at_least(problem, n), n);
    if (n == 9) continue;
    ++problem.goal;  // A nanometre more takes one more.
    EXPECT_GE(stations_at_least(problem, n + 1), std::max(1, n));
    EXPECT_LE(stations_at_least(problem, n + 1), n + 1);
  }
}

TEST(StationsAtLeast, SaysNothingOfNothing) {
  EXPECT_EQ(stations_at_least({}, 0), 0);
  EXPECT_EQ(stations_at_least({.weight = {5}, .sets = {{0}}, .goal = 0}, 0), 0);
  EXPECT_EQ(stations_at_least({.weight = {5}, .sets = {{0}}, .goal = 1}, 1), 1);
}

// --- The judge

TEST(CoverCbc, FindsTheSmallestCover) {
  Dice dice(2);
  for (int round = 0; round < 25; ++round) {
    const SetCover problem = random_cover(dice, 12, 4 + dice.below(30), dice.uniform(0.1, 0.5));
    if (problem.goal == 0) continue;
    const auto exact = tools::solve_cover(problem);
    EXPECT_TRUE(exact.is_optimal);
    EXPECT_EQ(exact.at_least, optimum(problem));
    EXPECT_EQ(static_cast<int>(exact.sets.size()), exact.at_least);
    EXPECT_GE(covered(problem, exact.sets), problem.goal);
    const auto joined = tools::solve_cover(problem, {}, {.time_s = 60, .cells_max = 4});
    EXPECT_LE(joined.at_least, exact.at_least);
  }
}

TEST(CoverCbc, RefusesWhatCannotBeCovered) {
  EXPECT_THROW(tools::solve_cover({.weight = {5, 5}, .sets = {{0}}, .goal = 6}),
               std::invalid_argument);
}

TEST(CoverCbc, BoundLiesBelowItOnLargerCovers) {
  Dice dice(3);
  for (int round = 0; round < 4; ++round) {
    const SetCover problem = random_cover(dice, 60, 120, 0.08);
    const auto exact = tools::solve_cover(problem);
    ASSERT_TRUE(exact.is_optimal);
    const int bound = stations_at_least(problem, exact.at_least);
    EXPECT_LE(bound, exact.at_least);
    EXPECT_GE(bound, exact.at_least - 3);
  }
}

}  // namespace
}  // namespace planning
