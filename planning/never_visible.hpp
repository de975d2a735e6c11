// What no view from the ground will ever show, as the map stands: roofs, pockets. Work for a mast
// or a drone.
#pragma once

#include <cstdint>
#include <vector>

#include "planning/next_best_view.hpp"
#include "planning/why.hpp"

namespace planning {

struct NeverVisible {
  std::uint32_t voxel{};  // Index into the boundary.
  // What stopped the candidate that came furthest: too_far where none is in range, blocked where
  // at least one would see it but for what lies between. Never visible.
  ViewVerdict reason{};

  bool operator==(const NeverVisible&) const = default;
};

// The boundary voxels that none of the candidates sees, ascending. Without candidates: all, as
// too_far. One sweep for who is seen; then, for the others only, range and angle to candidates,
// from the nearest rows out, until one comes as far as any of them could. Independent of threads.
// Throws std::invalid_argument as tally() does.
std::vector<NeverVisible> never_visible(const VoxelMap& map,
                                        const std::vector<BoundaryVoxel>& boundary,
                                        const std::vector<Voxel>& candidates,
                                        const ViewLimits& limits, int threads = 1);

}  // namespace planning
