// What a laser scanner reports of a surface that its beam meets.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "sim/noise.hpp"
#include "sim/scan.hpp"

namespace sim {

class RangeNoise {
 public:
  explicit RangeNoise(const ScannerModel& model)
      : model_(model),
        lossless_cosine_(model.lost_share_max > 0
                             ? static_cast<float>(std::cos(model.grazing_start_rad))
                             : 0.0F) {}

  // Of a surface at `distance_m` with this normal (of any length), seen along `direction` (unit).
  // 0 where the beam is lost or the surface out of range. The same `bits` (64 random ones) give the
  // same answer.
  float reported_m(float distance_m, const Eigen::Vector3f& normal,
                   const Eigen::Vector3f& direction, std::uint64_t bits) const {
    if (is_lost(normal, direction, static_cast<std::uint32_t>(bits))) return 0;
    const double range_m = distance_m;
    if (range_m < model_.range_min_m) return 0;
    if (model_.range_sigma_m == 0) return distance_m;
    const double uniform = (static_cast<double>(bits >> 32) + 0.5) * 0x1p-32;
    const double noisy_m = range_m + model_.range_sigma_m * normal_quantile(uniform);
    const bool in_range = noisy_m >= model_.range_min_m && noisy_m <= model_.range_max_m;
    return in_range ? static_cast<float>(noisy_m) : 0;
  }

 private:
  bool is_lost(const Eigen::Vector3f& normal, const Eigen::Vector3f& direction,
               std::uint32_t bits) const {
    const float along = std::abs(normal.dot(direction));
    const float length2 = normal.squaredNorm() * direction.squaredNorm();
    if (along * along >= lossless_cosine_ * lossless_cosine_ * length2) return false;
    const double incidence_rad = std::acos(static_cast<double>(along / std::sqrt(length2)));
    return bits * 0x1p-32 < lost_share(model_, incidence_rad);
  }

  ScannerModel model_;
  float lossless_cosine_;
};

}  // namespace sim
