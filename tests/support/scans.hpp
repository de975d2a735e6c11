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
nav::Points sampled(const std::vector<Panel>& panels, const Eigen::Isometry3d& T_W_S, double per_m2,
                    double sigma_m, std::uint64_t seed);

// What a scanner sees: the nearest panel along beams of `step_deg`, from -30 deg up to 60 deg.
nav::Points seen_from(const std::vector<Panel>& panels, const Eigen::Isometry3d& T_W_S,
                      double step_deg, double sigma_m, std::uint64_t seed);

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
