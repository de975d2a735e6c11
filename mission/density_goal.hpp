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

// Which surface voxels have the density: those on which, as the map stands, some scan so far puts
// as many points (planning/scan_density.hpp). It follows from map and scans alone: a scan also
// counts for faces that a later one lays open, and no longer for what a later one finds to be
// hidden. Takes 4 bytes per voxel of the box, nothing without a goal.
class DensityGoal {
 public:
  // goal_ppm2 0: no goal, and nothing is ever thin.
  DensityGoal(const ScannerConfig& scanner, double goal_ppm2, int threads);

  bool is_set() const { return goal_ppm2_ > 0; }
  const planning::ViewLimits& limits() const { return limits_; }  // Of views that reach it.

  // After the scan is in the map. The box may have grown in z since the last one. For most voxels
  // the scan that sufficed before is asked again; only for the others all are.
  void add(const planning::VoxelMap& map, const hal::ScanPattern& pattern,
           const Eigen::Isometry3d& T_W_S);
  // All scans of an earlier run, in the map that it left behind, and what it had set aside.
  struct PastScan {
    hal::ScanPattern pattern;
    Eigen::Isometry3d T_W_S;
  };
  void restore(const planning::VoxelMap& map, const std::vector<PastScan>& scans,
               const std::vector<planning::Voxel>& set_aside);
  // Takes up what an earlier one had tried in vain.
  void take_up(const DensityGoal& before) { tries_ = before.tries_; }
  // What was tried in vain, ordered by z, then y, then x.
  std::vector<planning::Voxel> set_aside() const;

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

  bool reached(planning::Voxel v) const { return scan_of_[index(v)] != 0; }
  std::size_t index(planning::Voxel v) const;
  void find_reached(const planning::VoxelMap& map);
  std::uint32_t scan_that_reaches(const planning::VoxelMap& map,
                                  const planning::BoundaryVoxel& u) const;
  void find_thin();

  planning::ViewLimits limits_;
  double goal_ppm2_;
  int threads_;
  std::size_t nx_{}, ny_{};
  std::vector<planning::ScanDensity> scans_;
  std::vector<std::uint32_t> scan_of_;  // Per voxel: one that reaches the goal, from 1; 0: none.
  std::vector<planning::BoundaryVoxel> all_, thin_;  // Of the surface.
  std::vector<planning::Voxel> expected_;
  std::map<planning::Voxel, int> tries_;  // Of those that a view did not bring to the goal.
  std::uint64_t surface_{}, reached_{};
};

}  // namespace mission
