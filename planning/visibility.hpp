// Which parts of the walls a scanner images from where it stands (paper 3.1.1): line of sight, then
// maximum range, minimum range, grazing angle and field of view, in that order.
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "nav/geometry.hpp"
#include "planning/sight.hpp"

namespace planning {

// What the scanner can image (paper 3.1.1). Angles in degrees as in the config.
struct SensorLimits {
  double range_min_m = 1.0;
  double range_max_m = 100.0;
  double grazing_max_deg = 70.0;  // Between the beam and the surface normal; 90 is no limit.
  double fov_deg = 360.0;         // Horizontal field of view, centred on the heading.
};

// A part of walls[wall], in metres from its end a.
struct WallPiece {
  int wall{};
  double from_m{};
  double to_m{};

  bool operator==(const WallPiece&) const = default;
};

struct Candidate {
  nav::PointMm position;
  double heading_rad{};  // Without meaning where the field of view is 360 deg.

  bool operator==(const Candidate&) const = default;
};

// Why a piece of wall is not seen (the first five, in the order they are asked) or not covered.
// given: the stations were given and see none of it, others could.
enum class Excluded {
  occluded,
  range_max,
  range_min,
  grazing,
  field_of_view,
  overlap,
  gain,
  goal,
  given
};
std::string_view name(Excluded reason);     // "range_max"
std::string_view meaning(Excluded reason);  // What it means for the piece, in a sentence.
std::string_view remedy(Excluded reason);   // What one could do about it, in a sentence.

// What becomes of a piece of a target wall at one viewpoint: nothing excludes it, it is seen.
struct Outcome {
  WallPiece piece;
  std::optional<Excluded> excluded;

  bool operator==(const Outcome&) const = default;
};

// Pieces shorter than this are not worth imaging and dropped.
inline constexpr double kPieceMinM = 0.001;

// Answers for many viewpoints among the same walls. Const calls may run at once.
class Visibility {
 public:
  // Throws std::invalid_argument for limits no scanner has: range_min_m not in [0, range_max_m),
  // grazing_max_deg not in (0, 90], fov_deg not in (0, 360].
  Visibility(const std::vector<Wall>& walls, const SensorLimits& limits);

  const std::vector<Wall>& walls() const { return walls_; }
  const SensorLimits& limits() const { return limits_; }

  // What is imaged of the target walls: in order of wall and place, disjoint, kPieceMinM or longer.
  std::vector<WallPiece> from(const Candidate& viewpoint) const;

  // Line of sight alone, to any distance; also to pieces shorter than kPieceMinM.
  std::vector<WallPiece> in_sight(nav::PointMm viewpoint) const;

  // All of the target walls, in order, each cut where the outcome changes. Slower than from(), as
  // it also looks beyond the maximum range.
  std::vector<Outcome> explain(const Candidate& viewpoint) const;

 private:
  std::vector<Wall> walls_;
  SensorLimits limits_;
  double grazing_tan_;
  Sight sight_;
};

// The same for one viewpoint.
std::vector<WallPiece> visible_walls(const Candidate& viewpoint, const std::vector<Wall>& walls,
                                     const SensorLimits& limits);

}  // namespace planning
