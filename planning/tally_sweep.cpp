#include "planning/tally_sweep.hpp"

#include <algorithm>
#include <bit>
#include <cstdlib>
#include <stdexcept>
#include <string>

namespace planning {
namespace {

static_assert(std::endian::native == std::endian::little, "windows are loaded as bytes");

std::uint64_t reverse_bits(std::uint64_t bits) {
  const auto swap = [&](unsigned shift, std::uint64_t mask) {
    bits = ((bits >> shift) & mask) | ((bits & mask) << shift);
  };
  swap(1, 0x5555555555555555);
  swap(2, 0x3333333333333333);
  swap(4, 0x0F0F0F0F0F0F0F0F);
  return __builtin_bswap64(bits);
}

}  // namespace

void require_inside(const VoxelGrid& grid, Voxel v, const char* what) {
  if (!grid.contains(v))
    throw std::invalid_argument(std::string(what) + " (" + std::to_string(v.x) + ", " +
                                std::to_string(v.y) + ", " + std::to_string(v.z) +
                                ") is outside the voxel box");
}

BlockedRows::BlockedRows(const VoxelMap& map) {
  const VoxelGrid& grid = map.grid();
  const auto row_words = static_cast<std::size_t>(map.row_words());
  const auto level_words = row_words * static_cast<std::size_t>(grid.ny);
  row_bytes_ = static_cast<std::int64_t>(row_words * sizeof(std::uint64_t));
  for (auto& words : words_) words.reserve(level_words * static_cast<std::size_t>(grid.nz) + 1);
  for (int z = 0; z < grid.nz; ++z)
    for (int y = 0; y < grid.ny; ++y)
      for (const std::uint64_t empty : map.empty_row(y, z)) words_[0].push_back(~empty);
  // Each block is two of half its size. Levels follow one another, so rows of the next level come
  // in beyond the last row: such blocks are never asked for.
  for (int block = 1; block < kYSizes * kZSizes; ++block) {
    const int l = block % kYSizes, m = block / kYSizes;
    const auto& half = words_[l > 0 ? block - 1 : block - kYSizes];
    const std::size_t distance = l > 0 ? row_words << (l - 1) : level_words << (m - 1);
    auto& words = words_[block];
    words = half;
    for (std::size_t i = 0; i + distance < words.size(); ++i) words[i] |= half[i + distance];
  }
  for (int block = 0; block < kYSizes * kZSizes; ++block) {
    words_[block].push_back(0);  // A window may be loaded past the last word.
    bytes_[block] = reinterpret_cast<const unsigned char*>(words_[block].data());
  }
}

CandidateLayer::CandidateLayer(int z, int row_words, const std::vector<Voxel>& candidates,
                               std::size_t tally_begin)
    : z_(z), tally_end_(tally_begin) {
  words_.push_back(0);
  for (const Voxel p : candidates) {
    if (rows_.empty() || rows_.back().y != p.y) {
      rows_.push_back({p.y, p.x, p.x, tally_end_, words_.size()});
      words_.resize(words_.size() + static_cast<std::size_t>(row_words) + 1);
    }
    Row& row = rows_.back();
    row.x_last = p.x;
    tally_end_ = row.tally_begin + static_cast<std::size_t>(p.x - row.x_first) + 1;
    words_[row.bits_begin + static_cast<std::size_t>(p.x >> 6)] |= std::uint64_t{1} << (p.x & 63);
  }
}

std::size_t CandidateLayer::tally_of(Voxel candidate) const {
  const auto row = std::lower_bound(rows_.begin(), rows_.end(), candidate.y,
                                    [](const Row& r, int y) { return r.y < y; });
  return row->tally_begin + static_cast<std::size_t>(candidate.x - row->x_first);
}

template <class Sink>
void Sweep<Sink>::Live::measure() {
  low = first + std::countr_zero(bits);
  high = first + 63 - std::countl_zero(bits);
}

template <class Sink>
const LayerPaths& Sweep<Sink>::paths(int c) {
  const auto known = std::find_if(paths_.rbegin(), paths_.rend(),
                                  [&](const LayerPaths& paths) { return paths.c() == c; });
  if (known != paths_.rend()) return *known;
  if (paths_.size() == kPathsKept) paths_.erase(paths_.begin());
  return paths_.emplace_back(rule_, c, grid_.ny - 1);
}

template <class Sink>
typename Sweep<Sink>::Rays Sweep<Sink>::rays_to(Voxel u, const CandidateLayer& layer) const {
  const int c = layer.z() - u.z;
  Rays rays{};
  rays.u = u;
  rays.c = std::abs(c);
  rays.row_u = std::int64_t{u.z} * grid_.ny + u.y;
  rays.z_sign = c < 0 ? -1 : 1;
  rays.step_z = rays.z_sign * grid_.ny;
  return rays;
}

template <class Sink>
template <class Visit>
void Sweep<Sink>::for_rows(Rays rays, std::size_t us, const CandidateLayer& layer, Interval rows,
                           const Visit& visit) {
  const LayerPaths& paths = this->paths(rays.c);
  const int y = rays.u.y;
  rows.first = std::max(rows.first, y - paths.rows() + 1);
  rows.last = std::min(rows.last, y + paths.rows() - 1);
  const auto first = std::lower_bound(layer.rows().begin(), layer.rows().end(), rows.first,
                                      [](const Row& r, int at) { return r.y < at; });
  for (auto row = first; row != layer.rows().end() && row->y <= rows.last; ++row) {
    const int y_sign = row->y < y ? -1 : 1;
    if (row == first || y_sign != rays.y_sign) last_.assign(2 * us, {});
    rays.y_sign = y_sign;
    rays.step_y = y_sign;
    rays.b = std::abs(row->y - y);
    rays.path = paths.path(rays.b);
    rays.limits = &paths.limits(rays.b);
    visit(rays, *row);
  }
}

template <class Sink>
void Sweep<Sink>::add(const BoundaryVoxel* begin, const BoundaryVoxel* end,
                      const CandidateLayer& layer) {
  if (begin == end) return;
  constexpr Interval kAll[2];
  const auto us = static_cast<std::size_t>(end - begin);
  for_rows(rays_to(begin->v, layer), us, layer, {}, [&](Rays& rays, const Row& row) {
    LastRuns* last = last_.data();
    for (const BoundaryVoxel* u = begin; u != end; ++u, last += 2) {
      rays.u.x = u->v.x;
      add_row(rays, *u, layer, row, kAll, last);
    }
  });
}

template <class Sink>
void Sweep<Sink>::add_behind(const BoundaryVoxel& u, const CandidateLayer& layer,
                             const std::vector<Opening>& openings) {
  Interval rows{INT32_MAX, -1};
  for (const Opening& opening : openings)
    if (!opening.rows.empty())
      rows = {std::min(rows.first, opening.rows.first), std::max(rows.last, opening.rows.last)};
  if (rows.empty()) return;
  for_rows(rays_to(u.v, layer), 1, layer, rows, [&](const Rays& rays, const Row& row) {
    Interval within[2]{{INT32_MAX, -1}, {INT32_MAX, -1}};  // |a|, of the plus and the minus side.
    for (const Opening& opening : openings) {
      if (row.y < opening.rows.first || row.y > opening.rows.last) continue;
      const int j = (opening.y - u.v.y) * rays.y_sign, k = (opening.z - u.v.z) * rays.z_sign;
      const PathTimes* const times = j < 0 || k < 0 ? nullptr : rays.path.times_in(j, k);
      if (times == nullptr) continue;
      const auto widen = [&](Interval& side, int r0, int r1) {
        if (r1 < 0) return;
        side = {std::min(side.first, times->shadow_first(r0)),
                std::max(side.last, times->shadow_last(r1))};
      };
      widen(within[0], opening.x_first - u.v.x, opening.x_last - u.v.x);
      widen(within[1], u.v.x - opening.x_last, u.v.x - opening.x_first);
    }
    add_row(rays, u, layer, row, within, last_.data());
  });
}

// The candidates of one row that are within, in |a| on either side.
template <class Sink>
void Sweep<Sink>::add_row(const Rays& rays, const BoundaryVoxel& u, const CandidateLayer& layer,
                          const Row& row, const Interval within[2], LastRuns last[2]) {
  const RowLimits& limits = *rays.limits;
  const Face y_face = rays.y_sign > 0 ? kFaceYPlus : kFaceYMinus;
  const Face z_face = rays.z_sign > 0 ? kFaceZPlus : kFaceZMinus;
  const int faced_last = std::max(rays.b != 0 && (u.faces & y_face) != 0 ? limits.y_face_last : -1,
                                  rays.c != 0 && (u.faces & z_face) != 0 ? limits.z_face_last : -1);
  const auto admit = [&](Face x_face) {
    const int from = std::max(limits.in_range_first, limits.x_face_first);
    return Admitted{
        {limits.in_range_first, from},
        {std::min(faced_last, limits.in_range_last),
         (u.faces & x_face) != 0 ? std::min(limits.x_face_last, limits.in_range_last) : -1}};
  };
  add_side<1>(rays, layer, row, admit(kFaceXPlus), within[0], last[0]);
  add_side<-1>(rays, layer, row, admit(kFaceXMinus), within[1], last[1]);
}

template <class Sink>
template <int kSide>
void Sweep<Sink>::add_side(const Rays& rays, const CandidateLayer& layer, const Row& row,
                           const Admitted& admitted, Interval within, LastRuns& last_runs) {
  // In |a|, from the first to the last admitted candidate of the row; a = 0 is on the plus side.
  int first = INT32_MAX, last = -1;
  for (int i = 0; i < 2; ++i)
    if (admitted.first[i] <= admitted.last[i]) {
      first = std::min(first, admitted.first[i]);
      last = std::max(last, admitted.last[i]);
    }
  const int nearest = kSide > 0 ? row.x_first - rays.u.x : rays.u.x - row.x_last;
  const int farthest = kSide > 0 ? row.x_last - rays.u.x : rays.u.x - row.x_first;
  first = std::max({first, nearest, within.first, kSide > 0 ? 0 : 1});
  last = std::min({last, farthest, within.last});
  if (first > last) return;
  const Known known = known_shadows<kSide>(rays, {first, last}, last_runs);
  first = known.open.first;
  last = known.open.last;

  const auto candidates = [&](int a) {
    std::uint64_t bits;
    if constexpr (kSide > 0) {
      bits = layer.bits(row, rays.u.x + a);
    } else {
      bits = reverse_bits(layer.bits(row, rays.u.x - a - 63));
    }
    bits &= (bits_within(a, admitted.first[0], admitted.last[0]) |
             bits_within(a, admitted.first[1], admitted.last[1])) &
            bits_within(a, first, last);
    for (int i = 0; i < known.count; ++i)
      bits &= ~bits_within(a, known.inner[i].first, known.inner[i].last);
    return bits;
  };
  while (first <= last) {
    std::uint64_t bits = candidates(first);
    if (bits != 0) {
      const int skip = std::countr_zero(bits);
      if (skip != 0) bits = candidates(first += skip);
      Live live{bits, first, 0, 0};
      cast<kSide>(rays, last_runs, live);
      if (live.bits != 0) {
        if constexpr (kSide > 0) {
          sink_.seen(layer, row, rays.u.x + first, live.bits);
        } else {
          sink_.seen(layer, row, rays.u.x - first - 63, reverse_bits(live.bits));
        }
      }
    }
    first += 64;
  }
}

// Clears the candidates that something hides, from u outwards.
template <class Sink>
template <int kSide>
void Sweep<Sink>::cast(const Rays& rays, LastRuns& last_runs, Live& live) {
  live.measure();
  shade<kSide>(rays, 0, last_runs, live);
  int l = 1;
  for (int i = 1; i < rays.path.count && live.bits != 0;) {
    const PathCell& cell = rays.path.cells[i];
    while ((1 << l) > cell.within[2]) --l;
    // The next 2^l cells lie in 2^l rows of 2^m levels, of which a block names the lowest.
    const int cells = 1 << l, m = (cells > cell.within[0]) + (cells > cell.within[1]);
    const PathCell& end = rays.path.cells[i + cells - 1];
    const int j = rays.y_sign > 0 ? cell.j : end.j, k = rays.z_sign > 0 ? cell.k : end.k;
    const std::int64_t row = rays.row_u + j * rays.step_y + k * rays.step_z;
    const int first =
        static_cast<int>((static_cast<std::uint32_t>(live.low) * cell.in + 0x8000U) >> 16);
    const int last =
        static_cast<int>((static_cast<std::uint32_t>(live.high) * end.out + 0x8000U) >> 16);
    if (clear_window<kSide>(rays, m * BlockedRows::kYSizes + l, row, first, last)) {
      i += cells;
      l = std::min(l + 1, BlockedRows::kYSizes - 1);
    } else if (l > 0) {
      l /= 4;
    } else {
      shade<kSide>(rays, i, last_runs, live);
      ++i;
    }
  }
}

// Bits of voxels first .. first + width - 1 from u, in the direction of a for the plus side and
// reversed for the minus side.
template <class Sink>
template <int kSide>
std::uint64_t Sweep<Sink>::window(const Rays& rays, int block, std::int64_t row, int first,
                                  int width) const {
  const int x = kSide > 0 ? rays.u.x + first : rays.u.x - first - width + 1;
  return blocked_.window(block, row, x, width);
}

template <class Sink>
template <int kSide>
bool Sweep<Sink>::clear_window(const Rays& rays, int block, std::int64_t row, int first,
                               int last) const {
  for (; last - first >= BlockedRows::kWindow; first += BlockedRows::kWindow)
    if (window<kSide>(rays, block, row, first, BlockedRows::kWindow) != 0) return false;
  return window<kSide>(rays, block, row, first, last - first + 1) == 0;
}

// Clears what the blocked voxels of one cell shadow. u itself does not block.
template <class Sink>
template <int kSide>
void Sweep<Sink>::shade(const Rays& rays, int cell, LastRuns& last_runs, Live& live) {
  const PathCell& c = rays.path.cells[cell];
  const PathTimes& times = rays.path.times[cell];
  const std::int64_t row = rays.row_u + c.j * rays.step_y + c.k * rays.step_z;
  int first = static_cast<int>((static_cast<std::uint32_t>(live.low) * c.in + 0x8000U) >> 16);
  const int last =
      static_cast<int>((static_cast<std::uint32_t>(live.high) * c.out + 0x8000U) >> 16);
  if (cell == 0) first = 1;
  for (; first <= last && live.bits != 0; first += BlockedRows::kWindow) {
    const int width = std::min(last - first + 1, BlockedRows::kWindow);
    std::uint64_t blocked = window<kSide>(rays, 0, row, first, width);
    while (blocked != 0) {
      const int begin = std::countr_zero(blocked);
      const int length = std::countr_one(blocked >> begin);
      blocked &= ~(ones(length) << begin);
      const int r0 = kSide > 0 ? first + begin : first + width - begin - length;
      Run run{c.j, c.k, r0, r0 + length - 1};
      if (begin == 0 || begin + length == width) extend<kSide>(rays, row, run);
      hide<kSide>(rays, run, times, last_runs, live);
    }
  }
  if (live.bits != 0) live.measure();
}

// Takes in what is blocked beyond both ends: the window shows of a wall only what matters here, but
// the next row needs a little more.
template <class Sink>
template <int kSide>
void Sweep<Sink>::extend(const Rays& rays, std::int64_t row, Run& run) const {
  // In x, so that right is upwards; u itself stays out.
  const int limit = kSide > 0 ? grid_.nx - 1 - rays.u.x : rays.u.x;
  const int outer = std::min(limit - run.r1, BlockedRows::kWindow);
  const int inner = std::min(run.r0 - 1, BlockedRows::kWindow);
  const auto blocked = [&](int first, int width, bool upwards) {
    const std::uint64_t bits = window<kSide>(rays, 0, row, first, width);
    return upwards ? std::countr_one(bits) : std::countl_one(bits << (64 - width));
  };
  if (outer > 0) run.r1 += blocked(run.r1 + 1, outer, kSide > 0);
  if (inner > 0) run.r0 -= blocked(run.r0 - inner, inner, kSide < 0);
}

// Clears what one run shadows, and keeps it in mind if that was anything.
template <class Sink>
template <int kSide>
void Sweep<Sink>::hide(const Rays& rays, const Run& run, const PathTimes& times,
                       LastRuns& last_runs, Live& live) {
  const std::uint64_t shadow =
      bits_within(live.first, times.shadow_first(run.r0), times.shadow_last(run.r1));
  if ((live.bits & shadow) == 0) return;
  live.bits &= ~shadow;
  if (last_runs.count < LastRuns::kMost) last_runs.runs[last_runs.count++] = run;
  name<kSide>(rays, run);
}

// What the runs that hid candidates of the row before hide of this one, forgetting the others.
template <class Sink>
template <int kSide>
typename Sweep<Sink>::Known Sweep<Sink>::known_shadows(const Rays& rays, Interval span,
                                                       LastRuns& last_runs) {
  Known known{.open = span, .inner = {}, .count = 0};
  Interval& open = known.open;
  const int before = last_runs.count;
  last_runs.count = 0;
  for (int i = 0; i < before && !open.empty(); ++i) {
    const Run run = last_runs.runs[i];
    const PathTimes* const times = rays.path.times_in(run.j, run.k);
    if (times == nullptr) continue;
    const int first = times->shadow_first(run.r0), last = times->shadow_last(run.r1);
    if (first > open.last || last < open.first) continue;
    last_runs.runs[last_runs.count++] = run;
    name<kSide>(rays, run);
    if (first <= open.first) {
      open.first = std::min(last, open.last) + 1;
    } else if (last >= open.last) {
      open.last = first - 1;
    } else {
      known.inner[known.count++] = {first, last};
    }
  }
  return known;
}

template <class Sink>
template <int kSide>
void Sweep<Sink>::name(const Rays& rays, const Run& run) {
  sink_.hidden(rays.row_u + run.j * rays.step_y + run.k * rays.step_z,
               kSide > 0 ? rays.u.x + run.r0 : rays.u.x - run.r1, run.r1 - run.r0 + 1);
}

void SeenCounts::seen(const CandidateLayer&, const CandidateLayer::Row& row, int x,
                      std::uint64_t bits) {
  // May begin before the row: only the sums are indices.
  const std::int64_t zero = static_cast<std::int64_t>(row.tally_begin) + x - row.x_first;
  for (; bits != 0; bits &= bits - 1)
    ++tallies[static_cast<std::size_t>(zero + std::countr_zero(bits))];
}

void SeenSet::seen(const CandidateLayer&, const CandidateLayer::Row& row, int x,
                   std::uint64_t bits) {
  // x may be negative, but no bit is set there.
  const int shift = x & 63;
  const std::int64_t word = word_begin + row.y * row_words_ + (x >> 6);
  if (const std::uint64_t low = bits << shift; low != 0)
    words.push_back({static_cast<std::uint32_t>(word), low});
  if (const std::uint64_t high = shift == 0 ? 0 : bits >> (64 - shift); high != 0)
    words.push_back({static_cast<std::uint32_t>(word + 1), high});
}

void SeenSet::hidden(std::int64_t row, int x, int width) {
  const std::int64_t bytes = row * row_words_ * 8;
  for (int byte = x >> 3; byte <= (x + width - 1) >> 3; ++byte)
    name(static_cast<std::uint32_t>(bytes + byte));
}

void SeenSet::name(std::uint32_t byte) {
  const std::uint64_t bit = std::uint64_t{1} << (byte & 63);
  if ((named_[byte >> 6] & bit) != 0) return;
  named_[byte >> 6] |= bit;
  hidden_by.push_back(byte);
}

void SeenSet::restart(const std::vector<std::uint32_t>& known_to_hide) {
  words.clear();
  for (const std::uint32_t byte : hidden_by) named_[byte >> 6] = 0;
  hidden_by.clear();
  for (const std::uint32_t byte : known_to_hide) name(byte);
}

template class Sweep<SeenCounts>;
template class Sweep<SeenSet>;
template class Sweep<AnySeen>;

}  // namespace planning
