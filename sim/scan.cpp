#include "sim/scan.hpp"

#include <embree3/rtcore.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "sim/parallel.hpp"
#include "sim/range_noise.hpp"

namespace sim {
namespace {

constexpr std::uint32_t kTile = 4;  // Packets of 4 x 4 neighbouring beams.
constexpr std::uint32_t kPacket = kTile * kTile;

std::uint32_t steps(double interval_rad, double step_rad) {
  const double count = std::round(interval_rad / step_rad);
  if (!(step_rad > 0) || !(interval_rad > 0) || !(count < 1e6))
    throw std::invalid_argument(
        "a scan pattern needs positive angles and steps above 1e-6 of them");
  return std::max(1u, static_cast<std::uint32_t>(count));
}

struct SinCos {
  double sin, cos;
};

std::vector<SinCos> sines(double first_rad, double step_rad, std::uint32_t count) {
  std::vector<SinCos> out;
  for (std::uint32_t i = 0; i < count; ++i)
    out.push_back({std::sin(first_rad + i * step_rad), std::cos(first_rad + i * step_rad)});
  return out;
}

class ScanCaster {
 public:
  ScanCaster(const Scene& scene, const Eigen::Isometry3d& T_W_S, const hal::ScanPattern& pattern,
             const ScannerModel& model, std::uint64_t key)
      : scene_(scene),
        R_W_S_(T_W_S.linear().cast<float>()),
        origin_((T_W_S.translation() - scene.origin_m()).cast<float>()),
        pattern_(pattern),
        model_(model),
        key_(key),
        azimuths_(sines(pattern.azimuth_first_rad, pattern.azimuth_step_rad, pattern.columns)),
        elevations_(sines(pattern.elevation_first_rad, pattern.elevation_step_rad, pattern.rows)),
        noise_(model) {
    rtcInitIntersectContext(&context_);
    context_.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  }

  // The kTile columns from `column`.
  void cast_columns(std::uint32_t column, float* ranges_m) {
    for (std::uint32_t row = 0; row < pattern_.rows; row += kTile) {
      RTCRayHit16 rays;
      alignas(64) int valid[kPacket];
      aim(column, row, rays, valid);
      rtcIntersect16(valid, scene_.embree(), &context_, &rays);
      for (std::uint32_t i = 0; i < kPacket; ++i)
        if (valid[i]) {
          const std::size_t beam = beam_index(column, row, i);
          ranges_m[beam] =
              rays.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID ? 0.0f : returned_m(rays, i, beam);
        }
    }
  }

 private:
  std::size_t beam_index(std::uint32_t column, std::uint32_t row, std::uint32_t i) const {
    return std::size_t{column + i / kTile} * pattern_.rows + row + i % kTile;
  }

  void aim(std::uint32_t column, std::uint32_t row, RTCRayHit16& rays, int* valid) const {
    for (std::uint32_t i = 0; i < kPacket; ++i) {
      const std::uint32_t c = column + i / kTile;
      const std::uint32_t r = row + i % kTile;
      valid[i] = c < pattern_.columns && r < pattern_.rows ? -1 : 0;
      const SinCos& azimuth = azimuths_[std::min(c, pattern_.columns - 1)];
      const SinCos& elevation = elevations_[std::min(r, pattern_.rows - 1)];
      const Eigen::Vector3f direction =
          R_W_S_ *
          Eigen::Vector3d(elevation.cos * azimuth.cos, elevation.cos * azimuth.sin, elevation.sin)
              .cast<float>();
      rays.ray.org_x[i] = origin_.x();
      rays.ray.org_y[i] = origin_.y();
      rays.ray.org_z[i] = origin_.z();
      rays.ray.dir_x[i] = direction.x();
      rays.ray.dir_y[i] = direction.y();
      rays.ray.dir_z[i] = direction.z();
      rays.ray.tnear[i] = 0;
      rays.ray.tfar[i] = static_cast<float>(model_.range_max_m);
      rays.ray.time[i] = 0;
      rays.ray.mask[i] = ~0u;
      rays.ray.id[i] = 0;
      rays.ray.flags[i] = 0;
      rays.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
    }
  }

  float returned_m(const RTCRayHit16& rays, std::uint32_t i, std::size_t beam) const {
    const Eigen::Vector3f normal(rays.hit.Ng_x[i], rays.hit.Ng_y[i], rays.hit.Ng_z[i]);
    const Eigen::Vector3f direction(rays.ray.dir_x[i], rays.ray.dir_y[i], rays.ray.dir_z[i]);
    return noise_.reported_m(rays.ray.tfar[i], normal, direction, mix(key_ + beam));
  }

  const Scene& scene_;
  const Eigen::Matrix3f R_W_S_;
  const Eigen::Vector3f origin_;
  const hal::ScanPattern pattern_;
  const ScannerModel model_;
  const std::uint64_t key_;
  const std::vector<SinCos> azimuths_, elevations_;
  const RangeNoise noise_;
  RTCIntersectContext context_;
};

}  // namespace

hal::ScanPattern make_pattern(const ScannerModel& model) {
  const double rise_rad = model.elevation_max_rad - model.elevation_min_rad;
  hal::ScanPattern pattern;
  pattern.columns = steps(model.fov_rad, model.azimuth_step_rad);
  pattern.rows = steps(rise_rad, model.elevation_step_rad);
  if (pattern.beams() > 1'000'000'000)
    throw std::invalid_argument("a scan pattern of more than 1e9 beams");
  pattern.azimuth_step_rad = model.fov_rad / pattern.columns;
  pattern.elevation_step_rad = rise_rad / pattern.rows;
  pattern.azimuth_first_rad = (pattern.azimuth_step_rad - model.fov_rad) / 2;
  pattern.elevation_first_rad = model.elevation_min_rad + pattern.elevation_step_rad / 2;
  return pattern;
}

double lost_share(const ScannerModel& model, double incidence_rad) {
  const double s = std::clamp(
      (incidence_rad - model.grazing_start_rad) / (model.grazing_end_rad - model.grazing_start_rad),
      0.0, 1.0);
  return model.lost_share_max * s * s * (3 - 2 * s);
}

std::vector<float> cast_scan(const Scene& scene, const Eigen::Isometry3d& T_W_S,
                             const hal::ScanPattern& pattern, const ScannerModel& model,
                             std::uint64_t seed, std::uint64_t scan_number, int threads) {
  std::vector<float> ranges_m(pattern.beams());
  const std::uint64_t key = mix(mix(seed) ^ scan_number);
  ScanCaster caster(scene, T_W_S, pattern, model, key);
  const std::size_t strips = (pattern.columns + kTile - 1) / kTile;
  for_each_chunk(strips, threads, [&](std::size_t strip) {
    caster.cast_columns(static_cast<std::uint32_t>(strip) * kTile, ranges_m.data());
  });
  return ranges_m;
}

}  // namespace sim
