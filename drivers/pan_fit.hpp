// The angle of a pan unit that turns at constant speed, from positions asked for now and then.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "hal/values.hpp"

namespace drivers {

struct PanSample {
  hal::Time asked{}, answered{};  // The position was read between the two.
  double angle_rad{};
};

struct PanFit {
  hal::Time origin{};
  double angle_rad{};  // At origin.
  double rate_radps{};
  double residual_rms_rad{}, residual_max_rad{};
  double rate_sigma_radps{};  // 1 sigma of the rate, from the residuals.
  std::size_t used{};

  double angle_at(hal::Time time) const {
    return angle_rad + rate_radps * hal::seconds(time - origin);
  }
};

// Samples at least three, of different times: a line by least squares through the middles of asking
// and answering, without samples further than `outlier_rad` from it (at most a fifth of them).
// Nothing where there are too few.
std::optional<PanFit> fit_pan(const std::vector<PanSample>& samples, double outlier_rad);

// The part of a sweep where the speed is constant: begins and ends `ramp_s` within the first and
// last sample that moved by more than `still_rad`.
std::vector<PanSample> constant_part(const std::vector<PanSample>& samples, double still_rad,
                                     double ramp_s);

}  // namespace drivers
