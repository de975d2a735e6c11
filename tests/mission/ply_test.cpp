#include "mission/ply.hpp"

#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <numbers>
#include <random>
#include <set>

#include "tests/support/temp_folder.hpp"

namespace mission {
namespace {

using test::TempFolder;

hal::ScanCloud cloud_of(std::uint32_t columns, std::uint32_t rows) {
  hal::ScanCloud cloud;
  cloud.pattern = {0.1, 2 * std::numbers::pi / columns, -1.0, 2.5 / rows, columns, rows};
  cloud.ranges_m.resize(cloud.pattern.beams());
  std::mt19937_64 random(7);
  for (float& range_m : cloud.ranges_m) {
    range_m = random() % 10 == 0 ? 0.0F : 1.0F + static_cast<float>(random() % 9000) / 100;
  }
  return cloud;
}

Eigen::Isometry3d some_pose() {
  Eigen::Isometry3d T_W_S = Eigen::Isometry3d::Identity();
  T_W_S.linear() = Eigen::AngleAxisd(1.0 / 3, Eigen::Vector3d(0.1, 0.2, 1).normalized()).matrix();
  T_W_S.translation() = Eigen::Vector3d(120.1, -33.7, 1.0 / 7);
  return T_W_S;
}

TEST(Ply, PointsAreTheBeamsInTheSiteFrame) {
  const hal::ScanCloud cloud = cloud_of(50, 30);
  const Eigen::Isometry3d T_W_S = some_pose();
  const auto points = scan_points(cloud, T_W_S);
  std::size_t next = 0;
  for (std::uint32_t column = 0; column < 50; ++column) {
    for (std::uint32_t row = 0; row < 30; ++row) {
      const double range_m = cloud.ranges_m[column * 30 + row];
      if (range_m == 0) continue;
      const double azimuth = 0.1 + column * cloud.pattern.azimuth_step_rad;
      const double elevation = -1.0 + row * cloud.pattern.elevation_step_rad;
      const Eigen::Vector3d S_point(range_m * std::cos(elevation) * std::cos(azimuth),
                                    range_m * std::cos(elevation) * std::sin(azimuth),
                                    range_m * std::sin(elevation));
      ASSERT_LT(next, points.size());
      EXPECT_LT((points[next++].cast<double>() - T_W_S * S_point).norm(), 3e-5);
    }
  }
  EXPECT_EQ(next, points.size());
}

TEST(Ply, PoseAndPointsSurviveTheFileExactly) {
  const TempFolder folder;
  const hal::ScanCloud cloud = cloud_of(40, 20);
  const auto path = folder.path() / "0001.ply";
  ASSERT_TRUE(write_scan_ply(path, cloud, some_pose(), {1, "inner\n3", 12.5, 42}));
  const PlyCloud back = read_ply(path).value();
  EXPECT_EQ(back.W_points_m, scan_points(cloud, some_pose()));
  ASSERT_TRUE(back.T_W_S);
  EXPECT_EQ(back.T_W_S->matrix(), some_pose().matrix());
  EXPECT_EQ(back.comments[1], "station inner 3");
  EXPECT_EQ(back.comments[2], "time_s 12.5");
  EXPECT_EQ(back.comments[3], "seed 42");
  EXPECT_FALSE(std::filesystem::exists(part_name(path)));
}

TEST(Ply, AScanWithoutReturnsIsAnEmptyCloud) {
  const TempFolder folder;
  hal::ScanCloud cloud = cloud_of(10, 10);
  std::fill(cloud.ranges_m.begin(), cloud.ranges_m.end(), 0.0F);
  ASSERT_TRUE(write_scan_ply(folder.path() / "a.ply", cloud, some_pose(), {}));
  EXPECT_TRUE(read_ply(folder.path() / "a.ply").value().W_points_m.empty());
}

TEST(Ply, RefusesAScanWhoseRangesDoNotMatchItsPattern) {
  hal::ScanCloud cloud = cloud_of(10, 10);
  cloud.ranges_m.pop_back();
  EXPECT_THROW(scan_points(cloud, some_pose()), std::invalid_argument);
}

TEST(Ply, AFileCutAnywhereIsAnErrorThatNamesIt) {
  const TempFolder folder;
  const auto path = folder.path() / "cut.ply";
  ASSERT_TRUE(write_scan_ply(path, cloud_of(4, 4), some_pose(), {1, "a", 1, 1}));
  const std::string whole = read_file(path).value();
  for (std::size_t size = 0; size < whole.size(); ++size) {
    const auto read = parse_ply(std::string_view(whole).substr(0, size), path);
    ASSERT_FALSE(read) << size;
    EXPECT_NE(read.error().text().find("cut.ply"), std::string::npos);
  }
  EXPECT_FALSE(parse_ply(whole + "x", path));
}

TEST(Ply, AFolderThatIsNotThereIsAnErrorThatNamesTheFile) {
  const auto wrote = write_scan_ply("/nowhere/at/all.ply", cloud_of(2, 2), some_pose(), {});
  ASSERT_FALSE(wrote);
  EXPECT_EQ(wrote.error().text(), "cannot write /nowhere/at/all.ply: No such file or directory");
}

TEST(Ply, WritesMillionsOfPointsQuickly) {
  const TempFolder folder;
  const hal::ScanCloud cloud = cloud_of(1800, 926);
  const auto start = std::chrono::steady_clock::now();
  ASSERT_TRUE(write_scan_ply(folder.path() / "big.ply", cloud, some_pose(), {}));
  const std::chrono::duration<double> span = std::chrono::steady_clock::now() - start;
  const auto points = scan_points(cloud, some_pose()).size();
  RecordProperty("points", static_cast<int>(points));
  RecordProperty("milliseconds", static_cast<int>(span.count() * 1000));
  EXPECT_GT(points, 1'490'000U);
  EXPECT_LT(span.count(), 5.0);  // Some 50 ms on an idle machine; the disk decides.
}

std::vector<Eigen::Vector3f> random_points(std::size_t count, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<Eigen::Vector3f> points;
  for (std::size_t i = 0; i < count; ++i) {
    const auto draw = [&] { return static_cast<float>(random() % 20001) / 1000 - 10; };
    const float x = draw(), y = draw(), z = draw();
    points.push_back({x, y, z});
  }
  return points;
}

using Cell = std::array<int, 3>;

Cell cell_of(const Eigen::Vector3f& point, double grid_m) {
  return {static_cast<int>(std::floor(point.x() / grid_m)),
          static_cast<int>(std::floor(point.y() / grid_m)),
          static_cast<int>(std::floor(point.z() / grid_m))};
}

std::vector<Eigen::Vector3f> first_in_each_cell(const std::vector<Eigen::Vector3f>& points,
                                                double grid_m) {
  std::set<Cell> taken;
  std::vector<Eigen::Vector3f> kept;
  for (const auto& point : points) {
    if (taken.insert(cell_of(point, grid_m)).second) kept.push_back(point);
  }
  return kept;
}

TEST(CloudMerger, KeepsTheFirstPointOfEachCell) {
  const auto points = random_points(20000, 1);
  CloudMerger merger(0.7);
  merger.add(points);
  merger.add(points);
  EXPECT_EQ(merger.points(), first_in_each_cell(points, 0.7));
  EXPECT_EQ(merger.points_in(), 40000U);
  EXPECT_EQ(merger.doublings(), 0);
}

TEST(CloudMerger, AFullOneKeepsWhatTheDoubledGridWouldHaveKept) {
  const auto points = random_points(20000, 2);
  CloudMerger merger(0.1, 1500);
  merger.add(points);
  EXPECT_LE(merger.points().size(), 1500U);
  EXPECT_GT(merger.doublings(), 2);
  EXPECT_DOUBLE_EQ(merger.grid_m(), 0.1 * (1 << merger.doublings()));
  EXPECT_EQ(merger.points(), first_in_each_cell(points, merger.grid_m()));
}

TEST(CloudMerger, LeavesOutPointsThatAreNowhere) {
  CloudMerger merger;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  merger.add({{1, 2, nan}, {1e30F, 0, 0}, {1, 2, 3}});
  EXPECT_EQ(merger.points().size(), 1U);
  EXPECT_EQ(merger.points_in(), 1U);
}

TEST(CloudMerger, WritesACloudThatReadsBack) {
  const TempFolder folder;
  CloudMerger merger(0.5);
  merger.add(random_points(1000, 3));
  ASSERT_TRUE(merger.write(folder.path() / "cloud.ply"));
  const PlyCloud back = read_ply(folder.path() / "cloud.ply").value();
  EXPECT_EQ(back.W_points_m, merger.points());
  EXPECT_FALSE(back.T_W_S);
}

}  // namespace
}  // namespace mission
