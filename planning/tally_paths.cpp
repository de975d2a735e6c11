#include "planning/tally_paths.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace planning {
namespace {

// The first i of [low, high) with holds(i), which stays true once it is; high if none.
template <class Holds>
int first_that(int low, int high, const Holds& holds) {
  while (low < high) {
    const int middle = low + (high - low) / 2;
    if (holds(middle)) {
      high = middle;
    } else {
      low = middle + 1;
    }
  }
  return low;
}

RowLimits limits_of(const ViewRule& rule, std::int64_t b, std::int64_t c) {
  const std::int64_t m = b * b + c * c;
  const auto distance2 = [m](std::int64_t a) { return a * a + m; };
  const int end =
      first_that(0, 1 << 15, [&](int a) { return distance2(a) > rule.distance2_max(); });
  RowLimits limits;
  limits.in_range_last = end - 1;
  limits.in_range_first =
      first_that(0, end, [&](int a) { return distance2(a) >= rule.distance2_min(); });
  const auto sees = [&](std::int64_t n, std::int64_t a) {
    return rule.along_normal(n * n, distance2(a)) && rule.dense(n * n, distance2(a), a * a + b * b);
  };
  limits.x_face_first = end;
  for (int a = 1; a < end; ++a) {  // An interval: nearer is too grazing, farther too sparse.
    if (!sees(a, a)) continue;
    limits.x_face_first = std::min(limits.x_face_first, a);
    limits.x_face_last = a;
  }
  const auto last_along = [&](std::int64_t n) {
    if (n == 0) return -1;
    return first_that(0, end, [&](int a) { return !sees(n, a); }) - 1;
  };
  limits.y_face_last = last_along(b);
  limits.z_face_last = last_along(c);
  return limits;
}

}  // namespace

Interval rows_behind(Voxel u, Voxel v, int z) {
  const Interval none{0, -1};
  const std::int64_t side = z < u.z ? -1 : 1;
  const std::int64_t c = std::abs(z - u.z), k = side * (v.z - u.z), j = std::abs(v.y - u.y);
  if (k < 0 || k > c) return none;
  // b (2 k + 1) > c (2 j - 1) and b (2 k - 1) < c (2 j + 1), or the ray is above or below v.
  std::int64_t low = j, high = INT32_MAX / 2;
  if (k < c && j > 0) low = std::max(low, c * (2 * j - 1) / (2 * k + 1));
  if (k > 0) high = c * (2 * j + 1) / (2 * k - 1);
  if (low > high) return none;
  const int near = static_cast<int>(low), far = static_cast<int>(high);
  if (v.y > u.y) return {u.y + near, u.y + far};
  if (v.y < u.y) return {u.y - far, u.y - near};
  return {u.y - far, u.y + far};
}

Interval crossing(int from, Interval to, int c, int k) {
  const double in = k == 0 ? 0 : (k - 0.5) / c, out = k == c ? 1 : (k + 0.5) / c;
  const double low = to.first - from, high = to.last - from;
  constexpr double kRounding = 1e-6;
  return {from + static_cast<int>(std::floor(std::min(low * in, low * out) + 0.5 - kRounding)),
          from + static_cast<int>(std::ceil(std::max(high * in, high * out) - 0.5 + kRounding))};
}

std::uint64_t shadow_of(Voxel u, Voxel v, Voxel p) {
  const bool back = (p.y < u.y && v.y > u.y) || (p.y > u.y && v.y < u.y) ||
                    (p.z < u.z && v.z > u.z) || (p.z > u.z && v.z < u.z);
  const auto times = times_in_cell(std::abs(p.y - u.y), std::abs(p.z - u.z), std::abs(v.y - u.y),
                                   std::abs(v.z - u.z));
  const int r = std::abs(v.x - u.x);
  if (back || !times || r > PathTimes::kRunMax) return 0;
  const int first = times->shadow_first(r), last = std::min(times->shadow_last(r), 1 << 20);
  std::uint64_t bits = 0;
  if (v.x >= u.x) bits |= bits_within(p.x, u.x + first, u.x + last);
  if (v.x <= u.x) bits |= bits_within(p.x, u.x - last, u.x - first);
  return bits;
}

LayerPaths::LayerPaths(const ViewRule& rule, int c, int b_max) : c_(c) {
  begin_.push_back(0);
  for (int b = 0; b <= b_max; ++b) {
    const RowLimits limits = limits_of(rule, b, c);
    if (limits.in_range_last < 0) break;
    limits_.push_back(limits);
    add_path(b);
  }
}

void LayerPaths::add_path(int b) {
  const std::size_t first = cells_.size();
  steps_begin_.push_back(after_steps_.size());
  PathTimes times;
  int j = 0, k = 0;
  for (bool more = true; more;) {
    // The next face along y is crossed at (2j+1)/(2b), along z at (2k+1)/(2c).
    const std::int64_t y = (2 * std::int64_t{j} + 1) * c_, z = (2 * std::int64_t{k} + 1) * b;
    const bool step_y = j < b && (k == c_ || y <= z), step_z = k < c_ && (j == b || z <= y);
    more = step_y || step_z;
    times.out_num = step_y ? 2 * j + 1 : step_z ? 2 * k + 1 : 2;
    times.out_den = step_y ? b : step_z ? c_ : 1;
    PathCell cell;
    cell.in = static_cast<std::uint32_t>((std::int64_t{times.in_num} << 15) / times.in_den);
    cell.out = static_cast<std::uint32_t>(
        ((std::int64_t{times.out_num} << 15) + times.out_den - 1) / times.out_den);
    cell.j = static_cast<std::int16_t>(j);
    cell.k = static_cast<std::int16_t>(k);
    cells_.push_back(cell);
    times_.push_back(times);
    // A diagonal step passes no cell between: the one before stands in for it.
    for (int step = 0; step < std::max(step_y + step_z, 1); ++step)
      after_steps_.push_back(static_cast<std::uint16_t>(cells_.size() - 1 - first));
    times.in_num = times.out_num;
    times.in_den = times.out_den;
    j += step_y;
    k += step_z;
  }
  for (int m = 0; m < 3; ++m)
    for (std::size_t i = first, end = first; i < cells_.size(); ++i) {
      while (end < cells_.size() && cells_[end].k < cells_[i].k + (1 << m)) ++end;
      cells_[i].within[m] = static_cast<std::uint16_t>(end - i);
    }
  begin_.push_back(cells_.size());
}

}  // namespace planning
