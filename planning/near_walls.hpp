// Walls so near that a scanner does not see them: what gives nothing back there is not the sky.
#pragma once

#include <vector>

#include "planning/voxel_beams.hpp"

namespace planning {

// Of InsertConfig::walls, those that a beam of the scan may meet below range_min_m.
class NearWalls {
 public:
  // offset_max_m: no beam starts further from the scanner. Throws std::invalid_argument for a
  // margin that is negative or not finite. Refers to the grid.
  NearWalls(const VoxelGrid& grid, const Eigen::Isometry3d& T_W_S, double offset_max_m,
            const InsertConfig& config);

  bool any() const { return !near_.empty(); }
  // Whether a wall lies within the margin of the segment, both seen from above.
  bool meets(const LatticePoint& from, const LatticePoint& to) const;

 private:
  Eigen::Vector2d W_at_m(const LatticePoint& p) const;

  const VoxelGrid& grid_;
  double margin_m_;
  std::vector<WallLine> near_;
};

}  // namespace planning
