// The row-interval sweep: Counts(p) for all candidates at once, exactly. See tally_paths.hpp.
#pragma once

#include <cstdint>
#include <cstring>
#include <utility>
#include <vector>

#include "planning/next_best_view.hpp"
#include "planning/tally_paths.hpp"

namespace planning {

// Throws std::invalid_argument that names what.
void require_inside(const VoxelGrid& grid, Voxel v, const char* what);

// What blocks the view (not seen-empty), one bit per voxel, and the same for blocks of rows or-ed
// together: of block (l, m), row (y, z) is blocked where any of rows y .. y + 2^l - 1 of any of
// levels z .. z + 2^m - 1 is.
class BlockedRows {
 public:
  static constexpr int kYSizes = 5, kZSizes = 3;
  static constexpr int kWindow = 57;  // The widest window() that one load can give.

  explicit BlockedRows(const VoxelMap& map);

  // Bits x .. x + width - 1 of row `row` (z ny + y) of block m * kYSizes + l, 1 <= width <=
  // kWindow, 0 <= x.
  std::uint64_t window(int block, std::int64_t row, int x, int width) const {
    std::uint64_t bits;
    std::memcpy(&bits, bytes_[block] + row * row_bytes_ + (x >> 3), sizeof bits);
    return (bits >> (x & 7)) & ((std::uint64_t{1} << width) - 1);
  }

 private:
  std::int64_t row_bytes_;
  std::vector<std::uint64_t> words_[kYSizes * kZSizes];
  const unsigned char* bytes_[kYSizes * kZSizes];
};

// The seen-empty candidates of one layer as rows of bits, and where their tallies are kept.
class CandidateLayer {
 public:
  struct Row {
    int y{};
    int x_first{}, x_last{-1};
    std::size_t tally_begin{};  // Of x_first.
    std::size_t bits_begin{};   // Of the word of x = 0; a word of 0 lies before and behind.
  };

  // candidates: of this z, ordered by y, then x, without repetition. tally_begin: of the layer.
  CandidateLayer(int z, int row_words, const std::vector<Voxel>& candidates,
                 std::size_t tally_begin);

  int z() const { return z_; }
  const std::vector<Row>& rows() const { return rows_; }
  std::size_t tally_end() const { return tally_end_; }
  std::size_t tally_of(Voxel candidate) const;

  // 64 candidates from x on, -64 <= x.
  std::uint64_t bits(const Row& row, int x) const {
    const std::size_t bit = 64 * (row.bits_begin - 1) + static_cast<std::size_t>(x + 64);
    const unsigned shift = bit & 63;
    const std::uint64_t low = words_[bit >> 6] >> shift;
    return shift == 0 ? low : low | (words_[(bit >> 6) + 1] << (64 - shift));
  }

 private:
  int z_;
  std::vector<Row> rows_;
  std::vector<std::uint64_t> words_;
  std::size_t tally_end_;
};

// Voxels x_first .. x_last of row y of level z that block no more.
struct Opening {
  int y{}, z{};
  int x_first{}, x_last{};
  Interval rows;  // Of the candidates' layer: where they can have hidden anyone.
};

// One thread's sweep. What it finds goes to a sink with
//     void seen(const CandidateLayer&, const CandidateLayer::Row&, int x, std::uint64_t bits)
// bit i: the candidate at x + i sees the boundary voxel; each candidate comes at most once;
//     void hidden(std::int64_t row, int x, int width)
// blocked voxels x .. x + width - 1 of a row of BlockedRows hide a candidate. As long as all that
// were named stay blocked, no other candidate comes to see the boundary voxel.
template <class Sink>
class Sweep {
 public:
  // Refers to grid and blocked.
  Sweep(const VoxelGrid& grid, const BlockedRows& blocked, const ViewRule& rule, Sink sink)
      : grid_(grid), blocked_(blocked), rule_(rule), sink_(std::move(sink)) {}

  void add(const BoundaryVoxel& u, const CandidateLayer& layer) { add(&u, &u + 1, layer); }
  // Only candidates that the openings hid, and maybe others between these.
  void add_behind(const BoundaryVoxel& u, const CandidateLayer& layer,
                  const std::vector<Opening>& openings);
  // Several of one y and z at once, so that they share a row's paths while these are at hand. What
  // the sink gets does not tell them apart.
  void add(const BoundaryVoxel* begin, const BoundaryVoxel* end, const CandidateLayer& layer);
  Sink& sink() { return sink_; }
  const Sink& sink() const { return sink_; }

