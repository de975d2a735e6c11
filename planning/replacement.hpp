// What to scan from instead of a station that cannot be reached. Values in, values out.
#pragma once

#include <functional>
#include <vector>

#include "planning/cover.hpp"

namespace planning {

struct LostStation {
  std::vector<WallPiece> sees;               // By the station that cannot be reached.
  std::vector<std::vector<WallPiece>> kept;  // By each scan in hand and each station still to come.
  std::vector<Candidate> candidates;         // Where the scanner might stand instead.
  // Asked only of those that would be chosen.
  std::function<bool(const Candidate&)> can_be_reached;
  double overlap_min{};  // Share of what a station sees that must be seen already.
};

struct Replacements {
  double lost_m{};                // Seen by that station and nothing that is kept.
  double left_m{};                // Of that, what these stations do not see either.
  std::vector<Station> stations;  // adds_m: of what was lost.
};

// A station that sees less than this share of what was lost, or less wall than that, is not worth a
// scan; so there are at most five.
inline constexpr double kWorthShare = 0.2, kWorthM = 0.5;

// Greedy as plan_cover: always the candidate that sees most of what is still lost, ties to the
// lowest index, of those that can be reached and overlap what is kept and chosen as the rules ask.
// Independent of `threads`.
Replacements replace_station(const LostStation& lost, const std::vector<Wall>& walls,
                             const SensorLimits& limits, int threads);

}  // namespace planning
