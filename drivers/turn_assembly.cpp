#include "drivers/turn_assembly.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace drivers {
namespace {

constexpr double kWholeTurn = 2 * std::numbers::pi;
constexpr double kSeam_rad = -std::numbers::pi / 2;  // Where a turn begins.
constexpr float kNotMeasured = std::numeric_limits<float>::quiet_NaN();

// The upper of two that are as near: it meets more of walls and less of what stands before them.
std::size_t nearest_to_level(const std::vector<BeamCone>& rows) {
  std::size_t best = 0;
  for (std::size_t i = 1; i < rows.size(); ++i)
    if (std::abs(rows[i].elevation_rad) < std::abs(rows[best].elevation_rad) + 1e-6) best = i;
  return best;
}

std::size_t rows_up_to(const std::vector<BeamCone>& rows, double elevation_max_rad) {
  std::size_t count = 0;
  while (count < rows.size() && rows[count].elevation_rad <= elevation_max_rad) ++count;
  return count;
}

}  // namespace

ConeOfBeam cone_of(const hal::Beam& beam) {
  const Eigen::Vector3d origin = beam.S_origin_m.cast<double>();
  const Eigen::Vector3d way = beam.S_direction.cast<double>();
  const double across = way.head<2>().norm();
  const double ahead_m = origin.head<2>().dot(way.head<2>()) / across;
  return {{std::atan2(way.z(), across), origin.z() - ahead_m * way.z() / across}, ahead_m / across};
}

TurnAssembly::TurnAssembly(std::uint32_t columns, const std::vector<BeamCone>& rows,
                           double elevation_max_rad)
    : columns_(columns),
      rows_(rows),
      kept_(std::max(rows_up_to(rows, elevation_max_rad), nearest_to_level(rows) + 1)),
      level_(nearest_to_level(rows)) {
  begin();
}

void TurnAssembly::begin() {
  last_column_.reset();
  began_.reset();
  clear();
}

void TurnAssembly::clear() {
  ranges_m_.assign(kept_, std::vector<float>(columns_, kNotMeasured));
}

std::uint32_t TurnAssembly::column_of(double azimuth_rad) const {
  const double after_rad = std::remainder(kSeam_rad - azimuth_rad, kWholeTurn);
  const double share = after_rad / kWholeTurn;
  const double column = (share < 0 ? share + 1 : share) * columns_;
  return std::min(static_cast<std::uint32_t>(column), columns_ - 1);
}

std::optional<hal::Turn> TurnAssembly::next_packet(double azimuth_rad, hal::Time at) {
  packet_column_ = column_of(azimuth_rad);
  const bool turned = last_column_ && packet_column_ < *last_column_;
  last_column_ = packet_column_;
  if (!turned) return std::nullopt;
  std::optional<hal::Turn> whole;
  if (began_ && at > *began_) whole = take(at);
  clear();
  began_ = at;
  began_column_ = packet_column_;
  return whole;
}

// What straddles the seam belongs to the turn before or after, which is not in hand.
void TurnAssembly::add(std::size_t row, double azimuth_rad, float range_m) {
  const std::uint32_t column = column_of(azimuth_rad);
  const std::uint32_t off =
      column > packet_column_ ? column - packet_column_ : packet_column_ - column;
  if (off > columns_ / 2) return;
  float& known_m = ranges_m_[row][column];
  if (!(range_m > 0)) range_m = 0;
  const bool nearer = std::isnan(known_m) || known_m == 0 || (range_m > 0 && range_m < known_m);
  if (nearer) known_m = range_m;
}

hal::Turn TurnAssembly::take(hal::Time ended) {
  const double step_rad = kWholeTurn / columns_;
  const double period_s = hal::seconds(ended - *began_) /
                          (static_cast<double>(columns_) + packet_column_ - began_column_);
  hal::Turn turn{.stamp = *began_ - hal::from_seconds(began_column_ * period_s),
                 .beam_period_s = period_s,
                 .angle_first_rad = kSeam_rad - step_rad / 2,
                 .angle_step_rad = -step_rad,
                 .rows = {},
                 .level = level_,
                 .lost_before = 0};
  for (std::size_t row = 0; row < kept_; ++row)
    turn.rows.push_back({rows_[row].elevation_rad, rows_[row].tip_z_m, std::move(ranges_m_[row])});
  return turn;
}

}  // namespace drivers
