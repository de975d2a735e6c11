// What has been seen of the site (paper 3.2.1; definitions fixed in ARCHITECTURE.md).
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "hal/values.hpp"

namespace planning {

class BeamCarver;

enum class VoxelState : std::uint8_t { unseen, seen_empty, seen_occupied };

struct Voxel {
  int x{}, y{}, z{};

  auto operator<=>(const Voxel&) const = default;
};

// An axis-aligned box of cubes. Voxel (x, y, z) is the half-open cube from
// W_min_m + voxel_m * (x, y, z).
struct VoxelGrid {
  Eigen::Vector3d W_min_m{0, 0, 0};
  double voxel_m = 1.0;
  int nx{}, ny{}, nz{};

  std::size_t size() const {
    return static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny) *
           static_cast<std::size_t>(nz);
  }
  bool contains(Voxel v) const {
    return v.x >= 0 && v.y >= 0 && v.z >= 0 && v.x < nx && v.y < ny && v.z < nz;
  }
  Eigen::Vector3d center_m(Voxel v) const {
    return W_min_m + voxel_m * (Eigen::Vector3d(v.x, v.y, v.z) + Eigen::Vector3d::Constant(0.5));
  }
  // The voxel that holds the point; may lie outside the box.
  Voxel voxel_at(const Eigen::Vector3d& W_point_m) const {
    const Eigen::Vector3d q = (W_point_m - W_min_m) / voxel_m;
    return {static_cast<int>(std::floor(q.x())), static_cast<int>(std::floor(q.y())),
            static_cast<int>(std::floor(q.z()))};
  }
};

struct VoxelCounts {
  std::size_t unseen{};
  std::size_t seen_empty{};
  std::size_t seen_occupied{};

  auto operator<=>(const VoxelCounts&) const = default;
};

// A wall of the site's map as seen from above, of unknown height.
struct WallLine {
  Eigen::Vector2d W_from_m, W_to_m;
};

// How a scan is believed.
struct InsertConfig {
  double range_min_m = 1.0;
  double range_max_m = 100.0;
  // A beam without return has met nothing up to range_max_m. false: only data points carve.
  bool carve_no_return = true;
  // See trusted_no_returns() in voxel_beams.hpp. 0: every beam without return is believed.
  int no_return_window = 2;
  // The ground where it is known and flat: a beam without return that points down at it was lost on
  // the ground and did not pass through. It is carved only down to the top of the voxel layer that
  // holds this height, so that no ground voxel becomes seen-empty by a drop-out.
  std::optional<double> ground_z_m;
  // Walls that are known to stand. One that is nearer than range_min_m gives nothing back, as the
  // sky does: so a beam without return is not believed at all if its first range_min_m come, seen
  // from above, within walls_margin_m of a wall. The margin is for the errors of pose and map.
  std::vector<WallLine> walls;
  double walls_margin_m = 0.15;
  int threads = 1;  // The result does not depend on it.
};

// What one scan did.
struct InsertReport {
  std::size_t returns{};            // Within range.
  std::size_t returns_outside{};    // Of these, with the point outside the box.
  std::size_t returns_too_near{};   // Below range_min_m: ignored.
  std::size_t returns_too_far{};    // Above range_max_m: ignored.
  std::size_t returns_invalid{};    // Negative or not a number: ignored.
  std::size_t no_returns{};         // Beams from which nothing came back.
  std::size_t no_returns_carved{};  // Of these, carved at least part of the way.
  int layers_needed{};              // nz with which no return lies above the box (see grow_z).
  // [i]: returns above the box, in its columns, in layer nz + i. Ends with the highest of them.
  std::vector<std::uint64_t> returns_above;
  std::size_t new_occupied{};         // Voxels that became seen-occupied,
  std::size_t emptied_to_occupied{};  // of these, seen-empty before.
  std::size_t new_empty{};            // Voxels that became seen-empty.

  bool operator==(const InsertReport&) const = default;
};

