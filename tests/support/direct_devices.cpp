#include "tests/support/direct_devices.hpp"

namespace direct {

hal::Profile Obstacles::look() const {
  hal::Profile profile{.stamp = clock_.now(),
                       .beam_period_s = 0,
                       .angle_first_rad = -0.75 * M_PI,
                       .angle_step_rad = 1.5 * M_PI / (kBeams - 1),
                       .ranges_m = std::vector<float>(kBeams),
                       .intensities = {},
                       .lost_before = 0};
  const Eigen::Isometry3d T_W_S = world_.robot().T_W_S(kHeightM);
  for (int i = 0; i < kBeams; ++i) {
    const double angle = profile.angle_first_rad + i * profile.angle_step_rad;
    const Eigen::Vector3d W_direction =
        T_W_S.linear() * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0);
    const auto hit = world_.scene().cast(T_W_S.translation(), W_direction, 0.05, kReachM);
    double range_m = world_.range_to_people_m(T_W_S.translation(), W_direction);
    if (hit) range_m = std::min(range_m, hit->distance_m);
    profile.ranges_m[static_cast<std::size_t>(i)] =
        range_m <= kReachM ? static_cast<float>(range_m) : 0.0F;
  }
  return profile;
}

}  // namespace direct
