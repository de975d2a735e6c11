#include "planning/running_tally.hpp"

#include <algorithm>
#include <bit>
#include <cstring>
#include <numeric>
#include <stdexcept>

#include "planning/voxel_parallel.hpp"

namespace planning {
namespace {

// By z, then y, then x; for voxels of a box, which has at most 2^17 along each axis.
std::uint64_t place(const Voxel& v) {
  return static_cast<std::uint64_t>(v.z) << 40 | static_cast<std::uint64_t>(v.y) << 20 |
         static_cast<std::uint64_t>(v.x);
}

bool by_place(const Voxel& a, const Voxel& b) {
  return place(a) < place(b);
}

bool same_box(const VoxelGrid& a, const VoxelGrid& b) {
  return a.nx == b.nx && a.ny == b.ny && a.nz == b.nz && a.voxel_m == b.voxel_m;
}

// Calls change(word, added bits, removed bits) where two ascending lists differ.
template <class Change>
void compare(const std::vector<SeenWord>& before, const std::vector<SeenWord>& after,
             const Change& change) {
  auto b = before.begin();
  auto a = after.begin();
  while (b != before.end() || a != after.end()) {
    const bool use_b = b != before.end() && (a == after.end() || b->word <= a->word);
    const bool use_a = a != after.end() && (b == before.end() || a->word <= b->word);
    const std::uint32_t word = use_b ? b->word : a->word;
    const std::uint64_t old_bits = use_b ? b->bits : 0, new_bits = use_a ? a->bits : 0;
    if (old_bits != new_bits) change(word, new_bits & ~old_bits, old_bits & ~new_bits);
    b += use_b;
    a += use_a;
  }
}

void add_to(std::vector<std::uint32_t>& counts, std::size_t word, std::uint64_t bits,
            std::uint32_t summand) {
  for (; bits != 0; bits &= bits - 1)
    counts[64 * word + static_cast<std::size_t>(std::countr_zero(bits))] += summand;
}

// Ascending, each word once.
void normalize(std::vector<SeenWord>& words) {
  std::sort(words.begin(), words.end(),
            [](const SeenWord& a, const SeenWord& b) { return a.word < b.word; });
  std::size_t kept = 0;
  for (const SeenWord& word : words) {
    if (kept > 0 && words[kept - 1].word == word.word) {
      words[kept - 1].bits |= word.bits;
    } else {
      words[kept++] = word;
    }
  }
  words.resize(kept);
}

}  // namespace

RunningTally::Options RunningTally::default_options() {
  Options options;
#ifndef NDEBUG
  options.self_check = true;
#endif
  return options;
}

RunningTally::RunningTally(const ViewLimits& limits, int threads)
    : RunningTally(limits, threads, default_options()) {}

RunningTally::RunningTally(const ViewLimits& limits, int threads, const Options& options)
    : limits_(limits), threads_(std::max(threads, 1)), options_(options) {}

const std::vector<std::uint32_t>& RunningTally::update(const VoxelMap& map,
                                                       const std::vector<BoundaryVoxel>& boundary,
                                                       const std::vector<Voxel>& candidates) {
  const VoxelGrid& grid = map.grid();
  for (const BoundaryVoxel& u : boundary) require_inside(grid, u.v, "boundary voxel");
  for (const Voxel p : candidates) require_inside(grid, p, "candidate");
  rule_.emplace(limits_, grid.voxel_m);
  if (map_ && !same_box(map_->grid(), grid)) forget();
  const bool whole = work_.whole;
  work_ = {};
  const Changes changes = note_changes(map);
  boundary_ = boundary;
  if (!whole) {
    note_candidates(candidates);
    note_boundary(boundary);
    refresh(changes);
    work_.bytes = bytes();
    result_ = answer(candidates);
  }
  if (whole || work_.bytes > options_.memory_max_bytes) {
    forget();
    map_ = map;
    work_ = {.whole = true};
    result_ = tally(map, boundary, candidates, limits_, threads_);
  }
  if (options_.self_check && result_ != tally(map, boundary, candidates, limits_, threads_))
    throw std::logic_error("running tally: differs from the whole tally");
  return result_;
}

std::vector<std::uint32_t> RunningTally::visible(Voxel p) const {
  if (!map_) throw std::invalid_argument("running tally: asked before the first update");
  const Layer* layer = layer_of(p.z);
  if (layer == nullptr || map_->at(p) != VoxelState::seen_empty ||
      (layer->known[word_of(*layer, p) - layer->word_begin] >> (p.x & 63) & 1) == 0)
    return visible_from(*map_, boundary_, p, limits_);
  const auto wanted = static_cast<std::uint32_t>(word_of(*layer, p));
  std::vector<std::uint32_t> result;
  for (std::size_t i = 0; i < sights_.size(); ++i) {
    const Sight& sight = sights_[i];
    if (sight.words.empty() || !rule_->admits(sight.u, p)) continue;
    const auto word =
        std::lower_bound(sight.words.begin(), sight.words.end(), wanted,
                         [](const SeenWord& w, std::uint32_t k) { return w.word < k; });
    if (word != sight.words.end() && word->word == wanted && (word->bits >> (p.x & 63) & 1) != 0)
      result.push_back(order_[i]);
  }
  std::sort(result.begin(), result.end());
  return result;
}

void RunningTally::forget() {
  map_.reset();
  sights_ = {};
  layers_ = {};
  counts_ = {};
  order_ = {};
}

RunningTally::Changes RunningTally::note_changes(const VoxelMap& map) {
  const VoxelGrid& grid = map.grid();
  Changes changes;
  changes.emptied.resize(static_cast<std::size_t>(map.row_words()) * 8 *
                         static_cast<std::size_t>(grid.ny) * static_cast<std::size_t>(grid.nz));
  std::size_t byte = 0;
  changes.filled_rows.assign(
      static_cast<std::size_t>(grid.ny) * static_cast<std::size_t>(grid.nz) + 1, 0);
  std::size_t row = 0;
  for (int z = 0; map_ && z < grid.nz; ++z)
    for (int y = 0; y < grid.ny; ++y) {
      const auto before = map_->empty_row(y, z), after = map.empty_row(y, z);
      for (std::size_t i = 0; i < after.size(); ++i, byte += 8) {
        const std::uint64_t emptied = after[i] & ~before[i];
        if (emptied != 0) std::memcpy(&changes.emptied[byte], &emptied, sizeof emptied);
        for (std::uint64_t filled = before[i] & ~after[i]; filled != 0; filled &= filled - 1)
          changes.filled.push_back({static_cast<int>(64 * i) + std::countr_zero(filled), y, z});
      }
      changes.filled_rows[++row] = static_cast<std::uint32_t>(changes.filled.size());
    }
  map_ = map;
  return changes;
}

void RunningTally::note_candidates(const std::vector<Voxel>& candidates) {
  for (Layer& layer : layers_) layer.fresh.clear();
  for (const Voxel p : candidates) {
    Layer* layer = layer_of(p.z);
    if (layer == nullptr) {
      layer = &layers_.emplace_back();
      layer->z = p.z;
      layer->word_begin = (layers_.size() - 1) * layer_words();
      layer->known.resize(layer_words());
    }
    std::uint64_t& known = layer->known[word_of(*layer, p) - layer->word_begin];
    const std::uint64_t bit = std::uint64_t{1} << (p.x & 63);
    if ((known & bit) != 0) continue;
    known |= bit;
    layer->fresh.push_back(p);
  }
  counts_.resize(64 * layers_.size() * layer_words());
  const int row_words = map_->row_words();
  for (Layer& layer : layers_) {
    if (layer.fresh.empty()) continue;
    std::sort(layer.fresh.begin(), layer.fresh.end(), by_place);
    layer.new_ones.emplace(layer.z, row_words, layer.fresh, 0);
    std::vector<Voxel> all;
    for (std::size_t word = 0; word < layer.known.size(); ++word) {
      const int y = static_cast<int>(word) / row_words,
                x = 64 * (static_cast<int>(word) % row_words);
      for (std::uint64_t bits = layer.known[word]; bits != 0; bits &= bits - 1)
        all.push_back({x + std::countr_zero(bits), y, layer.z});
    }
    layer.all.emplace(layer.z, row_words, all, 0);
  }
}

void RunningTally::note_boundary(const std::vector<BoundaryVoxel>& boundary) {
  order_.resize(boundary.size());
  std::iota(order_.begin(), order_.end(), 0U);
  const auto before = [&](std::uint32_t i, std::uint32_t k) {
    return by_place(boundary[i].v, boundary[k].v);
  };
  if (!std::is_sorted(order_.begin(), order_.end(), before))
    std::stable_sort(order_.begin(), order_.end(), before);
  std::vector<Sight> sights;
  sights.reserve(boundary.size());
  auto old = sights_.begin();
  const auto subtract = [&] {
    for (const SeenWord& word : old->words) add_to(counts_, word.word, word.bits, ~0U);
    ++old;
  };
  for (const std::uint32_t i : order_) {
    const BoundaryVoxel& u = boundary[i];
    while (old != sights_.end() && by_place(old->u.v, u.v)) subtract();
    if (old != sights_.end() && old->u.v == u.v) {
      old->swept = old->u.faces == u.faces;
      sights.push_back(std::move(*old++));
      sights.back().u = u;
    } else {
      sights.push_back({.u = u, .swept = false, .words = {}, .hidden_by = {}});
    }
  }
  while (old != sights_.end()) subtract();
  sights_ = std::move(sights);
}

void RunningTally::refresh(const Changes& changes) {
  const VoxelGrid& grid = map_->grid();
  const BlockedRows blocked(*map_);
  const std::size_t rows = static_cast<std::size_t>(grid.ny) * static_cast<std::size_t>(grid.nz);
  std::vector<Worker> workers;
  for (int i = 0; i < threads_; ++i)
    workers.push_back({.sweep = {grid, blocked, *rule_, SeenSet(map_->row_words(), rows)},
                       .gains = std::vector<std::uint32_t>(counts_.size()),
                       .before = {},
                       .saved = false,
                       .openings = {}});
  constexpr std::size_t kPiece = 128;
  for_pieces(threads_, sights_.size(), kPiece, [&](int thread, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      refresh(sights_[i], changes, workers[static_cast<std::size_t>(thread)]);
  });
  for (const Worker& worker : workers) {
    for (std::size_t i = 0; i < counts_.size(); ++i) counts_[i] += worker.gains[i];
    work_.swept += worker.swept;
    work_.partly_swept += worker.partly_swept;
  }
  work_.kept = sights_.size() - work_.swept - work_.partly_swept;
}

void RunningTally::refresh(Sight& sight, const Changes& changes, Worker& worker) const {
  worker.saved = false;  // Most sights stay as they are and need no copy.
  worker.openings.clear();
  if (sight.swept) {
    uncover(sight, changes, worker.openings);
    if (!sight.words.empty() && !changes.filled.empty()) shade(sight, changes, worker);
  } else {
    worker.save(sight.words);
    sight.words.clear();
    sight.hidden_by.clear();
  }
  worker.swept += !sight.swept;
  worker.partly_swept += !worker.openings.empty();
  sweep(sight, worker);
  sight.swept = true;
  if (!worker.saved) return;
  compare(worker.before, sight.words,
          [&](std::size_t word, std::uint64_t added, std::uint64_t removed) {
            add_to(worker.gains, word, added, 1);
            add_to(worker.gains, word, removed, ~0U);
          });
}

// Sweeps for everybody, or for whom the openings hid and for the new candidates.
void RunningTally::sweep(Sight& sight, Worker& worker) const {
  const auto is_fresh = [](const Layer& layer) { return !layer.fresh.empty(); };
  if (sight.swept && worker.openings.empty() &&
      std::none_of(layers_.begin(), layers_.end(), is_fresh))
    return;
  worker.save(sight.words);
  SeenSet& found = worker.sweep.sink();
  found.restart(sight.hidden_by);
  for (const Layer& layer : layers_) {
    found.word_begin = static_cast<std::int64_t>(layer.word_begin);
    if (!sight.swept) {
      worker.sweep.add(sight.u, *layer.all);
      continue;
    }
    if (!worker.openings.empty()) {
      for (Opening& opening : worker.openings)
        opening.rows = rows_behind(sight.u.v, {0, opening.y, opening.z}, layer.z);
      worker.sweep.add_behind(sight.u, *layer.all, worker.openings);
    }
    if (is_fresh(layer)) worker.sweep.add(sight.u, *layer.new_ones);
  }
  sight.words.insert(sight.words.end(), found.words.begin(), found.words.end());
  normalize(sight.words);
  sight.hidden_by.assign(found.hidden_by.begin(), found.hidden_by.end());
}

// What hid sight.u and does so no more. Who sees it already goes on to see it.
void RunningTally::uncover(Sight& sight, const Changes& changes,
                           std::vector<Opening>& openings) const {
  const int ny = map_->grid().ny, row_bytes = 8 * map_->row_words();
  std::erase_if(sight.hidden_by, [&](std::uint32_t byte) {
    const unsigned emptied = changes.emptied[byte];
    if (emptied == 0) return false;
    const int in_row = static_cast<int>(byte) % row_bytes, row = static_cast<int>(byte) / row_bytes;
    openings.push_back({.y = row % ny,
                        .z = row / ny,
                        .x_first = 8 * in_row + std::countr_zero(emptied),
                        .x_last = 8 * in_row + 31 - std::countl_zero(emptied),
                        .rows = {}});
    const std::uint64_t word = map_->empty_row(row % ny, row / ny)[in_row / 8];
    return (word >> (8 * (in_row % 8)) & 0xFF) == 0xFF;  // Else a part of it may still hide some.
  });
}

// The box around the candidates of the layer that see the boundary voxel.
RunningTally::Box RunningTally::box_of(const Sight& sight, const Layer& layer) const {
  const auto row_words = static_cast<std::size_t>(map_->row_words());
  Box box{.x = {INT32_MAX, -1}, .y = {INT32_MAX, -1}};
  for (const SeenWord& word : sight.words) {
    if (word.word < layer.word_begin || word.word >= layer.word_begin + layer_words()) continue;
    const std::size_t in_layer = word.word - layer.word_begin;
    const int y = static_cast<int>(in_layer / row_words);
    const int x = 64 * static_cast<int>(in_layer % row_words);
    box.y = {std::min(box.y.first, y), std::max(box.y.last, y)};
    box.x = {std::min(box.x.first, x + std::countr_zero(word.bits)),
             std::max(box.x.last, x + 63 - std::countl_zero(word.bits))};
  }
  return box;
}

// Takes the shadows of what became blocked out of the words.
void RunningTally::shade(Sight& sight, const Changes& changes, Worker& worker) const {
  const Voxel u = sight.u.v;
  const int ny = map_->grid().ny;
  for (const Layer& layer : layers_) {
    const Box box = box_of(sight, layer);
    const int c = std::abs(layer.z - u.z), step = layer.z < u.z ? -1 : 1;
    for (int k = 0; k <= c && !box.y.empty(); ++k) {
      const Interval x = crossing(u.x, box.x, c, k), y = crossing(u.y, box.y, c, k);
      const auto row = [&](int at) {
        return changes.filled_rows[static_cast<std::size_t>((u.z + k * step) * ny + at)];
      };
      const std::uint32_t end = row(std::min(y.last, ny - 1) + 1);
      for (std::uint32_t i = row(std::max(y.first, 0)); i < end; ++i)
        if (changes.filled[i].x >= x.first && changes.filled[i].x <= x.last)
          shade(sight, layer, changes.filled[i], worker);
    }
  }
}

void RunningTally::shade(Sight& sight, const Layer& layer, Voxel filled, Worker& worker) const {
  const Voxel u = sight.u.v;
  const Interval rows = rows_behind(u, filled, layer.z);
  if (rows.empty() || filled == u) return;
  const std::size_t row_words = static_cast<std::size_t>(map_->row_words());
  const auto row_word = [&](int y) {
    return static_cast<std::uint32_t>(layer.word_begin + static_cast<std::size_t>(y) * row_words);
  };
  const auto ascending = [](const SeenWord& word, std::uint32_t i) { return word.word < i; };
  const auto begin = std::lower_bound(sight.words.begin(), sight.words.end(),
                                      row_word(std::max(rows.first, 0)), ascending);
  const auto end = std::lower_bound(
      begin, sight.words.end(), row_word(std::min(rows.last, map_->grid().ny - 1) + 1), ascending);
  bool hides = false;
  for (auto word = begin; word != end; ++word) {
    const std::size_t in_layer = word->word - layer.word_begin;
    const int y = static_cast<int>(in_layer / row_words);
    const int x = 64 * static_cast<int>(in_layer % row_words);
    const std::uint64_t shadow = shadow_of(u, filled, {x, y, layer.z}) & word->bits;
    if (shadow == 0) continue;
    hides = true;
    worker.save(sight.words);
    word->bits &= ~shadow;
  }
  if (!hides) return;
  std::erase_if(sight.words, [](const SeenWord& word) { return word.bits == 0; });
  const auto byte = static_cast<std::uint32_t>(
      (static_cast<std::size_t>(filled.z) * static_cast<std::size_t>(map_->grid().ny) +
       static_cast<std::size_t>(filled.y)) *
          8 * row_words +
      static_cast<std::size_t>(filled.x >> 3));
  if (std::find(sight.hidden_by.begin(), sight.hidden_by.end(), byte) == sight.hidden_by.end())
    sight.hidden_by.push_back(byte);
}

std::vector<std::uint32_t> RunningTally::answer(const std::vector<Voxel>& candidates) const {
  std::vector<std::uint32_t> result(candidates.size());
  for_pieces(threads_, candidates.size(), 256, [&](int, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Voxel p = candidates[i];
      result[i] =
          map_->at(p) == VoxelState::seen_empty
              ? counts_[64 * word_of(*layer_of(p.z), p) + static_cast<std::size_t>(p.x & 63)]
              : static_cast<std::uint32_t>(visible(p).size());
    }
  });
  return result;
}

