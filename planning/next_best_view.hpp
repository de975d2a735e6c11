// Phase II (Algorithm 2 of the paper; definitions fixed in ARCHITECTURE.md): from where the most
// boundary-unseen voxels can be seen. Exact: integers decide, on every machine alike.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "planning/voxel_map.hpp"

namespace planning {

// What the scanner can image. The angle is between the beam and the normal of the face it meets.
struct ViewLimits {
  double range_min_m = 1.0;
  double range_max_m = 100.0;
  double grazing_max_deg = 70.0;
  // 0: no such limit. Else a face counts only where a scan would put as many points on it, see
  // scan_density.hpp; beams_per_sr on the horizon.
  double density_min_ppm2 = 0;
  double beams_per_sr = 0;
};

// ViewLimits between voxel centres, in voxels; everything that decides who counts is rounded here,
// once.
class ViewRule {
 public:
  // Throws std::invalid_argument for limits that no scanner has, or beyond 16000 voxels.
  ViewRule(const ViewLimits& limits, double voxel_m);

  // Squared distances that are within range, both inclusive.
  std::int64_t distance2_min() const { return distance2_min_; }
  std::int64_t distance2_max() const { return distance2_max_; }
  // A face is seen from d if its outward part n of d is > 0 and n^2 >= cos2_grazing() |d|^2, and
  // densely enough.
  double cos2_grazing() const { return cos2_grazing_; }

  bool in_range(std::int64_t distance2) const {
    return distance2 >= distance2_min_ && distance2 <= distance2_max_;
  }
  bool along_normal(std::int64_t outward2, std::int64_t distance2) const {
    return static_cast<double>(outward2) >= cos2_grazing_ * static_cast<double>(distance2);
  }
  // Whether beams_per_sr n / (|d|^2 h) >= density_min_ppm2, h being the horizontal length of d: the
  // beams of a scanner lie as 1 / cos(elevation), that is |d| / h. Straight above there is no end
  // to them. For fixed y and z of d, and n fixed or along x, this holds for x in one interval.
  bool dense(std::int64_t outward2, std::int64_t distance2, std::int64_t horizontal2) const;
  // Whether p is in range of u and sees one of its faces at a fair angle; occlusion aside.
  bool admits(const BoundaryVoxel& u, Voxel p) const;

 private:
  std::int64_t distance2_min_{}, distance2_max_{};
  double cos2_grazing_{};
  __extension__ using Wide = unsigned __int128;
  bool any_density_ = true;
  Wide dense_{};  // (beams_per_sr / (density_min_ppm2 voxel_m^2))^2, in 2^-20.
};

// Of the voxels that the open segment between the two centres meets, the first that is not
// seen-empty, `from` and `to` aside; nothing if there is none. Through edges and corners it meets
// no voxel. Both inside the box.
std::optional<Voxel> first_between(const VoxelMap& map, Voxel from, Voxel to);
// Whether there is none. Sight is mutual.
bool clear_between(const VoxelMap& map, Voxel u, Voxel p);

// For every candidate the number of boundary voxels that can be seen from its centre: Counts(p).
// Candidates may be any voxels of the box, in any order, of several layers, and repeated; a
// candidate's own voxel does not block. Independent of threads.
// Throws std::invalid_argument for voxels outside the box.
std::vector<std::uint32_t> tally(const VoxelMap& map, const std::vector<BoundaryVoxel>& boundary,
                                 const std::vector<Voxel>& candidates, const ViewLimits& limits,
                                 int threads = 1);

// For every boundary voxel 1 if any of the candidates counts it, else 0. As tally().
std::vector<std::uint8_t> seen_by_any(const VoxelMap& map,
                                      const std::vector<BoundaryVoxel>& boundary,
                                      const std::vector<Voxel>& candidates,
                                      const ViewLimits& limits, int threads = 1);

// The boundary voxels that Counts(p) counts, as indices, ascending.
std::vector<std::uint32_t> visible_from(const VoxelMap& map,
                                        const std::vector<BoundaryVoxel>& boundary, Voxel p,
                                        const ViewLimits& limits);

struct BestView {
  std::size_t candidate{};
  std::uint32_t gain_voxels{};

  bool operator==(const BestView&) const = default;
};

// The largest tally, ties to the lowest index; nothing if there is no candidate.
std::optional<BestView> best(const std::vector<std::uint32_t>& tally_of_candidates);

}  // namespace planning
