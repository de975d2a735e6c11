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

std::size_t count(const Bits& bits, std::size_t words) {
  std::size_t sum = 0;
  for (std::size_t i = 0; i < words; ++i) sum += static_cast<std::size_t>(std::popcount(bits[i]));
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
  std::vector<std::uint64_t> above;  // See InsertReport::returns_above.

  void add(const Marks& other) {
    for (std::size_t word = 0; word < bits.size(); ++word) bits[word] |= other.bits[word];
    outside += other.outside;
    above.resize(std::max(above.size(), other.above.size()));
    for (std::size_t i = 0; i < other.above.size(); ++i) above[i] += other.above[i];
  }
};

class ReturnMarker {
 public:
  // `kept` is the box with the layers kept above its nz.
  ReturnMarker(const VoxelGrid& kept, int nz, int row_words, const hal::ScanCloud& scan,
               const BeamFan& fan, const std::vector<float>& reach_m)
      : kept_(kept), nz_(nz), row_words_(row_words), scan_(scan), fan_(fan), reach_m_(reach_m) {}

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
    if (kept_.contains(v)) {
      const std::size_t row = static_cast<std::size_t>(v.z) * static_cast<std::size_t>(kept_.ny) +
                              static_cast<std::size_t>(v.y);
      marks.bits[row * static_cast<std::size_t>(row_words_) + static_cast<std::size_t>(v.x >> 6)] |=
          bit(v.x);
      if (v.z < nz_) return;
    }
    ++marks.outside;
    if (v.z < nz_ || !kept_.contains({v.x, v.y, 0})) return;
    const auto layer = static_cast<std::size_t>(v.z - nz_);
    if (layer >= marks.above.size()) marks.above.resize(layer + 1);
    ++marks.above[layer];
  }

  const VoxelGrid& kept_;
  int nz_;
  int row_words_;
  const hal::ScanCloud& scan_;
  const BeamFan& fan_;
  const std::vector<float>& reach_m_;
};

Marks mark_returns(const ReturnMarker& marker, std::uint32_t columns, std::size_t words,
                   int threads) {
  std::vector<Marks> parts(static_cast<std::size_t>(std::max(threads, 1)));
  for (Marks& part : parts) part.bits.resize(words);
  for_pieces(threads, columns, 16, [&](int thread, std::size_t begin, std::size_t end) {
    for (auto column = static_cast<std::uint32_t>(begin); column < end; ++column)
      marker.mark(column, parts[static_cast<std::size_t>(thread)]);
  });
  for (std::size_t i = 1; i < parts.size(); ++i) parts.front().add(parts[i]);
  return std::move(parts.front());
}

}  // namespace

VoxelMap::VoxelMap(const VoxelGrid& grid, int nz_kept)
    : grid_(grid), row_words_((grid.nx + 63) / 64), nz_kept_(std::max(nz_kept, grid.nz)) {
  check(grid);
  check(kept_grid());
  occupied_.resize(row_begin(0, nz_kept_));
  empty_.resize(occupied_.size());
}

VoxelGrid VoxelMap::kept_grid() const {
  VoxelGrid kept = grid_;
  kept.nz = nz_kept_;
  return kept;
}

bool VoxelMap::operator==(const VoxelMap& other) const {
  const auto same = [&](const Bits& a, const Bits& b) {
    return std::equal(a.begin(), a.begin() + static_cast<std::ptrdiff_t>(box_words()), b.begin());
  };
  return grid_.nx == other.grid_.nx && grid_.ny == other.grid_.ny && grid_.nz == other.grid_.nz &&
         same(occupied_, other.occupied_) && same(empty_, other.empty_);
}

VoxelState VoxelMap::at(Voxel v) const {
  if (!grid_.contains(v)) return VoxelState::unseen;
  const std::size_t word = row_begin(v.y, v.z) + static_cast<std::size_t>(v.x >> 6);
  if (occupied_[word] & bit(v.x)) return VoxelState::seen_occupied;
  return empty_[word] & bit(v.x) ? VoxelState::seen_empty : VoxelState::unseen;
}

VoxelCounts VoxelMap::counts() const {
  const std::size_t occupied = count(occupied_, box_words()), empty = count(empty_, box_words());
  return {grid_.size() - occupied - empty, empty, occupied};
}

void VoxelMap::set_run(Voxel v, int count, VoxelState state) {
  if (count < 1) return;
  if (!grid_.contains(v) || count > grid_.nx - v.x)
    throw std::out_of_range("VoxelMap::set_run: voxels outside the box");
  const int end = v.x + count;
  for (int word = v.x >> 6; word <= (end - 1) >> 6; ++word) {
    const std::size_t i = row_begin(v.y, v.z) + static_cast<std::size_t>(word);
    const int before = std::max(v.x - 64 * word, 0);
    const std::uint64_t run = inside(word, end) & (~std::uint64_t{0} << before);
    occupied_[i] &= ~run;
    empty_[i] &= ~run;
    if (state == VoxelState::seen_occupied) occupied_[i] |= run;
    if (state == VoxelState::seen_empty) empty_[i] |= run;
  }
}

void VoxelMap::grow_z(int nz) {
  VoxelGrid grown = grid_;
  grown.nz = nz;
  check(grown);
  if (nz < grid_.nz)
    throw std::invalid_argument("grow_z: " + std::to_string(nz) + " layers are fewer than " +
                                std::to_string(grid_.nz));
  grid_ = grown;
  if (nz <= nz_kept_) return;
  nz_kept_ = nz;
  occupied_.resize(row_begin(0, nz));
  empty_.resize(occupied_.size());
}

InsertReport VoxelMap::insert(const hal::ScanCloud& scan, const Eigen::Isometry3d& T_W_S,
                              const InsertConfig& config) {
  const VoxelGrid kept = kept_grid();
  const BeamFan fan(kept, scan, T_W_S);
  const BeamReach reach = beam_reach(scan, kept, T_W_S, fan, config);
  InsertReport report = reach.counted;

  const ReturnMarker marker(kept, grid_.nz, row_words_, scan, fan, reach.reach_m);
  Marks marks = mark_returns(marker, scan.pattern.columns, occupied_.size(), config.threads);
  report.returns_outside = marks.outside;
  report.layers_needed = grid_.nz + static_cast<int>(marks.above.size());
  report.returns_above = std::move(marks.above);
  const VoxelCounts before = counts();
  for (std::size_t word = 0; word < occupied_.size(); ++word) {
    occupied_[word] |= marks.bits[word];
    empty_[word] &= ~marks.bits[word];
  }
  const VoxelCounts marked = counts();
  report.new_occupied = marked.seen_occupied - before.seen_occupied;
  report.emptied_to_occupied = before.seen_empty - marked.seen_empty;

  carve({kept, scan.pattern, T_W_S, fan, reach.reach_m, config.threads}, config.threads);
  report.new_empty = counts().seen_empty - marked.seen_empty;
  return report;
}

void VoxelMap::carve(const BeamCarver& carver, int threads) {
  const auto rows = static_cast<std::size_t>(grid_.ny) * static_cast<std::size_t>(nz_kept_);
  for_pieces(threads, rows, 32, [&](int, std::size_t begin, std::size_t end) {
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
