#include "planning/refine.hpp"

#include <gtest/gtest.h>

#include "nav/polygons.hpp"
#include "planning/cover.hpp"
#include "planning/cover_bound.hpp"
#include "planning/overlap_graph.hpp"
#include "planning/station_choice.hpp"
#include "planning/station_order.hpp"
#include "tests/planning/cover_problems.hpp"
#include "tools/cover_cbc.hpp"

namespace planning {
namespace {

using cover_problems::any_subset;
using cover_problems::obeys_literally;
using cover_problems::random_views;
using cover_problems::Views;
using support::Dice;

std::vector<int> candidates(const GreedyCover& cover) {
  std::vector<int> order;
  for (const Pick& pick : cover.picks) order.push_back(pick.candidate);
  return order;
}

struct Case {
  Views v;
  SetCover atoms;
  CoverRules rules;
  GreedyCover greedy;
};

Case random_case(Dice& dice, int count) {
  Case c{random_views(dice, count), {}, {}, {}};
  c.atoms = wall_atoms(c.v.views, c.v.walls);
  c.rules = {.goal_nm = total(c.atoms) * (70 + dice.below(31)) / 100,
             .gain_min_nm = 10 * dice.below(6),
             .overlap_min = 0.1 * dice.below(5)};
  c.greedy = greedy_cover(c.v.views, c.v.walls, c.rules);
  c.atoms.goal = std::min(c.rules.goal_nm, covered_nm(c.greedy));
  return c;
}

GreedyCover refined(const Case& c, int at_least = 0, std::uint64_t seed = 1) {
  return refined_cover(c.v.views, c.v.walls, c.atoms, c.rules, c.greedy, at_least, seed,
                       {.swaps = 300, .swaps_links = 60});
}

// --- Order

// Whether any order at all obeys the rules.
bool any_order(const Views& v, std::vector<int> chosen, const CoverRules& rules) {
  std::ranges::sort(chosen);
  do {
    if (obeys_literally(v, chosen, rules)) return true;
  } while (std::ranges::next_permutation(chosen).found);
  return false;
}

TEST(StationOrder, ObeysTheRulesWheneverItFindsOne) {
  Dice dice(1);
  int found = 0, missed = 0, none = 0;
  for (int round = 0; round < 600; ++round) {
    const Case c = random_case(dice, 5);
    const std::vector<int> all{0, 1, 2, 3, 4};
    const auto order = station_order(c.atoms, all, c.rules);
    if (!order) {
      ++(any_order(c.v, all, c.rules) ? missed : none);
      continue;
    }
    ++found;
    EXPECT_TRUE(std::ranges::is_permutation(*order, all));
    EXPECT_TRUE(obeys_literally(c.v, *order, c.rules));
  }
  EXPECT_GT(found, 20);
  EXPECT_GT(none, 100);
  EXPECT_LE(missed, found / 2);  // Most are odd enough to defeat any simple rule.
}

TEST(StationOrder, ForOverlapAloneItMissesNoneThatBeginsWithTheSame) {
  Dice dice(2);
  int found = 0;
  for (int round = 0; round < 400; ++round) {
    Case c = random_case(dice, 4);  // As many as it tries to begin with.
    c.rules.gain_min_nm = 0;
    const std::vector<int> all{0, 1, 2, 3};
    const bool has_order = station_order(c.atoms, all, c.rules).has_value();
    EXPECT_EQ(has_order, any_order(c.v, all, c.rules));
    found += has_order;
  }
  EXPECT_GT(found, 50);
}

// --- Refined covers

// The least number of stations that some order of which obeys the rules.
int optimum_by_the_rules(const Case& c) {
  int size = 0;
  any_subset(static_cast<int>(c.v.views.size()), [&](const std::vector<int>& chosen) {
    size = static_cast<int>(chosen.size());
    return covered(c.atoms, chosen) >= c.atoms.goal && any_order(c.v, chosen, c.rules);
  });
  return size;
}

TEST(RefinedCover, LiesBetweenTheOptimumAndGreedy) {
  Dice dice(3);
  int fewer = 0, optimal = 0, cases = 0;
  for (int round = 0; round < 80; ++round) {
    const Case c = random_case(dice, 8 + dice.below(6));
    if (c.greedy.picks.empty()) continue;
    const auto size = static_cast<int>(refined(c).picks.size());
    const int best = optimum_by_the_rules(c);
    EXPECT_LE(stations_at_least(c.atoms, size), best);
    EXPECT_LE(best, size);
    EXPECT_LE(size, static_cast<int>(c.greedy.picks.size()));
    fewer += size < static_cast<int>(c.greedy.picks.size());
    optimal += size == best;
    ++cases;
  }
  EXPECT_GT(fewer, 2);
  EXPECT_GE(optimal, cases * 95 / 100);
}

TEST(RefinedCover, IsNeverWorseThanGreedyAndObeysTheSameRules) {
  Dice dice(4);
  for (int round = 0; round < 200; ++round) {
    const Case c = random_case(dice, dice.below(40));
    const GreedyCover fine = refined(c, 0, static_cast<std::uint64_t>(round));
    EXPECT_LE(fine.picks.size(), c.greedy.picks.size());
    EXPECT_GE(covered_nm(fine), c.atoms.goal);
    if (fine.picks.size() == c.greedy.picks.size()) {
      EXPECT_GE(covered_nm(fine), covered_nm(c.greedy));
    }
    if (c.greedy.end == CoverEnd::goal) {
      EXPECT_EQ(fine.end, CoverEnd::goal);
    }
    EXPECT_TRUE(obeys_literally(c.v, candidates(fine), c.rules));
    EXPECT_TRUE(obeys(c.atoms, candidates(fine), c.rules));
    EXPECT_EQ(covered(c.atoms, candidates(fine)), covered_nm(fine));
    EXPECT_EQ(refined(c, 0, static_cast<std::uint64_t>(round)).picks, fine.picks);
  }
}

TEST(RefinedCover, HoldsTogetherNoWorseThanGreedyWithAsManyStations) {
  Dice dice(5);
  int firmer = 0;
  for (int round = 0; round < 150; ++round) {
    const Case c = random_case(dice, 30);
    const GreedyCover fine = refined(c);
    if (c.greedy.end != CoverEnd::goal || fine.picks.size() != c.greedy.picks.size()) continue;
    const auto graph = [&](const GreedyCover& cover) {
      std::vector<std::vector<Span>> views;
      for (const int i : candidates(cover)) views.push_back(c.v.views[static_cast<std::size_t>(i)]);
      return overlap_graph(views, c.rules.overlap_min);
    };
    const OverlapGraph before = graph(c.greedy), after = graph(fine);
    const std::pair was(before.parts, before.weak_links()), is(after.parts, after.weak_links());
    EXPECT_LE(is, was);
    firmer += is < was;
  }
  EXPECT_GT(firmer, 10);
}

TEST(ChooseStations, KeepsItsPromisesBeyondTheCandidatesItTakesInFull) {
  Dice dice(7);
  int fewer = 0;
  for (int round = 0; round < 25; ++round) {
    const Case c = random_case(dice, 60);
    const int in_all = stations_at_least(c.atoms, static_cast<int>(c.greedy.picks.size()));
    for (const std::size_t in_full : {5u, 20u, 60u}) {
      const StationChoice choice = choose_stations(c.v.views, c.v.walls, c.rules, true, 1, in_full);
      EXPECT_EQ(choice.greedy, static_cast<int>(c.greedy.picks.size()));
      EXPECT_LE(choice.cover.picks.size(), c.greedy.picks.size());
      EXPECT_LE(choice.at_least, static_cast<int>(choice.cover.picks.size()));
      EXPECT_LE(choice.at_least, in_all + 1);
      EXPECT_GE(covered_nm(choice.cover), choice.goal_nm);
      EXPECT_TRUE(obeys_literally(c.v, candidates(choice.cover), c.rules));
      fewer += choice.cover.picks.size() < c.greedy.picks.size();
    }
    EXPECT_EQ(choose_stations(c.v.views, c.v.walls, c.rules, false, 1, 5).cover.picks,
              c.greedy.picks);
  }
  EXPECT_GE(fewer, 3);
}

// Stations in a random yard, against the integer programme; without the rules, which it lacks.
TEST(RefinedCover, ComesWithinOneOfTheIntegerProgramme) {
  Dice dice(6);
  int sum = 0, sum_exact = 0;
  for (int round = 0; round < 5; ++round) {
    const nav::FreeArea area = support::random_area(dice, {.obstacles = 12}, 0.3);
    std::vector<Wall> walls;
    for (const nav::SegmentMm& e : nav::edges(area.drivable)) walls.push_back({e.b, e.a});
    Case c{{{}, walls.size()}, {}, {}, {}};
    const Visibility visibility(walls, {.range_max_m = 25});
    for (const auto& at : draw_candidates(area, 60, 360, 1))
      c.v.views.push_back(spans_of(visibility.from(at)));
    join_ends(c.v.views, walls.size());
    c.atoms = wall_atoms(c.v.views, walls.size());
    c.rules.goal_nm = c.atoms.goal = total(c.atoms) / 100 * 95;
    c.greedy = greedy_cover(c.v.views, walls.size(), c.rules);
    ASSERT_EQ(c.greedy.end, CoverEnd::goal);
    const auto size = static_cast<int>(refined(c).picks.size());
    const auto exact = tools::solve_cover(c.atoms);
    ASSERT_TRUE(exact.is_optimal);
    EXPECT_LE(stations_at_least(c.atoms, size), exact.at_least);
    EXPECT_LE(exact.at_least, size);
    EXPECT_LE(size, exact.at_least + 1);
    EXPECT_LE(size, static_cast<int>(c.greedy.picks.size()));
    sum += size;
    sum_exact += exact.at_least;
  }
  RecordProperty("stations", sum);
  RecordProperty("stations_exact", sum_exact);
}

}  // namespace
}  // namespace planning
