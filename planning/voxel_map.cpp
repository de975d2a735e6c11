#include "planning/voxel_map.hpp"

#include <algorithm>
#include <atomic>
#include <bit>
#include <stdexcept>
#include <string>

#include "planning/voxel_beams.hpp"
#include "planning/voxel_carve.hpp"
#include "planning/voxel_parallel.hpp"

namespace planning {
namespace {

using Bits = std::vector<std::uint64_t>;

std::uint64_t bit(int x) {
  return std::uint64_t{1} << (x & 63);
}

// The bits of word `word` that are voxels of a row of nx.
std::uint64_t inside(int word, int nx) {
  const int left = nx - 64 * word;
  return left >= 64 ? ~std::uint64_t{0} : bit(left) - 1;
}

std::size_t count(const Bits& bits) {
  std::size_t sum = 0;
  for (const std::uint64_t word : bits) sum += static_cast<std::size_t>(std::popcount(word));
  return sum;
}

void check(const VoxelGrid& grid) {
  constexpr int kMax = 1 << 17;
  const auto axis = [](const char* name, int n) {
    if (n < 1 || n > kMax)
      throw std::invalid_argument(std::string("voxel grid: ") + name + " = " + std::to_string(n) +
                                  ", must be 1 to " + std::to_string(kMax) + " voxels");
  };
  axis("nx", grid.nx);
  axis("ny", grid.ny);
  axis("nz", grid.nz);
  if (!(grid.voxel_m > 0) || !std::isfinite(grid.voxel_m) || !grid.W_min_m.allFinite())
    throw std::invalid_argument("voxel grid: voxel_m must be positive and W_min_m finite");
}

// Marks the voxels of all returns; what one thread saw.
struct Marks {
  Bits bits;
  std::size_t outside{};
  int layers_needed{};
};

class ReturnMarker {
 public:
  ReturnMarker(const VoxelGrid& grid, int row_words, const hal::ScanCloud& scan, const BeamFan& fan,
               const std::vector<float>& reach_m)
      : grid_(grid), row_words_(row_words), scan_(scan), fan_(fan), reach_m_(reach_m) {}

  void mark(std::uint32_t column, Marks& marks) const {
    const std::uint32_t rows = scan_.pattern.rows;
    std::size_t beam = std::size_t{column} * rows;
    for (std::uint32_t row = 0; row < rows; ++row, ++beam) {
      if (!(scan_.ranges_m[beam] > 0) || !(reach_m_[beam] > 0)) continue;
      mark(voxel_of(fan_.end(column, row, reach_m_[beam])), marks);
    }
  }

 private:
  void mark(Voxel v, Marks& marks) const {
    if (grid_.contains(v)) {
      const std::size_t row = static_cast<std::size_t>(v.z) * static_cast<std::size_t>(grid_.ny) +
                              static_cast<std::size_t>(v.y);
      marks.bits[row * static_cast<std::size_t>(row_words_) + static_cast<std::size_t>(v.x >> 6)] |=
          bit(v.x);
      return;
    }
    ++marks.outside;
    if (grid_.contains({v.x, v.y, 0})) marks.layers_needed = std::max(marks.layers_needed, v.z + 1);
  }

