// Random limits and candidates, and a made-up site after some scans: what the tests of Phase II ask
// about.
#pragma once

#include <algorithm>
#include <vector>

#include "planning/next_best_view.hpp"
#include "planning/voxel_map.hpp"
#include "tests/support/voxel_worlds.hpp"

namespace worlds {

inline planning::ViewLimits random_limits(Random& random, double longest_m) {
  planning::ViewLimits limits;
  limits.range_min_m = uniform_int(random, 0, 2) == 0 ? 0 : uniform(random, 0, 4);
  limits.range_max_m = limits.range_min_m + uniform(random, 0, 1.2) * longest_m;
  const double grazing[] = {90, 70, 45, 60, uniform(random, 0, 90), 0};
  limits.grazing_max_deg = grazing[uniform_int(random, 0, 5)];
  return limits;
}

// Some of the seen-empty voxels of some layers, and a few others.
inline std::vector<planning::Voxel> random_candidates(Random& random, const planning::VoxelMap& map,
                                                      int most) {
  const planning::VoxelGrid& grid = map.grid();
  std::vector<planning::Voxel> result;
  const int layers = uniform_int(random, 1, 3);
  for (int l = 0; l < layers; ++l) {
    const int z = uniform_int(random, 0, grid.nz - 1);
    const double share = std::min(1.0, static_cast<double>(most) / (grid.nx * grid.ny * layers));
    for (int y = 0; y < grid.ny; ++y)
      for (int x = 0; x < grid.nx; ++x) {
        const bool empty = map.at({x, y, z}) == planning::VoxelState::seen_empty;
        if (uniform(random, 0, 1) < share * (empty ? 1 : 0.02)) result.push_back({x, y, z});
      }
  }
  return result;
}

// A small fort after six scans.
struct Site {
  World world = fort(120, 5);
  planning::VoxelMap map{{{0, 0, -0.5}, 1.0, 120, 120, 20}};

  Site() {
    Random random(6);
    planning::InsertConfig config;
    config.range_max_m = 60;
    for (const Eigen::Isometry3d& pose : stations(world, 120, 6, 7))
      map.insert(world.scan(sphere(0.5, 0.4), pose, 60, random), pose, config);
  }
};

// A map of noise, what can be seen of it, and from where.
struct ViewCase {
  planning::VoxelMap map;
  std::vector<planning::BoundaryVoxel> boundary;
  std::vector<planning::Voxel> candidates;
  planning::ViewLimits limits;
};

inline ViewCase random_case(std::uint64_t seed, int side = 14, int candidates = 60) {
  Random random(seed);
  const auto length = [&] { return uniform_int(random, 1, side); };
  const int nx = length(), ny = length(), nz = length();
  ViewCase made{
      noise(nx, ny, nz, uniform(random, 0.01, 0.4), uniform(random, 0, 0.3), seed), {}, {}, {}};
  made.boundary = planning::boundary_unseen(made.map);
  made.candidates = random_candidates(random, made.map, candidates);
  made.limits = random_limits(random, 1.5 * side);
  return made;
}

}  // namespace worlds
