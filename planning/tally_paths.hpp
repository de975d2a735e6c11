// What the rays from one voxel to a whole row of candidates have in common.
//
// All rays from a voxel u to the candidates of one row (y and z fixed, x any) share their path in
// the (y, z) plane: the same cells, entered and left at the same times t of [0, 1]. A candidate a
// voxels along x is at x = a t, so within a cell of times (in, out) a run of blocked voxels [r0,
// r1] (from u, in the direction of a) shadows exactly the candidates with
//     a out > r0 - 1/2  and  a in < r1 + 1/2,
// an interval with rational ends. (Several voxels of a run are as one: a ray that leaves one
// through an inner face enters the next.)
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <vector>

#include "planning/next_best_view.hpp"

namespace planning {

// Integers, both inclusive; none if first > last.
struct Interval {
  int first{0}, last{INT32_MAX};

  bool empty() const { return first > last; }
};

inline std::uint64_t ones(int count) {
  return count >= 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << count) - 1;
}

// Bits i with first <= base + i <= last.
inline std::uint64_t bits_within(int base, int first, int last) {
  const int low = std::max(first - base, 0), high = std::min(last - base, 63);
  return low > high ? 0 : ones(high - low + 1) << low;
}

// Which of the candidates of a row at (b, c) voxels (|b|, |c| suffice) are in range and see a face;
// all in |a|.
struct RowLimits {
  int in_range_first{}, in_range_last{-1};  // Empty if first > last.
  int x_face_first{}, x_face_last{-1};      // A face towards the candidate along x, within these.
  int y_face_last{-1}, z_face_last{-1};     // A face towards the row along y or z, up to here.
};

// A cell of the path in the (y, z) plane.
struct PathCell {
  std::uint32_t in{}, out{};  // Times in 1/65536; `in` rounded down, `out` up.
  std::int16_t j{}, k{};      // Steps along y and z since u.
  // Cells from here on, this included, within the next 1, 2 and 4 levels of z (k, k+1, ...).
  std::uint16_t within[3]{};
};
// Its times exactly: num / (2 den).
struct PathTimes {
  std::int32_t in_num{}, in_den{1}, out_num{}, out_den{1};

  // The candidates that blocked voxels [r0, r1], 0 <= r1, shadow: |a| in [first, last]. Nothing is
  // in view beyond 16000 voxels (ViewRule), so 32 bits do for r up to kRunMax.
  static constexpr int kRunMax = 32000;
  int shadow_first(int r0) const { return r0 <= 0 ? 0 : (2 * r0 - 1) * out_den / out_num + 1; }
  int shadow_last(int r1) const {
    return in_num == 0 ? INT32_MAX : ((2 * r1 + 1) * in_den - 1) / in_num;
  }
};

// When the path to row (b, c) is in cell (j, k), all >= 0; nothing if it passes it by.
inline std::optional<PathTimes> times_in_cell(int b, int c, int j, int k) {
  if (j > b || k > c) return std::nullopt;
  PathTimes times;
  times.out_num = 2;
  const auto enter = [&](int num, int den) {
    if (std::int64_t{num} * times.in_den > std::int64_t{times.in_num} * den)
      times.in_num = num, times.in_den = den;
  };
  const auto leave = [&](int num, int den) {
    if (std::int64_t{num} * times.out_den < std::int64_t{times.out_num} * den)
      times.out_num = num, times.out_den = den;
  };
  if (j > 0) enter(2 * j - 1, b);
  if (k > 0) enter(2 * k - 1, c);
  if (j < b) leave(2 * j + 1, b);
  if (k < c) leave(2 * k + 1, c);
  if (std::int64_t{times.in_num} * times.out_den >= std::int64_t{times.out_num} * times.in_den)
    return std::nullopt;
  return times;
}

// Paths and limits of all rows in one layer of candidates, |c| voxels above or below u.
class LayerPaths {
 public:
  LayerPaths(const ViewRule& rule, int c, int b_max);

  int c() const { return c_; }
  int rows() const { return static_cast<int>(limits_.size()); }  // |b| < rows() may be in range.
  const RowLimits& limits(int b) const { return limits_[static_cast<std::size_t>(b)]; }

  struct Path {
    const PathCell* cells;
    const PathTimes* times;
    const std::uint16_t* after_steps;  // The cell after so many steps along y and z; b + c + 1.
    int count, steps;

    // When it is in cell (j, k), all >= 0; nullptr if it passes it by.
    const PathTimes* times_in(int j, int k) const {
      if (j + k > steps) return nullptr;
      const int i = after_steps[j + k];
      return cells[i].j == j && cells[i].k == k ? &times[i] : nullptr;
    }
  };
  Path path(int b) const {
    const auto i = static_cast<std::size_t>(b);
    return {&cells_[begin_[i]], &times_[begin_[i]], &after_steps_[steps_begin_[i]],
            static_cast<int>(begin_[i + 1] - begin_[i]), b + c_};
  }

 private:
  void add_path(int b);

  int c_;
  std::vector<RowLimits> limits_;
  std::vector<std::size_t> begin_, steps_begin_;
  std::vector<std::uint16_t> after_steps_;
  std::vector<PathCell> cells_;
  std::vector<PathTimes> times_;
};

// The rows of layer z in which v may hide candidates from u, maybe some more.
Interval rows_behind(Voxel u, Voxel v, int z);

// Where, along one axis, rays from `from` to candidates within `to` may be while they cross the
// voxels k levels from u on the way to level c, 0 <= k <= c; maybe one voxel more.
Interval crossing(int from, Interval to, int c, int k);

// Exactly whom v hides from u among the 64 candidates from p along x, p's x upwards. v is not u.
std::uint64_t shadow_of(Voxel u, Voxel v, Voxel p);

}  // namespace planning
