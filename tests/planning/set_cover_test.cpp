#include "planning/set_cover.hpp"

#include <gtest/gtest.h>

#include <set>

#include "planning/set_cover_search.hpp"
#include "tests/planning/cover_problems.hpp"

namespace planning {
namespace {

using cover_problems::optimum;
using cover_problems::random_cover;
using cover_problems::random_views;
using support::Dice;

std::vector<int> random_choice(Dice& dice, std::size_t sets) {
  std::vector<int> chosen;
  for (int i = 0; i < static_cast<int>(sets); ++i)
    if (dice.below(3) == 0) chosen.push_back(i);
  return chosen;
}

// --- Ends of views

TEST(JoinEnds, EndsThatDifferByRoundingBecomeOnePlace) {
  std::vector<std::vector<Span>> views{{{0, 0, 1000}, {0, 1001, 2000}}, {{0, 999, 2001}}};
  join_ends(views, 1);
  EXPECT_EQ(views[0], (std::vector<Span>{{0, 0, 2000}}));
  EXPECT_EQ(views[1], (std::vector<Span>{{0, 999, 2000}}));
}

TEST(JoinEnds, AfterwardsUnionsCloseNoGaps) {
  Dice dice(5);
  for (int round = 0; round < 300; ++round) {
    std::vector<std::vector<Span>> views(6);
    for (auto& view : views) {
      SpanSet seen(2);
      for (int i = 0; i < 5; ++i) {
        const int from = dice.below(60);
        seen.add(Span{dice.below(2), from, from + 3 + dice.below(9)});
      }
      view = seen.spans();
    }
    const auto before = views;
    join_ends(views, 2);
    SpanSet all(2);
    std::set<std::pair<int, std::int64_t>> seen;  // Nanometre by nanometre.
    for (std::size_t i = 0; i < views.size(); ++i) {
      EXPECT_LE(std::abs(length_nm(views[i]) - length_nm(before[i])), 60);
      all.add(views[i]);
      for (const Span& s : views[i])
        for (std::int64_t at = s.from_nm; at < s.to_nm; ++at) seen.emplace(s.wall, at);
    }
    EXPECT_EQ(all.total_nm(), static_cast<std::int64_t>(seen.size()));
  }
}

// --- Atoms

TEST(WallAtoms, WeighWhatSpansMeasure) {
  Dice dice(6);
  for (int round = 0; round < 300; ++round) {
    auto v = random_views(dice, 1 + dice.below(30));
    join_ends(v.views, v.walls);
    const SetCover atoms = wall_atoms(v.views, v.walls);
    for (std::size_t i = 0; i < v.views.size(); ++i)
      EXPECT_EQ(weight_of(atoms, atoms.sets[i]), length_nm(v.views[i]));
    const auto chosen = random_choice(dice, v.views.size());
    SpanSet seen(v.walls);
    for (const int i : chosen) seen.add(v.views[static_cast<std::size_t>(i)]);
    EXPECT_EQ(covered(atoms, chosen), seen.total_nm());
    std::set<std::vector<int>> distinct;  // No two atoms are seen by the same candidates.
    for (const auto& seen_by : holders(atoms)) distinct.insert(seen_by);
    EXPECT_EQ(distinct.size(), atoms.atoms());
  }
}

TEST(SetCover, RunsHoldTheSameAtoms) {
  Dice dice(7);
  const SetCover problem = random_cover(dice, 40, 60, 0.6);
  const auto as_runs = runs(problem);
  for (std::size_t i = 0; i < problem.sets.size(); ++i) {
    std::vector<int> atoms;
    for (const auto& [from, to] : as_runs[i])
      for (auto a = from; a < to; ++a) atoms.push_back(static_cast<int>(a));
    EXPECT_EQ(atoms, problem.sets[i]);
  }
}

TEST(SetCover, UndominatedSetsArePartOfNoOther) {
  Dice dice(8);
  std::size_t dropped = 0;
  for (int round = 0; round < 200; ++round) {
    const SetCover problem = random_cover(dice, 14, 1 + dice.below(8), 0.4);
    const auto kept = undominated(problem);
    dropped += problem.sets.size() - kept.size();
    for (int i = 0; i < 14; ++i) {
      const auto& set = problem.sets[static_cast<std::size_t>(i)];
      const bool is_kept = std::ranges::count(kept, i) == 1;
      const bool is_part = std::ranges::any_of(kept, [&](int k) {
        return k != i && std::ranges::includes(problem.sets[static_cast<std::size_t>(k)], set);
      });
      EXPECT_NE(is_kept, is_part || set.empty());
    }
  }
  EXPECT_GT(dropped, 500u);
}

TEST(SetCover, FewerAtomsAndSetsTakeAsManySets) {
  Dice dice(9);
  std::size_t dropped = 0;
  for (int round = 0; round < 300; ++round) {
    SetCover problem = random_cover(dice, 10, 12, 0.3);
    if (round % 2 == 0) problem.goal = covered(problem, {0, 1, 2, 3, 4, 5, 6, 7, 8, 9});
    const SetCover fewer_atoms = without_implied_atoms(problem);
    dropped += problem.atoms() - fewer_atoms.atoms();
    EXPECT_EQ(optimum(fewer_atoms), optimum(problem));
    const auto chosen = random_choice(dice, 10);
    EXPECT_EQ(covered(fewer_atoms, chosen) >= fewer_atoms.goal,
              covered(problem, chosen) >= problem.goal);
    SetCover fewer_sets{problem.weight, {}, problem.goal};
    for (const int i : undominated(problem))
      fewer_sets.sets.push_back(problem.sets[static_cast<std::size_t>(i)]);
    EXPECT_EQ(optimum(fewer_sets), optimum(problem));
  }
  EXPECT_GT(dropped, 300u);
}

// --- Swaps

std::vector<int> sorted(std::vector<int> v) {
  std::ranges::sort(v);
  return v;
}

// What the best exchange of one set would cover, asked one by one.
std::int64_t best_exchange(const SetCover& problem, const std::vector<int>& chosen) {
  std::int64_t best = -1;
  for (std::size_t slot = 0; slot < chosen.size(); ++slot) {
    for (int i = 0; i < static_cast<int>(problem.sets.size()); ++i) {
      if (std::ranges::count(chosen, i) > 0) continue;
      std::vector<int> other = chosen;
      other[slot] = i;
      best = std::max(best, covered(problem, other));
    }
  }
  return best;
}

TEST(SwapSearch, FirstSwapIsTheBestOfAll) {
  Dice dice(10);
  for (int round = 0; round < 200; ++round) {
    const SetCover problem = random_cover(dice, 20, 40, 0.15);
    const std::vector<int> chosen{3, 7, 11, 19};
    std::vector<int> all(20);
    for (int i = 0; i < 20; ++i) all[static_cast<std::size_t>(i)] = i;
    SwapSearch search(problem, all, chosen, 1);
    ASSERT_TRUE(search.swap());
    EXPECT_EQ(search.covered(), best_exchange(problem, chosen));
  }
}

TEST(SwapSearch, KnowsWhatItCoversWhateverItDid) {
  Dice dice(11);
  for (int round = 0; round < 40; ++round) {
    const SetCover problem = random_cover(dice, 30, 50, 0.15);
    SwapSearch search(problem, undominated(problem), {0, 1, 2, 3, 4, 5, 6, 7}, 1);
    for (int i = 0; i < 40 && search.chosen().size() > 2; ++i) {
      EXPECT_EQ(search.covered(), covered(problem, search.chosen()));
      const auto distinct = sorted(search.chosen());
      EXPECT_EQ(std::ranges::adjacent_find(distinct), distinct.end());
      if (i % 8 == 7) {  // The set whose loss is least goes.
        std::int64_t most = -1;
        for (const int gone : distinct) {
          std::vector<int> rest = distinct;
          std::erase(rest, gone);
          most = std::max(most, covered(problem, rest));
        }
        search.drop();
        if (problem.goal < total(problem) - 9) {  // Else some atoms count for more.
          EXPECT_EQ(search.covered(), most);
        }
      }
      search.swap();
    }
  }
}

}  // namespace
}  // namespace planning
