#include "mission/octomap_io.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <octomap/ColorOcTree.h>
#include <octomap/octomap.h>

#include <memory>
#include <random>
#include <sstream>

#include "tests/support/temp_folder.hpp"

namespace mission {
namespace {

using planning::Voxel;
using planning::VoxelGrid;
using planning::VoxelMap;
using planning::VoxelState;
using testing::HasSubstr;

constexpr OctomapFormat kFormats[] = {OctomapFormat::full, OctomapFormat::binary};

// A map with blocks of equal states (so that pruning has work) and noise.
VoxelMap some_map(const VoxelGrid& grid, std::uint64_t seed) {
  VoxelMap map(grid);
  std::mt19937_64 random(seed);
  for (int z = 0; z < grid.nz; ++z)
    for (int y = 0; y < grid.ny; ++y)
      for (int x = 0; x < grid.nx; ++x) {
        const int block = (x / 9 + 2 * (y / 7) + z / 5) % 3;
        const int state = random() % 50 == 0 ? static_cast<int>(random() % 3) : block;
        map.set({x, y, z}, static_cast<VoxelState>(state));
      }
  return map;
}

// By OctoMap's own library.
std::unique_ptr<octomap::OcTree> read_with_octomap(const std::string& bytes, OctomapFormat format) {
  std::istringstream stream(bytes);
  if (format == OctomapFormat::binary) {
    auto tree = std::make_unique<octomap::OcTree>(1.0);
    return tree->readBinary(stream) ? std::move(tree) : nullptr;
  }
  std::unique_ptr<octomap::AbstractOcTree> tree(octomap::AbstractOcTree::read(stream));
  auto* as_octree = dynamic_cast<octomap::OcTree*>(tree.get());
  if (as_octree != nullptr) (void)tree.release();
  return std::unique_ptr<octomap::OcTree>(as_octree);
}

std::string written_by_octomap(octomap::OcTree& tree, OctomapFormat format) {
  std::ostringstream stream;
  if (format == OctomapFormat::full)
    tree.write(stream);
  else
    tree.writeBinary(stream);
  return stream.str();
}

VoxelState state_in(const octomap::OcTree& tree, const Eigen::Vector3d& point_m) {
  const octomap::OcTreeNode* node = tree.search(point_m.x(), point_m.y(), point_m.z());
  if (node == nullptr) return VoxelState::unseen;
  return tree.isNodeOccupied(node) ? VoxelState::seen_occupied : VoxelState::seen_empty;
}

// Fails unless every voxel of the map, and one around it, is as OctoMap's tree has it.
void expect_same(const VoxelMap& map, const octomap::OcTree& tree,
                 const Eigen::Vector3d& offset_m) {
  const VoxelGrid& grid = map.grid();
  for (int z = -1; z <= grid.nz; ++z)
    for (int y = -1; y <= grid.ny; ++y)
      for (int x = -1; x <= grid.nx; ++x) {
        const Voxel v{x, y, z};
        ASSERT_EQ(state_in(tree, grid.center_m(v) - offset_m), map.at(v))
            << x << ' ' << y << ' ' << z;
      }
}

std::string error_of(const std::string& bytes) {
  const auto read = parse_octomap(bytes, "maps/site.ot");
  return read ? "" : read.error().text();
}

std::string header(const std::string& lines, const std::string& first = "# Octomap OcTree file") {
  return first + "\n" + lines + "data\n";
}

const VoxelGrid kGrids[] = {
    {{0, 0, 0}, 1.0, 33, 20, 17},
    {{-151.0, -149.0, -0.9}, 1.0, 40, 41, 9},
    {{10.05, -3.33, 0.07}, 0.1, 25, 16, 16},
    {{652000.4, 6862000.6, 34.9}, 0.5, 12, 13, 14},  // Beyond OctoMap's reach from 0.
};

TEST(OctomapIo, OctomapItselfReadsEveryVoxelAtItsPlace) {
  for (const OctomapFormat format : kFormats)
    for (const VoxelGrid& grid : kGrids) {
      const VoxelMap map = some_map(grid, 1);
      const auto tree = read_with_octomap(octomap_bytes(map, format), format);
      ASSERT_TRUE(tree);
      EXPECT_EQ(tree->getResolution(), grid.voxel_m);
      expect_same(map, *tree, octomap_offset_m(grid));
    }
}

TEST(OctomapIo, TheTreeIsTheOneOctomapWouldWrite) {
  for (const OctomapFormat format : kFormats) {
    const std::string bytes = octomap_bytes(some_map(kGrids[1], 2), format);
    const auto tree = read_with_octomap(bytes, format);
    ASSERT_TRUE(tree);
    const std::size_t nodes = tree->size();
    EXPECT_THAT(bytes, HasSubstr("\nsize " + std::to_string(nodes) + "\n"));
    tree->updateInnerOccupancy();
    tree->prune();
    EXPECT_EQ(tree->size(), nodes);  // Nothing was left to prune.
    std::ostringstream again;
    if (format == OctomapFormat::full)
      tree->writeData(again);  // The inner values are OctoMap's as well.
    else
      tree->writeBinaryData(again);
    EXPECT_TRUE(bytes.ends_with(again.str()));
  }
}

TEST(OctomapIo, LiesInTheSiteFrameInXAndYAndWithinHalfAVoxelOfItInZ) {
  EXPECT_EQ(octomap_offset_m(kGrids[0]), Eigen::Vector3d::Zero());
  const Eigen::Vector3d offset_m = octomap_offset_m(kGrids[1]);
  EXPECT_EQ(offset_m.x(), 0);
  EXPECT_EQ(offset_m.y(), 0);
  EXPECT_LE(std::abs(offset_m.z()), 0.5);
  EXPECT_LE(octomap_offset_m(kGrids[2]).cwiseAbs().maxCoeff(), 0.05 + 1e-9);
}

TEST(OctomapIo, WhatWasWrittenIsReadBackIntoTheSiteFrame) {
  const test::TempFolder folder;
  for (const char* name : {"map.ot", "map.bt"})
    for (const VoxelGrid& grid : kGrids) {
      const VoxelMap map = some_map(grid, 3);
      const auto wrote = write_octomap(folder.path() / name, map);
      ASSERT_TRUE(wrote);
      const OctomapMap back = read_octomap(folder.path() / name).value();
      EXPECT_EQ(back.map, map);
      EXPECT_EQ(back.map.grid().W_min_m, grid.W_min_m);
      EXPECT_EQ(back.map.grid().voxel_m, grid.voxel_m);
      EXPECT_EQ(back.offset_m, wrote->offset_m);
      EXPECT_TRUE(back.ours);
    }
  const auto size = [&](const char* name) {
    return std::filesystem::file_size(folder.path() / name);
  };
  EXPECT_LT(size("map.bt"), size("map.ot"));
}

// Points with known places in a tree of another resolution than ours, by OctoMap's own insertion.
octomap::OcTree their_tree(double resolution_m, std::uint64_t seed) {
  octomap::OcTree tree(resolution_m);
  std::mt19937_64 random(seed);
  const auto coordinate = [&](double extent_m) {
    return static_cast<float>((static_cast<double>(random() % 2000) / 1000 - 1) * extent_m);
  };
  for (int scan = 0; scan < 3; ++scan) {
    octomap::Pointcloud cloud;
    for (int i = 0; i < 400; ++i) cloud.push_back(coordinate(6), coordinate(4), coordinate(1) - 7);
    tree.insertPointCloud(cloud, octomap::point3d(0.1F, 0.2F, 5.3F));
  }
  return tree;
}

TEST(OctomapIo, ReadsTreesThatOctomapWroteVoxelForVoxel) {
  for (const double resolution_m : {0.05, 0.13, 0.5, 2.0})
    for (const OctomapFormat format : kFormats) {
      octomap::OcTree tree = their_tree(resolution_m, 1);
      const OctomapMap read = parse_octomap(written_by_octomap(tree, format), "theirs").value();
      EXPECT_FALSE(read.ours);
      EXPECT_EQ(read.offset_m, Eigen::Vector3d::Zero());
      EXPECT_EQ(read.map.grid().voxel_m, resolution_m);
      EXPECT_GT(read.map.counts().seen_occupied, 20u);
      EXPECT_GT(read.map.counts().seen_empty, 50u);
      if (resolution_m > 0.1) expect_same(read.map, tree, {0, 0, 0});
    }
}

TEST(OctomapIo, ReadsTheSameFromBothFormatsOfATree) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    octomap::OcTree tree = their_tree(0.3, seed);
    // Log-odds of 0 are occupied in OctoMap.
    tree.setNodeValue(octomap::point3d(3.1F, 3.1F, 3.1F), 0.0F);
    const OctomapMap full =
        parse_octomap(written_by_octomap(tree, OctomapFormat::full), "a.ot").value();
    const OctomapMap binary =
        parse_octomap(written_by_octomap(tree, OctomapFormat::binary), "a.bt").value();
    EXPECT_EQ(full.map, binary.map);
    EXPECT_EQ(full.map.grid().W_min_m, binary.map.grid().W_min_m);
    EXPECT_EQ(full.map.at(full.map.grid().voxel_at({3.1, 3.1, 3.1})), VoxelState::seen_occupied);
  }
}

