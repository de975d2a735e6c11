// How many points per square metre a scan puts on the surface.
//
// Beams lie evenly in azimuth and elevation, so around a direction of elevation e there are
// 1 / (azimuth step * elevation step * cos e) to the steradian. A face at range r whose normal is
// at the angle a to the beam gets that times cos(a) / r^2 points per m^2. One number per surface
// voxel and scan: for the voxel's centre and the exposed face that the scanner sees least flatly.
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "hal/values.hpp"
#include "planning/next_best_view.hpp"
#include "planning/voxel_map.hpp"

namespace planning {

// Seen-occupied voxels with a seen-empty neighbour behind each of `faces` (at least one), ordered
// by z, then y, then x.
std::vector<BoundaryVoxel> surface_voxels(const VoxelMap& map);

// On the horizon, where they lie least densely. Throws std::invalid_argument for steps of 0.
double beams_per_sr(const hal::ScanPattern& pattern);

// Points per m^2 on u from a scanner at T_W_S, occlusion and the limits of range and angle aside; 0
// where all faces face away, or where the pattern has no beams. At the poles of the pattern the
// beams do not get closer than half an elevation step from the axis.
double expected_density_ppm2(const VoxelGrid& grid, const BoundaryVoxel& u,
                             const hal::ScanPattern& pattern, const Eigen::Isometry3d& T_W_S);

// What one scan puts on surface voxels of a map that goes on changing.
class ScanDensity {
 public:
  // limits: of range and angle; that of density is left aside. Throws std::invalid_argument as
  // ViewRule does.
  ScanDensity(const VoxelGrid& grid, const hal::ScanPattern& pattern,
              const Eigen::Isometry3d& T_W_S, const ViewLimits& limits);

  // Points per m^2 on u as the map has it; 0 where the scanner's voxel does not see it (seeing is
  // as for Counts(p)) or lies outside the box. The map's box may have grown in z.
  float on(const VoxelMap& map, const BoundaryVoxel& u) const;
  // The same, or 0 if it is below least_ppm2 > 0: what falls short by its direction is not walked.
  float on(const VoxelMap& map, const BoundaryVoxel& u, float least_ppm2) const;

 private:
  hal::ScanPattern pattern_;
  Eigen::Isometry3d T_W_S_;
  Voxel scanner_;
  ViewRule rule_;
};

// The same for each surface voxel.
std::vector<float> scan_density(const VoxelMap& map, const std::vector<BoundaryVoxel>& surface,
                                const hal::ScanPattern& pattern, const Eigen::Isometry3d& T_W_S,
                                const ViewLimits& limits, int threads = 1);

}  // namespace planning
