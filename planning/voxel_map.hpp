// What has been seen of the site (paper 3.2.1; definitions fixed in ARCHITECTURE.md).
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "hal/values.hpp"

namespace planning {

enum class VoxelState : std::uint8_t { unseen, seen_empty, seen_occupied };

struct Voxel {
  int x{}, y{}, z{};

  auto operator<=>(const Voxel&) const = default;
};

// An axis-aligned box of cubes. Voxel (x, y, z) is the half-open cube from
// W_min_m + voxel_m * (x, y, z).
struct VoxelGrid {
  Eigen::Vector3d W_min_m{0, 0, 0};
  double voxel_m = 1.0;
  int nx{}, ny{}, nz{};

  std::size_t size() const {
    return static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny) * static_cast<std::size_t>(nz);
  }
  bool contains(Voxel v) const {
    return v.x >= 0 && v.y >= 0 && v.z >= 0 && v.x < nx && v.y < ny && v.z < nz;
  }
  Eigen::Vector3d center_m(Voxel v) const {
    return W_min_m + voxel_m * (Eigen::Vector3d(v.x, v.y, v.z) + Eigen::Vector3d::Constant(0.5));
  }
  // The voxel that holds the point; may lie outside the box.
  Voxel voxel_at(const Eigen::Vector3d& W_point_m) const {
    const Eigen::Vector3d q = (W_point_m - W_min_m) / voxel_m;
    return {static_cast<int>(std::floor(q.x())), static_cast<int>(std::floor(q.y())),
            static_cast<int>(std::floor(q.z()))};
  }
};

}  // namespace planning
