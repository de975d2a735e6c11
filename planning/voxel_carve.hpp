// Which unseen voxels the beams of a scan cross, asked voxel by voxel.
//
// A plain walk visits a voxel once for every beam through it: hundreds of times near the scanner
// and again with every scan. Here each voxel that is still unknown looks up the few beams in its
// direction, and one certain beam ends the search. Minima and maxima of the reach over tiles of
// beams decide most voxels (open air: every beam nearby goes on; inside of buildings: none
// arrives); only what is left is tested beam by beam, in integers. Floating point is used only with
// margins wide enough that it never decides what the integers would decide otherwise.
#pragma once

#include <cstdint>
#include <vector>

#include "planning/voxel_beams.hpp"
#include "planning/voxel_map.hpp"

namespace planning {

// Minimum and maximum reach over kSide x kSide beams.
struct ReachTiles {
  static constexpr int kSide = 8;
  struct Tile {
    float min_m, max_m;
  };
  int columns{}, rows{};  // Of tiles.
  std::vector<Tile> tiles;

  const Tile& at(int column, int row) const {
    return tiles[static_cast<std::size_t>(column) * static_cast<std::size_t>(rows) +
                 static_cast<std::size_t>(row)];
  }
};

class BeamCarver {
 public:
  // Everything is referred to, not copied. The scan's sizes were checked before.
  BeamCarver(const VoxelGrid& grid, const hal::ScanPattern& pattern, const Eigen::Isometry3d& T_W_S,
             const BeamFan& fan, const std::vector<float>& reach_m, int threads);

  // Bit i of the result: voxel (64 word + i, y, z), among those set in `wanted`, is crossed.
  std::uint64_t crossed(int word, int y, int z, std::uint64_t wanted) const;
  // The words of row (y, z) that any beam may reach: [first, last).
  struct Words {
    int first, last;
  };
  Words reachable_words(int y, int z) const;

 private:
  // A voxel's centre as the scanner sees it; lengths in voxels.
  struct Sight {
    double x, y, z;  // In S.
    double distance;
  };
  // The same for the 64 voxels of a word, in single precision.
  struct WordSight {
    float distance[64];
    float azimuth_rad[64];
    float elevation_rad[64];
  };
  // Inclusive; empty if first > last.
  struct Span {
    int first, last;
  };

  void look(int word, int y, int z, WordSight& sight) const;
  bool surely_crossed(float distance, float azimuth_rad, float elevation_rad) const;
  bool search(Voxel v, double azimuth_rad, double elevation_rad) const;
  bool search_around(Voxel v, const Sight& sight, double azimuth_rad, double elevation_rad) const;
  bool search_window(Voxel v, const Sight& sight, Span columns, Span rows) const;
  bool search_tile(Voxel v, const Sight& sight, Span columns, Span rows) const;
  bool may_meet(const Sight& sight, int tile_column, int tile_row) const;

  const VoxelGrid& grid_;
  const hal::ScanPattern& pattern_;
  const BeamFan& fan_;
  const std::vector<float>& reach_m_;
  ReachTiles tiles_;
  Eigen::Vector3d S_corner_;  // Centre of voxel (0, 0, 0) in S, in voxels.
  Eigen::Matrix3d R_S_W_;
  Eigen::Vector3d W_scanner_;  // In voxels from the box's corner.
  double reach_max_{};         // In voxels.
  double deviation_rad_{};     // Of any beam from the pattern's direction, at most,
  double offset_{};            // and of its start from the scanner, in voxels.
  double column_step_rad_{}, row_step_rad_{};
  bool over_the_pole_{};  // Some elevations are beyond +-90 deg.
  std::vector<Eigen::Vector2d> column_direction_;
  std::vector<Eigen::Vector2d> row_direction_;
};

}  // namespace planning