 private:
  // The candidates a = side |a| whose |a| is in one of two spans (inclusive).
  struct Admitted {
    int first[2], last[2];
  };
  // Where rays go: from u along a row.
  struct Rays {
    Voxel u;
    std::int64_t row_u, step_y, step_z;  // Rows of BlockedRows.
    int b, c;                            // In voxels.
    int y_sign, z_sign;
    LayerPaths::Path path;
    const RowLimits* limits;
  };
  // Blocked voxels x from r0 to r1 (from u, in the direction of a) of a row that is j and k steps
  // along y and z from u.
  struct Run {
    int j, k, r0, r1;
  };
  // The runs that hid candidates of the row before: likely they do so again in the next one, and
  // then the way there need not be gone.
  struct LastRuns {
    static constexpr int kMost = 8;
    Run runs[kMost];
    int count{};
  };
  // What the last runs leave: |a| within `open`, less what is in `inner`.
  struct Known {
    Interval open;
    Interval inner[LastRuns::kMost];
    int count{};
  };
  // Candidates still visible: bit i for |a| = first + i.
  struct Live {
    std::uint64_t bits;
    int first;
    int low, high;  // The smallest and the largest |a|; meaningless when bits is 0.
    void measure();
  };

  using Row = CandidateLayer::Row;
  const LayerPaths& paths(int c);
  Rays rays_to(Voxel u, const CandidateLayer& layer) const;
  // Calls visit() with the rays of each row in range in turn.
  template <class Visit>
  void for_rows(Rays rays, std::size_t us, const CandidateLayer& layer, Interval rows,
                const Visit& visit);
  void add_row(const Rays& rays, const BoundaryVoxel& u, const CandidateLayer& layer,
               const Row& row, const Interval within[2], LastRuns last[2]);
  template <int kSide>
  void add_side(const Rays& rays, const CandidateLayer& layer, const Row& row,
                const Admitted& admitted, Interval within, LastRuns& last_runs);
  template <int kSide>
  void cast(const Rays& rays, LastRuns& last_runs, Live& live);
  template <int kSide>
  Known known_shadows(const Rays& rays, Interval span, LastRuns& last_runs);
  template <int kSide>
  void shade(const Rays& rays, int cell, LastRuns& last_runs, Live& live);
  template <int kSide>
  void extend(const Rays& rays, std::int64_t row, Run& run) const;
  template <int kSide>
  void hide(const Rays& rays, const Run& run, const PathTimes& times, LastRuns& last_runs,
            Live& live);
  template <int kSide>
  void name(const Rays& rays, const Run& run);
  template <int kSide>
  std::uint64_t window(const Rays& rays, int block, std::int64_t row, int first, int width) const;
  template <int kSide>
  bool clear_window(const Rays& rays, int block, std::int64_t row, int first, int last) const;

  const VoxelGrid& grid_;
  const BlockedRows& blocked_;
  ViewRule rule_;
  static constexpr std::size_t kPathsKept = 4;
  std::vector<LayerPaths> paths_;  // Of the last few |c| asked for, the latest at the end.
  std::vector<LastRuns> last_;     // Two for each u, of its plus and its minus side.
  Sink sink_;
};

// Sink: how many boundary voxels each candidate sees.
struct SeenCounts {
  std::vector<std::uint32_t> tallies;

  void seen(const CandidateLayer&, const CandidateLayer::Row& row, int x, std::uint64_t bits);
  void hidden(std::int64_t, int, int) {}
};

// 64 candidates of a row of voxels, from an x that is a multiple of 64.
struct SeenWord {
  std::uint32_t word{};  // Index among the words of all voxels of the layer.
  std::uint64_t bits{};
};

// Sink: which candidates see a boundary voxel, and what hides the others.
class SeenSet {
 public:
  // For rows of row_words words, `rows` of them in the map.
  SeenSet(std::int64_t row_words, std::size_t rows)
      : row_words_(row_words), named_((static_cast<std::size_t>(row_words) * rows + 7) / 8) {}

  // Of the layer that is swept next: the word of its row 0.
  std::int64_t word_begin{};
  std::vector<SeenWord> words;           // In no order, a word may be repeated.
  std::vector<std::uint32_t> hidden_by;  // Bytes of BlockedRows, each once, in no order.

  void seen(const CandidateLayer&, const CandidateLayer::Row& row, int x, std::uint64_t bits);
  void hidden(std::int64_t row, int x, int width);
  // Empties both lists, or begins with those that are known to hide something.
  void restart(const std::vector<std::uint32_t>& known_to_hide);

 private:
  void name(std::uint32_t byte);

  std::int64_t row_words_;
  std::vector<std::uint64_t> named_;  // A bit per byte: whether it is in hidden_by.
};

// Sink: whether any candidate sees a boundary voxel.
struct AnySeen {
  bool any{};

  void seen(const CandidateLayer&, const CandidateLayer::Row&, int, std::uint64_t) { any = true; }
  void hidden(std::int64_t, int, int) {}
};

extern template class Sweep<SeenCounts>;
extern template class Sweep<SeenSet>;
extern template class Sweep<AnySeen>;

}  // namespace planning
