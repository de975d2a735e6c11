// The turns of a scanner with beams above each other, for a robot that drives: beams are put in
// their columns as their packets come, and a turn is told when it is whole.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "hal/turns.hpp"

namespace drivers {

// A row of beams: the cone on which they go, in S.
struct BeamCone {
  double elevation_rad{};
  double tip_z_m{};
};

// The cone of a beam, as if its scanner turned it about the z axis of S; and how much farther than
// from its own origin its ranges are from the cone's tip.
struct ConeOfBeam {
  BeamCone cone;
  double farther_m{};
};
ConeOfBeam cone_of(const hal::Beam& beam);

// Turns are clockwise, as those of a VLP-16 and an Ouster are, and begin at the robot's right: what
// is ahead is measured late in a turn and told soon after. Packets are told in their order; the
// robot's own time of each is known.
class TurnAssembly {
 public:
  // Rows from the lowest; those above the limit are left out, but never the one nearest to level.
  TurnAssembly(std::uint32_t columns, const std::vector<BeamCone>& rows, double elevation_max_rad);

  // The next packet is the first: nothing is known of a turn before it.
  void begin();
  // A packet whose first beam goes to that azimuth (counter-clockwise from x of S) at `at`, and its
  // beams. Returns the turn that it ends: beams that did not come are NaN.
  std::optional<hal::Turn> next_packet(double azimuth_rad, hal::Time at);
  // Of two returns in one column the nearer counts. range_m from the cone's tip; not above 0:
  // nothing came back.
  bool looks(std::size_t row) const { return row < kept_; }
  void add(std::size_t row, double azimuth_rad, float range_m);

 private:
  std::uint32_t column_of(double azimuth_rad) const;
  void clear();
  hal::Turn take(hal::Time ended);

  const std::uint32_t columns_;
  const std::vector<BeamCone> rows_;
  std::size_t kept_{}, level_{};
  std::vector<std::vector<float>> ranges_m_;  // Of each row that is kept.
  std::uint32_t packet_column_{};
  std::optional<std::uint32_t> last_column_;
  std::optional<hal::Time> began_;  // The turn's first packet, which begins in this column.
  std::uint32_t began_column_{};
};

}  // namespace drivers
