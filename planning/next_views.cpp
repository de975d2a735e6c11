#include "planning/next_views.hpp"

#include <algorithm>
#include <stdexcept>

#include "planning/tour.hpp"

namespace planning {

std::vector<PlannedView> next_views(const VoxelMap& map, const std::vector<BoundaryVoxel>& boundary,
                                    const std::vector<Voxel>& candidates,
                                    std::vector<std::uint32_t> tallies, const ViewLimits& limits,
                                    const NextViewsConfig& config) {
  if (tallies.size() != candidates.size())
    throw std::invalid_argument("next views: need one count per candidate");
  const std::uint32_t least = std::max(config.adds_min_voxels, 1U);
  const std::vector<std::uint32_t> alone = tallies;
  std::vector<BoundaryVoxel> left = boundary;  // Seen by none of the views.
  std::vector<PlannedView> views;
  while (views.size() < config.views_max) {
    const auto most = best(tallies);
    if (!most || most->gain_voxels < least) break;
    const std::size_t p = most->candidate;
    views.push_back({p, alone[p], most->gain_voxels});
    std::vector<BoundaryVoxel> taken;
    std::vector<char> is_taken(left.size());
    for (const std::uint32_t i : visible_from(map, left, candidates[p], limits)) {
      taken.push_back(left[i]);
      is_taken[i] = 1;
    }
    std::size_t kept = 0;
    for (std::size_t i = 0; i < left.size(); ++i)
      if (!is_taken[i]) left[kept++] = left[i];
    left.resize(kept);
    if (views.size() == config.views_max) break;
    const auto lost = tally(map, taken, candidates, limits, config.threads);
    for (std::size_t i = 0; i < tallies.size(); ++i) tallies[i] -= lost[i];
  }
  return views;
}

std::vector<std::size_t> visiting_order(const std::vector<std::vector<double>>& cost) {
  if (cost.empty()) return {};
  TourProblem problem;
  problem.cost = cost;
  problem.closed = false;
  std::vector<std::size_t> views;
  for (const int node : solve_tour(problem).order)
    if (node > 0) views.push_back(static_cast<std::size_t>(node - 1));
  return views;
}

}  // namespace planning