TEST(OctomapIo, ExpandsLeavesAboveTheLowestLevelToAllTheirVoxels) {
  octomap::OcTree tree(1.0);
  for (int x = 0; x < 8; ++x)
    for (int y = 0; y < 8; ++y)
      for (int z = 0; z < 8; ++z)
        tree.setNodeValue(
            octomap::point3d(static_cast<float>(x) + 0.5F, static_cast<float>(y) + 0.5F,
                             static_cast<float>(z) + 8.5F),
            -1.0F);
  tree.setNodeValue(octomap::point3d(-0.5F, 0.5F, 8.5F), 1.0F);
  tree.updateInnerOccupancy();
  tree.prune();
  ASSERT_EQ(tree.getNumLeafNodes(), 2u);
  for (const OctomapFormat format : kFormats) {
    const OctomapMap read = parse_octomap(written_by_octomap(tree, format), "big").value();
    EXPECT_EQ(read.map.grid().nx, 9);
    EXPECT_EQ(read.map.grid().W_min_m, Eigen::Vector3d(-1, 0, 8));
    EXPECT_EQ(read.map.counts(), (planning::VoxelCounts{63, 512, 1}));
    expect_same(read.map, tree, {0, 0, 0});
  }
}

TEST(OctomapIo, WhatOctomapWroteAgainIsReadWhereItStands) {
  const VoxelMap map = some_map(kGrids[1], 4);
  auto tree = read_with_octomap(octomap_bytes(map), OctomapFormat::full);
  ASSERT_TRUE(tree);
  const OctomapMap read =
      parse_octomap(written_by_octomap(*tree, OctomapFormat::full), "again.ot").value();
  EXPECT_FALSE(read.ours);
  EXPECT_EQ(read.map.counts().seen_occupied, map.counts().seen_occupied);
  expect_same(read.map, *tree, {0, 0, 0});
}

