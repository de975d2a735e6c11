// When to stop, with proof: could any view still help, now or after any further views?
//
// Optimistic count. Take the map as it is, let only seen-occupied voxels (and those that are known
// never to be seen empty, such as the ground's) block the view, and call a face of an unseen voxel
// exposed if the neighbour behind it is in the box and does not block. Opt(p) counts the unseen
// voxels u such that p is in range of u, p sees one of these faces at a fair angle, and the open
// segment between the centres meets no voxel that blocks.
//
// Claim. Let M be the map now and M' any map that scans may make of it. For every p: the count of
// the paper, Counts(p) in M', is at most Opt(p) in M. So if Opt(p) is below the threshold for all
// candidates, no view from any of them will ever reach the threshold, whatever the scans between
// now and then show, and wherever they are taken from.
//
// Proof. From M to M' a scan leaves seen-occupied voxels so, and makes no seen voxel unseen (the
// exception, known ground that is made unseen again, is in `never_empty`, which M' has not as
// seen-empty). Let u count for p in M'. (1) u is unseen in M', hence in M. (2) The face that p sees
// has behind it a voxel that is seen-empty in M'; that is in the box, not seen-occupied in M and
// not in never_empty; so the face is exposed in the optimistic sense. Range and angle depend on
// places only. (3) All voxels between are seen-empty in M', hence not seen-occupied in M nor in
// never_empty: none blocks. So u counts in Opt(p). QED. It needs the box to stay as it is, voxels
// that count for nothing now (outside the site, set aside) to stay so, and every cell that may
// become a candidate to be among the candidates: also those that are unseen now.
//
// "Sees" is the paper's measure, between centres. That the beams of a scan also pass voxels whose
// centre is hidden, and resolve some of them by luck, is not counted by either side.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "planning/next_best_view.hpp"

namespace planning {

struct StopCertificate {
  std::optional<BestView> pessimistic;  // Unseen blocks, as in the paper.
  // Unseen is air. If proven, the largest Opt(p) of all candidates, ties to the lowest index; else
  // a witness: a candidate whose Opt(p) reaches the threshold, and Opt(p) there.
  std::optional<BestView> optimistic;
  std::uint32_t threshold_voxels{};

  std::uint32_t pessimistic_max() const { return pessimistic ? pessimistic->gain_voxels : 0; }
  // At least; the maximum if proven.
  std::uint32_t optimistic_voxels() const { return optimistic ? optimistic->gain_voxels : 0; }
  // No view will ever see threshold_voxels.
  bool proven() const { return optimistic_voxels() < threshold_voxels; }
  bool operator==(const StopCertificate&) const = default;
};

// The map with unseen as seen-empty and never_empty as seen-occupied: what blocks for Opt(p).
VoxelMap optimistic_map(const VoxelMap& map, const std::vector<Voxel>& never_empty);

// Every unseen voxel that has, or might get, an exposed face, with all such faces; ordered by z,
// then y, then x. `optimistic` is optimistic_map() of the same map.
std::vector<BoundaryVoxel> exposable_unseen(const VoxelMap& map, const VoxelMap& optimistic);

struct OptimisticConfig {
  std::vector<Voxel> never_empty;     // No scan will make these seen-empty.
  std::function<bool(Voxel)> counts;  // Which unseen voxels count at all; empty: all.
  int threads = 1;                    // The result does not depend on it.
};

// boundary: the voxels that count in the paper's sense, boundary_unseen() or some of it.
// candidates: every cell that is or may become one. Seen-occupied ones never will and are passed
// over; the pessimistic count asks only those that are seen-empty. BestView::candidate is an index
// into `candidates`.
// Costs a tally, and where much is unseen little more: then one of a few cells that look promising
// is a witness, asked alone. Only if none is, all unseen voxels are tallied for all cells, first
// those around the most promising one, until some cell has enough. Throws as tally() does.
StopCertificate stop_certificate(const VoxelMap& map, const std::vector<BoundaryVoxel>& boundary,
                                 const std::vector<Voxel>& candidates, const ViewLimits& limits,
                                 std::uint32_t threshold_voxels,
                                 const OptimisticConfig& config = {});

}  // namespace planning
