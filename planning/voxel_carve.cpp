#include "planning/voxel_carve.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

#include "planning/voxel_parallel.hpp"

namespace planning {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kHalfDiagonal = 0.8661;  // Of a voxel, rounded up.
constexpr double kHalfSide = 0.49;        // Of a voxel, less what the lattice rounds.
constexpr double kSlack = 0.01;           // Voxels; many times what lattice and floats round.
constexpr double kAngleSlack = 1e-4;      // Radians; several times the error of fast_atan2().

// Error below 2e-5 rad (Abramowitz and Stegun 4.4.47), without branches.
inline float fast_atan2(float y, float x) {
  const float ax = std::abs(x), ay = std::abs(y);
  const float high = std::max(ax, ay), low = std::min(ax, ay);
  const float a = low / (high + 1e-20F), s = a * a;
  float angle =
      ((((0.0208351F * s - 0.085133F) * s + 0.180141F) * s - 0.3302995F) * s + 0.999866F) * a;
  angle = ay > ax ? static_cast<float>(kPi / 2) - angle : angle;
  angle = x < 0 ? static_cast<float>(kPi) - angle : angle;
  return y < 0 ? -angle : angle;
}

// At least the arc sine, and not much more.
double arc_sine_above(double sine) {
  return sine < 0.25 ? 1.011 * sine : std::asin(sine);
}

// A step to divide by, also where there is only one column or row.
double usable_step(double step_rad, std::uint32_t count) {
  return count > 1 ? step_rad : 1.0;
}

// Calls visit(first, last) with all indices i of [0, count) with first_rad + i * step_rad in
// [low_rad, high_rad], give or take whole turns, until it returns true.
template <class Visit>
bool for_indices(double low_rad, double high_rad, double first_rad, double step_rad,
                 std::uint32_t count, const Visit& visit) {
  const int last_index = static_cast<int>(count) - 1;
  if (high_rad - low_rad >= 2 * kPi) return visit(0, last_index);
  const double last_rad = first_rad + last_index * step_rad;
  const double pattern_low = std::min(first_rad, last_rad),
               pattern_high = std::max(first_rad, last_rad);
  const double turn_first = std::ceil((pattern_low - high_rad) / (2 * kPi));
  for (double turn = turn_first; low_rad + turn * 2 * kPi <= pattern_high; ++turn) {
    double a = (low_rad + turn * 2 * kPi - first_rad) / step_rad;
    double b = (high_rad + turn * 2 * kPi - first_rad) / step_rad;
    if (a > b) std::swap(a, b);
    const int first = static_cast<int>(std::ceil(std::clamp(a, 0.0, last_index + 1.0)));
    const int last = static_cast<int>(std::floor(std::clamp(b, -1.0, last_index + 0.0)));
    if (first <= last && visit(first, last)) return true;
  }
  return false;
}

ReachTiles make_tiles(const hal::ScanPattern& pattern, const std::vector<float>& reach_m,
                      int threads) {
  constexpr int side = ReachTiles::kSide;
  ReachTiles result;
  result.columns = (static_cast<int>(pattern.columns) + side - 1) / side;
  result.rows = (static_cast<int>(pattern.rows) + side - 1) / side;
  result.tiles.assign(
      static_cast<std::size_t>(result.columns) * static_cast<std::size_t>(result.rows),
      {std::numeric_limits<float>::max(), 0});
  const std::size_t rows = pattern.rows;
  const auto piece = [&](int, std::size_t begin, std::size_t end) {
    for (std::size_t tile_column = begin; tile_column < end; ++tile_column) {
      const std::size_t last = std::min<std::size_t>((tile_column + 1) * side, pattern.columns);
      for (std::size_t column = tile_column * side; column < last; ++column)
        for (std::size_t row = 0; row < rows; ++row) {
          ReachTiles::Tile& tile =
              result.tiles[tile_column * static_cast<std::size_t>(result.rows) + row / side];
          const float reach = reach_m[column * rows + row];
          tile.min_m = std::min(tile.min_m, reach);
          tile.max_m = std::max(tile.max_m, reach);
        }
    }
  };
  for_pieces(threads, static_cast<std::size_t>(result.columns), 4, piece);
  return result;
}

}  // namespace