  const VoxelGrid& grid_;
  int row_words_;
  const hal::ScanCloud& scan_;
  const BeamFan& fan_;
  const std::vector<float>& reach_m_;
};

Marks mark_returns(const ReturnMarker& marker, std::uint32_t columns, const Bits& occupied,
                   int layers, int threads) {
  std::vector<Marks> parts(static_cast<std::size_t>(std::max(threads, 1)));
  for (Marks& part : parts) part = {Bits(occupied.size()), 0, layers};
  for_pieces(threads, columns, 16, [&](int thread, std::size_t begin, std::size_t end) {
    for (auto column = static_cast<std::uint32_t>(begin); column < end; ++column)
      marker.mark(column, parts[static_cast<std::size_t>(thread)]);
  });
  Marks& sum = parts.front();
  for (std::size_t i = 1; i < parts.size(); ++i) {
    for (std::size_t word = 0; word < sum.bits.size(); ++word)
      sum.bits[word] |= parts[i].bits[word];
    sum.outside += parts[i].outside;
    sum.layers_needed = std::max(sum.layers_needed, parts[i].layers_needed);
  }
  return std::move(sum);
}

}  // namespace

VoxelMap::VoxelMap(const VoxelGrid& grid) : grid_(grid), row_words_((grid.nx + 63) / 64) {
  check(grid);
  occupied_.resize(row_begin(0, grid.nz));
  empty_.resize(occupied_.size());
}

VoxelState VoxelMap::at(Voxel v) const {
  if (!grid_.contains(v)) return VoxelState::unseen;
  const std::size_t word = row_begin(v.y, v.z) + static_cast<std::size_t>(v.x >> 6);
  if (occupied_[word] & bit(v.x)) return VoxelState::seen_occupied;
  return empty_[word] & bit(v.x) ? VoxelState::seen_empty : VoxelState::unseen;
}

VoxelCounts VoxelMap::counts() const {
  const std::size_t occupied = count(occupied_), empty = count(empty_);
  return {grid_.size() - occupied - empty, empty, occupied};
}

void VoxelMap::set(Voxel v, VoxelState state) {
  if (!grid_.contains(v)) throw std::out_of_range("VoxelMap::set: voxel outside the box");
  const std::size_t word = row_begin(v.y, v.z) + static_cast<std::size_t>(v.x >> 6);
  occupied_[word] &= ~bit(v.x);
  empty_[word] &= ~bit(v.x);
  if (state == VoxelState::seen_occupied) occupied_[word] |= bit(v.x);
  if (state == VoxelState::seen_empty) empty_[word] |= bit(v.x);
}

void VoxelMap::grow_z(int nz) {
  VoxelGrid grown = grid_;
  grown.nz = nz;
  check(grown);
  if (nz < grid_.nz)
    throw std::invalid_argument("grow_z: " + std::to_string(nz) + " layers are fewer than " +
                                std::to_string(grid_.nz));
  grid_ = grown;
  occupied_.resize(row_begin(0, nz));
  empty_.resize(occupied_.size());
}

InsertReport VoxelMap::insert(const hal::ScanCloud& scan, const Eigen::Isometry3d& T_W_S,
                              const InsertConfig& config) {
  const BeamFan fan(grid_, scan.pattern, T_W_S);
  const BeamReach reach = beam_reach(scan, grid_, T_W_S, fan, config);
  InsertReport report = reach.counted;

  const ReturnMarker marker(grid_, row_words_, scan, fan, reach.reach_m);
  const Marks marks =
      mark_returns(marker, scan.pattern.columns, occupied_, grid_.nz, config.threads);
  report.returns_outside = marks.outside;
  report.layers_needed = marks.layers_needed;
  const std::size_t occupied_before = count(occupied_), empty_before = count(empty_);
  for (std::size_t word = 0; word < occupied_.size(); ++word) {
    occupied_[word] |= marks.bits[word];
    empty_[word] &= ~marks.bits[word];
  }
  report.new_occupied = count(occupied_) - occupied_before;
  report.emptied_to_occupied = empty_before - count(empty_);

  const BeamCarver carver(grid_, scan.pattern, T_W_S, fan, reach.reach_m, config.threads);
  const auto rows = static_cast<std::size_t>(grid_.ny) * static_cast<std::size_t>(grid_.nz);
  for_pieces(config.threads, rows, 32, [&](int, std::size_t begin, std::size_t end) {
    for (std::size_t row = begin; row < end; ++row) {
      const int y = static_cast<int>(row) % grid_.ny, z = static_cast<int>(row) / grid_.ny;
      const BeamCarver::Words words = carver.reachable_words(y, z);
      for (int word = words.first; word < words.last; ++word) {
        const std::size_t i = row_begin(y, z) + static_cast<std::size_t>(word);
        const std::uint64_t unseen = ~(occupied_[i] | empty_[i]) & inside(word, grid_.nx);
        if (unseen != 0) empty_[i] |= carver.crossed(word, y, z, unseen);
      }
    }
  });
  report.new_empty = count(empty_) - (empty_before - report.emptied_to_occupied);
  return report;
}

std::vector<BoundaryVoxel> boundary_unseen(const VoxelMap& map) {
  const VoxelGrid& grid = map.grid();
  const auto empty = [&](int y, int z, int word) -> std::uint64_t {
    if (y < 0 || z < 0 || word < 0 || y >= grid.ny || z >= grid.nz || word >= map.row_words())
      return 0;
    return map.empty_row(y, z)[static_cast<std::size_t>(word)];
  };
  std::vector<BoundaryVoxel> result;
  const auto one_word = [&](int y, int z, int word) {
    const auto w = static_cast<std::size_t>(word);
    const std::uint64_t here = empty(y, z, word);
    const std::uint64_t beside[6] = {(here << 1) | (empty(y, z, word - 1) >> 63),
                                     (here >> 1) | (empty(y, z, word + 1) << 63),
                                     empty(y - 1, z, word),
                                     empty(y + 1, z, word),
                                     empty(y, z - 1, word),
                                     empty(y, z + 1, word)};
    std::uint64_t any = 0;
    for (const std::uint64_t side : beside) any |= side;
    any &= ~(here | map.occupied_row(y, z)[w]) & inside(word, grid.nx);
    for (; any != 0; any &= any - 1) {
      const int i = std::countr_zero(any);
      unsigned faces = 0;
      for (int face = 0; face < 6; ++face)
        faces |= static_cast<unsigned>((beside[face] >> i) & 1) << face;
      result.push_back({{64 * word + i, y, z}, static_cast<std::uint8_t>(faces)});
    }
  };
  for (int z = 0; z < grid.nz; ++z)
    for (int y = 0; y < grid.ny; ++y)
      for (int word = 0; word < map.row_words(); ++word) one_word(y, z, word);
  return result;
}

}  // namespace planning
