#include "tests/support/voxel_worlds.hpp"

namespace worlds {

double hit(const Box& box, const Eigen::Vector3d& from, const Eigen::Vector3d& direction) {
  double enter = 0, leave = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 3; ++i) {
    const double inverse = 1 / direction[i];
    const double a = (box.min_m[i] - from[i]) * inverse, b = (box.max_m[i] - from[i]) * inverse;
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  return enter < leave ? enter : std::numeric_limits<double>::infinity();
}

double World::range_m(const Eigen::Vector3d& from, const Eigen::Vector3d& direction) const {
  double range = std::numeric_limits<double>::infinity();
  if (direction.z() < 0 && from.z() > 0) range = from.z() / -direction.z();
  for (const Box& box : boxes) range = std::min(range, hit(box, from, direction));
  return range;
}

hal::ScanCloud World::scan(const hal::ScanPattern& pattern, const Eigen::Isometry3d& T_W_S,
                           double range_max_m, Random& random, double noise_m,
                           double drop_out_deg) const {
  hal::ScanCloud cloud;
  cloud.pattern = pattern;
  for (std::uint32_t c = 0; c < pattern.columns; ++c)
    for (std::uint32_t r = 0; r < pattern.rows; ++r) {
      const Eigen::Vector3d direction = T_W_S.linear() * direction_of(pattern, c, r);
      const double range = range_m(T_W_S.translation(), direction);
      const bool lost = direction.z() < 0 && -direction.z() < std::sin(drop_out_deg * kDegree);
      const double noise = noise_m > 0 ? uniform(random, -noise_m, noise_m) : 0;
      cloud.ranges_m.push_back(
          range + noise > range_max_m || lost ? 0.0F : static_cast<float>(range + noise));
    }
  return cloud;
}

void grow_bush(hal::ScanCloud& scan, const Eigen::Isometry3d& T_W_S, const Box& bush, double per_m,
               Random& random) {
  std::size_t beam = 0;
  for (std::uint32_t c = 0; c < scan.pattern.columns; ++c)
    for (std::uint32_t r = 0; r < scan.pattern.rows; ++r, ++beam) {
      const Eigen::Vector3d direction = T_W_S.linear() * direction_of(scan.pattern, c, r);
      const double enter_m = hit(bush, T_W_S.translation(), direction);
      if (!std::isfinite(enter_m)) continue;
      const double stop_m = enter_m - std::log(uniform(random, 1e-9, 1)) / per_m;
      const Eigen::Vector3d at = T_W_S.translation() + stop_m * direction;
      float& range_m = scan.ranges_m[beam];
      if ((at.array() >= bush.min_m.array()).all() && (at.array() <= bush.max_m.array()).all() &&
          (range_m == 0 || stop_m < range_m))
        range_m = static_cast<float>(stop_m);
    }
}

}  // namespace worlds
