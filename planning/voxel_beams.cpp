#include "planning/voxel_beams.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <string>

#include "planning/near_walls.hpp"
#include "planning/voxel_parallel.hpp"

namespace planning {
namespace {

constexpr float kNothing = std::numeric_limits<float>::infinity();
// How far from the box a scanner may stand, and how far it may see, so that products of lattice
// coordinates fit 64 bits.
constexpr double kVoxelsMax = 1 << 18;

// The open interval of the parameter (num / den) in which a segment is within a slab.
struct Within {
  std::int64_t from_num = 0, from_den = 1, to_num = 1, to_den = 1;

  // False once the interval is empty for good.
  bool clip(std::int64_t start, std::int64_t end, std::int64_t low, std::int64_t high) {
    if ((start <= low && end <= low) || (start >= high && end >= high)) return false;
    std::int64_t length = end - start, enter = low - start, leave = high - start;
    if (length == 0) return true;
    if (length < 0) {
      length = -length;
      enter = start - high;
      leave = start - low;
    }
    if (enter * from_den > from_num * length) from_num = enter, from_den = length;
    if (leave * to_den < to_num * length) to_num = leave, to_den = length;
    return true;
  }
  bool empty() const { return from_num * to_den >= to_num * from_den; }
};

bool full_circle(const hal::ScanPattern& pattern) {
  const double step = std::abs(pattern.azimuth_step_rad);
  return std::abs(step * pattern.columns - 2 * std::numbers::pi) < step / 2;
}

// The nearest return within `window` rows, for one column.
void nearest_in_column(const float* range_m, std::int64_t rows, int window, float* nearest_m) {
  for (std::int64_t row = 0; row < rows; ++row) {
    const std::int64_t first = std::max<std::int64_t>(row - window, 0);
    const std::int64_t last = std::min<std::int64_t>(row + window, rows - 1);
    float nearest = kNothing;
    for (std::int64_t i = first; i <= last; ++i)
      nearest = std::min(nearest, range_m[i] > 0 ? range_m[i] : kNothing);
    nearest_m[row] = nearest;
  }
}

std::vector<float> nearest_in_columns(const hal::ScanCloud& scan, int window, int threads) {
  const std::size_t rows = scan.pattern.rows;
  std::vector<float> nearest_m(scan.ranges_m.size());
  for_pieces(threads, scan.pattern.columns, 16, [&](int, std::size_t begin, std::size_t end) {
    for (std::size_t column = begin; column < end; ++column)
      nearest_in_column(&scan.ranges_m[column * rows], static_cast<std::int64_t>(rows), window,
                        &nearest_m[column * rows]);
  });
  return nearest_m;
}

void check(const hal::ScanCloud& scan) {
  if (scan.ranges_m.size() != scan.pattern.beams())
    throw std::invalid_argument("scan: " + std::to_string(scan.ranges_m.size()) + " ranges for " +
                                std::to_string(scan.pattern.columns) + " columns of " +
                                std::to_string(scan.pattern.rows) + " rows");
}

// Where a drop-out on the ground ends: just above the top of the layer that holds the ground, by
// more than the lattice rounds.
double drop_out_floor_m(const VoxelGrid& grid, double ground_z_m) {
  const double ground = (ground_z_m - grid.W_min_m.z()) / grid.voxel_m;
  return grid.W_min_m.z() + grid.voxel_m * (std::ceil(ground - 1e-6) + 2.0 / 1024);
}

// Decides one beam after the other, in the order of ranges_m.
struct Reach {
  const InsertConfig& config;
  const BeamFan& fan;
  const NearWalls& walls;
  std::optional<double> above_floor_m;  // Height of the scanner above drop_out_floor_m.
  InsertReport counted;

