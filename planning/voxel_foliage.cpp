#include "planning/voxel_foliage.hpp"

#include <algorithm>
#include <bit>
#include <cstdlib>

#include "planning/voxel_beams.hpp"
#include "planning/voxel_parallel.hpp"

namespace planning {
namespace {

// Which face a segment crosses next, on two axes: with n the way to the next face and d the whole
// way along each axis, the sign of n_a d_b - n_b d_a. Exact: all factors are within 2^30.
class SegmentWalk {
 public:
  SegmentWalk(const LatticePoint& from, const LatticePoint& to) : v_(voxel_of(from)) {
    const std::int64_t a[3] = {from.x, from.y, from.z}, b[3] = {to.x, to.y, to.z};
    for (int i = 0; i < 3; ++i) {
      length_[i] = std::abs(b[i] - a[i]);
      sign_[i] = b[i] < a[i] ? -1 : 1;
      const std::int64_t low = (a[i] >> kLatticeShift) << kLatticeShift;
      next_[i] = b[i] < a[i] ? a[i] - low : low + kSide - a[i];
    }
    xy_ = next_[0] * length_[1] - next_[1] * length_[0];
    xz_ = next_[0] * length_[2] - next_[2] * length_[0];
    yz_ = next_[1] * length_[2] - next_[2] * length_[1];
  }

  Voxel voxel() const { return v_; }
  // Through the nearest face, or through two or three at once where they meet.
  void step() {
    const bool x = xy_ <= 0 && xz_ <= 0, y = xy_ >= 0 && yz_ <= 0, z = xz_ >= 0 && yz_ >= 0;
    if (x) v_.x += sign_[0], xy_ += kSide * length_[1], xz_ += kSide * length_[2];
    if (y) v_.y += sign_[1], xy_ -= kSide * length_[0], yz_ += kSide * length_[2];
    if (z) v_.z += sign_[2], xz_ -= kSide * length_[0], yz_ -= kSide * length_[1];
  }

 private:
  static constexpr std::int64_t kSide = std::int64_t{1} << kLatticeShift;

  Voxel v_;
  std::int64_t length_[3], next_[3];
  int sign_[3];
  std::int64_t xy_, xz_, yz_;
};

void count_one(std::uint16_t& counter) {
  counter += counter < BeamCounts::kMax;
}

std::uint16_t saturating_sum(std::uint16_t a, std::uint16_t b) {
  return static_cast<std::uint16_t>(std::min(a + b, BeamCounts::kMax));
}

// Calls visit(v) for the voxels of the box that the segment crosses, but not for its last one.
template <class Visit>
void for_passed(const VoxelGrid& grid, const LatticePoint& from, const LatticePoint& to,
                const Visit& visit) {
  const Voxel last = voxel_of(to);
  bool inside = false;
  for (SegmentWalk walk(from, to); walk.voxel() != last; walk.step()) {
    if (grid.contains(walk.voxel())) {
      inside = true;
      visit(walk.voxel());
    } else if (inside) {
      return;  // It does not come back.
    }
  }
}

}  // namespace

BeamCounts::BeamCounts(const VoxelMap& map) : grid_(map.grid()) {
  grid_.nz = map.nz_kept();
  counts_.resize(grid_.size());
}

std::size_t BeamCounts::index(Voxel v) const {
  const auto nx = static_cast<std::size_t>(grid_.nx), ny = static_cast<std::size_t>(grid_.ny);
  return (static_cast<std::size_t>(v.z) * ny + static_cast<std::size_t>(v.y)) * nx +
         static_cast<std::size_t>(v.x);
}

int BeamCounts::hits(Voxel v) const {
  return grid_.contains(v) ? counts_[index(v)].hits : 0;
}

int BeamCounts::passes(Voxel v) const {
  return grid_.contains(v) ? counts_[index(v)].passes : 0;
}

bool BeamCounts::foliage(Voxel v, const FoliageRule& rule) const {
  const int passed = passes(v);
  return passed >= rule.passes_min && passed >= rule.share_min * (hits(v) + passed);
}

void BeamCounts::add(const hal::ScanCloud& scan, const Eigen::Isometry3d& T_W_S,
                     const InsertConfig& config) {
  const BeamFan fan(grid_, scan, T_W_S);
  const BeamReach reach = beam_reach(scan, grid_, T_W_S, fan, config);
  const int threads = std::clamp(config.threads, 1, kThreadsMax);
  std::vector<std::vector<Count>> others(static_cast<std::size_t>(threads) - 1);
  for (auto& other : others) other.resize(counts_.size());

  const std::uint32_t rows = scan.pattern.rows;
  const auto one_column = [&](std::uint32_t column, std::vector<Count>& counts) {
    std::size_t beam = std::size_t{column} * rows;
    for (std::uint32_t row = 0; row < rows; ++row, ++beam) {
      if (!(reach.reach_m[beam] > 0)) continue;
      const LatticePoint end = fan.end(column, row, reach.reach_m[beam]);
      for_passed(grid_, fan.start(column, row), end,
                 [&](Voxel v) { count_one(counts[index(v)].passes); });
      const Voxel last = voxel_of(end);
      if (scan.ranges_m[beam] > 0 && grid_.contains(last)) count_one(counts[index(last)].hits);
    }
  };
  for_pieces(threads, scan.pattern.columns, 8, [&](int thread, std::size_t begin, std::size_t end) {
    std::vector<Count>& counts =
        thread == 0 ? counts_ : others[static_cast<std::size_t>(thread) - 1];
    for (auto column = static_cast<std::uint32_t>(begin); column < end; ++column)
      one_column(column, counts);
  });
  for (const std::vector<Count>& other : others)
    for (std::size_t i = 0; i < counts_.size(); ++i)
      counts_[i] = {saturating_sum(counts_[i].hits, other[i].hits),
                    saturating_sum(counts_[i].passes, other[i].passes)};
}

VoxelMap see_through(const VoxelMap& map, const BeamCounts& counts, const FoliageRule& rule) {
  VoxelMap seen = map;
  const VoxelGrid& grid = map.grid();
  for (int z = 0; z < grid.nz; ++z)
    for (int y = 0; y < grid.ny; ++y)
      for (int word = 0; word < map.row_words(); ++word) {
        std::uint64_t left = map.occupied_row(y, z)[static_cast<std::size_t>(word)];
        for (; left != 0; left &= left - 1) {
          const Voxel v{64 * word + std::countr_zero(left), y, z};
          if (counts.foliage(v, rule)) seen.set(v, VoxelState::seen_empty);
        }
      }
  return seen;
}

}  // namespace planning
