// How many sets any cover needs: a bound from below that is proven, by Lagrangian duality.
#pragma once

#include "planning/set_cover.hpp"

namespace planning {

struct BoundEffort {
  int rounds = 400;      // Of the subgradient method; each costs the incidences of the cells.
  int cells_max = 2500;  // Atoms are priced in at most about this many groups.
};

// No choice of sets whose atoms weigh problem.goal together has fewer members than this; 0 for a
// goal of 0. `known` is the size of some cover, which guides the search for good prices.
//
// Why it is proven: give every nanometre of cell k a price p_k >= 0. A set is worth its price minus
// 1, and what is covered costs at least the cheapest `goal` nanometres. So for any prices
//   sets >= sum over sets of min(0, 1 - their price) + the price of the cheapest `goal` of all.
// The prices are sought in floating point, then rounded to whole numbers, and the right hand side
// is worked out from these in 128-bit integers. Overlap and gain rules are not asked: a cover that
// must obey them too needs no fewer sets.
int stations_at_least(const SetCover& problem, int known, const BoundEffort& effort = {});

}  // namespace planning
