#include "planning/next_views.hpp"

#include <algorithm>
#include <cstdint>
#include <map>
#include <numeric>
#include <optional>
#include <stdexcept>

#include "planning/best_heading.hpp"
#include "planning/tour.hpp"
#include "planning/voxel_parallel.hpp"

namespace planning {

namespace {

class GreedyViews {
 public:
  GreedyViews(const VoxelMap& map, std::vector<ViewTargets> targets,
              const std::vector<Voxel>& candidates, std::vector<std::uint32_t> tallies,
              const NextViewsConfig& config)
      : map_(map),
        all_(targets),
        left_(std::move(targets)),
        candidates_(candidates),
        at_most_(std::move(tallies)),
        alone_(at_most_),
        view_(config.fov_deg),
        threads_(config.threads) {}

  // Of what is left, the view that adds the most, ties to the lowest index.
  std::optional<PlannedView> best_view() {
    std::optional<PlannedView> found = view_.all_around() ? best_around() : best_faced();
    if (found) found->sees_voxels = seen_alone(*found);
    return found;
  }

  // Nothing of what it sees is left.
  void take(const PlannedView& view) {
    for (ViewTargets& targets : left_) {
      ViewTargets taken{{}, targets.limits};
      std::vector<char> is_taken(targets.voxels.size());
      for (const std::uint32_t i : seen(targets, view)) {
        taken.voxels.push_back(targets.voxels[i]);
        is_taken[i] = 1;
      }
      std::size_t kept = 0;
      for (std::size_t i = 0; i < targets.voxels.size(); ++i)
        if (!is_taken[i]) targets.voxels[kept++] = targets.voxels[i];
      targets.voxels.resize(kept);
      const auto lost = tally(map_, taken.voxels, candidates_, taken.limits, threads_);
      for (std::size_t i = 0; i < at_most_.size(); ++i) at_most_[i] -= lost[i];
    }
  }

 private:
  static constexpr std::size_t kFacedAtOnce = 32;

  std::optional<PlannedView> best_around() const {
    const auto most = best(at_most_);
    if (!most) return std::nullopt;
    return PlannedView{most->candidate, 0, most->gain_voxels, 0};
  }

  std::optional<PlannedView> best_faced() {
    std::vector<std::size_t> order(candidates_.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    const auto bound = [&](std::size_t i) { return std::min(at_most_[i], added_at_most(i)); };
    std::ranges::stable_sort(order, std::ranges::greater{}, bound);
    std::optional<PlannedView> found;
    for (std::size_t begin = 0; begin < order.size(); begin += kFacedAtOnce) {
      if (found && bound(order[begin]) < found->adds_voxels) break;
      const std::size_t count = std::min(kFacedAtOnce, order.size() - begin);
      std::vector<PlannedView> faced(count);
      for_pieces(threads_, count, 1,
                 [&](int, std::size_t i, std::size_t) { faced[i] = face(order[begin + i]); });
      for (const PlannedView& view : faced) {
        added_[view.candidate] = view.adds_voxels;
        const bool better =
            !found || view.adds_voxels > found->adds_voxels ||
            (view.adds_voxels == found->adds_voxels && view.candidate < found->candidate);
        if (better) found = view;
      }
    }
    return found;
  }

  PlannedView face(std::size_t candidate) const {
    const Voxel p = candidates_[candidate];
    std::vector<Voxel> voxels;
    for (const ViewTargets& targets : left_)
      for (const std::uint32_t i : visible_from(map_, targets.voxels, p, targets.limits))
        voxels.push_back(targets.voxels[i].v);
    const auto [heading_rad, adds] = view_.best(p, voxels);
    return {candidate, 0, adds, heading_rad};
  }

  std::vector<std::uint32_t> seen(const ViewTargets& targets, const PlannedView& view) const {
    const Voxel p = candidates_[view.candidate];
    std::vector<std::uint32_t> voxels = visible_from(map_, targets.voxels, p, targets.limits);
    std::erase_if(voxels, [&](std::uint32_t i) {
      return !view_.faces(p, view.heading_rad, targets.voxels[i].v);
    });
    return voxels;
  }

  std::uint32_t seen_alone(const PlannedView& view) const {
    if (view_.all_around()) return alone_[view.candidate];
    std::size_t sum = 0;
    for (const ViewTargets& targets : all_) sum += seen(targets, view).size();
    return static_cast<std::uint32_t>(sum);
  }

  // What it added when it was last faced; since then it can only have become less.
  std::uint32_t added_at_most(std::size_t candidate) const {
    const auto added = added_.find(candidate);
    return added == added_.end() ? UINT32_MAX : added->second;
  }

  const VoxelMap& map_;
  const std::vector<ViewTargets> all_;
  std::vector<ViewTargets> left_;  // Seen by none of the views taken.
  const std::vector<Voxel>& candidates_;
  std::vector<std::uint32_t> at_most_;  // Of what is left, all around.
  const std::vector<std::uint32_t> alone_;
  const HorizontalView view_;
  const int threads_;
  std::map<std::size_t, std::uint32_t> added_;
};

}  // namespace

std::vector<PlannedView> next_views(const VoxelMap& map, const std::vector<BoundaryVoxel>& boundary,
                                    const std::vector<Voxel>& candidates,
                                    std::vector<std::uint32_t> tallies, const ViewLimits& limits,
                                    const NextViewsConfig& config) {
  return next_views(map, {{boundary, limits}}, candidates, std::move(tallies), config);
}

std::vector<PlannedView> next_views(const VoxelMap& map, std::vector<ViewTargets> targets,
                                    const std::vector<Voxel>& candidates,
                                    std::vector<std::uint32_t> tallies,
                                    const NextViewsConfig& config) {
  if (tallies.size() != candidates.size())
    throw std::invalid_argument("next views: need one count per candidate");
  const std::uint32_t least = std::max(config.adds_min_voxels, 1U);
  GreedyViews greedy(map, std::move(targets), candidates, std::move(tallies), config);
  std::vector<PlannedView> views;
  while (views.size() < config.views_max) {
    const auto most = greedy.best_view();
    if (!most || most->adds_voxels < least) break;
    views.push_back(*most);
    if (views.size() < config.views_max) greedy.take(*most);
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
