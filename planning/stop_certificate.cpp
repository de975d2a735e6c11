#include "planning/stop_certificate.hpp"

#include "planning/why.hpp"

namespace planning {
namespace {

template <class Visit>
void for_all(const VoxelGrid& grid, const Visit& visit) {
  for (int z = 0; z < grid.nz; ++z)
    for (int y = 0; y < grid.ny; ++y)
      for (int x = 0; x < grid.nx; ++x) visit(Voxel{x, y, z});
}

// The best of the candidates that are seen-empty in the map, as an index into all.
std::optional<BestView> best_standing(const VoxelMap& map,
                                      const std::vector<BoundaryVoxel>& boundary,
                                      const std::vector<Voxel>& candidates,
                                      const ViewLimits& limits, int threads) {
  std::vector<std::size_t> index;
  std::vector<Voxel> standing;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    if (map.at(candidates[i]) != VoxelState::seen_empty) continue;
    index.push_back(i);
    standing.push_back(candidates[i]);
  }
  std::optional<BestView> found = best(tally(map, boundary, standing, limits, threads));
  if (found) found->candidate = index[found->candidate];
  return found;
}

}  // namespace

VoxelMap optimistic_map(const VoxelMap& map, const std::vector<Voxel>& never_empty) {
  VoxelMap optimistic = map;
  for_all(map.grid(), [&](Voxel v) {
    if (map.at(v) == VoxelState::unseen) optimistic.set(v, VoxelState::seen_empty);
  });
  for (const Voxel v : never_empty) optimistic.set(v, VoxelState::seen_occupied);
  return optimistic;
}

std::vector<BoundaryVoxel> exposable_unseen(const VoxelMap& map, const VoxelMap& optimistic) {
  std::vector<BoundaryVoxel> result;
  for_all(map.grid(), [&](Voxel v) {
    if (map.at(v) != VoxelState::unseen) return;
    const BoundaryVoxel u = with_exposed_faces(optimistic, v);
    if (u.faces != 0) result.push_back(u);
  });
  return result;
}

StopCertificate stop_certificate(const VoxelMap& map, const std::vector<BoundaryVoxel>& boundary,
                                 const std::vector<Voxel>& candidates, const ViewLimits& limits,
                                 std::uint32_t threshold_voxels, const OptimisticConfig& config) {
  const VoxelMap optimistic = optimistic_map(map, config.never_empty);
  std::vector<BoundaryVoxel> exposable = exposable_unseen(map, optimistic);
  if (config.counts)
    std::erase_if(exposable, [&](const BoundaryVoxel& u) { return !config.counts(u.v); });
  StopCertificate certificate;
  certificate.threshold_voxels = threshold_voxels;
  certificate.pessimistic = best_standing(map, boundary, candidates, limits, config.threads);
  certificate.optimistic = best_standing(optimistic, exposable, candidates, limits, config.threads);
  return certificate;
}

}  // namespace planning
