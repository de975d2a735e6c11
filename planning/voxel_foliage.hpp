// Thin vegetation told from walls: how many beams ended in a voxel, and how many went on through
// it.
//
// The paper (conclusion) names the problem: a bush or a crown fills whole voxels with a few
// returns, and seen-occupied voxels hide what is behind them and take candidate cells away. A voxel
// of a wall lets no beam pass but those that graze it; a voxel of twigs lets most of them pass.
#pragma once

#include <cstdint>
#include <vector>

#include "planning/voxel_map.hpp"

namespace planning {

// A voxel is foliage if `passes` is at least passes_min and at least share_min of hits + passes.
// A wall that leaves the share a of its voxels' depth open and is seen at an angle t from its plane
// has passes / (hits + passes) = a / (a + tan t) there: 0.8 is a wall seen at 14 deg or less.
struct FoliageRule {
  double share_min = 0.8;
  int passes_min = 20;
};

// hits(v): returns in v. passes(v): beams, with return or without, that crossed v's inside and went
// on, that is, did not end in v. Over all scans added; the same beams, paths and reach as in
// VoxelMap::insert(). Each stops counting at kMax. Walks every beam: as slow as the plain dense
// walk, and 4 bytes per voxel.
class BeamCounts {
 public:
  static constexpr int kMax = 65535;

  // Of the map's box and of the layers it keeps above.
  explicit BeamCounts(const VoxelMap& map);

  // Throws what VoxelMap::insert() throws. Neither the order of scans nor config.threads matters.
  // Beyond the first thread, each of at most kThreadsMax borrows 4 bytes per voxel for the time.
  void add(const hal::ScanCloud& scan, const Eigen::Isometry3d& T_W_S, const InsertConfig& config);

  // Outside the layers counted: 0.
  int hits(Voxel v) const;
  int passes(Voxel v) const;
  bool foliage(Voxel v, const FoliageRule& rule) const;

  std::size_t storage_bytes() const { return counts_.capacity() * sizeof(Count); }

 private:
  static constexpr int kThreadsMax = 4;
  struct Count {
    std::uint16_t hits{}, passes{};
  };

  std::size_t index(Voxel v) const;

  VoxelGrid grid_;  // With the kept layers.
  std::vector<Count> counts_;
};

// The map as the planner looks through it: seen-occupied voxels that are foliage are seen-empty.
VoxelMap see_through(const VoxelMap& map, const BeamCounts& counts, const FoliageRule& rule);

}  // namespace planning
