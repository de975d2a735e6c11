#include "mission/density_goal.hpp"

#include <algorithm>
#include <array>
#include <numbers>

#include "planning/voxel_parallel.hpp"

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
  scans_.emplace_back(map.grid(), pattern, T_W_S, limits_);
  find_reached(map);
}

void DensityGoal::restore(const planning::VoxelMap& map, const std::vector<PastScan>& scans,
                          const std::vector<planning::Voxel>& set_aside) {
  if (!is_set()) return;
  for (const PastScan& scan : scans)
    scans_.emplace_back(map.grid(), scan.pattern, scan.T_W_S, limits_);
  for (const planning::Voxel& v : set_aside) tries_[v] = kTriesMax;
  find_reached(map);
}

std::vector<planning::Voxel> DensityGoal::set_aside() const {
  std::vector<planning::Voxel> voxels;
  for (const auto& [v, tries] : tries_)
    if (tries >= kTriesMax) voxels.push_back(v);
  std::ranges::sort(voxels, {}, [](const planning::Voxel& v) { return std::array{v.z, v.y, v.x}; });
  return voxels;
}

void DensityGoal::find_reached(const planning::VoxelMap& map) {
  nx_ = static_cast<std::size_t>(map.grid().nx);
  ny_ = static_cast<std::size_t>(map.grid().ny);
  scan_of_.resize(map.grid().size());
  all_ = planning::surface_voxels(map);
  planning::for_pieces(threads_, all_.size(), 256, [&](int, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      scan_of_[index(all_[i].v)] = scan_that_reaches(map, all_[i]);
  });
  find_thin();
}

// The one that did before, else the last that does.
std::uint32_t DensityGoal::scan_that_reaches(const planning::VoxelMap& map,
                                             const planning::BoundaryVoxel& u) const {
  const auto goal_ppm2 = static_cast<float>(goal_ppm2_);
  const auto reaches = [&](std::uint32_t scan) {
    return scans_[scan - 1].on(map, u, goal_ppm2) >= goal_ppm2;
  };
  const std::uint32_t before = scan_of_[index(u.v)];
  if (before != 0 && reaches(before)) return before;
  for (auto scan = static_cast<std::uint32_t>(scans_.size()); scan > 0; --scan)
    if (scan != before && reaches(scan)) return scan;
  return 0;
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
