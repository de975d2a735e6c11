// Why a station does not image a place on a wall: the constraint that excludes it, with its
// numbers.
#pragma once

#include <optional>
#include <string>

#include "planning/visibility.hpp"

namespace planning {

struct WhyWall {
  std::optional<Excluded> excluded;  // Nothing: the place is imaged.
  double distance_m{};
  double angle_deg{};    // Between the beam and the wall's normal; above 90 from behind.
  double heading_deg{};  // From the station's heading to the place, in (-180, 180].
  bool behind{};         // occluded: the station is on the wall's inner side, or on its line.
  // occluded: the wall that the beam meets first, and where; nothing if the beam only grazes
  // corners. Not the wall asked for.
  std::optional<int> occluder;
  Eigen::Vector2d W_occluder_m{0, 0};
  SensorLimits limits;
};

// What Visibility::explain() says of the place at_m from end a of a target wall (where two pieces
// meet: of the first), and by how much. Throws std::invalid_argument for a wall that there is not
// or that is no target, or a place not on it.
WhyWall why_wall(const Visibility& visibility, int wall, double at_m, const Candidate& station);

// "hidden by wall 12 at (3.40, 1.25)"
std::string text(const WhyWall& why);

}  // namespace planning
