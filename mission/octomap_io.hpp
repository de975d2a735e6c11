// The voxel map as an OctoMap file (map.ot, opens in octovis), and back.
//
// An OctoMap grid starts at 0: voxel k of an axis is [k, k + 1) * resolution. Ours starts at
// VoxelGrid::W_min_m, which need not be a multiple of voxel_m (the ground lies a little below the
// top of its layer). So the file holds our voxels cube for cube on OctoMap's grid, displaced by
// less than half a voxel (farther only where OctoMap's 2^16 voxels per axis would not reach):
//   point in W = point in map.ot + offset_m.
// The offset stands in a comment of the file's header, with W_min_m, voxel_m and the size.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <string_view>
#include <vector>

#include "mission/files.hpp"
#include "planning/voxel_map.hpp"

namespace mission {

struct OctomapWritten {
  Eigen::Vector3d offset_m{0, 0, 0};  // Goes into summary.json as map_ot_offset_m.
  std::size_t nodes{};                // Of the pruned tree.
};

// The offset write_octomap would use for this grid.
Eigen::Vector3d octomap_offset_m(const planning::VoxelGrid& grid);

// Writes an octomap::OcTree, pruned: seen-occupied voxels have log-odds 3.5, seen-empty ones -2
// (OctoMap's default clamps), unseen ones are absent. Durable when it returns. Fails with
// argument_out_of_domain when an axis has more than 65536 voxels.
FileResult<OctomapWritten> write_octomap(
    const std::filesystem::path& path, const planning::VoxelGrid& grid,
    const std::function<planning::VoxelState(planning::Voxel)>& state_at);

// The same as bytes, without a file.
std::string octomap_bytes(const planning::VoxelGrid& grid,
                          const std::function<planning::VoxelState(planning::Voxel)>& state_at,
                          std::size_t& nodes);

struct OctomapGrid {
  planning::VoxelGrid grid;  // As written; the known voxels' box at offset 0 when
                             // another program wrote the file.
  Eigen::Vector3d offset_m{0, 0, 0};
  std::vector<planning::VoxelState> states;  // x fastest, then y, then z.

  planning::VoxelState at(planning::Voxel v) const {
    const auto nx = static_cast<std::size_t>(grid.nx), ny = static_cast<std::size_t>(grid.ny);
    return states[(static_cast<std::size_t>(v.z) * ny + static_cast<std::size_t>(v.y)) * nx +
                  static_cast<std::size_t>(v.x)];
  }
};

// Reads a file of type OcTree (full, not .bt): log-odds > 0 is seen-occupied, < 0 seen-empty, 0 and
// absent unseen. Fails with bad_message on anything cut short, malformed or larger than 2^29
// voxels.
FileResult<OctomapGrid> read_octomap(const std::filesystem::path& path);
// The same from bytes; `path` is for the error's text.
FileResult<OctomapGrid> parse_octomap(std::string_view bytes, const std::filesystem::path& path);

}  // namespace mission
