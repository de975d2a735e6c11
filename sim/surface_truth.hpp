// The judge of a simulated run: which voxels of the true surface a scanner on the reachable ground
// could see at all, and how many of these were seen. Brute force on the mesh; shares nothing with
// planning/.
//
// Surface voxel: the mesh, sampled on a lattice about voxel/4 apart, has at least 1/16 of a voxel
// face's area inside the voxel. Visible: at least one sample has a straight line to a scanner
// position that meets no triangle (from 1 mm off the sample on), with range, elevation and
// incidence within limits. Both sides of a triangle count: third-party models are shells with
// either winding.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "sim/mesh.hpp"
#include "sim/scene.hpp"

namespace sim {

// Half-open cubes from W_min_m + voxel_m * (x, y, z).
struct TruthGrid {
  Eigen::Vector3d W_min_m{0, 0, 0};
  double voxel_m = 1.0;
  int nx = 0, ny = 0, nz = 0;
};

struct TruthLimits {
  double range_min_m = 1.0;
  double range_max_m = 100.0;
  double grazing_max_rad = 70 * 0.017453292519943295;  // Between the beam and the surface's normal.
  double elevation_min_rad = -60 * 0.017453292519943295;
  double elevation_max_rad = 90 * 0.017453292519943295;
};

// Part of the surface: a sample stands for its area.
struct SurfaceSample {
  std::uint64_t voxel{};  // x + nx * (y + ny * z)
  std::uint32_t triangle{};
  Eigen::Vector3f W_point_m;  // Relative to the grid's W_min_m.
  float area_m2{};
};

// The samples of every surface voxel, ordered by voxel, triangle and lattice. Triangles are clipped
// to the grid first.
std::vector<SurfaceSample> sample_surface(const Mesh& mesh, const TruthGrid& grid);

struct TruthVoxel {
  int x{}, y{}, z{};
};

struct SurfaceTruth {
  std::uint64_t surface = 0;           // Surface voxels in the grid.
  std::uint64_t visible = 0;           // Of those, visible from some position.
  std::uint64_t visible_seen = 0;      // Of those, seen-occupied.
  std::uint64_t seen_not_visible = 0;  // Seen-occupied surface voxels without proof of visibility.
  std::vector<TruthVoxel> missed;      // Visible and not seen-occupied, ordered by z, y, x.
};

// W_scanner_positions_m: where the scanner's own origin can be, one per reachable ground cell; the
// first `stations` of them are where scans were taken, which makes the proof for most seen voxels
// short. The result depends on neither order nor threads. seen_occupied is called once per surface
// voxel, from this thread. Throws std::invalid_argument for a grid or limits that make no sense.
SurfaceTruth judge_surface(const Mesh& mesh, const Scene& scene, const TruthGrid& grid,
                           const TruthLimits& limits,
                           std::span<const Eigen::Vector3d> W_scanner_positions_m,
                           std::size_t stations,
                           const std::function<bool(int x, int y, int z)>& seen_occupied,
                           int threads);

}  // namespace sim