TEST(OctomapIo, AMapInWhichNothingWasSeenIsAnEmptyTree) {
  const VoxelMap map({{0, 0, 0}, 1.0, 5, 5, 5});
  for (const OctomapFormat format : kFormats) {
    const std::string bytes = octomap_bytes(map, format);
    EXPECT_EQ(parse_octomap(bytes, "empty").value().map, map);
    const auto tree = read_with_octomap(bytes, format);
    EXPECT_TRUE(tree && tree->size() == 0);
  }
}

TEST(OctomapIo, AFileCutAnywhereIsAnError) {
  for (const OctomapFormat format : kFormats) {
    const std::string whole = octomap_bytes(some_map({{0, 0, 0}, 1.0, 6, 5, 4}, 4), format);
    for (std::size_t size = 0; size < whole.size(); ++size)
      EXPECT_FALSE(parse_octomap(std::string_view(whole).substr(0, size), "cut.ot")) << size;
    EXPECT_FALSE(parse_octomap(whole + "x", "long.ot"));
  }
}

TEST(OctomapIo, FlippedBytesNeverCrashTheReader) {
  for (const OctomapFormat format : kFormats) {
    const std::string whole = octomap_bytes(some_map({{0, 0, 0}, 1.0, 12, 9, 7}, 5), format);
    std::mt19937_64 random(6);
    int refused = 0;
    for (int i = 0; i < 2000; ++i) {
      std::string broken = whole;
      broken[random() % broken.size()] ^= static_cast<char>(1U << random() % 8);
      refused += parse_octomap(broken, "broken.ot") ? 0 : 1;
    }
    EXPECT_GT(refused, 0);
  }
}

