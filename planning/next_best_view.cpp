#include "planning/next_best_view.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

#include "planning/tally_sweep.hpp"
#include "planning/voxel_parallel.hpp"

namespace planning {
namespace {

constexpr double kRangeMaxVoxels = 16000;

std::int64_t square(std::int64_t n) {
  return n * n;
}

// Candidates without repetition, by layer, and which are not seen-empty (their own voxel has to be
// let through: they are walked one by one).
struct SortedCandidates {
  std::vector<CandidateLayer> layers;
  std::vector<Voxel> walked;
};

bool by_layer(const Voxel& a, const Voxel& b) {
  return std::array{a.z, a.y, a.x} < std::array{b.z, b.y, b.x};
}

SortedCandidates sort_candidates(const VoxelMap& map, std::vector<Voxel> candidates) {
  for (const Voxel p : candidates) require_inside(map.grid(), p, "candidate");
  std::sort(candidates.begin(), candidates.end(), by_layer);
  candidates.erase(std::unique(candidates.begin(), candidates.end()), candidates.end());
  SortedCandidates sorted;
  std::size_t tallies = 0;
  for (auto begin = candidates.begin(); begin != candidates.end();) {
    const auto end =
        std::find_if(begin, candidates.end(), [&](Voxel p) { return p.z != begin->z; });
    std::vector<Voxel> layer;
    for (auto p = begin; p != end; ++p)
      (map.at(*p) == VoxelState::seen_empty ? layer : sorted.walked).push_back(*p);
    sorted.layers.emplace_back(begin->z, map.row_words(), layer, tallies);
    tallies = sorted.layers.back().tally_end();
    begin = end;
  }
  return sorted;
}

// Boundary voxels of one |c| to a layer, so that a thread seldom changes its paths.
struct Task {
  int c;
  const CandidateLayer* layer;
  std::size_t begin, end;
};

std::vector<Task> make_tasks(const std::vector<BoundaryVoxel>& by_z,
                             const std::vector<CandidateLayer>& layers) {
  constexpr std::size_t kPiece = 128;
  std::vector<Task> tasks;
  for (const CandidateLayer& layer : layers)
    for (std::size_t begin = 0; begin < by_z.size();) {
      std::size_t end = begin;
      const int z = by_z[begin].v.z;
      while (end < by_z.size() && end < begin + kPiece && by_z[end].v.z == z) ++end;
      tasks.push_back({std::abs(layer.z() - z), &layer, begin, end});
      begin = end;
    }
  std::stable_sort(tasks.begin(), tasks.end(),
                   [](const Task& a, const Task& b) { return a.c < b.c; });
  return tasks;
}

std::vector<std::uint32_t> sweep(const VoxelMap& map, std::vector<BoundaryVoxel> boundary,
                                 const std::vector<CandidateLayer>& layers, const ViewRule& rule,
                                 int threads) {
  const std::size_t tallies = layers.empty() ? 0 : layers.back().tally_end();
  std::stable_sort(
      boundary.begin(), boundary.end(),
      [](const BoundaryVoxel& a, const BoundaryVoxel& b) { return by_layer(a.v, b.v); });
  const std::vector<Task> tasks = make_tasks(boundary, layers);
  const BlockedRows blocked(map);
  std::vector<Sweep<SeenCounts>> sweeps(
      static_cast<std::size_t>(std::max(threads, 1)),
      {map.grid(), blocked, rule, SeenCounts{std::vector<std::uint32_t>(tallies)}});
  for_pieces(threads, tasks.size(), 1, [&](int thread, std::size_t task, std::size_t) {
    const BoundaryVoxel* const end = boundary.data() + tasks[task].end;
    for (const BoundaryVoxel *row = boundary.data() + tasks[task].begin, *next; row != end;
         row = next) {
      next = std::find_if(row, end, [&](const BoundaryVoxel& u) { return u.v.y != row->v.y; });
      sweeps[static_cast<std::size_t>(thread)].add(row, next, *tasks[task].layer);
    }
  });
  std::vector<std::uint32_t> sum(tallies);
  for (const Sweep<SeenCounts>& part : sweeps)
    for (std::size_t i = 0; i < tallies; ++i) sum[i] += part.sink().tallies[i];
  return sum;
}

}  // namespace

ViewRule::ViewRule(const ViewLimits& limits, double voxel_m) {
  const double nearest = limits.range_min_m / voxel_m, farthest = limits.range_max_m / voxel_m;
  if (!(nearest >= 0) || !(farthest >= nearest) || !(farthest <= kRangeMaxVoxels))
    throw std::invalid_argument("view limits: need 0 <= range_min_m <= range_max_m <= " +
                                std::to_string(kRangeMaxVoxels * voxel_m) + " m");
  if (!(limits.grazing_max_deg >= 0) || !(limits.grazing_max_deg <= 90))
    throw std::invalid_argument("view limits: grazing_max_deg must be within 0 and 90");
  // A metre value that should be a whole number of voxels counts as such.
  constexpr double kRounding = 1e-12;
  distance2_min_ = static_cast<std::int64_t>(std::ceil(nearest * nearest * (1 - kRounding)));
  distance2_max_ = static_cast<std::int64_t>(std::floor(farthest * farthest * (1 + kRounding)));
  const double cosine = std::cos(limits.grazing_max_deg * std::numbers::pi / 180);
  cos2_grazing_ = cosine * cosine;
  if (!(limits.density_min_ppm2 >= 0) || !(limits.beams_per_sr >= 0))
    throw std::invalid_argument("view limits: densities must be 0 or more");
  any_density_ = limits.density_min_ppm2 == 0;
  if (any_density_) return;
  const double ratio = limits.beams_per_sr / (limits.density_min_ppm2 * voxel_m * voxel_m);
  // Whole numbers decide, so that the interval of dense() has no holes. No scanner comes near the
  // cap, which keeps products below 2^128.
  constexpr double kRatioMax = 1e12;
  const double capped = std::min(ratio, kRatioMax);
  dense_ = static_cast<Wide>(std::ceil(capped * capped * 0x1.0p20));
}

bool ViewRule::dense(std::int64_t outward2, std::int64_t distance2,
                     std::int64_t horizontal2) const {
  if (any_density_) return true;
  const auto wide = [](std::int64_t n) { return static_cast<Wide>(n); };
  return wide(outward2) * dense_ >= ((wide(distance2) * wide(distance2) * wide(horizontal2)) << 20);
}

bool ViewRule::admits(const BoundaryVoxel& u, Voxel p) const {
  const std::int64_t x = p.x - u.v.x, y = p.y - u.v.y, z = p.z - u.v.z;
  const std::int64_t distance2 = square(x) + square(y) + square(z);
  if (!in_range(distance2)) return false;
  const auto seen = [&](Face minus, Face plus, std::int64_t n) {
    return n != 0 && (u.faces & (n < 0 ? minus : plus)) != 0 && along_normal(n * n, distance2) &&
           dense(n * n, distance2, square(x) + square(y));
  };
  return seen(kFaceXMinus, kFaceXPlus, x) || seen(kFaceYMinus, kFaceYPlus, y) ||
         seen(kFaceZMinus, kFaceZPlus, z);
}

std::optional<Voxel> first_between(const VoxelMap& map, Voxel from, Voxel to) {
  struct Axis {
    int at, sign;
    std::int64_t next, step;  // Crossing times in 1 / (2 |dx| |dy| |dz|), zeros left out.
  };
  const std::int64_t d[3] = {to.x - from.x, to.y - from.y, to.z - from.z};
  const auto weight = [&](int i) { return d[i] == 0 ? std::int64_t{1} : std::abs(d[i]); };
  Axis axes[3];
  const int start[3] = {from.x, from.y, from.z};
  for (int i = 0; i < 3; ++i) {
    const std::int64_t half = weight((i + 1) % 3) * weight((i + 2) % 3);
    axes[i] = {start[i], d[i] < 0 ? -1 : 1, d[i] == 0 ? INT64_MAX : half, 2 * half};
  }
  while (true) {
    const std::int64_t now = std::min({axes[0].next, axes[1].next, axes[2].next});
    for (Axis& axis : axes) {
      if (axis.next != now || now == INT64_MAX) continue;
      axis.at += axis.sign;
      axis.next += axis.step;
    }
    const Voxel v{axes[0].at, axes[1].at, axes[2].at};
    if (v == to) return std::nullopt;
    if (map.at(v) != VoxelState::seen_empty) return v;
  }
}

bool clear_between(const VoxelMap& map, Voxel u, Voxel p) {
  return !first_between(map, u, p);
}

std::vector<std::uint32_t> tally(const VoxelMap& map, const std::vector<BoundaryVoxel>& boundary,
                                 const std::vector<Voxel>& candidates, const ViewLimits& limits,
                                 int threads) {
  const ViewRule rule(limits, map.grid().voxel_m);
  for (const BoundaryVoxel& u : boundary) require_inside(map.grid(), u.v, "boundary voxel");
  const SortedCandidates sorted = sort_candidates(map, candidates);
  const std::vector<std::uint32_t> swept = sweep(map, boundary, sorted.layers, rule, threads);

  std::vector<std::uint32_t> walked(sorted.walked.size());
  for_pieces(threads, walked.size(), 4, [&](int, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      walked[i] =
          static_cast<std::uint32_t>(visible_from(map, boundary, sorted.walked[i], limits).size());
  });

  std::vector<std::uint32_t> result;
  result.reserve(candidates.size());
  for (const Voxel p : candidates) {
    if (map.at(p) == VoxelState::seen_empty) {
      const auto layer = std::lower_bound(sorted.layers.begin(), sorted.layers.end(), p.z,
                                          [](const CandidateLayer& l, int z) { return l.z() < z; });
      result.push_back(swept[layer->tally_of(p)]);
    } else {
      const auto i = std::lower_bound(sorted.walked.begin(), sorted.walked.end(), p, by_layer);
      result.push_back(walked[static_cast<std::size_t>(i - sorted.walked.begin())]);
    }
  }
  return result;
}

std::vector<std::uint8_t> seen_by_any(const VoxelMap& map,
                                      const std::vector<BoundaryVoxel>& boundary,
                                      const std::vector<Voxel>& candidates,
                                      const ViewLimits& limits, int threads) {
  const ViewRule rule(limits, map.grid().voxel_m);
  for (const BoundaryVoxel& u : boundary) require_inside(map.grid(), u.v, "boundary voxel");
  const SortedCandidates sorted = sort_candidates(map, candidates);
  const BlockedRows blocked(map);
  std::vector<Sweep<AnySeen>> sweeps(static_cast<std::size_t>(std::max(threads, 1)),
                                     Sweep(map.grid(), blocked, rule, AnySeen{}));
  std::vector<std::uint8_t> seen(boundary.size());
  // Neighbours in the list share a layer: a thread seldom changes its paths.
  for_pieces(threads, boundary.size(), 128, [&](int thread, std::size_t begin, std::size_t end) {
    Sweep<AnySeen>& sweep = sweeps[static_cast<std::size_t>(thread)];
    for (const CandidateLayer& layer : sorted.layers)
      for (std::size_t i = begin; i < end; ++i) {
        if (seen[i] != 0) continue;
        sweep.sink().any = false;
        sweep.add(boundary[i], layer);
        seen[i] = sweep.sink().any;
      }
    for (std::size_t i = begin; i < end; ++i)
      for (std::size_t k = 0; seen[i] == 0 && k < sorted.walked.size(); ++k)
        seen[i] = rule.admits(boundary[i], sorted.walked[k]) &&
                  clear_between(map, boundary[i].v, sorted.walked[k]);
  });
  return seen;
}

std::vector<std::uint32_t> visible_from(const VoxelMap& map,
                                        const std::vector<BoundaryVoxel>& boundary, Voxel p,
                                        const ViewLimits& limits) {
  require_inside(map.grid(), p, "viewpoint");
  const ViewRule rule(limits, map.grid().voxel_m);
  std::vector<std::uint32_t> result;
  for (std::size_t i = 0; i < boundary.size(); ++i)
    if (rule.admits(boundary[i], p) && clear_between(map, boundary[i].v, p))
      result.push_back(static_cast<std::uint32_t>(i));
  return result;
}

std::optional<BestView> best(const std::vector<std::uint32_t>& tally_of_candidates) {
  const auto largest = std::max_element(tally_of_candidates.begin(), tally_of_candidates.end());
  if (largest == tally_of_candidates.end()) return std::nullopt;
  return BestView{static_cast<std::size_t>(largest - tally_of_candidates.begin()), *largest};
}

}  // namespace planning
