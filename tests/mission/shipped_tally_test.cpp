// The exact tally on maps of the sites that are shipped, scanned as a mission scans them.
#include <gtest/gtest.h>

#include <filesystem>

#include "planning/running_tally.hpp"
#include "sim/mesh.hpp"
#include "sim/scan.hpp"
#include "sim/scene.hpp"
#include "tests/planning/voxel_oracle.hpp"
#include "tests/support/voxel_worlds.hpp"

namespace {

using planning::BoundaryVoxel;
using planning::ViewLimits;
using planning::Voxel;
using planning::VoxelMap;
using planning::VoxelState;

struct Case {
  const char* site;
  double voxel_m;
  double side_m;  // Of the part of the site that is mapped, around its middle.
};

void PrintTo(const Case& c, std::ostream* out) {
  *out << c.site << " at " << c.voxel_m << " m";
}

class ShippedSite : public testing::TestWithParam<Case> {
 protected:
  ShippedSite()
      : mesh_(sim::load_obj(std::filesystem::path(VANTAGE_SOURCE_DIR) / "configs/sites" /
                            GetParam().site / "model.obj")
                  .mesh),
        scene_(mesh_) {}

  planning::VoxelGrid grid() const {
    const Eigen::AlignedBox3d bounds = mesh_.bounds_m();
    const Eigen::Vector3d middle_m = bounds.center();
    const auto [site, voxel_m, side_m] = GetParam();
    const auto voxels = [&](double length_m) {
      return static_cast<int>(std::ceil(std::min(length_m, side_m) / voxel_m));
    };
    planning::VoxelGrid grid;
    grid.voxel_m = voxel_m;
    grid.nx = voxels(bounds.sizes().x());
    grid.ny = voxels(bounds.sizes().y());
    grid.nz = static_cast<int>(std::ceil(std::min(bounds.sizes().z(), 20.0) / voxel_m)) + 1;
    grid.W_min_m << middle_m.x() - grid.nx * voxel_m / 2, middle_m.y() - grid.ny * voxel_m / 2,
        bounds.min().z() - 0.9 * voxel_m;
    return grid;
  }

  // On the ground of the mapped part, clear of everything at the height of a robot.
  Eigen::Isometry3d draw_pose(worlds::Random& random) const {
    const planning::VoxelGrid box = grid();
    while (true) {
      const Eigen::Vector2d at_m{
          box.W_min_m.x() + worlds::uniform(random, 0.1, 0.9) * box.nx * box.voxel_m,
          box.W_min_m.y() + worlds::uniform(random, 0.1, 0.9) * box.ny * box.voxel_m};
      const std::vector<double> heights_m =
          scene_.heights_below({at_m.x(), at_m.y(), mesh_.bounds_m().max().z() + 1}, 1000);
      if (heights_m.empty()) continue;
      const double ground_m = heights_m.back();
      if (scene_.clearance_m(at_m, ground_m + 0.3, ground_m + 2, 1) < 0.5) continue;
      return worlds::upright({at_m.x(), at_m.y(), ground_m + 1.8},
                             worlds::uniform(random, 0, 6.28));
    }
  }

  hal::ScanCloud scan(const Eigen::Isometry3d& pose, std::uint64_t number) const {
    sim::ScannerModel model;
    model.azimuth_step_rad = model.elevation_step_rad = 0.6 * worlds::kDegree;
    hal::ScanCloud cloud;
    cloud.pattern = sim::make_pattern(model);
    cloud.ranges_m = sim::cast_scan(scene_, pose, cloud.pattern, model, 1, number, 2);
    return cloud;
  }

  const sim::Mesh mesh_;
  const sim::Scene scene_;
};

// Every cell of the level of the first scan, after each scan; some of them by the literal loop.
TEST_P(ShippedSite, IsTalliedAsByTheLiteralLoop) {
  const double range_max_m = std::min(100.0, 100 * GetParam().voxel_m);
  const ViewLimits limits{1, range_max_m, 70};
  planning::RunningTally running(limits, 2);
  VoxelMap map(grid());
  worlds::Random random(11);
  int z = -1;
  std::uint64_t seen = 0;
  for (std::uint64_t number = 1; number <= 4; ++number) {
    const Eigen::Isometry3d pose = draw_pose(random);
    map.insert(scan(pose, number), pose, {});
    if (z < 0) z = map.grid().voxel_at(pose.translation()).z;
    const std::vector<BoundaryVoxel> boundary = planning::boundary_unseen(map);
    std::vector<Voxel> candidates, some;
    for (int y = 0; y < map.grid().ny; ++y)
      for (int x = 0; x < map.grid().nx; ++x)
        if (map.at({x, y, z}) == VoxelState::seen_empty) candidates.push_back({x, y, z});
    const auto tally = planning::tally(map, boundary, candidates, limits, 2);
    ASSERT_EQ(running.update(map, boundary, candidates), tally) << "scan " << number;
    std::vector<std::uint32_t> tally_of_some;
    for (std::size_t i = number; i < candidates.size(); i += 1 + candidates.size() / 12) {
      some.push_back(candidates[i]);
      tally_of_some.push_back(tally[i]);
    }
    ASSERT_EQ(tally_of_some, oracle::tally(map, boundary, some, limits)) << "scan " << number;
    for (const std::uint32_t count : tally_of_some) seen += count;
  }
  EXPECT_GT(seen, 500U) << "too little in view to test anything";
}

INSTANTIATE_TEST_SUITE_P(
    Tally, ShippedSite,
    testing::Values(Case{"church", 1, 500}, Case{"courtyard", 1, 500}, Case{"fort", 1, 500},
                    Case{"museum", 1, 500}, Case{"tower", 1, 500}, Case{"church", 0.5, 60},
                    Case{"courtyard", 0.5, 60}, Case{"fort", 0.5, 60}, Case{"museum", 0.5, 60},
                    Case{"tower", 0.5, 60}, Case{"church", 0.25, 24}, Case{"courtyard", 0.25, 24},
                    Case{"fort", 0.25, 24}, Case{"museum", 0.25, 24}, Case{"tower", 0.25, 24}));

}  // namespace
