// Which candidates become stations, and how few could do: greedy, refined and bounded, with bounds
// on memory for any number of candidates.
#pragma once

#include <cstdint>
#include <vector>

#include "planning/greedy.hpp"

namespace planning {

struct StationChoice {
  GreedyCover cover;
  int greedy{};            // How many the greedy cover takes.
  std::int64_t goal_nm{};  // The rules' goal, or what the greedy cover covers if that is less.
  int at_least{};          // Proven: no fewer of all candidates cover goal_nm.
};

// Atoms and who sees them grow with the square of the number of candidates. Beyond this many the
// search swaps only the first of them and greedy's picks, and the bound takes views for longer than
// they are, to the next of evenly spaced places: it stays proven, and gets weaker.
inline constexpr std::size_t kCandidatesInFull = 2000;

// views[i]: what candidate i sees, in order of wall and place, ends joined (join_ends). Greedy if
// `refine` is false; see refine.hpp otherwise.
StationChoice choose_stations(const std::vector<std::vector<Span>>& views, std::size_t walls,
                              const CoverRules& rules, bool refine, std::uint64_t seed,
                              std::size_t in_full = kCandidatesInFull);

}  // namespace planning