TEST(OctomapIo, SaysWhichFileWhatIsWrongAndWhatToDo) {
  EXPECT_THAT(error_of("ply\n"), HasSubstr("cannot read maps/site.ot"));
  EXPECT_THAT(error_of("ply\n"), HasSubstr("not an OctoMap file: the first line must be"));
  EXPECT_THAT(error_of("# Octomap OcTree file\nid OcTree\n"), HasSubstr("no line 'data'"));
  EXPECT_THAT(error_of(header("id OcTree\nsize 0\n")), HasSubstr("'res' is missing"));
  EXPECT_THAT(error_of(header("id OcTree\nsize 0\nres -1\n")), HasSubstr("positive"));
  EXPECT_THAT(error_of(header("id OcTree\nres 1\n")), HasSubstr("'size' is missing"));
  EXPECT_THAT(error_of(header("id OcTree\nsize 0\nres 1\n")), HasSubstr("no known voxel"));
  EXPECT_THAT(error_of(header("id OcTree\nsize 3\nres 1\n")),
              HasSubstr("its tree has 0 nodes, its line 'size' says 3"));
  EXPECT_THAT(error_of(header("id OcTree\nsize 1\nres 1\n") + std::string("\0\0\x80\x3f\1", 5)),
              HasSubstr("cut short (node 2, byte 5 after the header)"));
  EXPECT_THAT(error_of(header("id OcTree\nsize 1\nres 1\n") + std::string("\0\0\xc0\x7f\0", 5)),
              HasSubstr("not a number"));
  EXPECT_THAT(error_of(header("id OcTree\nsize 1\nres 1\n") + std::string("\0\0\x80\x3f\0", 5)),
              HasSubstr("it spans 65536 x 65536 x 65536 voxels of 1 m"));
  std::string deep = header("id OcTree\nsize 18\nres 1\n", "# Octomap OcTree binary file");
  for (int i = 0; i < 18; ++i) deep += std::string("\3\0", 2);
  EXPECT_THAT(error_of(deep), HasSubstr("deeper than 16 levels"));
  octomap::ColorOcTree color(0.5);
  color.updateNode(octomap::point3d(1, 1, 1), true);
  std::ostringstream stream;
  color.write(stream);
  EXPECT_THAT(error_of(stream.str()), HasSubstr("its tree is of type 'ColorOcTree'"));
}

TEST(OctomapIo, RefusesAGridThatOctomapCannotHold) {
  const auto wrote = write_octomap("/nowhere/map.ot", {{0, 0, 0}, 0.001, 70000, 2, 2},
                                   [](Voxel) { return VoxelState::unseen; });
  ASSERT_FALSE(wrote);
  EXPECT_THAT(wrote.error().text(), HasSubstr("raise voxel_m"));
}

}  // namespace
}  // namespace mission