  float of_return(float range_m) {
    if (!std::isfinite(range_m) || range_m < 0) return ++counted.returns_invalid, 0.0F;
    if (range_m < config.range_min_m) return ++counted.returns_too_near, 0.0F;
    if (range_m > config.range_max_m) return ++counted.returns_too_far, 0.0F;
    return ++counted.returns, range_m;
  }
  float of_no_return(float trusted_m, std::uint32_t column, std::uint32_t row) {
    ++counted.no_returns;
    if (walls.any() && trusted_m > 0 &&
        walls.meets(fan.start(column, row),
                    fan.end(column, row, static_cast<float>(config.range_min_m))))
      return 0;
    if (above_floor_m) {
      const double climb = fan.climb(column, row);
      if (climb < 0) {
        const double above_m = *above_floor_m + fan.start_up_m(column, row);
        const double to_floor_m = std::max(0.0, above_m / -climb);
        if (to_floor_m < trusted_m) trusted_m = static_cast<float>(to_floor_m);
      }
    }
    counted.no_returns_carved += trusted_m > 0;
    return trusted_m;
  }
};

void add_counts(InsertReport& sum, const InsertReport& part) {
  sum.returns += part.returns;
  sum.returns_too_near += part.returns_too_near;
  sum.returns_too_far += part.returns_too_far;
  sum.returns_invalid += part.returns_invalid;
  sum.no_returns += part.no_returns;
  sum.no_returns_carved += part.no_returns_carved;
}

}  // namespace

bool meets(const LatticePoint& from, const LatticePoint& to, Voxel v) {
  const auto low = [](int i) { return std::int64_t{i} << kLatticeShift; };
  Within within;
  return within.clip(from.x, to.x, low(v.x), low(v.x + 1)) &&
         within.clip(from.y, to.y, low(v.y), low(v.y + 1)) &&
         within.clip(from.z, to.z, low(v.z), low(v.z + 1)) && !within.empty();
}

BeamFan::BeamFan(const VoxelGrid& grid, const hal::ScanCloud& scan,
                 const Eigen::Isometry3d& T_W_S) {
  const hal::ScanPattern& pattern = scan.pattern;
  const auto usable = [](double first, double step, std::uint32_t count) {
    return std::isfinite(first) && std::isfinite(step) && (count < 2 || step != 0);
  };
  if (!usable(pattern.azimuth_first_rad, pattern.azimuth_step_rad, pattern.columns) ||
      !usable(pattern.elevation_first_rad, pattern.elevation_step_rad, pattern.rows))
    throw std::invalid_argument("scan pattern: angles must be finite and steps not 0");
  const double per_m = 1024 / grid.voxel_m;
  const Eigen::Vector3d base = (T_W_S.translation() - grid.W_min_m) * per_m;
  if (!T_W_S.matrix().allFinite() || base.cwiseAbs().maxCoeff() > kVoxelsMax * 1024)
    throw std::invalid_argument("scan pose: not finite, or too far from the voxel box");

  const Eigen::Matrix3d R_W_S = T_W_S.linear();
  if (!(R_W_S.transpose() * R_W_S).isIdentity(1e-6))
    throw std::invalid_argument("scan pose: its rotation is not a rotation");
  const auto in_lattice = [per_m](const Eigen::Vector3d& W_direction) {
    const Eigen::Vector3d q = W_direction * per_m;
    return Direction{q.x(), q.y(), q.z()};
  };
  for (std::uint32_t column = 0; column < pattern.columns; ++column) {
    const double azimuth = pattern.azimuth_first_rad + column * pattern.azimuth_step_rad;
    columns_.push_back(
        in_lattice(R_W_S * Eigen::Vector3d(std::cos(azimuth), std::sin(azimuth), 0)));
  }
  for (std::uint32_t row = 0; row < pattern.rows; ++row) {
    const double elevation = pattern.elevation_first_rad + row * pattern.elevation_step_rad;
    rows_.push_back({std::cos(elevation), std::sin(elevation)});
  }
  up_ = in_lattice(R_W_S.col(2));
  base_ = {base.x(), base.y(), base.z()};
  lattice_m_ = 1 / per_m;
  scanner_ = {on_lattice(base_[0]), on_lattice(base_[1]), on_lattice(base_[2])};
  lattice_S_ = R_W_S * per_m;
  W_up_S_ = R_W_S.row(2).transpose();
  if (!scan.beams.empty()) measure_beams(scan);
}

void BeamFan::measure_beams(const hal::ScanCloud& scan) {
  const hal::ScanPattern& pattern = scan.pattern;
  if (scan.beams.size() != pattern.beams())
    throw std::invalid_argument("scan: " + std::to_string(scan.beams.size()) + " beams for " +
                                std::to_string(pattern.beams()) + " of the pattern");
  double chord2_max = 0, offset2_max = 0;
  std::size_t i = 0;
  for (std::uint32_t column = 0; column < pattern.columns; ++column) {
    const double azimuth = pattern.azimuth_first_rad + column * pattern.azimuth_step_rad;
    const double cos = std::cos(azimuth), sin = std::sin(azimuth);
    for (std::uint32_t row = 0; row < pattern.rows; ++row, ++i) {
      const hal::Beam& beam = scan.beams[i];
      const Eigen::Vector3d direction = beam.S_direction.cast<double>();
      if (!(std::abs(direction.squaredNorm() - 1) < 1e-5) || !beam.S_origin_m.allFinite())
        throw std::invalid_argument("scan: beam " + std::to_string(i) +
                                    " has no direction of length 1, or no origin");
      const Eigen::Vector3d nominal(rows_[row].cos * cos, rows_[row].cos * sin, rows_[row].sin);
      chord2_max = std::max(chord2_max, (direction - nominal).squaredNorm());
      offset2_max = std::max(offset2_max, beam.S_origin_m.cast<double>().squaredNorm());
    }
  }
  if (offset2_max > kOffsetMax_m * kOffsetMax_m)
    throw std::invalid_argument("scan: a beam starts too far from the scanner");
  // The chord of an angle, with room for the direction's rounding.
  deviation_max_rad_ = 2 * std::asin(std::min(std::sqrt(chord2_max) / 2, 1.0)) + 1e-5;
  offset_max_m_ = std::sqrt(offset2_max);
  beams_ = scan.beams.data();
}

std::vector<float> trusted_no_returns(const hal::ScanCloud& scan, int window, double range_max_m,
                                      int threads) {
  check(scan);
  const auto columns = static_cast<std::int64_t>(scan.pattern.columns);
  const std::size_t rows = scan.pattern.rows;
  const bool wraps = full_circle(scan.pattern);
  const float limit_m = static_cast<float>(range_max_m);
  // A minimum over a window is a minimum over columns of minima over rows.
  std::vector<float> nearest_m;
  if (window > 0) nearest_m = nearest_in_columns(scan, window, threads);

  std::vector<float> trusted_m(scan.ranges_m.size());
  const auto one_column = [&](std::int64_t column) {
    float* const out = &trusted_m[static_cast<std::size_t>(column) * rows];
    std::fill_n(out, rows, limit_m);
    for (std::int64_t i = column - window; window > 0 && i <= column + window; ++i) {
      if (!wraps && (i < 0 || i >= columns)) continue;
      const auto neighbour = static_cast<std::size_t>((i % columns + columns) % columns);
      for (std::size_t row = 0; row < rows; ++row)
        out[row] = std::min(out[row], nearest_m[neighbour * rows + row]);
    }
    const float* const range_m = &scan.ranges_m[static_cast<std::size_t>(column) * rows];
    for (std::size_t row = 0; row < rows; ++row) out[row] = range_m[row] == 0 ? out[row] : 0;
  };
  for_pieces(threads, scan.pattern.columns, 16, [&](int, std::size_t begin, std::size_t end) {
    for (std::size_t column = begin; column < end; ++column)
      one_column(static_cast<std::int64_t>(column));
  });
  return trusted_m;
}

BeamReach beam_reach(const hal::ScanCloud& scan, const VoxelGrid& grid,
                     const Eigen::Isometry3d& T_W_S, const BeamFan& fan,
                     const InsertConfig& config) {
  check(scan);
  if (!(config.range_min_m >= 0) || !(config.range_max_m > 0) ||
      config.range_max_m / grid.voxel_m > kVoxelsMax || config.no_return_window < 0)
    throw std::invalid_argument("scan limits: ranges must be positive and at most 2^18 voxels");
  const double limit_m = config.carve_no_return ? config.range_max_m : 0;
  BeamReach result{trusted_no_returns(scan, config.no_return_window, limit_m, config.threads), {}};
  std::optional<double> above_floor_m;
  if (config.ground_z_m)
    above_floor_m = T_W_S.translation().z() - drop_out_floor_m(grid, *config.ground_z_m);

  const NearWalls walls(grid, T_W_S, fan.offset_max_m(), config);
  const std::uint32_t rows = scan.pattern.rows;
  std::vector<Reach> parts(static_cast<std::size_t>(std::max(config.threads, 1)),
                           {config, fan, walls, above_floor_m, {}});
  const auto piece = [&](int thread, std::size_t begin, std::size_t end) {
    Reach reach = parts[static_cast<std::size_t>(thread)];
    std::size_t beam = begin * rows;
    for (auto column = static_cast<std::uint32_t>(begin); column < end; ++column)
      for (std::uint32_t row = 0; row < rows; ++row, ++beam) {
        const float range_m = scan.ranges_m[beam];
        float& out = result.reach_m[beam];
        out = range_m == 0 ? reach.of_no_return(out, column, row) : reach.of_return(range_m);
      }
    parts[static_cast<std::size_t>(thread)].counted = reach.counted;
  };
  for_pieces(config.threads, scan.pattern.columns, 16, piece);
  for (const Reach& part : parts) add_counts(result.counted, part.counted);
  return result;
}

}  // namespace planning
