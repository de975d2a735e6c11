// Beyond the paper: fewer stations than the greedy cover, under the same rules.
#pragma once

#include <cstdint>

#include "planning/greedy.hpp"
#include "planning/set_cover.hpp"

namespace planning {

// Bounds of the search, in steps rather than time, so that its result is the same everywhere.
struct RefineEffort {
  int swaps = 800;        // Without success, for each number of stations, in each of three tries.
  int swaps_links = 200;  // For better links, once the number stands.
};

// The greedy cover of these views, refined. `atoms` are wall_atoms(views, walls); nothing is asked
// of its goal. No worse than `greedy`: fewer stations that reach the coverage goal, or what greedy
// covers if that is less; or as many that cover no less. The picks are in an order in which each
// overlaps those before it and adds enough, as the rules ask; where the search ends without the
// goal, greedy picks follow as long as they may. Of covers with the same number of stations the one
// whose overlap graph has fewer parts, then fewer bridges, then covers more. If weak links are
// left, up to greedy's number of stations are spent where that leaves none.
//
// Never looks for fewer than at_least stations. Same seed, same result.
GreedyCover refined_cover(const std::vector<std::vector<Span>>& views, std::size_t walls,
                          const SetCover& atoms, const CoverRules& rules, const GreedyCover& greedy,
                          int at_least, std::uint64_t seed, const RefineEffort& effort = {});

}  // namespace planning
