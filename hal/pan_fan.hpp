// Where the beams of a fan went that turned about the pan axis. Inline: codecs, which link nothing
// that waits, make clouds of it too.
#pragma once

#include <cmath>
#include <span>
#include <vector>

#include "hal/values.hpp"

namespace hal {

// Column by column. The same bits for the same fan: what was written as a fan is read as the beams
// that were measured.
class FanAim {
 public:
  // The fan must outlive it.
  explicit FanAim(const PanFan& fan)
      : fan_(fan),
        cos_row_(std::cos(fan.pan_per_row_rad)),
        sin_row_(std::sin(fan.pan_per_row_rad)) {}

  // The beams of one column, as many as the fan has rows.
  void column(double pan_rad, std::span<Beam> beams) const {
    double c = std::cos(pan_rad), s = std::sin(pan_rad);
    const auto turned = [&](const Eigen::Vector3d& p) -> Eigen::Vector3f {
      return Eigen::Vector3d(c * p.x() - s * p.y(), s * p.x() + c * p.y(), p.z()).cast<float>();
    };
    for (std::size_t row = 0; row < fan_.P_directions.size(); ++row) {
      beams[row].S_direction = turned(fan_.P_directions[row]);
      beams[row].S_origin_m = turned(fan_.P_origin_m);
      const double next = c * cos_row_ - s * sin_row_;
      s = s * cos_row_ + c * sin_row_;
      c = next;
    }
  }

 private:
  const PanFan& fan_;
  double cos_row_, sin_row_;
};

// ScanCloud's order: row by row, column by column.
inline std::vector<Beam> beams_of(const PanFan& fan) {
  const FanAim aim(fan);
  const std::size_t rows = fan.P_directions.size();
  std::vector<Beam> beams;
  beams.reserve(fan.beams());
  for (const double pan_rad : fan.pan_rad) {  // Each column while it is in the cache.
    beams.resize(beams.size() + rows);
    aim.column(pan_rad, std::span(beams).last(rows));
  }
  return beams;
}

}  // namespace hal