// Two bits per voxel. Rows run along x and are padded to 64 bits, padding 0.
class VoxelMap {
 public:
  // All unseen. The states of layers up to nz_kept are kept from the start although the box does
  // not show them, so that grow_z() up to there gives what the higher box would have given.
  // Throws std::invalid_argument for a box without voxels or beyond 2^17 per axis.
  explicit VoxelMap(const VoxelGrid& grid, int nz_kept = 0);

  const VoxelGrid& grid() const { return grid_; }
  // Outside the box: unseen.
  VoxelState at(Voxel v) const;
  VoxelCounts counts() const;

  // Puts one scan into the map, by the rule of the paper: every voxel that holds a return becomes
  // seen-occupied for good; then every unseen voxel that a beam crosses on its way, from the
  // scanner's own voxel to the beam's end, becomes seen-empty. All returns of the scan come
  // first, so neither the order of beams nor the number of threads matters. The paths are exact
  // segments between end points on a lattice of 1/1024 voxel (voxel_beams.hpp); what lies outside
  // the box is as if walked and forgotten. T_W_S is the scanner's pose at the scan.
  // Throws std::invalid_argument for what cannot be a scan of this site (sizes, steps, limits).
  InsertReport insert(const hal::ScanCloud& scan, const Eigen::Isometry3d& T_W_S,
                      const InsertConfig& config);

  // A higher box. Layers that were kept show what all scans saw there, as if the box had been this
  // high from the start; those above are unseen until a scan is inserted. Throws
  // std::invalid_argument when nz is less than now.
  void grow_z(int nz);
  int nz_kept() const { return nz_kept_; }  // At least grid().nz.

  // For maps that come from elsewhere (files, tests). v must be inside the box.
  void set(Voxel v, VoxelState state) { set_run(v, 1, state); }
  // The same for `count` voxels from v on along x.
  void set_run(Voxel v, int count, VoxelState state);

  // Of the states, kept layers included: 2 bits a voxel and the padding of rows, so at most a byte
  // per voxel from nx = 16 on (a quarter of one where nx is a multiple of 64).
  std::size_t storage_bytes() const {
    return (occupied_.capacity() + empty_.capacity()) * sizeof(std::uint64_t);
  }

  int row_words() const { return row_words_; }
  std::span<const std::uint64_t> occupied_row(int y, int z) const { return row(occupied_, y, z); }
  std::span<const std::uint64_t> empty_row(int y, int z) const { return row(empty_, y, z); }

  // The same box of voxels in the same states; what is kept above it does not count.
  bool operator==(const VoxelMap& other) const;

 private:
  std::span<const std::uint64_t> row(const std::vector<std::uint64_t>& bits, int y, int z) const {
    return {bits.data() + row_begin(y, z), static_cast<std::size_t>(row_words_)};
  }
  std::size_t row_begin(int y, int z) const {
    return (static_cast<std::size_t>(z) * static_cast<std::size_t>(grid_.ny) +
            static_cast<std::size_t>(y)) *
           static_cast<std::size_t>(row_words_);
  }

  // How many words the layers of the box take; kept layers come after.
  std::size_t box_words() const { return row_begin(0, grid_.nz); }
  VoxelGrid kept_grid() const;
  void carve(const BeamCarver& carver, int threads);

  VoxelGrid grid_;
  int row_words_{};
  int nz_kept_{};
  std::vector<std::uint64_t> occupied_;
  std::vector<std::uint64_t> empty_;  // Never both.
};

// The six faces of a voxel, as bits.
enum Face : std::uint8_t {
  kFaceXMinus = 1,
  kFaceXPlus = 2,
  kFaceYMinus = 4,
  kFaceYPlus = 8,
  kFaceZMinus = 16,
  kFaceZPlus = 32,
};

// An unseen voxel with a seen-empty neighbour behind each of `faces` (at least one).
struct BoundaryVoxel {
  Voxel v;
  std::uint8_t faces{};

  bool operator==(const BoundaryVoxel&) const = default;
};

// All of them (the set U of Algorithm 2), ordered by z, then y, then x.
std::vector<BoundaryVoxel> boundary_unseen(const VoxelMap& map);

}  // namespace planning