BeamCarver::BeamCarver(const VoxelGrid& grid, const hal::ScanPattern& pattern,
                       const Eigen::Isometry3d& T_W_S, const BeamFan& fan,
                       const std::vector<float>& reach_m, int threads)
    : grid_(grid),
      pattern_(pattern),
      fan_(fan),
      reach_m_(reach_m),
      tiles_(make_tiles(pattern, reach_m, threads)),
      R_S_W_(T_W_S.linear().transpose()),
      W_scanner_((T_W_S.translation() - grid.W_min_m) / grid.voxel_m),
      deviation_rad_(fan.deviation_max_rad()),
      offset_(fan.offset_max_m() / grid.voxel_m),
      column_step_rad_(usable_step(pattern.azimuth_step_rad, pattern.columns)),
      row_step_rad_(usable_step(pattern.elevation_step_rad, pattern.rows)) {
  S_corner_ = R_S_W_ * (Eigen::Vector3d::Constant(0.5) - W_scanner_);
  for (const ReachTiles::Tile& tile : tiles_.tiles)
    reach_max_ = std::max(reach_max_, tile.max_m / grid.voxel_m);
  const double first = pattern.elevation_first_rad;
  const double last = first + (pattern.rows - 1.0) * pattern.elevation_step_rad;
  over_the_pole_ = std::max(std::abs(first), std::abs(last)) > kPi / 2 + 1e-6;
  for (std::uint32_t column = 0; column < pattern.columns; ++column) {
    const double azimuth = pattern.azimuth_first_rad + column * pattern.azimuth_step_rad;
    column_direction_.emplace_back(std::cos(azimuth), std::sin(azimuth));
  }
  for (std::uint32_t row = 0; row < pattern.rows; ++row) {
    const double elevation = first + row * pattern.elevation_step_rad;
    row_direction_.emplace_back(std::cos(elevation), std::sin(elevation));
  }
}

BeamCarver::Words BeamCarver::reachable_words(int y, int z) const {
  const double dy = y + 0.5 - W_scanner_.y(), dz = z + 0.5 - W_scanner_.z();
  const double reach = reach_max_ + offset_ + 1;
  const double rest = reach * reach - dy * dy - dz * dz;
  if (reach_max_ == 0 || rest < 0) return {0, 0};
  const double half = std::sqrt(rest) + 1;
  const double first = std::floor(W_scanner_.x() - half), last = std::floor(W_scanner_.x() + half);
  if (last < 0 || first >= grid_.nx) return {0, 0};
  return {static_cast<int>(std::max(first, 0.0)) / 64,
          static_cast<int>(std::min(last, grid_.nx - 1.0)) / 64 + 1};
}

std::uint64_t BeamCarver::crossed(int word, int y, int z, std::uint64_t wanted) const {
  WordSight sight;
  look(word, y, z, sight);
  std::uint64_t result = 0;
  for (std::uint64_t left = wanted; left != 0; left &= left - 1) {
    const int i = std::countr_zero(left);
    const float distance = sight.distance[i];
    if (distance > static_cast<float>(reach_max_ + offset_ + kHalfDiagonal + kSlack)) continue;
    if (surely_crossed(distance, sight.azimuth_rad[i], sight.elevation_rad[i]) ||
        search({64 * word + i, y, z}, sight.azimuth_rad[i], sight.elevation_rad[i]))
      result |= std::uint64_t{1} << i;
  }
  return result;
}

