// In which order a set of stations obeys the rules of the paper (3.1.1).
#pragma once

#include <optional>
#include <vector>

#include "planning/greedy.hpp"
#include "planning/set_cover.hpp"

namespace planning {

// An order of these sets in which each (the first excepted) overlaps those before it by
// rules.overlap_min of what it sees, and adds at least rules.gain_min_nm to them; empty if none is
// found. Always the one that adds the most of those that overlap enough; where that fails, those
// that later ones would leave too little to add go first. Tries the kFirstsMax sets that see most
// as the first. For overlap alone this finds an order that begins there if there is one, because
// overlap only grows; with a smallest gain it may miss one.
std::optional<std::vector<int>> station_order(const SetCover& atoms, const std::vector<int>& chosen,
                                              const CoverRules& rules);
inline constexpr std::size_t kFirstsMax = 4;

// Whether the rules hold in this order.
bool obeys(const SetCover& atoms, const std::vector<int>& order, const CoverRules& rules);

}  // namespace planning
