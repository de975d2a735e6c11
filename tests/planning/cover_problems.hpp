// Made-up cover problems and their slow, obviously right answers.
#pragma once

#include <algorithm>
#include <optional>
#include <vector>

#include "planning/greedy.hpp"
#include "planning/set_cover.hpp"
#include "planning/spans.hpp"
#include "tests/support/random_site.hpp"

namespace cover_problems {

using planning::CoverRules;
using planning::SetCover;
using planning::Span;
using planning::SpanSet;
using support::Dice;

struct Views {
  std::vector<std::vector<Span>> views;
  std::size_t walls = 4;
};

// Short walls and coarse ends, multiples of unit_nm, so that much is equal.
inline Views random_views(Dice& dice, int count, std::int64_t unit_nm = 10) {
  Views made{std::vector<std::vector<Span>>(static_cast<std::size_t>(count)), 4};
  for (auto& view : made.views) {
    SpanSet seen(made.walls);
    for (int i = dice.below(6); i > 0; --i) {
      const int from = dice.below(40), wall = dice.below(4), to = from + 2 + dice.below(12);
      seen.add(Span{wall, unit_nm * from, unit_nm * to});
    }
    view = seen.spans();
  }
  return made;
}

inline SetCover random_cover(Dice& dice, int sets, int atoms, double density) {
  SetCover problem;
  for (int a = 0; a < atoms; ++a) problem.weight.push_back(1 + dice.below(9));
  problem.sets.resize(static_cast<std::size_t>(sets));
  for (auto& set : problem.sets)
    for (int a = 0; a < atoms; ++a)
      if (dice.uniform(0, 1) < density) set.push_back(a);
  std::vector<int> all;
  for (int i = 0; i < sets; ++i) all.push_back(i);
  problem.goal = covered(problem, all) * (70 + dice.below(31)) / 100;
  return problem;
}

// Calls look(chosen) for every subset of the sets, smaller ones first; until it returns true.
template <class Look>
bool any_subset(int sets, const Look& look) {
  for (int size = 0; size <= sets; ++size) {
    std::vector<char> member(static_cast<std::size_t>(sets));
    std::fill(member.begin(), member.begin() + size, 1);
    do {
      std::vector<int> chosen;
      for (int i = 0; i < sets; ++i)
        if (member[static_cast<std::size_t>(i)]) chosen.push_back(i);
      if (look(chosen)) return true;
    } while (std::prev_permutation(member.begin(), member.end()));
  }
  return false;
}

// The size of the smallest cover.
inline int optimum(const SetCover& problem) {
  int size = 0;
  any_subset(static_cast<int>(problem.sets.size()), [&](const std::vector<int>& chosen) {
    size = static_cast<int>(chosen.size());
    return covered(problem, chosen) >= problem.goal;
  });
  return size;
}

// The literal rules: each but the first overlaps those before it enough, and adds enough.
inline bool obeys_literally(const Views& v, const std::vector<int>& order,
                            const CoverRules& rules) {
  SpanSet seen(v.walls);
  for (std::size_t i = 0; i < order.size(); ++i) {
    const auto& view = v.views[static_cast<std::size_t>(order[i])];
    const auto sees = static_cast<double>(length_nm(view));
    const std::int64_t overlaps = seen.overlap_nm(view);
    if (i > 0 && (static_cast<double>(overlaps) < rules.overlap_min * sees ||
                  length_nm(view) - overlaps < rules.gain_min_nm))
      return false;
    seen.add(view);
  }
  return true;
}

// Asks every candidate every time.
inline std::vector<planning::Pick> plain_greedy(const std::vector<std::vector<Span>>& views,
                                                std::size_t walls, const CoverRules& rules) {
  std::vector<planning::Pick> picks;
  SpanSet covered(walls);
  while (covered.total_nm() == 0 || covered.total_nm() < rules.goal_nm) {
    planning::Pick best{-1, 0, 0};
    for (std::size_t i = 0; i < views.size(); ++i) {
      const std::int64_t overlaps = covered.overlap_nm(views[i]);
      const std::int64_t adds = length_nm(views[i]) - overlaps;
      const bool enough =
          static_cast<double>(overlaps) >= rules.overlap_min * static_cast<double>(adds + overlaps);
      if (!picks.empty() && !enough) continue;
      if (adds > best.adds_nm) best = {static_cast<int>(i), adds, overlaps};
    }
    if (best.candidate < 0 || best.adds_nm < rules.gain_min_nm) break;
    picks.push_back(best);
    covered.add(views[static_cast<std::size_t>(best.candidate)]);
  }
  return picks;
}

}  // namespace cover_problems
