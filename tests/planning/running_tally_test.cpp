#include "planning/running_tally.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "planning/tally_paths.hpp"
#include "tests/planning/voxel_oracle.hpp"
#include "tests/support/voxel_worlds.hpp"

namespace {

using planning::BoundaryVoxel;
using planning::RunningTally;
using planning::ViewLimits;
using planning::Voxel;
using planning::VoxelGrid;
using planning::VoxelMap;
using planning::VoxelState;
using worlds::Random;
using worlds::uniform;
using worlds::uniform_int;

Voxel any_voxel(Random& random, const VoxelGrid& grid) {
  return {uniform_int(random, 0, grid.nx - 1), uniform_int(random, 0, grid.ny - 1),
          uniform_int(random, 0, grid.nz - 1)};
}

TEST(Shadow, IsWhatASingleBlockedVoxelHides) {
  std::size_t hidden = 0;
  for (std::uint64_t seed = 1; seed <= 3000; ++seed) {
    Random random(seed);
    const int n = uniform_int(random, 2, 12);
    VoxelMap map = worlds::noise(70, n, n, 0, 0, 1);
    Voxel u = any_voxel(random, map.grid()), v = any_voxel(random, map.grid());
    u.x = uniform_int(random, 0, 20);
    v.x = uniform_int(random, 0, 20);
    if (u == v) continue;
    map.set(v, VoxelState::seen_occupied);
    const int z = any_voxel(random, map.grid()).z;
    const planning::Interval rows = planning::rows_behind(u, v, z);
    for (int y = 0; y < n; ++y) {
      const Voxel p{uniform_int(random, 0, 6), y, z};
      const std::uint64_t shadow = planning::shadow_of(u, v, p);
      if (shadow != 0) {
        ASSERT_LE(rows.first, y);
        ASSERT_GE(rows.last, y);
      }
      for (int i = 0; i < 64; ++i) {
        const Voxel candidate{p.x + i, y, z};
        const bool hides = candidate == v || !oracle::visible(map, u, candidate);
        ASSERT_EQ(shadow >> i & 1, hides) << "seed " << seed << " bit " << i << " row " << y;
        hidden += hides;
      }
    }
  }
  EXPECT_GT(hidden, 10000U);
}

// Everything that a tally is asked for, and random changes of it.
struct Scene {
  Random random;
  VoxelMap map;
  std::vector<Voxel> candidates;
  std::vector<BoundaryVoxel> boundary;

  explicit Scene(std::uint64_t seed)
      : random(seed),
        map(worlds::noise(uniform_int(random, 1, seed % 5 == 0 ? 140 : 30),
                          uniform_int(random, 1, 30), uniform_int(random, 1, 12),
                          uniform(random, 0, 0.2), uniform(random, 0, 0.1), seed)) {
    change_candidates();
    change_boundary();
  }