void BeamCarver::look(int word, int y, int z, WordSight& sight) const {
  const Eigen::Vector3f first =
      (S_corner_ + R_S_W_ * Eigen::Vector3d(64.0 * word, y, z)).cast<float>();
  const Eigen::Vector3f step = R_S_W_.col(0).cast<float>();
  const float fx = first.x(), fy = first.y(), fz = first.z();
  const float sx = step.x(), sy = step.y(), sz = step.z();
  for (int i = 0; i < 64; ++i) {
    const float n = static_cast<float>(i);
    const float x = fx + n * sx, y_S = fy + n * sy, z_S = fz + n * sz;
    const float flat2 = x * x + y_S * y_S;
    sight.distance[i] = std::sqrt(flat2 + z_S * z_S);
    sight.azimuth_rad[i] = fast_atan2(y_S, x);
    sight.elevation_rad[i] = fast_atan2(z_S, std::sqrt(flat2));
  }
}

// Whether the beam nearest to the centre passes it so closely, and goes on so far, that it crosses.
// Judged by the least reach around that beam; false says nothing.
bool BeamCarver::surely_crossed(float distance, float azimuth_rad, float elevation_rad) const {
  const auto turn = static_cast<float>(2 * kPi);
  float from_first = azimuth_rad - static_cast<float>(pattern_.azimuth_first_rad);
  if (column_step_rad_ > 0) {
    const float half = static_cast<float>(column_step_rad_ / 2);
    from_first -= turn * std::floor((from_first + half) / turn);
  } else {
    const float half = static_cast<float>(-column_step_rad_ / 2);
    from_first -= turn * std::ceil((from_first - half) / turn);
  }
  const float column = std::nearbyint(from_first / static_cast<float>(column_step_rad_));
  const float from_row = elevation_rad - static_cast<float>(pattern_.elevation_first_rad);
  const float row = std::nearbyint(from_row / static_cast<float>(row_step_rad_));
  if (!(column >= 0) || column >= static_cast<float>(pattern_.columns) || !(row >= 0) ||
      row >= static_cast<float>(pattern_.rows))
    return false;
  const float d_azimuth = std::abs(from_first - column * static_cast<float>(column_step_rad_));
  const float d_elevation = std::abs(from_row - row * static_cast<float>(row_step_rad_));
  // The way along the sphere, first in elevation, then in azimuth, is no shorter than the angle.
  const float angle =
      d_elevation + d_azimuth + static_cast<float>(deviation_rad_ + 2 * kAngleSlack);
  const float offset = static_cast<float>(offset_);
  if (angle * distance + offset > static_cast<float>(kHalfSide)) return false;
  if (offset > 0 && distance < 2 * offset + 1) return false;  // It may start beyond the voxel.
  const ReachTiles::Tile& tile = tiles_.at(static_cast<int>(column) / ReachTiles::kSide,
                                           static_cast<int>(row) / ReachTiles::kSide);
  return tile.min_m >=
         (distance + offset + static_cast<float>(kSlack)) * static_cast<float>(grid_.voxel_m);
}

bool BeamCarver::search(Voxel v, double azimuth_rad, double elevation_rad) const {
  const Eigen::Vector3d c = S_corner_ + R_S_W_ * Eigen::Vector3d(v.x, v.y, v.z);
  const Sight sight{c.x(), c.y(), c.z(), c.norm()};
  if (search_around(v, sight, azimuth_rad, elevation_rad)) return true;
  // An elevation beyond the pole is the opposite azimuth.
  return over_the_pole_ && search_around(v, sight, azimuth_rad + kPi, kPi - elevation_rad);
}

// All beams within the angle that the voxel's circumscribed sphere fills.
bool BeamCarver::search_around(Voxel v, const Sight& sight, double azimuth_rad,
                               double elevation_rad) const {
  double angle = 2 * kPi, azimuth_angle = 2 * kPi;
  const double sine = (kHalfDiagonal + offset_ + kSlack) / sight.distance;
  if (sine < 1) {
    angle = arc_sine_above(sine) + deviation_rad_ + kAngleSlack;
    const double flat = std::sqrt(sight.x * sight.x + sight.y * sight.y) / sight.distance;
    if (angle < 0.999 * flat) azimuth_angle = arc_sine_above(angle / flat) + kAngleSlack;
  }
  return for_indices(elevation_rad - angle, elevation_rad + angle, pattern_.elevation_first_rad,
                     row_step_rad_, pattern_.rows, [&](int row_first, int row_last) {
                       return for_indices(
                           azimuth_rad - azimuth_angle, azimuth_rad + azimuth_angle,
                           pattern_.azimuth_first_rad, column_step_rad_, pattern_.columns,
                           [&](int first, int last) {
                             return search_window(v, sight, {first, last}, {row_first, row_last});
                           });
                     });
}

