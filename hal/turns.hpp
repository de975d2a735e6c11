// What a scanner with beams above each other shows turn by turn while its robot drives.
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "hal/values.hpp"

namespace hal {

// Beams on a cone about the z axis of S.
struct BeamRow {
  double elevation_rad{};  // Above the xy plane.
  double tip_z_m{};        // Of the cone, in S; ranges count from there.
  std::vector<float> ranges_m;
};

// One turn: in every row a beam for each column, at angles about the z axis of S as in a Profile,
// and the beams of a column at about the same time.
struct Turn {
  Time stamp{};            // Of the first column, by our clock.
  double beam_period_s{};  // From one column to the next.
  double angle_first_rad{};
  double angle_step_rad{};
  std::vector<BeamRow> rows;    // From the lowest; at least one.
  std::size_t level{};          // The row that is nearest to level.
  std::uint64_t lost_before{};  // Turns that went missing since the one before.

  std::size_t columns() const { return rows[level].ranges_m.size(); }
  Time last_at() const {
    return stamp + from_seconds((static_cast<double>(columns()) - 1) * beam_period_s);
  }
};

// What its level row shows, as if it lay in the xy plane: ranges are ways along the ground.
inline Profile level_profile(const Turn& turn) {
  const BeamRow& row = turn.rows[turn.level];
  Profile profile{turn.stamp,          turn.beam_period_s, turn.angle_first_rad,
                  turn.angle_step_rad, row.ranges_m,       {},
                  turn.lost_before};
  const auto flat_share = static_cast<float>(std::cos(row.elevation_rad));
  for (float& range_m : profile.ranges_m) range_m *= flat_share;
  return profile;
}

}  // namespace hal
