// A quality target beside the paper's: every surface that has been seen is to carry enough points
// per m^2 from some scan ([phase2] density_min_ppm2). Values only.
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "mission/config.hpp"
#include "mission/record.hpp"
#include "planning/scan_density.hpp"

namespace mission {

// Limits of range and angle, and for density with the goal (0: without).
planning::ViewLimits view_limits(const ScannerConfig& scanner, double density_min_ppm2 = 0);

// The density reached so far, the best of all scans per voxel, as expected at the time of each scan
// (planning/scan_density.hpp). Takes 4 bytes per voxel of the box, nothing without a goal.
class DensityGoal {
 public:
  // goal_ppm2 0: no goal, and nothing is ever thin.
  DensityGoal(const ScannerConfig& scanner, double goal_ppm2, int threads);

  bool is_set() const { return goal_ppm2_ > 0; }
  const planning::ViewLimits& limits() const { return limits_; }  // Of views that reach it.

  // After the scan is in the map. The box may have grown in z since the last one.
  void add(const planning::VoxelMap& map, const hal::ScanPattern& pattern,
           const Eigen::Isometry3d& T_W_S);

  // Surface voxels below the goal that views have not tried for tries_max times in vain: what is
  // worth seeing again for a view that reaches the goal. Ordered by z, then y, then x.
  const std::vector<planning::BoundaryVoxel>& thin() const { return thin_; }

  // Of thin(), what a view from p would bring to the goal.
  std::vector<planning::Voxel> in_sight(const planning::VoxelMap& map, planning::Voxel p) const;
  // Takes note of what a view should bring to the goal; after add(), how much of it did.
  void expect(std::vector<planning::Voxel> voxels) { expected_ = std::move(voxels); }
  std::uint64_t settle();

  DensityFacts facts() const { return {goal_ppm2_, surface_, reached_}; }

 private:
  static constexpr int kTriesMax = 2;

  bool reached(planning::Voxel v) const {
    return best_ppm2_[index(v)] >= static_cast<float>(goal_ppm2_);
  }
  std::size_t index(planning::Voxel v) const;
  void find_thin();

  planning::ViewLimits limits_;
  double goal_ppm2_;
  int threads_;
  std::size_t nx_{}, ny_{};
  std::vector<float> best_ppm2_;
  std::vector<planning::BoundaryVoxel> all_, thin_;  // Of the surface.
  std::vector<planning::Voxel> expected_;
  std::map<planning::Voxel, int> tries_;  // Of those that a view did not bring to the goal.
  std::uint64_t surface_{}, reached_{};
};

}  // namespace mission
