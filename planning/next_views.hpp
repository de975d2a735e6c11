// The next views at once: which k places, each with what it adds to those before it, and in which
// order to visit them. What a crew takes along for a whole trip.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "planning/next_best_view.hpp"

namespace planning {

struct PlannedView {
  std::size_t candidate{};
  std::uint32_t sees_voxels{};  // Counts(p): what it would see as the only view.
  std::uint32_t adds_voxels{};  // Of these, seen by none of the views before it.
  double heading_rad = 0;       // Below 360 deg: the one that adds the most; sees_voxels is of it.

  bool operator==(const PlannedView&) const = default;
};

struct NextViewsConfig {
  std::size_t views_max = 5;
  std::uint32_t adds_min_voxels = 1;  // Stop when the next would add fewer; 0 counts as 1.
  int threads = 1;                    // The result does not depend on it.
  double fov_deg = 360;               // Of a view, horizontal.
};

// What views are to bring: voxels, each with how it has to be seen.
struct ViewTargets {
  std::vector<BoundaryVoxel> voxels;
  ViewLimits limits;
};

// The greedy choice: each view is the candidate that sees the most boundary voxels that the views
// before it do not (ties: the lowest index); the first is the next best view. `tallies` is tally()
// of the same arguments. All views are judged by the map as it is: what the first would reveal is
// not guessed at.
//
// Exact, and not dearer than the voxels it deals with: a view takes its voxels from all candidates
// at once, by a tally of these voxels only, so nothing is ever recounted. Over all views at most
// one more tally.
// Below 360 deg the tally bounds what a heading shows: headings are worked out for the candidates
// with the highest bounds, until none of the others can be better.
// Throws std::invalid_argument as tally() does, or if there is not one count per candidate.
std::vector<PlannedView> next_views(const VoxelMap& map, const std::vector<BoundaryVoxel>& boundary,
                                    const std::vector<Voxel>& candidates,
                                    std::vector<std::uint32_t> tallies, const ViewLimits& limits,
                                    const NextViewsConfig& config = {});
// The same for targets of several kinds; `tallies` are the sums of their tallies.
std::vector<PlannedView> next_views(const VoxelMap& map, std::vector<ViewTargets> targets,
                                    const std::vector<Voxel>& candidates,
                                    std::vector<std::uint32_t> tallies,
                                    const NextViewsConfig& config = {});

// The cheapest order in which to visit views: their indices. cost: node 0 is where one stands, node
// i + 1 is view i; otherwise as TourProblem::cost. One way, ending anywhere. Views that cannot be
// reached are left out. Proven cheapest for up to 14 views.
std::vector<std::size_t> visiting_order(const std::vector<std::vector<double>>& cost);

}  // namespace planning
