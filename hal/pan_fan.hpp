// Where the beams of a fan went that turned about the pan axis.
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
  void column(double pan_rad, std::span<Beam> beams) const;

 private:
  const PanFan& fan_;
  double cos_row_, sin_row_;
};

// ScanCloud's order: row by row, column by column.
std::vector<Beam> beams_of(const PanFan& fan);

}  // namespace hal
