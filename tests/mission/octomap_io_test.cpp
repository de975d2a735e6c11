#include "mission/octomap_io.hpp"

#include <gtest/gtest.h>
#include <octomap/octomap.h>

#include <memory>
#include <random>
#include <sstream>

#include "tests/support/temp_folder.hpp"

namespace mission {
namespace {

using planning::Voxel;
using planning::VoxelGrid;
using planning::VoxelState;

// A grid with blocks of equal states (so that pruning has work) and noise.
OctomapGrid some_map(VoxelGrid grid, std::uint64_t seed) {
  OctomapGrid map;
  map.grid = grid;
  std::mt19937_64 random(seed);
  for (int z = 0; z < grid.nz; ++z) {
    for (int y = 0; y < grid.ny; ++y) {
      for (int x = 0; x < grid.nx; ++x) {
        const int block = (x / 9 + 2 * (y / 7) + z / 5) % 3;
        const int state = random() % 50 == 0 ? static_cast<int>(random() % 3) : block;
        map.states.push_back(static_cast<VoxelState>(state));
      }
    }
  }
  return map;
}

std::string bytes_of(const OctomapGrid& map) {
  std::size_t nodes{};
  return octomap_bytes(
      map.grid, [&map](Voxel v) { return map.at(v); }, nodes);
}

std::unique_ptr<octomap::OcTree> read_with_octomap(const std::string& bytes) {
  std::istringstream stream(bytes);
  std::unique_ptr<octomap::AbstractOcTree> tree(octomap::AbstractOcTree::read(stream));
  auto* as_octree = dynamic_cast<octomap::OcTree*>(tree.get());
  if (as_octree != nullptr) (void)tree.release();
  return std::unique_ptr<octomap::OcTree>(as_octree);
}

VoxelState state_in(const octomap::OcTree& tree, const Eigen::Vector3d& point_m) {
  const octomap::OcTreeNode* node = tree.search(point_m.x(), point_m.y(), point_m.z());
  if (node == nullptr) return VoxelState::unseen;
  return tree.isNodeOccupied(node) ? VoxelState::seen_occupied : VoxelState::seen_empty;
}

const VoxelGrid kGrids[] = {
    {{0, 0, 0}, 1.0, 33, 20, 17},
    {{-151.3, -149.77, -0.9}, 1.0, 40, 41, 9},
    {{10.05, -3.33, 0.07}, 0.1, 25, 16, 16},
    {{652000.4, 6862000.6, 34.9}, 0.5, 12, 13, 14},  // Beyond OctoMap's reach from 0.
};

TEST(OctomapIo, OctomapItselfReadsEveryVoxelAtItsPlace) {
  for (const VoxelGrid& grid : kGrids) {
    const OctomapGrid map = some_map(grid, 1);
    const auto tree = read_with_octomap(bytes_of(map));
    ASSERT_TRUE(tree);
    EXPECT_EQ(tree->getResolution(), grid.voxel_m);
    const Eigen::Vector3d offset_m = octomap_offset_m(grid);
    for (int z = 0; z < grid.nz; ++z) {
      for (int y = 0; y < grid.ny; ++y) {
        for (int x = 0; x < grid.nx; ++x) {
          const Voxel v{x, y, z};
          ASSERT_EQ(state_in(*tree, grid.center_m(v) - offset_m), map.at(v))
              << x << ' ' << y << ' ' << z;
        }
      }
    }
  }
}

TEST(OctomapIo, TheTreeIsTheOneOctomapWouldWrite) {
  const OctomapGrid map = some_map(kGrids[1], 2);
  std::size_t nodes{};
  const std::string bytes = octomap_bytes(
      map.grid, [&map](Voxel v) { return map.at(v); }, nodes);
  const auto tree = read_with_octomap(bytes);
  ASSERT_TRUE(tree);
  EXPECT_EQ(tree->size(), nodes);
  tree->updateInnerOccupancy();
  tree->prune();
  EXPECT_EQ(tree->size(), nodes);  // Nothing was left to prune.
  std::ostringstream again;
  tree->writeData(again);
  EXPECT_TRUE(bytes.ends_with(again.str()));  // And the inner values are OctoMap's.
}

TEST(OctomapIo, StaysWithinHalfAVoxelOfTheSiteFrame) {
  for (const VoxelGrid& grid : {kGrids[0], kGrids[1], kGrids[2]}) {
    EXPECT_LE(octomap_offset_m(grid).cwiseAbs().maxCoeff(), grid.voxel_m * 0.5 + 1e-9);
  }
  EXPECT_EQ(octomap_offset_m(kGrids[0]), Eigen::Vector3d::Zero());
}

TEST(OctomapIo, WhatWasWrittenIsReadBack) {
  const test::TempFolder folder;
  for (const VoxelGrid& grid : kGrids) {
    const OctomapGrid map = some_map(grid, 3);
    const auto path = folder.path() / "map.ot";
    const auto wrote = write_octomap(path, grid, [&map](Voxel v) { return map.at(v); });
    ASSERT_TRUE(wrote);
    const OctomapGrid back = read_octomap(path).value();
    EXPECT_EQ(back.states, map.states);
    EXPECT_EQ(back.grid.W_min_m, grid.W_min_m);
    EXPECT_EQ(back.grid.voxel_m, grid.voxel_m);
    EXPECT_EQ(back.offset_m, wrote->offset_m);
  }
}

TEST(OctomapIo, ReadsATreeThatOctomapWrote) {
  octomap::OcTree tree(0.5);
  tree.updateNode(octomap::point3d(1.2F, 3.3F, -0.7F), true);
  tree.updateNode(octomap::point3d(-1.2F, 3.3F, -0.7F), false);
  std::ostringstream stream;
  tree.write(stream);
  const OctomapGrid map = parse_octomap(stream.str(), "theirs.ot").value();
  EXPECT_EQ(map.at(map.grid.voxel_at({1.2, 3.3, -0.7})), VoxelState::seen_occupied);
  EXPECT_EQ(map.at(map.grid.voxel_at({-1.2, 3.3, -0.7})), VoxelState::seen_empty);
  EXPECT_EQ(std::count(map.states.begin(), map.states.end(), VoxelState::unseen),
            static_cast<std::ptrdiff_t>(map.states.size()) - 2);
}

TEST(OctomapIo, AMapInWhichNothingWasSeenIsAnEmptyTree) {
  OctomapGrid map;
  map.grid = {{0, 0, 0}, 1.0, 5, 5, 5};
  map.states.assign(125, VoxelState::unseen);
  const OctomapGrid back = parse_octomap(bytes_of(map), "empty.ot").value();
  EXPECT_EQ(back.states, map.states);
}

TEST(OctomapIo, AFileCutAnywhereIsAnError) {
  const std::string whole = bytes_of(some_map({{0, 0, 0}, 1.0, 6, 5, 4}, 4));
  const std::size_t tree = whole.find("\ndata\n") + 6;
  for (std::size_t size = 0; size < whole.size(); ++size) {
    if (size == tree) continue;  // A header alone is an empty tree.
    EXPECT_FALSE(parse_octomap(std::string_view(whole).substr(0, size), "cut.ot")) << size;
  }
  EXPECT_FALSE(parse_octomap(whole + "x", "long.ot"));
}

TEST(OctomapIo, FlippedBytesNeverCrashTheReader) {
  const std::string whole = bytes_of(some_map({{0, 0, 0}, 1.0, 12, 9, 7}, 5));
  std::mt19937_64 random(6);
  int refused = 0;
  for (int i = 0; i < 2000; ++i) {
    std::string broken = whole;
    broken[random() % broken.size()] ^= static_cast<char>(1U << random() % 8);
    refused += parse_octomap(broken, "broken.ot") ? 0 : 1;
  }
  EXPECT_GT(refused, 0);
}

TEST(OctomapIo, RefusesAGridThatOctomapCannotHold) {
  const auto wrote = write_octomap("/nowhere/map.ot", {{0, 0, 0}, 0.001, 70000, 2, 2},
                                   [](Voxel) { return VoxelState::unseen; });
  ASSERT_FALSE(wrote);
  EXPECT_NE(wrote.error().text().find("raise voxel_m"), std::string::npos);
}

}  // namespace
}  // namespace mission
