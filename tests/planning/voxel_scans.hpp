// Scans for the tests of the voxel map: single beams, and random ones of any kind that a scanner
// could have, and worse.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "planning/voxel_map.hpp"
#include "tests/support/voxel_worlds.hpp"

namespace worlds {

// One beam along +x of S with the given range.
inline hal::ScanCloud beam(float range_m, double elevation_rad = 0) {
  hal::ScanCloud scan;
  scan.pattern.columns = scan.pattern.rows = 1;
  scan.pattern.elevation_first_rad = elevation_rad;
  scan.ranges_m = {range_m};
  return scan;
}

inline planning::InsertConfig literal(double range_max_m = 100) {
  planning::InsertConfig config;
  config.range_min_m = 0;
  config.range_max_m = range_max_m;
  config.no_return_window = 0;
  return config;
}

// A pattern, ranges and pose of any kind that a scanner could have, and worse.
struct RandomScan {
  planning::VoxelGrid grid;
  hal::ScanCloud scan;
  Eigen::Isometry3d T_W_S = Eigen::Isometry3d::Identity();
  planning::InsertConfig config;
};

inline hal::ScanPattern random_pattern(Random& random) {
  hal::ScanPattern pattern;
  pattern.columns = static_cast<std::uint32_t>(uniform_int(random, 1, 90));
  pattern.rows = static_cast<std::uint32_t>(uniform_int(random, 1, 60));
  pattern.azimuth_first_rad = uniform(random, -7, 7);
  pattern.elevation_first_rad = uniform(random, -1.6, 0.5);
  const double sign = uniform_int(random, 0, 1) != 0 ? 1 : -1;
  switch (uniform_int(random, 0, 3)) {
    case 0:
      pattern.azimuth_step_rad = sign * 2 * M_PI / pattern.columns;
      break;
    case 1:
      pattern.azimuth_step_rad = sign * uniform(random, 0.001, 0.02);
      break;
    case 2:
      pattern.azimuth_step_rad = sign * uniform(random, 0.02, 0.2);
      break;
    default:
      pattern.azimuth_step_rad = sign * M_PI / 64;
      pattern.azimuth_first_rad = 0;
  }
  pattern.elevation_step_rad = uniform(random, 0.002, 0.08);
  if (uniform_int(random, 0, 3) == 0) pattern.elevation_step_rad = M_PI / 64;
  if (uniform_int(random, 0, 3) == 0) {
    pattern.elevation_first_rad = 1.57;
    pattern.elevation_step_rad *= -1;
  }
  return pattern;
}

inline Eigen::Isometry3d random_pose(Random& random, const planning::VoxelGrid& grid) {
  Eigen::Vector3d q;
  for (int i = 0; i < 3; ++i) q[i] = uniform(random, -3, std::max({grid.nx, grid.ny, grid.nz}) + 3);
  if (uniform_int(random, 0, 2) == 0) q = q.array().round();  // On corners of voxels.
  if (uniform_int(random, 0, 2) == 0)
    q = q.cwiseMin(Eigen::Vector3d(grid.nx, grid.ny, grid.nz) * 0.7).cwiseMax(0.3);
  Eigen::Isometry3d pose = upright(grid.W_min_m + grid.voxel_m * q, uniform(random, -4, 4));
  const int kind = uniform_int(random, 0, 3);
  if (kind == 0) pose.linear().setIdentity();
  if (kind == 1)
    pose.rotate(Eigen::AngleAxisd(uniform(random, -0.2, 0.2), Eigen::Vector3d::UnitX()));
  if (kind == 2)
    pose.linear() = Eigen::Quaterniond(uniform(random, -1, 1), uniform(random, -1, 1),
                                       uniform(random, -1, 1), uniform(random, 0.1, 1))
                        .normalized()
                        .toRotationMatrix();
  return pose;
}

// Beams off the pattern by something: a scanner that turns as it measures, mounted askew, with its
// optics beside the pan axis; or worse.
inline void bend(hal::ScanCloud& scan, Random& random) {
  const hal::ScanPattern& pattern = scan.pattern;
  const double skew_rad = uniform(random, -1, 1) * pattern.azimuth_step_rad;
  const double off_rad = uniform_int(random, 0, 1) * uniform(random, 0, 0.3);
  const double off_m = uniform_int(random, 0, 3) == 0 ? 1 : uniform(random, 0, 0.2);
  for (std::uint32_t column = 0; column < pattern.columns; ++column)
    for (std::uint32_t row = 0; row < pattern.rows; ++row) {
      const double azimuth = pattern.azimuth_first_rad + column * pattern.azimuth_step_rad +
                             skew_rad * row / pattern.rows + uniform(random, -1, 1) * off_rad;
      const double elevation = pattern.elevation_first_rad + row * pattern.elevation_step_rad +
                               uniform(random, -1, 1) * off_rad;
      const Eigen::Vector3d direction(std::cos(elevation) * std::cos(azimuth),
                                      std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
      const Eigen::Vector3d origin(uniform(random, -1, 1), uniform(random, -1, 1),
                                   uniform(random, -1, 1));
      scan.beams.push_back({(off_m * origin).cast<float>(), direction.cast<float>().normalized()});
    }
}

// Walls around the scanner, some of them nearer than it measures, some no more than a point.
inline void stand_walls(RandomScan& scan, Random& random) {
  const Eigen::Vector2d W_scanner_m = scan.T_W_S.translation().head<2>();
  const auto near = [&] {
    return Eigen::Vector2d(W_scanner_m +
                           Eigen::Vector2d(uniform(random, -4, 4), uniform(random, -4, 4)));
  };
  for (int i = uniform_int(random, 1, 5); i > 0; --i) {
    const Eigen::Vector2d from = near();
    scan.config.walls.push_back({from, uniform_int(random, 0, 5) == 0 ? from : near()});
  }
  scan.config.walls_margin_m = uniform_int(random, 0, 3) == 0 ? 1e-4 : uniform(random, 1e-4, 0.5);
}

inline RandomScan random_scan(Random& random) {
  RandomScan result;
  const int sides[] = {1, 2, 7, 20, 33, 63, 64, 65, 130};
  result.grid.voxel_m = uniform_int(random, 0, 1) != 0 ? 1.0 : uniform(random, 0.2, 2);
  result.grid.W_min_m = {uniform(random, -50, 50), uniform(random, -50, 50),
                         uniform(random, -5, 5)};
  result.grid.nx = sides[uniform_int(random, 0, 8)];
  result.grid.ny = sides[uniform_int(random, 0, 6)];
  result.grid.nz = sides[uniform_int(random, 0, 4)];
  result.scan.pattern = random_pattern(random);
  result.T_W_S = random_pose(random, result.grid);
  planning::InsertConfig& config = result.config;
  config.range_min_m = uniform(random, 0, 3);
  config.range_max_m = uniform(random, 4, 60);
  config.carve_no_return = uniform_int(random, 0, 4) != 0;
  config.no_return_window = uniform_int(random, 0, 3);
  config.threads = uniform_int(random, 1, 3);
  if (uniform_int(random, 0, 1) != 0)
    config.ground_z_m = result.grid.W_min_m.z() + uniform(random, -2, 5);
  const double lost = uniform(random, 0, 1), smooth = uniform(random, 0, 1);
  float range_m = 5;
  for (std::size_t i = 0; i < result.scan.pattern.beams(); ++i) {
    if (uniform(random, 0, 1) > smooth) range_m = static_cast<float>(uniform(random, 0.01, 70));
    float out = uniform(random, 0, 1) < lost ? 0.0F : range_m;
    if (uniform_int(random, 0, 200) == 0) out = std::numeric_limits<float>::quiet_NaN();
    if (uniform_int(random, 0, 200) == 0) out = -1;
    result.scan.ranges_m.push_back(out);
  }
  if (uniform_int(random, 0, 2) == 0) bend(result.scan, random);
  if (uniform_int(random, 0, 1) == 0) stand_walls(result, random);
  return result;
}

}  // namespace worlds
