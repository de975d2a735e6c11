// What the mission's voxel model makes of scans: its box grows, and foliage does not hide.
#include "mission/site_model.hpp"

#include <gtest/gtest.h>

#include "nav/polygons.hpp"
#include "tests/support/voxel_worlds.hpp"

namespace mission {
namespace {

using planning::VoxelState;

nav::Ring box(double x0_m, double y0_m, double x1_m, double y1_m) {
  return {nav::to_mm({x0_m, y0_m}), nav::to_mm({x1_m, y0_m}), nav::to_mm({x1_m, y1_m}),
          nav::to_mm({x0_m, y1_m})};
}

constexpr double kSideM = 60;

// A yard of 60 m with a tower of 6 x 6 m in its middle.
nav::SiteMap yard() {
  nav::SiteMap map;
  map.name = "yard";
  map.boundary = {{box(0, 0, kSideM, kSideM), {}}};
  return map;
}

std::vector<AreaTask> tasks() {
  nav::FreeArea area;
  area.name = area.region = "yard";
  area.drivable = {{box(0, 0, kSideM, kSideM), {box(27, 27, 33, 33)}}};
  std::reverse(area.drivable[0].holes[0].begin(), area.drivable[0].holes[0].end());
  area.standable = nav::offset(area.drivable, -500);
  return {{area, AreaMode::robot}};
}

MissionConfig config_of(const std::string& phase2) {
  const auto loaded = parse_mission("[phase2]\ngain_min_voxels = 1\n" + phase2, "m.toml", "", "");
  EXPECT_TRUE(loaded.errors.empty());
  return loaded.config;
}

SiteModel model_of(const std::string& phase2) {
  return SiteModel(config_of(phase2), yard(), tasks(), 2);
}

worlds::World tower(double height_m) {
  worlds::World world;
  world.boxes.push_back({{27, 27, 0}, {33, 33, height_m}});
  return world;
}

std::vector<Eigen::Isometry3d> around_tower() {
  std::vector<Eigen::Isometry3d> poses;
  for (const auto& [x, y] : {std::pair{5.3, 8.1}, {52.4, 11.7}, {48.9, 50.2}, {9.6, 49.5}})
    poses.push_back(worlds::upright({x, y, 1.8}, x));
  return poses;
}

ScanEffect add(SiteModel& model, const hal::ScanCloud& scan, const Eigen::Isometry3d& pose) {
  return model.add(scan, {}, pose, 0);
}

hal::ScanCloud scan_of(const worlds::World& world, const Eigen::Isometry3d& pose) {
  worlds::Random random(1);
  return world.scan(worlds::sphere(1, 0.5), pose, 100, random);
}

void expect_same(SiteModel& low, SiteModel& high) {
  EXPECT_EQ(low.map().grid().nz, high.map().grid().nz);
  EXPECT_EQ(low.map(), high.map());
  EXPECT_EQ(low.counts().boundary_unseen, high.counts().boundary_unseen);
  EXPECT_EQ(low.points_outside_box(), high.points_outside_box());
  EXPECT_EQ(low.points_above_box(), high.points_above_box());
  const std::vector<NextView> a = low.next_views(), b = high.next_views();
  ASSERT_EQ(a.size(), b.size());
  ASSERT_FALSE(a.empty());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].cell.voxel, b[i].cell.voxel);
    EXPECT_EQ(a[i].voxels, b[i].voxels);
  }
}

TEST(SiteModelGrowth, EndsAsABoxThatWasHighEnoughFromTheStart) {
  SiteModel low = model_of("height_m = 10\n");
  const int layers = low.map().grid().nz;
  int added = 0;
  // What is low comes first, so that the box grows after scans that it was too low for.
  const double heights_m[] = {8, 17, 44.8, 44.8};
  SiteModel high = model_of("height_m = 45\nheight_max_m = 0\n");
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Isometry3d pose = around_tower()[i];
    const hal::ScanCloud scan = scan_of(tower(heights_m[i]), pose);
    const ScanEffect grown = add(low, scan, pose), whole = add(high, scan, pose);
    EXPECT_EQ(grown.points_outside_box, whole.points_outside_box);
    added += grown.layers_added;
    EXPECT_EQ(whole.layers_added, 0);
    EXPECT_EQ(low.map().grid().nz, layers + added);
  }
  // The tower's top is in layer 45 (the ground is 0.9 up in layer 0): 46 layers.
  EXPECT_EQ(low.map().grid().nz, 46);
  EXPECT_EQ(low.map().at({27, 40, 45}), high.map().at({27, 40, 45}));
  expect_same(low, high);
}

TEST(SiteModelGrowth, TakesATenthReturnAboveTheBoxAndNoStrayOne) {
  SiteModel model = model_of("height_m = 10\n");
  const Eigen::Isometry3d pose = worlds::upright({5.5, 5.5, 1.8}, 0);
  hal::ScanCloud up;
  up.pattern.columns = up.pattern.rows = 1;
  up.pattern.elevation_first_rad = M_PI / 2;
  up.ranges_m = {60};
  for (std::uint64_t i = 1; i < SiteModel::kReturnsToGrow; ++i) {
    EXPECT_EQ(add(model, up, pose).layers_added, 0) << i;
    EXPECT_EQ(model.points_above_box(), i);
  }
  const int before = model.map().grid().nz;
  const ScanEffect effect = add(model, up, pose);
  EXPECT_EQ(effect.points_outside_box, 0u);
  EXPECT_EQ(model.points_above_box(), 0u);
  EXPECT_EQ(model.points_outside_box(), 0u);
  EXPECT_EQ(before + effect.layers_added, 63);  // 61.8 m above the ground is in layer 62.
  EXPECT_EQ(model.map().at(model.map().grid().voxel_at({5.5, 5.5, 61.8})),
            VoxelState::seen_occupied);
}

