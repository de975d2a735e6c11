#include "planning/stop_certificate.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "planning/tally_sweep.hpp"
#include "planning/voxel_parallel.hpp"
#include "planning/why.hpp"

namespace planning {
namespace {

template <class Visit>
void for_all(const VoxelGrid& grid, const Visit& visit) {
  for (int z = 0; z < grid.nz; ++z)
    for (int y = 0; y < grid.ny; ++y)
      for (int x = 0; x < grid.nx; ++x) visit(Voxel{x, y, z});
}

// The candidates that are seen-empty in a map, and where they are among all.
struct Standing {
  std::vector<std::size_t> index;
  std::vector<Voxel> cells;

  Standing(const VoxelMap& map, const std::vector<Voxel>& candidates) {
    for (std::size_t i = 0; i < candidates.size(); ++i) {
      require_inside(map.grid(), candidates[i], "candidate");
      if (map.at(candidates[i]) != VoxelState::seen_empty) continue;
      index.push_back(i);
      cells.push_back(candidates[i]);
    }
  }
  std::optional<BestView> best_of(const std::vector<std::uint32_t>& counts) const {
    std::optional<BestView> found = best(counts);
    if (found) found->candidate = index[found->candidate];
    return found;
  }
};

// How many unseen voxels lie in the columns around a cell: a guess at what it might see.
class UnseenAround {
 public:
  UnseenAround(const VoxelGrid& grid, const std::vector<BoundaryVoxel>& unseen)
      : nx_(grid.nx), ny_(grid.ny), sums_(at(0, ny_ + 1)) {
    for (const BoundaryVoxel& u : unseen) ++sums_[at(u.v.x + 1, u.v.y + 1)];
    for (int y = 1; y <= ny_; ++y)
      for (int x = 1; x <= nx_; ++x)
        sums_[at(x, y)] += sums_[at(x - 1, y)] + sums_[at(x, y - 1)] - sums_[at(x - 1, y - 1)];
  }
  std::uint64_t count(Voxel p) const {
    const int x0 = std::max(p.x - kNear, 0), x1 = std::min(p.x + kNear + 1, nx_);
    const int y0 = std::max(p.y - kNear, 0), y1 = std::min(p.y + kNear + 1, ny_);
    return sums_[at(x1, y1)] - sums_[at(x0, y1)] - sums_[at(x1, y0)] + sums_[at(x0, y0)];
  }

  static constexpr int kNear = 16;

 private:
  std::size_t at(int x, int y) const {
    return static_cast<std::size_t>(y) * (static_cast<std::size_t>(nx_) + 1) +
           static_cast<std::size_t>(x);
  }

  int nx_, ny_;
  std::vector<std::uint64_t> sums_;
};

// Opt(p) of all candidates: which is the largest, or which one reaches a threshold.
class OptimisticCounts {
 public:
  OptimisticCounts(const VoxelMap& optimistic, std::vector<BoundaryVoxel> unseen,
                   const std::vector<Voxel>& candidates, const ViewLimits& limits, int threads)
      : map_(optimistic),
        unseen_(std::move(unseen)),
        standing_(optimistic, candidates),
        limits_(limits),
        rule_(limits, optimistic.grid().voxel_m),
        threads_(threads) {}

  std::optional<BestView> witness_or_largest(std::uint32_t threshold_voxels) {
    const std::vector<std::size_t> cells = promising();
    for (const std::size_t i : cells)
      if (const BestView view = view_from(i); view.gain_voxels >= threshold_voxels) return view;
    if (cells.empty()) return std::nullopt;
    return by_tally(standing_.cells[cells.front()], threshold_voxels);
  }

 private:
  // A few cells, well apart, with much unseen around them; the most promising first.
  std::vector<std::size_t> promising() const {
    const UnseenAround around(map_.grid(), unseen_);
    std::vector<std::pair<std::uint64_t, std::size_t>> order;
    for (std::size_t i = 0; i < standing_.cells.size(); ++i)
      order.emplace_back(around.count(standing_.cells[i]), i);
    std::ranges::stable_sort(order, std::ranges::greater{}, &decltype(order)::value_type::first);
    const auto near = [&](std::size_t i, std::size_t k) {
      const Voxel a = standing_.cells[i], b = standing_.cells[k];
      return std::max(std::abs(a.x - b.x), std::abs(a.y - b.y)) < UnseenAround::kNear;
    };
    std::vector<std::size_t> chosen;
    for (const auto& [count, i] : order) {
      if (chosen.size() == kAskedAlone) break;
      if (std::ranges::none_of(chosen, [&](std::size_t k) { return near(i, k); }))
        chosen.push_back(i);
    }
    return chosen;
  }

  // Opt(p) of one cell.
  BestView view_from(std::size_t cell) const {
    const Voxel p = standing_.cells[cell];
    std::atomic<std::uint32_t> sum{0};
    for_pieces(threads_, unseen_.size(), 4096, [&](int, std::size_t begin, std::size_t end) {
      std::uint32_t count = 0;
      for (std::size_t i = begin; i < end; ++i)
        count += rule_.admits(unseen_[i], p) && clear_between(map_, unseen_[i].v, p);
      sum += count;
    });
    return {standing_.index[cell], sum};
  }

  // Piece by piece, growing, so that what the first pieces show is known soon.
  std::optional<BestView> by_tally(Voxel center, std::uint32_t threshold_voxels) {
    const auto distance2 = [&](const BoundaryVoxel& u) {
      const std::int64_t x = u.v.x - center.x, y = u.v.y - center.y, z = u.v.z - center.z;
      return x * x + y * y + z * z;
    };
    std::ranges::stable_sort(unseen_, {}, distance2);
    std::vector<std::uint32_t> counts(standing_.cells.size());
    std::size_t piece = std::max(unseen_.size() / 64, kPieceMin);
    for (std::size_t begin = 0; begin < unseen_.size(); begin += piece, piece *= 2) {
      const auto first = unseen_.begin() + static_cast<std::ptrdiff_t>(begin);
      const auto size = static_cast<std::ptrdiff_t>(std::min(piece, unseen_.size() - begin));
      const auto some = tally(map_, {first, first + size}, standing_.cells, limits_, threads_);
      for (std::size_t i = 0; i < counts.size(); ++i) counts[i] += some[i];
      const std::optional<BestView> most = best(counts);
      if (most && most->gain_voxels >= threshold_voxels) return view_from(most->candidate);
    }
    return standing_.best_of(counts);
  }

  static constexpr std::size_t kAskedAlone = 8, kPieceMin = 2048;

  const VoxelMap& map_;
  std::vector<BoundaryVoxel> unseen_;
  Standing standing_;
  ViewLimits limits_;
  ViewRule rule_;
  int threads_;
};

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
  const Standing now(map, candidates);
  certificate.pessimistic = now.best_of(tally(map, boundary, now.cells, limits, config.threads));
  certificate.optimistic =
      OptimisticCounts(optimistic, std::move(exposable), candidates, limits, config.threads)
          .witness_or_largest(threshold_voxels);
  return certificate;
}

}  // namespace planning
