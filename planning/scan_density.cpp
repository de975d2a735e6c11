#include "planning/scan_density.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "planning/voxel_parallel.hpp"

namespace planning {
namespace {

// Whether the angle lies within the steps from first on, half a step beyond the ends included.
bool within(double angle_rad, double first_rad, double step_rad, std::uint32_t count) {
  const double at = (angle_rad - first_rad) / step_rad;
  return at >= -0.5 && at <= static_cast<double>(count) - 0.5;
}

bool has_beams(const hal::ScanPattern& pattern, const Eigen::Vector3d& S_d_m) {
  const double across_m = S_d_m.head<2>().norm();
  const double elevation_rad = std::atan2(S_d_m.z(), across_m);
  if (!within(elevation_rad, pattern.elevation_first_rad, pattern.elevation_step_rad, pattern.rows))
    return false;
  constexpr double kTurn = 2 * std::numbers::pi;
  const double step_rad = std::abs(pattern.azimuth_step_rad);
  if (pattern.columns * step_rad > kTurn - step_rad / 2) return true;
  const double azimuth_rad = std::atan2(S_d_m.y(), S_d_m.x());
  for (const double turned : {0.0, -2 * kTurn, -kTurn, kTurn, 2 * kTurn})
    if (within(azimuth_rad + turned, pattern.azimuth_first_rad, pattern.azimuth_step_rad,
               pattern.columns))
      return true;
  return false;
}

double outward_m(const BoundaryVoxel& u, const Eigen::Vector3d& W_to_scanner_m) {
  double most_m = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const unsigned minus = 1U << (2 * axis), plus = 2U << (2 * axis);
    if ((u.faces & minus) != 0) most_m = std::max(most_m, -W_to_scanner_m[axis]);
    if ((u.faces & plus) != 0) most_m = std::max(most_m, W_to_scanner_m[axis]);
  }
  return most_m;
}

}  // namespace

std::vector<BoundaryVoxel> surface_voxels(const VoxelMap& map) {
  // The frontier of a map in which seen-occupied and unseen change places.
  VoxelMap swapped(map.grid());
  const VoxelGrid& grid = map.grid();
  for (int z = 0; z < grid.nz; ++z)
    for (int y = 0; y < grid.ny; ++y)
      for (int x = 0; x < grid.nx; ++x) {
        const VoxelState state = map.at({x, y, z});
        if (state == VoxelState::seen_occupied) continue;
        swapped.set({x, y, z}, state == VoxelState::seen_empty ? state : VoxelState::seen_occupied);
      }
  return boundary_unseen(swapped);
}

double beams_per_sr(const hal::ScanPattern& pattern) {
  const double cell_sr = std::abs(pattern.azimuth_step_rad * pattern.elevation_step_rad);
  if (!(cell_sr > 0))
    throw std::invalid_argument("scan density: the pattern's steps must not be 0");
  return 1 / cell_sr;
}

double expected_density_ppm2(const VoxelGrid& grid, const BoundaryVoxel& u,
                             const hal::ScanPattern& pattern, const Eigen::Isometry3d& T_W_S) {
  const Eigen::Vector3d W_to_scanner_m = T_W_S.translation() - grid.center_m(u.v);
  const double range_m = W_to_scanner_m.norm(), facing_m = outward_m(u, W_to_scanner_m);
  if (!(facing_m > 0)) return 0;
  const Eigen::Vector3d S_d_m = T_W_S.linear().transpose() * -W_to_scanner_m;
  if (!has_beams(pattern, S_d_m)) return 0;
  const double across_m = std::max(S_d_m.head<2>().norm(),
                                   range_m * std::sin(std::abs(pattern.elevation_step_rad) / 2));
  return beams_per_sr(pattern) * facing_m / (range_m * range_m * across_m);
}

namespace {

ViewLimits without_density(ViewLimits limits) {
  limits.density_min_ppm2 = 0;
  return limits;
}

}  // namespace

ScanDensity::ScanDensity(const VoxelGrid& grid, const hal::ScanPattern& pattern,
                         const Eigen::Isometry3d& T_W_S, const ViewLimits& limits)
    : pattern_(pattern),
      T_W_S_(T_W_S),
      scanner_(grid.voxel_at(T_W_S.translation())),
      rule_(without_density(limits), grid.voxel_m) {}

float ScanDensity::on(const VoxelMap& map, const BoundaryVoxel& u) const {
  return on(map, u, std::numeric_limits<float>::min());
}

float ScanDensity::on(const VoxelMap& map, const BoundaryVoxel& u, float least_ppm2) const {
  if (!map.grid().contains(scanner_) || !rule_.admits(u, scanner_)) return 0;
  const auto density_ppm2 =
      static_cast<float>(expected_density_ppm2(map.grid(), u, pattern_, T_W_S_));
  return density_ppm2 >= least_ppm2 && clear_between(map, u.v, scanner_) ? density_ppm2 : 0;
}

std::vector<float> scan_density(const VoxelMap& map, const std::vector<BoundaryVoxel>& surface,
                                const hal::ScanPattern& pattern, const Eigen::Isometry3d& T_W_S,
                                const ViewLimits& limits, int threads) {
  std::vector<float> density_ppm2(surface.size());
  const ScanDensity scan(map.grid(), pattern, T_W_S, limits);
  for_pieces(threads, surface.size(), 256, [&](int, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) density_ppm2[i] = scan.on(map, surface[i]);
  });
  return density_ppm2;
}

}  // namespace planning
