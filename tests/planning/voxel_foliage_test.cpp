#include "planning/voxel_foliage.hpp"

#include <gtest/gtest.h>

#include "tests/planning/voxel_oracle.hpp"
#include "tests/planning/voxel_scans.hpp"
#include "tests/support/voxel_worlds.hpp"

namespace {

using planning::BeamCounts;
using planning::FoliageRule;
using planning::InsertConfig;
using planning::Voxel;
using planning::VoxelMap;
using planning::VoxelState;
using worlds::Random;

TEST(BeamCounts, EqualTheLiteralWalkForAnyScanAndNumberOfThreads) {
  std::int64_t hits = 0, passes = 0;
  for (std::uint64_t seed = 1; seed <= 120; ++seed) {
    Random random(seed);
    worlds::RandomScan s = worlds::random_scan(random);
    const planning::VoxelGrid grid = s.grid;
    BeamCounts fast{VoxelMap(grid)};
    oracle::BeamCounts slow;
    for (int scan = 0; scan < 2; ++scan) {
      fast.add(s.scan, s.T_W_S, s.config);
      slow.add(grid, s.scan, s.T_W_S, s.config);
      s = worlds::random_scan(random);
      s.grid = grid;
      s.T_W_S.translation() = worlds::random_pose(random, grid).translation();
    }
    for (int z = -1; z <= grid.nz; ++z)
      for (int y = -1; y <= grid.ny; ++y)
        for (int x = -1; x <= grid.nx; ++x) {
          const Voxel v{x, y, z};
          const auto of = [&](const auto& counts) {
            const auto found = counts.find(v);
            return found == counts.end() ? 0 : found->second;
          };
          ASSERT_EQ(fast.hits(v), of(slow.hits)) << seed << ": " << x << ' ' << y << ' ' << z;
          ASSERT_EQ(fast.passes(v), of(slow.passes)) << seed << ": " << x << ' ' << y << ' ' << z;
          hits += fast.hits(v);
          passes += fast.passes(v);
        }
  }
  EXPECT_GT(hits, 2000);
  EXPECT_GT(passes, 100000);
}

TEST(BeamCounts, StopAtTheirLargestNumber) {
  BeamCounts counts{VoxelMap({{0, 0, 0}, 1, 3, 1, 1})};
  hal::ScanCloud scan = worlds::beam(2);
  scan.pattern.columns = 10'000;  // All along +x.
  scan.pattern.azimuth_step_rad = 2 * M_PI;
  scan.ranges_m.assign(10'000, 2.0F);
  for (int i = 0; i < 7; ++i) {
    InsertConfig config = worlds::literal();
    config.threads = 1 + i % 3;
    counts.add(scan, worlds::upright({0.5, 0.5, 0.5}, 0), config);
    EXPECT_EQ(counts.passes({1, 0, 0}), std::min(10'000 * (i + 1), 65'535));
    EXPECT_EQ(counts.hits({2, 0, 0}), std::min(10'000 * (i + 1), 65'535));
    EXPECT_EQ(counts.passes({2, 0, 0}), 0);
  }
}

TEST(BeamCounts, CountInTheLayersThatTheMapKeepsAbove) {
  BeamCounts counts{VoxelMap({{0, 0, 0}, 1, 3, 1, 1}, 4)};
  counts.add(worlds::beam(2.0F, M_PI / 2), worlds::upright({0.5, 0.5, 0.5}, 0), worlds::literal());
  EXPECT_EQ(counts.passes({0, 0, 1}), 1);
  EXPECT_EQ(counts.hits({0, 0, 2}), 1);
  EXPECT_EQ(counts.hits({0, 0, 5}), 0);
}

TEST(BeamCounts, CallAVoxelFoliageFromTheShareOnAndNotBelow) {
  // Voxel 1 of a row of three: 16 beams pass it, 4 end in it.
  hal::ScanCloud scan = worlds::beam(2);
  scan.pattern.columns = 20;
  scan.pattern.azimuth_step_rad = 2 * M_PI;
  scan.ranges_m.assign(20, 2.0F);
  std::fill_n(scan.ranges_m.begin(), 4, 1.0F);
  BeamCounts counts{VoxelMap({{0, 0, 0}, 1, 3, 1, 1})};
  counts.add(scan, worlds::upright({0.5, 0.5, 0.5}, 0), worlds::literal());
  EXPECT_TRUE(counts.foliage({1, 0, 0}, {.share_min = 0.8, .passes_min = 16}));
  EXPECT_FALSE(counts.foliage({1, 0, 0}, {.share_min = 0.8, .passes_min = 17}));
  EXPECT_FALSE(counts.foliage({1, 0, 0}, {.share_min = 0.81, .passes_min = 16}));
  EXPECT_FALSE(counts.foliage({2, 0, 0}, {.share_min = 0.5, .passes_min = 1}));
}

// A bush of 4 x 8 x 4 m between the scanners and a wall.
TEST(SeeThrough, OpensABushAndLeavesWallsStanding) {
  worlds::World walls;
  walls.boxes.push_back({{20.4, 0, 0}, {22, 20, 8}});
  VoxelMap map({{0, 0, -0.9}, 1, 30, 20, 12});
  BeamCounts counts(map);
  Random random(1);
  InsertConfig config;
  config.range_max_m = 60;
  config.ground_z_m = 0;
  for (const double y : {4.3, 9.6, 15.2}) {
    const Eigen::Isometry3d pose = worlds::upright({3.5, y, 1.8}, 0);
    hal::ScanCloud scan = walls.scan(worlds::sphere(0.5, 0.5), pose, 60, random);
    worlds::grow_bush(scan, pose, {{10, 6, 0}, {14, 14, 4}}, 0.15, random);
    map.insert(scan, pose, config);
    counts.add(scan, pose, config);
  }
  const VoxelMap seen = planning::see_through(map, counts, FoliageRule{});
  int bush = 0, bush_open = 0, wall = 0;
  for (int z = 1; z < 12; ++z)
    for (int y = 0; y < 20; ++y)
      for (int x = 0; x < 30; ++x) {
        const Voxel v{x, y, z};
        if (map.at(v) != VoxelState::seen_occupied) {
          ASSERT_EQ(seen.at(v), map.at(v));
          continue;
        }
        const bool opened = seen.at(v) == VoxelState::seen_empty;
        ASSERT_EQ(opened, counts.foliage(v, FoliageRule{}));
        if (x >= 10 && x < 14) ++bush, bush_open += opened;
        if (x == 20) {
          ++wall;
          EXPECT_FALSE(opened) << y << ' ' << z << ": " << counts.hits(v) << " hits, "
                               << counts.passes(v) << " passes";
        }
      }
  EXPECT_GT(bush, 80);
  EXPECT_GT(bush_open, bush * 7 / 10) << "of " << bush;
  EXPECT_GT(wall, 100);
}

}  // namespace