  void change_map() {
    // Now and then in one place, as a scan would; also what no scan does.
    const Voxel around = any_voxel(random, map.grid());
    const int count = uniform_int(random, 0, 30), spread = uniform_int(random, 1, 30);
    for (int i = 0; i < count; ++i) {
      Voxel v = around;
      v.x += uniform_int(random, -spread, spread);
      v.y += uniform_int(random, -spread, spread);
      v.z += uniform_int(random, -spread, spread);
      if (map.grid().contains(v)) map.set(v, static_cast<VoxelState>(uniform_int(random, 0, 2)));
    }
  }
  void change_candidates() {
    if (uniform_int(random, 0, 3) == 0) candidates.clear();
    for (int i = uniform_int(random, 0, 60); i > 0; --i) {
      candidates.push_back(any_voxel(random, map.grid()));
      if (uniform_int(random, 0, 3) != 0) candidates.back().z = map.grid().nz / 2;
    }
    if (!candidates.empty()) candidates.pop_back();
  }
  // In no order, without some, with others that are none.
  void change_boundary() {
    boundary = planning::boundary_unseen(map);
    std::erase_if(boundary, [&](const BoundaryVoxel&) { return uniform_int(random, 0, 9) == 0; });
    for (int i = 0; i < 3; ++i)
      boundary.push_back(
          {any_voxel(random, map.grid()), static_cast<std::uint8_t>(uniform_int(random, 0, 63))});
    if (uniform_int(random, 0, 1) == 0) std::shuffle(boundary.begin(), boundary.end(), random);
  }
};

TEST(RunningTally, EqualsTheLiteralLoopAfterAnyChanges) {
  std::size_t seen = 0, kept = 0, partly = 0;
  for (std::uint64_t seed = 1; seed <= 150; ++seed) {
    Scene scene(seed);
    const double grazing[] = {90, 70, 40};
    const ViewLimits limits{uniform_int(scene.random, 0, 1) * 1.5, uniform(scene.random, 3, 60),
                            grazing[seed % 3]};
    RunningTally running(limits, 1 + static_cast<int>(seed % 3));
    for (int step = 0; step < 12; ++step) {
      const auto& fast = running.update(scene.map, scene.boundary, scene.candidates);
      const auto slow = oracle::tally(scene.map, scene.boundary, scene.candidates, limits);
      ASSERT_EQ(fast, slow) << "seed " << seed << ", step " << step;
      for (const std::uint32_t count : slow) seen += count;
      kept += running.work().kept;
      partly += running.work().partly_swept;
      for (std::size_t i = 0; i < scene.candidates.size(); i += 5)
        ASSERT_EQ(running.visible(scene.candidates[i]),
                  planning::visible_from(scene.map, scene.boundary, scene.candidates[i], limits));
      scene.change_map();
      if (step % 3 != 0) scene.change_candidates();
      scene.change_boundary();
    }
  }
  EXPECT_GT(seen, 1000000U) << "the maps hide too much to test anything";
  EXPECT_GT(kept, 100000U);
  EXPECT_GT(partly, 1000U);
}

// Stations, then next best views, as a mission takes them; the ground is seen by no beam.
TEST(RunningTally, EqualsTheWholeTallyThroughoutAMission) {
  for (const std::uint64_t seed : {5, 6}) {
    const worlds::World world = worlds::fort(120, seed);
    VoxelMap map({{0, 0, -0.5}, 1.0, 120, 120, 14});
    Random random(seed);
    planning::InsertConfig config;
    config.range_max_m = 60;
    const ViewLimits limits{1, 60, 70};
    RunningTally running(limits, 2, {.memory_max_bytes = std::size_t{1} << 30, .self_check = true});
    std::vector<Eigen::Isometry3d> poses = worlds::stations(world, 120, 6, seed);
    std::size_t boundary_voxels = 0, swept = 0;
    for (std::size_t scan = 0; scan < 12; ++scan) {
      const auto cloud = world.scan(worlds::sphere(1, 0.8), poses[scan], 60, random);
      map.insert(cloud, poses[scan], config);
      if (scan == 3) {
        map.grow_z(20);
        map.insert(cloud, poses[scan], config);
      }
      for (int y = 0; y < 120; ++y)
        for (int x = 0; x < 120; ++x)
          if (map.at({x, y, 0}) == VoxelState::seen_empty) map.set({x, y, 0}, VoxelState::unseen);
      const std::vector<Voxel> candidates = worlds::cells(map, world, 2);
      const std::vector<BoundaryVoxel> boundary = planning::boundary_unseen(map);
      const auto best = planning::best(running.update(map, boundary, candidates));
      ASSERT_TRUE(best);
      EXPECT_EQ(running.visible(candidates[best->candidate]).size(), best->gain_voxels);
      if (scan + 1 < poses.size()) continue;
      boundary_voxels += boundary.size();
      swept += running.work().swept + running.work().partly_swept;
      Eigen::Vector3d next_m = map.grid().center_m(candidates[best->candidate]);
      next_m.z() = 1.8;
      poses.push_back(worlds::upright(next_m, 0.3));
    }
    EXPECT_LT(swept, boundary_voxels / 2) << "keeping the sets is of no use";
  }
}

TEST(RunningTally, GoesBackToWholeTalliesWhenItsMemoryIsUsedUp) {
  Scene scene(3);
  const ViewLimits limits{0, 40, 90};
  RunningTally running(limits, 2, {.memory_max_bytes = 1000, .self_check = true});
  for (int step = 0; step < 3; ++step) {
    running.update(scene.map, scene.boundary, scene.candidates);
    EXPECT_TRUE(running.work().whole);
    EXPECT_EQ(running.visible({0, 0, 0}),
              planning::visible_from(scene.map, scene.boundary, {0, 0, 0}, limits));
    scene.change_map();
    scene.change_boundary();
  }
}

TEST(RunningTally, StartsAnewWithAnotherBox) {
  const ViewLimits limits{0, 40, 90};
  RunningTally running(limits, 1);
  for (const std::uint64_t seed : {1, 2, 3}) {
    const Scene scene(seed);
    EXPECT_EQ(running.update(scene.map, scene.boundary, scene.candidates),
              planning::tally(scene.map, scene.boundary, scene.candidates, limits));
    EXPECT_EQ(running.work().swept, scene.boundary.size());
  }
}

TEST(RunningTally, RefusesWhatLiesOutside) {
  const Scene scene(1);
  RunningTally running({0, 40, 90});
  EXPECT_THROW(running.visible({0, 0, 0}), std::invalid_argument);
  EXPECT_THROW(running.update(scene.map, {{{0, -1, 0}, 1}}, {}), std::invalid_argument);
  EXPECT_THROW(running.update(scene.map, {}, {{-1, 0, 0}}), std::invalid_argument);
  running.update(scene.map, {}, {});
  EXPECT_THROW(running.visible({0, 0, 1000}), std::invalid_argument);
}

}  // namespace
