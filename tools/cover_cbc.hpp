// Set covers by COIN-OR's CBC: the judge of the planner's own search and bound. For tests and tools
// only; the robot does not need it.
#pragma once

#include <vector>

#include "planning/set_cover.hpp"

namespace tools {

struct CbcLimits {
  double time_s = 60;
  // Neighbouring atoms are joined until there are about this many, and a set that holds a part of
  // such a cell counts for that part wherever the others' parts lie. That needs no more sets than
  // the problem itself, so the bound stands; but the sets found may miss the goal.
  int cells_max = 1'000'000;
};

struct CbcCover {
  std::vector<int> sets;  // The best found that reaches the goal, ascending; empty without any.
  int at_least{};         // CBC's bound, rounded up with its own tolerance: not exact arithmetic.
  bool is_optimal{};      // sets.size() == at_least
};

// The problem as an integer programme. `known` is a cover to start from, or empty.
CbcCover solve_cover(const planning::SetCover& problem, const std::vector<int>& known = {},
                     const CbcLimits& limits = {});

}  // namespace tools
