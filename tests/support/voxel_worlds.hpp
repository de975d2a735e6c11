// Made-up sites for the voxel tests and benchmarks: boxes on a plane, and scans of them.
#pragma once

#include <boost/random/uniform_int_distribution.hpp>
#include <boost/random/uniform_real_distribution.hpp>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "hal/values.hpp"
#include "planning/voxel_map.hpp"

namespace worlds {

using Random = std::mt19937_64;

inline double uniform(Random& random, double low, double high) {
  return boost::random::uniform_real_distribution<double>(low, high)(random);
}
inline int uniform_int(Random& random, int low, int high) {
  return boost::random::uniform_int_distribution<int>(low, high)(random);
}

struct Box {
  Eigen::Vector3d min_m, max_m;
};

// Distance along the unit direction to the box, or infinity.
double hit(const Box& box, const Eigen::Vector3d& from, const Eigen::Vector3d& direction);

inline Eigen::Isometry3d upright(const Eigen::Vector3d& position_m, double heading_rad) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translate(position_m);
  pose.rotate(Eigen::AngleAxisd(heading_rad, Eigen::Vector3d::UnitZ()));
  return pose;
}

inline constexpr double kDegree = M_PI / 180;

inline hal::ScanPattern sphere(double azimuth_step_deg, double elevation_step_deg,
                               double elevation_min_deg = -60, double elevation_max_deg = 90) {
  hal::ScanPattern pattern;
  pattern.azimuth_step_rad = azimuth_step_deg * kDegree;
  pattern.elevation_first_rad = elevation_min_deg * kDegree;
  pattern.elevation_step_rad = elevation_step_deg * kDegree;
  pattern.columns = static_cast<std::uint32_t>(std::lround(360 / azimuth_step_deg));
  pattern.rows = static_cast<std::uint32_t>(
      std::lround((elevation_max_deg - elevation_min_deg) / elevation_step_deg) + 1);
  return pattern;
}

// Of a beam in S.
inline Eigen::Vector3d direction_of(const hal::ScanPattern& pattern, std::uint32_t column,
                                    std::uint32_t row) {
  const double azimuth = pattern.azimuth_first_rad + column * pattern.azimuth_step_rad;
  const double elevation = pattern.elevation_first_rad + row * pattern.elevation_step_rad;
  return {std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth),
          std::sin(elevation)};
}

// Ground at z = 0 and boxes on it.
struct World {
  std::vector<Box> boxes;

  double range_m(const Eigen::Vector3d& from, const Eigen::Vector3d& direction) const;

  // Beams that graze at less than drop_out_deg from the ground's plane come back with nothing.
  hal::ScanCloud scan(const hal::ScanPattern& pattern, const Eigen::Isometry3d& T_W_S,
                      double range_max_m, Random& random, double noise_m = 0.01,
                      double drop_out_deg = 0) const;
};

// Adds a bush to a scan: a beam that goes through its box is stopped in it with the given
// probability per metre, if nothing stopped it before.
void grow_bush(hal::ScanCloud& scan, const Eigen::Isometry3d& T_W_S, const Box& bush, double per_m,
               Random& random);

// Something like a fort of size_m x size_m: an outer wall with a gate, a ring of casemates around
// a court, huts in the court and trees (boxes) outside. No roof is seen from the ground.
inline World fort(double size_m, std::uint64_t seed) {
  Random random(seed);
  World world;
  const double s = size_m;
  const auto block = [&](double x0, double y0, double x1, double y1, double z1) {
    world.boxes.push_back({{x0 * s, y0 * s, 0}, {x1 * s, y1 * s, z1}});
  };
  block(0.10, 0.10, 0.90, 0.12, 6);
  block(0.10, 0.88, 0.45, 0.90, 6);
  block(0.55, 0.88, 0.90, 0.90, 6);
  block(0.10, 0.12, 0.12, 0.88, 6);
  block(0.88, 0.12, 0.90, 0.88, 6);
  block(0.30, 0.30, 0.70, 0.36, 9);
  block(0.30, 0.64, 0.48, 0.70, 9);
  block(0.53, 0.64, 0.70, 0.70, 9);
  block(0.30, 0.36, 0.36, 0.64, 11);
  block(0.64, 0.36, 0.70, 0.64, 11);
  for (int i = 0; i < 40; ++i) {
    const double x = uniform(random, 0.02, 0.95), y = uniform(random, 0.02, 0.95);
    block(x, y, x + uniform(random, 0.005, 0.03), y + uniform(random, 0.005, 0.03),
          uniform(random, 2, 14));
  }
  return world;
}

// Whether (x, y) is at least margin_m from every box.
inline bool free_at(const World& world, double x, double y, double margin_m) {
  for (const Box& box : world.boxes)
    if (x > box.min_m.x() - margin_m && x < box.max_m.x() + margin_m &&
        y > box.min_m.y() - margin_m && y < box.max_m.y() + margin_m)
      return false;
  return true;
}

// Seen-empty voxels of layer z whose centre column is free.
inline std::vector<planning::Voxel> cells(const planning::VoxelMap& map, const World& world,
                                          int z) {
  std::vector<planning::Voxel> result;
  for (int y = 0; y < map.grid().ny; ++y)
    for (int x = 0; x < map.grid().nx; ++x) {
      const Eigen::Vector3d center = map.grid().center_m({x, y, z});
      if (map.at({x, y, z}) == planning::VoxelState::seen_empty &&
          free_at(world, center.x(), center.y(), 0.5))
        result.push_back({x, y, z});
    }
  return result;
}

// Poses 1.8 m above the ground, spread over the free places.
inline std::vector<Eigen::Isometry3d> stations(const World& world, double size_m, int count,
                                               std::uint64_t seed) {
  Random random(seed);
  std::vector<Eigen::Isometry3d> result;
  while (static_cast<int>(result.size()) < count) {
    const double x = uniform(random, 0.02, 0.98) * size_m, y = uniform(random, 0.02, 0.98) * size_m;
    if (free_at(world, x, y, 1)) result.push_back(upright({x, y, 1.8}, uniform(random, 0, 6.28)));
  }
  return result;
}

// A map of independent random voxels.
inline planning::VoxelMap noise(int nx, int ny, int nz, double unseen, double occupied,
                                std::uint64_t seed) {
  Random random(seed);
  planning::VoxelMap map({{0, 0, 0}, 1.0, nx, ny, nz});
  for (int z = 0; z < nz; ++z)
    for (int y = 0; y < ny; ++y)
      for (int x = 0; x < nx; ++x) {
        const double dice = uniform(random, 0, 1);
        map.set({x, y, z}, dice < unseen              ? planning::VoxelState::unseen
                           : dice < unseen + occupied ? planning::VoxelState::seen_occupied
                                                      : planning::VoxelState::seen_empty);
      }
  return map;
}

}  // namespace worlds
