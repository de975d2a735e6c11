// OctoMap's two encodings of an occupancy octree: nodes with log-odds (.ot), and two bits per node
// (.bt, "maximum likelihood"). The bytes after the header only.
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <string>
#include <string_view>

#include "planning/voxel_map.hpp"

namespace mission {

enum class OctomapFormat { full, binary };  // .ot, .bt

inline constexpr int kOctomapDepth = 16;
inline constexpr int kOctomapKeys = 1 << kOctomapDepth;  // Voxels per axis; key 0 is at -kKeys / 2.

using OctomapKey = std::array<int, 3>;

// A cube of keys of side 2^level in one state.
struct OctomapLeaf {
  OctomapKey low;
  int level;
  bool occupied;
};

struct OctomapTree {
  std::string bytes;
  std::size_t nodes{};
};

// The pruned tree of a grid whose voxel (0, 0, 0) has the key `first`: seen-occupied voxels have
// log-odds 3.5, seen-empty ones -2 (OctoMap's default clamps), unseen ones are absent.
OctomapTree write_tree(const planning::VoxelGrid& grid, const OctomapKey& first,
                       const std::function<planning::VoxelState(planning::Voxel)>& state_at,
                       OctomapFormat format);

// Calls visit() with every leaf until it returns false, and counts the nodes. Log-odds of 0 and
// more are occupied, as in OctoMap. Empty text: no nodes. Returns what is wrong with the bytes in
// words, "" for nothing.
std::string read_tree(std::string_view bytes, OctomapFormat format, std::size_t& nodes,
                      const std::function<bool(const OctomapLeaf&)>& visit);

}  // namespace mission
