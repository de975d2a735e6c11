#include "tests/support/scans.hpp"

namespace scans {

nav::Points sampled(const std::vector<Panel>& panels, const Eigen::Isometry3d& T_W_S, double per_m2,
                    double sigma_m, std::uint64_t seed) {
  support::Dice dice(seed);
  nav::Points points;
  for (const Panel& panel : panels) {
    const double area_m2 = panel.u.cross(panel.v).norm();
    for (int i = 0; i < static_cast<int>(area_m2 * per_m2); ++i) {
      const double a = dice.uniform(0, 1), b = dice.uniform(0, 1);
      Eigen::Vector3d p =
          T_W_S.inverse() * Eigen::Vector3d(panel.corner + a * panel.u + b * panel.v);
      for (int axis = 0; axis < 3; ++axis) p[axis] += dice.gauss(sigma_m);
      if (p.norm() < 45) points.push_back(p.cast<float>());
    }
  }
  return points;
}

nav::Points seen_from(const std::vector<Panel>& panels, const Eigen::Isometry3d& T_W_S,
                      double step_deg, double sigma_m, std::uint64_t seed) {
  support::Dice dice(seed);
  nav::Points points;
  for (double el = -30; el < 60; el += step_deg)
    for (double az = 0; az < 360; az += step_deg) {
      const Eigen::Vector3d S_beam(std::cos(el * kDeg) * std::cos(az * kDeg),
                                   std::cos(el * kDeg) * std::sin(az * kDeg), std::sin(el * kDeg));
      const Eigen::Vector3d beam = T_W_S.linear() * S_beam;
      double range_m = 60;
      for (const Panel& panel : panels) {
        Eigen::Matrix3d A;
        A << panel.u, panel.v, -beam;
        const Eigen::Vector3d hit = A.inverse() * (T_W_S.translation() - panel.corner);
        const bool inside = hit.x() >= 0 && hit.x() <= 1 && hit.y() >= 0 && hit.y() <= 1;
        if (inside && hit.z() > 0 && hit.z() < range_m) range_m = hit.z();
      }
      if (range_m < 60) points.push_back(((range_m + dice.gauss(sigma_m)) * S_beam).cast<float>());
    }
  return points;
}

}  // namespace scans
