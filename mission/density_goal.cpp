#include "mission/density_goal.hpp"

#include <algorithm>
#include <numbers>

namespace mission {

planning::ViewLimits view_limits(const ScannerConfig& scanner, double density_min_ppm2) {
  constexpr double kDegree = std::numbers::pi / 180;
  hal::ScanPattern pattern;
  pattern.azimuth_step_rad = scanner.azimuth_step_deg * kDegree;
  pattern.elevation_step_rad = scanner.elevation_step_deg * kDegree;
  return {.range_min_m = scanner.range_min_m,
          .range_max_m = scanner.range_max_m,
          .grazing_max_deg = scanner.grazing_max_deg,
          .density_min_ppm2 = density_min_ppm2,
          .beams_per_sr = planning::beams_per_sr(pattern)};
}

DensityGoal::DensityGoal(const ScannerConfig& scanner, double goal_ppm2, int threads)
    : limits_(view_limits(scanner, goal_ppm2)), goal_ppm2_(goal_ppm2), threads_(threads) {}

std::size_t DensityGoal::index(planning::Voxel v) const {
  return (static_cast<std::size_t>(v.z) * ny_ + static_cast<std::size_t>(v.y)) * nx_ +
         static_cast<std::size_t>(v.x);
}

void DensityGoal::add(const planning::VoxelMap& map, const hal::ScanPattern& pattern,
                      const Eigen::Isometry3d& T_W_S) {
  if (!is_set()) return;
  nx_ = static_cast<std::size_t>(map.grid().nx);
  ny_ = static_cast<std::size_t>(map.grid().ny);
  best_ppm2_.resize(map.grid().size());
  all_ = planning::surface_voxels(map);
  const std::vector<float> now =
      planning::scan_density(map, all_, pattern, T_W_S, limits_, threads_);
  for (std::size_t i = 0; i < all_.size(); ++i) {
    float& best_ppm2 = best_ppm2_[index(all_[i].v)];
    best_ppm2 = std::max(best_ppm2, now[i]);
  }
  find_thin();
}

void DensityGoal::find_thin() {
  thin_.clear();
  surface_ = all_.size();
  reached_ = 0;
  for (const planning::BoundaryVoxel& u : all_) {
    const auto tries = tries_.find(u.v);
    if (reached(u.v)) {
      ++reached_;
    } else if (tries == tries_.end() || tries->second < kTriesMax) {
      thin_.push_back(u);
    }
  }
}

std::vector<planning::Voxel> DensityGoal::in_sight(const planning::VoxelMap& map,
                                                   planning::Voxel p) const {
  std::vector<planning::Voxel> voxels;
  if (!is_set()) return voxels;
  for (const std::uint32_t i : planning::visible_from(map, thin_, p, limits_))
    voxels.push_back(thin_[i].v);
  return voxels;
}

std::uint64_t DensityGoal::settle() {
  std::uint64_t brought = 0;
  for (const planning::Voxel v : expected_) {
    if (reached(v)) {
      ++brought;
    } else {
      ++tries_[v];
    }
  }
  if (!expected_.empty()) find_thin();
  expected_.clear();
  return brought;
}

}  // namespace mission