TEST(SiteModelGrowth, EndsAtTheHighestThatIsAllowed) {
  SiteModel model = model_of("height_m = 10\nheight_max_m = 25\n");
  const Eigen::Isometry3d pose = around_tower()[0];
  add(model, scan_of(tower(44), pose), pose);
  EXPECT_EQ(model.map().grid().nz, 26);
  EXPECT_GT(model.points_above_box(), 100u);
  EXPECT_GT(model.points_outside_box(), model.points_above_box());  // The ground outside the yard.
}

TEST(SiteModel, TakesAtMostAByteForEachVoxelUpToWhereItMayGrow) {
  for (const char* voxels : {"", "voxel_m = 0.5\n"}) {
    const SiteModel model = model_of(voxels);
    EXPECT_LE(model.voxel_bytes(), static_cast<std::size_t>(model.map().grid().nx) *
                                       static_cast<std::size_t>(model.map().grid().ny) *
                                       static_cast<std::size_t>(model.map().nz_kept()));
    EXPECT_EQ(&model.planner_map(), &model.map());  // Without foliage there is no second map.
  }
}

// A wall of the map that is nearer than the scanner measures gives nothing back, as the sky does.
TEST(SiteModelWalls, NearerThanTheScannerMeasuresHideWhatIsBehind) {
  nav::SiteMap map = yard();
  map.obstacles = {{box(20.3, 5, 21.5, 55), {}}};
  MissionConfig config = config_of("voxel_m = 0.25\nheight_m = 10\n");
  config.robot.scanner.range_min_m = 0.5;
  SiteModel model(config, map, tasks(), 2);
  worlds::World world;
  world.boxes.push_back({{20.3, 5, 0}, {21.5, 55, 6}});
  const Eigen::Isometry3d pose = worlds::upright({20, 30, 1.8}, 0.4);
  hal::ScanCloud scan = scan_of(world, pose);
  for (float& range_m : scan.ranges_m)
    if (range_m < 0.5) range_m = 0;
  add(model, scan, pose);
  int behind = 0, before = 0;
  const planning::VoxelGrid& grid = model.map().grid();
  for (double y = 15; y < 45; y += 0.25) {
    for (double x = 20.7; x < 40; x += 0.25)
      behind += model.map().at(grid.voxel_at({x, y, 2})) == VoxelState::seen_empty;
    before += model.map().at(grid.voxel_at({15, y, 2})) == VoxelState::seen_empty;
  }
  EXPECT_EQ(behind, 0);
  EXPECT_EQ(before, 120);
}

// With a thin hedge at y = 20 to 22.
hal::ScanCloud scan_over_hedge(const Eigen::Isometry3d& pose, double tower_m) {
  worlds::Random random(3);
  hal::ScanCloud scan = tower(tower_m).scan(worlds::sphere(0.5, 0.25), pose, 100, random);
  worlds::grow_bush(scan, pose, {{0, 20, 0}, {60, 22, 3}}, 0.1, random);
  return scan;
}

TEST(SiteModelFoliage, NeitherHidesWhatIsBehindNorTakesCells) {
  SiteModel blind = model_of("height_m = 14\n"),
            seeing = model_of("height_m = 14\nfoliage = true\n");
  for (const double x : {12.5, 30.5, 47.5}) {
    const Eigen::Isometry3d pose = worlds::upright({x, 8.5, 1.8}, 0.3);
    const hal::ScanCloud scan = scan_over_hedge(pose, 12);
    add(blind, scan, pose);
    add(seeing, scan, pose);
  }
  EXPECT_EQ(blind.map(), seeing.map());  // It stays seen-occupied.
  int occupied = 0, open = 0;
  for (int x = 10; x < 50; ++x) {
    const planning::Voxel v = seeing.map().grid().voxel_at({x + 0.5, 20.5, 1.8});
    occupied += seeing.map().at(v) == VoxelState::seen_occupied;
    open += seeing.planner_map().at(v) == VoxelState::seen_empty;
    const planning::Voxel ground = seeing.map().grid().voxel_at({x + 0.5, 15.5, -0.01});
    EXPECT_EQ(seeing.planner_map().at(ground), seeing.map().at(ground));  // Known ground stays.
  }
  EXPECT_GT(occupied, 30);
  EXPECT_GT(open, 30);
  // From the hedge's own cells and through it, more is seen.
  EXPECT_GT(seeing.next_views().size(), blind.next_views().size());
  EXPECT_GE(seeing.best_voxels(), blind.best_voxels());
}

TEST(SiteModelFoliage, GrowsWithTheBox) {
  const Eigen::Isometry3d pose = worlds::upright({30.5, 8.5, 1.8}, 0.3);
  SiteModel low = model_of("height_m = 10\nfoliage = true\n"),
            high = model_of("height_m = 45\nheight_max_m = 0\nfoliage = true\n");
  const hal::ScanCloud scan = scan_over_hedge(pose, 44.8);
  EXPECT_GT(add(low, scan, pose).layers_added, 30);
  add(high, scan, pose);
  EXPECT_EQ(low.planner_map(), high.planner_map());
  EXPECT_FALSE(low.planner_map() == low.map());
}

}  // namespace
}  // namespace mission