std::size_t RunningTally::bytes() const {
  std::size_t sum = sights_.capacity() * sizeof(Sight) + counts_.size() * sizeof(std::uint32_t);
  for (const Sight& sight : sights_)
    sum += sight.words.capacity() * sizeof(SeenWord) +
           sight.hidden_by.capacity() * sizeof(std::uint32_t);
  return sum;
}

RunningTally::Layer* RunningTally::layer_of(int z) {
  const auto layer =
      std::find_if(layers_.begin(), layers_.end(), [z](const Layer& l) { return l.z == z; });
  return layer == layers_.end() ? nullptr : &*layer;
}

const RunningTally::Layer* RunningTally::layer_of(int z) const {
  const auto layer =
      std::find_if(layers_.begin(), layers_.end(), [z](const Layer& l) { return l.z == z; });
  return layer == layers_.end() ? nullptr : &*layer;
}

std::size_t RunningTally::layer_words() const {
  return static_cast<std::size_t>(map_->row_words()) * static_cast<std::size_t>(map_->grid().ny);
}

std::size_t RunningTally::word_of(const Layer& layer, Voxel p) const {
  return layer.word_begin +
         static_cast<std::size_t>(p.y) * static_cast<std::size_t>(map_->row_words()) +
         static_cast<std::size_t>(p.x >> 6);
}

}  // namespace planning
