// A wall nearer than the scanner measures gives nothing back: that must not open it.
#include "planning/near_walls.hpp"

#include <gtest/gtest.h>

#include "tests/planning/voxel_scans.hpp"

namespace {

using planning::InsertConfig;
using planning::Voxel;
using planning::VoxelMap;
using planning::VoxelState;

constexpr double kRangeMin_m = 0.5;

// A wall 4 m high whose face is in front of the scanner, its ends far away; nothing else.
struct NearWall {
  double face_m;  // x of it; the scanner is at x = 0.
  double pose_error_m = 0;
  InsertConfig config = believing();
  VoxelMap map{{{-20, -20, 0}, 0.25, 160, 160, 40}};

  static InsertConfig believing() {
    InsertConfig config;
    config.range_min_m = kRangeMin_m;
    config.range_max_m = 30;
    return config;
  }
  void know_wall() {
    const Eigen::Vector2d corners[] = {
        {face_m, -15}, {face_m + 1, -15}, {face_m + 1, 15}, {face_m, 15}};
    for (int i = 0; i < 4; ++i) config.walls.push_back({corners[i], corners[(i + 1) % 4]});
  }
  void scan() {
    worlds::World world;
    world.boxes.push_back({{face_m, -15, 0}, {face_m + 1, 15, 4}});
    const Eigen::Isometry3d truth = worlds::upright({0, 0.03, 1.8}, 0.4);
    worlds::Random random(1);
    hal::ScanCloud cloud = world.scan(worlds::sphere(1, 0.5), truth, 30, random);
    for (float& range_m : cloud.ranges_m)
      if (range_m < kRangeMin_m) range_m = 0;  // As scanners do.
    map.insert(cloud, worlds::upright({pose_error_m, 0.03, 1.8}, 0.4), config);
  }
  // How much of the wall's inside and of what is behind it, below its top, is seen-empty.
  int leaked() const {
    int count = 0;
    for (int z = 0; z < 15; ++z)
      for (int y = 20; y < 140; ++y)
        for (int x = map.grid().voxel_at({face_m + 0.3, 0, 0}).x + 1; x < 160; ++x)
          count += map.at({x, y, z}) == VoxelState::seen_empty;
    return count;
  }
};

TEST(NearWalls, LeakWhereTheScanIsAllThatIsKnown) {
  NearWall wall{.face_m = 0.3};
  wall.scan();
  EXPECT_GT(wall.leaked(), 10'000) << "nothing to guard against";
}

TEST(NearWalls, KeepWhatIsBehindThemUnseenHowPoseAndMapMayBeOff) {
  for (const double face_m : {0.2, 0.3, 0.45, 0.495})
    for (const double pose_error_m : {-0.1, 0.0, 0.1}) {
      NearWall wall{.face_m = face_m, .pose_error_m = pose_error_m};
      wall.know_wall();
      wall.scan();
      EXPECT_EQ(wall.leaked(), 0) << face_m << ", " << pose_error_m;
    }
}

TEST(NearWalls, LeaveAloneWhatIsOpenAndWhatIsOverThem) {
  NearWall known{.face_m = 0.3}, not_known{.face_m = 0.3};
  known.know_wall();
  known.scan();
  not_known.scan();
  int away = 0, over = 0;
  for (int z = 0; z < 40; ++z)
    for (int y = 0; y < 160; ++y)
      for (int x = 0; x < 160; ++x) {
        const Voxel v{x, y, z};
        const Eigen::Vector3d at_m = known.map.grid().center_m(v);
        if (at_m.x() < -0.5) {
          ASSERT_EQ(known.map.at(v), not_known.map.at(v)) << "the other side";
          away += known.map.at(v) == VoxelState::seen_empty;
        }
        over += at_m.x() > 0.6 && at_m.z() > 7 && known.map.at(v) == VoxelState::seen_empty;
      }
  EXPECT_GT(away, 100'000);
  EXPECT_GT(over, 100) << "steep beams would have measured the wall: they went over it";
}

TEST(NearWalls, OfNoMeaningAreRefused) {
  NearWall wall{.face_m = 0.3};
  wall.config.walls_margin_m = -1;
  EXPECT_THROW(wall.scan(), std::invalid_argument);
  wall.config.walls_margin_m = NAN;
  EXPECT_THROW(wall.scan(), std::invalid_argument);
}

}  // namespace
