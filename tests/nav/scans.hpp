// Made-up scans for tests of the registration, and where the real ones are.
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <thread>
#include <vector>

#include "hal/angles.hpp"
#include "nav/registration/registration.hpp"
#include "tests/support/random_site.hpp"

namespace scans {

using hal::kDeg;

inline Eigen::Isometry3d pose(double x_m, double y_m, double z_m, double yaw_deg,
                              double pitch_deg = 0, double roll_deg = 0) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() = Eigen::Vector3d(x_m, y_m, z_m);
  T.linear() = (Eigen::AngleAxisd(yaw_deg * kDeg, Eigen::Vector3d::UnitZ()) *
                Eigen::AngleAxisd(pitch_deg * kDeg, Eigen::Vector3d::UnitY()) *
                Eigen::AngleAxisd(roll_deg * kDeg, Eigen::Vector3d::UnitX()))
                   .toRotationMatrix();
  return T;
}

// A rectangle in space: a corner and two edges.
struct Panel {
  Eigen::Vector3d corner, u, v;
};

// In W: a yard of 40 x 30 m with walls of 6 m, two sheds and ground.
inline std::vector<Panel> yard() {
  std::vector<Panel> panels{{{-20, -15, 0}, {40, 0, 0}, {0, 30, 0}},
                            {{-20, -15, 0}, {40, 0, 0}, {0, 0, 6}},
                            {{-20, 15, 0}, {40, 0, 0}, {0, 0, 6}},
                            {{-20, -15, 0}, {0, 30, 0}, {0, 0, 6}},
                            {{20, -15, 0}, {0, 30, 0}, {0, 0, 6}}};
  for (const Eigen::Vector3d& at : {Eigen::Vector3d(6, 5, 0), Eigen::Vector3d(-12, -9, 0)}) {
    panels.push_back({at, {4, 0, 0}, {0, 0, 3}});
    panels.push_back({at, {0, 5, 0}, {0, 0, 3}});
    panels.push_back({at + Eigen::Vector3d(0, 5, 0), {4, 0, 0}, {0, 0, 3}});
    panels.push_back({at + Eigen::Vector3d(4, 0, 0), {0, 5, 0}, {0, 0, 3}});
  }
  return panels;
}

// Two long walls and the ground between them, along x.
inline std::vector<Panel> corridor() {
  return {{{-60, -3, 0}, {120, 0, 0}, {0, 6, 0}},
          {{-60, -3, 0}, {120, 0, 0}, {0, 0, 4}},
          {{-60, 3, 0}, {120, 0, 0}, {0, 0, 4}}};
}

// Random points on the panels, as far as 45 m from the scanner, with noise. No panel hides another:
// for what depends on that, see seen_from().
inline nav::Points sampled(const std::vector<Panel>& panels, const Eigen::Isometry3d& T_W_S,
                           double per_m2, double sigma_m, std::uint64_t seed) {
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

// What a scanner sees: the nearest panel along beams of `step_deg`, from -30 deg up to 60 deg.
inline nav::Points seen_from(const std::vector<Panel>& panels, const Eigen::Isometry3d& T_W_S,
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

// Pieces on two threads, in an order left to chance.
inline void on_two_threads(std::size_t count, const std::function<void(std::size_t)>& work) {
  const std::jthread other([&] {
    for (std::size_t i = 1; i < count; i += 2) work(i);
  });
  for (std::size_t i = 0; i < count; i += 2) work(i);
}

inline std::filesystem::path folder() {
  return std::filesystem::path(VANTAGE_SOURCE_DIR) / "../shared/data/scans";
}
inline std::string bytes_of(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

#define SCANS_OR_SKIP(name) \
  if (!std::filesystem::exists(scans::folder() / (name))) GTEST_SKIP() << "no scans " << (name)

}  // namespace scans
