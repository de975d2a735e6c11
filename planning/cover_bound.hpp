// How many sets any cover needs: a bound from below that is proven, by Lagrangian duality.
#pragma once

#include "planning/set_cover.hpp"

namespace planning {

// No choice of sets whose atoms weigh problem.goal together has fewer members than this; 0 for a
// goal of 0. `known`, the size of some cover, guides the search for good prices. At most `rounds`
// rounds, each costs the runs of all sets.
//
// Why it is proven: put a price of at least 0 on every unit of atom a's weight. Any cover buys at
// least the cheapest `goal` units there are, and each of its sets at best saves its price minus 1:
//   sets >= the price of the cheapest `goal` units + sum over all sets of min(0, 1 - their price).
// Good prices are sought in floating point, then rounded to whole numbers, and the right hand side
// is worked out from these in 128-bit integers. Overlap and gain rules are not asked: a cover that
// must obey them too needs no fewer sets.
int stations_at_least(const SetCover& problem, int known, int rounds = 1200);

}  // namespace planning
