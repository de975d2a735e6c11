// Phase II for a scanner that does not see all around: which way to face.
#pragma once

#include <cstdint>
#include <vector>

#include "planning/voxel_map.hpp"

namespace planning {

// Directions are rounded to whole nanoradians once, so that who is in view does not depend on how
// it is asked.
class HorizontalView {
 public:
  // fov_deg within (0, 360]: horizontal, centred on the heading. Throws std::invalid_argument else.
  explicit HorizontalView(double fov_deg);

  bool all_around() const { return fov_nrad_ >= kTurnNrad; }
  // Whether a scanner at p with this heading (rad, counter-clockwise from +x) has u between the
  // borders of its view, both included. What is straight above or below always is.
  bool faces(Voxel p, double heading_rad, Voxel u) const;

  struct Best {
    double heading_rad{};  // Within [-pi, pi); 0 when the view is all around or sees nothing.
    std::uint32_t seen{};
  };
  // The heading from which most of the voxels are in view: the middle between the outermost ones,
  // so that a heading error costs the least. Ties: the first counter-clockwise from -pi.
  Best best(Voxel p, const std::vector<Voxel>& voxels) const;

 private:
  static constexpr std::int64_t kTurnNrad = 6283185307;

  std::int64_t fov_nrad_;  // Even.
};

}  // namespace planning
