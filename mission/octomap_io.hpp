// The voxel map as an OctoMap file (map.ot or .bt, opens in octovis), and back.
//
// An OctoMap grid starts at 0: voxel k of an axis is [k, k + 1) * resolution. Ours starts at
// VoxelGrid::W_min_m, which is a multiple of voxel_m in x and y, but not in z (the ground lies a
// little below the top of its layer). So the file holds our voxels cube for cube on OctoMap's grid,
// displaced by less than half a voxel (farther only where OctoMap's 2^16 voxels per axis would not
// reach), in z only where the box is one of ours:
//   point in W = point in map.ot + offset_m.
// The offset stands in a comment of the file's own header, with W_min_m and the size: the file
// alone is enough to read the map back into the site frame, nothing has to lie beside it. What a
// program of others writes again loses the comment, and is then read as it stands.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <string_view>

#include "mission/files.hpp"
#include "mission/octomap_tree.hpp"
#include "planning/voxel_map.hpp"

namespace mission {

struct OctomapWritten {
  Eigen::Vector3d offset_m{0, 0, 0};  // Goes into summary.json as map_ot_offset_m.
  std::size_t nodes{};                // Of the pruned tree.
};

// The offset write_octomap would use for this grid.
Eigen::Vector3d octomap_offset_m(const planning::VoxelGrid& grid);

// Writes a pruned octomap::OcTree: two bits per node where the name ends in .bt, else log-odds (see
// write_tree). Durable when it returns. Fails with argument_out_of_domain when an axis has more
// than 65536 voxels.
FileResult<OctomapWritten> write_octomap(
    const std::filesystem::path& path, const planning::VoxelGrid& grid,
    const std::function<planning::VoxelState(planning::Voxel)>& state_at);
FileResult<OctomapWritten> write_octomap(const std::filesystem::path& path,
                                         const planning::VoxelMap& map);

// The same as bytes, without a file.
std::string octomap_bytes(const planning::VoxelMap& map,
                          OctomapFormat format = OctomapFormat::full);

// A map from a file.
struct OctomapMap {
  // In the site frame W, with the box as written, when the file is one of ours; otherwise in the
  // file's own frame, with the box of the known voxels.
  planning::VoxelMap map;
  Eigen::Vector3d offset_m{0, 0, 0};  // Point in map's frame = point in the file + this.
  bool ours{};                        // The file says where it lies in the site frame.
};

// Reads .ot and .bt files of type OcTree, whatever their name; which it is stands in the first
// line. Leaves above the lowest level are all their voxels; a log-odds of 0 or more is
// seen-occupied (as OctoMap has it), less seen-empty, and what is absent unseen. Fails with
// bad_message on anything cut short, malformed, without any known voxel, or larger than 2^29 voxels
// or 2^28 bytes as a VoxelMap.
FileResult<OctomapMap> read_octomap(const std::filesystem::path& path);
// The same from bytes; `path` is for the error's text.
FileResult<OctomapMap> parse_octomap(std::string_view bytes, const std::filesystem::path& path);

}  // namespace mission