bool BeamCarver::search_window(Voxel v, const Sight& sight, Span columns, Span rows) const {
  constexpr int side = ReachTiles::kSide;
  const auto near_m =
      static_cast<float>((sight.distance - offset_ - kHalfDiagonal - kSlack) * grid_.voxel_m);
  const bool wide = columns.last - columns.first > 4 * side || rows.last - rows.first > 4 * side;
  for (int tile_column = columns.first / side; tile_column <= columns.last / side; ++tile_column)
    for (int tile_row = rows.first / side; tile_row <= rows.last / side; ++tile_row) {
      const float max_m = tiles_.at(tile_column, tile_row).max_m;
      if (max_m <= 0 || max_m < near_m || (wide && !may_meet(sight, tile_column, tile_row)))
        continue;
      const Span tile_columns{std::max(columns.first, tile_column * side),
                              std::min(columns.last, tile_column * side + side - 1)};
      const Span tile_rows{std::max(rows.first, tile_row * side),
                           std::min(rows.last, tile_row * side + side - 1)};
      if (search_tile(v, sight, tile_columns, tile_rows)) return true;
    }
  return false;
}

// Whether the voxel's sphere meets the cone around the tile's beams.
bool BeamCarver::may_meet(const Sight& sight, int tile_column, int tile_row) const {
  constexpr int side = ReachTiles::kSide;
  const double sine = (kHalfDiagonal + offset_ + kSlack) / sight.distance;
  if (sine >= 1) return true;
  const double middle = (side - 1) / 2.0;
  const double azimuth =
      pattern_.azimuth_first_rad + (tile_column * side + middle) * column_step_rad_;
  const double elevation =
      pattern_.elevation_first_rad + (tile_row * side + middle) * row_step_rad_;
  const double radius = middle * (std::abs(column_step_rad_) + std::abs(row_step_rad_));
  const double limit = radius + std::asin(sine) + deviation_rad_ + kAngleSlack;
  if (limit >= kPi) return true;
  const double along =
      std::cos(elevation) * (std::cos(azimuth) * sight.x + std::sin(azimuth) * sight.y) +
      std::sin(elevation) * sight.z;
  return along >= std::cos(limit) * sight.distance - kSlack;
}

bool BeamCarver::search_tile(Voxel v, const Sight& sight, Span columns, Span rows) const {
  const double distance2 = sight.distance * sight.distance;
  const auto near_m =
      static_cast<float>((sight.distance - offset_ - kHalfDiagonal - kSlack) * grid_.voxel_m);
  // A beam beside the pattern's passes the centre at that distance at least, less what it is off.
  const double off = offset_ + deviation_rad_ * (sight.distance + offset_ + 1);
  const double near = kHalfDiagonal + off;
  const double outside = near * near + kSlack * (1 + 1e-6 * distance2);
  for (int column = columns.first; column <= columns.last; ++column) {
    const auto c = static_cast<std::uint32_t>(column);
    const Eigen::Vector2d& flat = column_direction_[c];
    const double flat_along = flat.x() * sight.x + flat.y() * sight.y;
    const float* const reach_m = &reach_m_[std::size_t{c} * pattern_.rows];
    for (int row = rows.first; row <= rows.last; ++row) {
      if (reach_m[row] <= 0 || reach_m[row] < near_m) continue;
      const auto r = static_cast<std::uint32_t>(row);
      const double along = row_direction_[r].x() * flat_along + row_direction_[r].y() * sight.z;
      if (distance2 - along * along > outside && sight.distance > 1 + off) continue;
      if (meets(fan_.start(c, r), fan_.end(c, r, reach_m[row]), v)) return true;
    }
  }
  return false;
}

}  // namespace planning
