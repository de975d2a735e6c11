// The greedy cover of Algorithm 1, with the overlap constraint of paper 3.1.1.
#pragma once

#include <cstdint>
#include <vector>

#include "planning/spans.hpp"

namespace planning {

struct CoverRules {
  std::int64_t goal_nm{};      // Enough is covered.
  std::int64_t gain_min_nm{};  // The least a further pick must add; at least 1 nm counts.
  double overlap_min{};        // Share of what a pick sees that must be covered, but for the first.
};

struct Pick {
  int candidate{};
  std::int64_t adds_nm{};
  std::int64_t overlaps_nm{};

  bool operator==(const Pick&) const = default;
};

// goal: enough is covered. gain: of the candidates with enough overlap, none adds enough, nor would
// any other. overlap: none adds enough, but others would. `all`: no candidate adds anything. given:
// the picks were not searched for.
enum class CoverEnd { goal, gain, overlap, all, given };

struct GreedyCover {
  std::vector<Pick> picks;
  CoverEnd end{};
  std::int64_t next_gain_nm{};          // The best that was not enough; 0 without any.
  std::int64_t next_gain_refused_nm{};  // The best among those without enough overlap.
};

// All picks together.
inline std::int64_t covered_nm(const GreedyCover& cover) {
  std::int64_t sum = 0;
  for (const Pick& pick : cover.picks) sum += pick.adds_nm;
  return sum;
}

// Whether so much of what a candidate sees is covered already that its scan can be registered.
inline bool overlaps_enough(std::int64_t sees_nm, std::int64_t overlaps_nm, double overlap_min) {
  return static_cast<double>(overlaps_nm) >= overlap_min * static_cast<double>(sees_nm);
}

// views[i]: what candidate i sees, disjoint. Picks the candidate that adds the most, ties to the
// lowest index, until the rules end it. What a candidate adds never grows, so old values are upper
// bounds and most need no update: the picks are those of asking all of them every time. `first` are
// picked before all others, in this order and whatever the rules say.
GreedyCover greedy_cover(const std::vector<std::vector<Span>>& views, std::size_t walls,
                         const CoverRules& rules, const std::vector<int>& first = {});

}  // namespace planning
