#include "sim/surface_truth.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>
#include <random>
#include <set>

#include "tests/sim/room.hpp"

namespace {

using Eigen::Vector3d;
constexpr double kDegree = std::numbers::pi / 180;

bool nothing_seen(int, int, int) {
  return false;
}

TEST(SampleSurface, AddsUpToTheArea) {
  sim::Mesh mesh;
  mesh.W_vertices_m = {{0.3, 0.2, 0.5}, {9.7, 1.1, 4.2}, {4.1, 7.9, 2.2}, {0.3, 0.25, 0.5}};
  mesh.triangles = {{0, 1, 2}, {0, 1, 3}};  // The second is a sliver.
  const sim::TruthGrid grid{{0, 0, 0}, 1, 10, 10, 10};
  double area_m2 = 0;
  std::size_t of_sliver = 0;
  for (const auto& sample : sim::sample_surface(mesh, grid)) {
    area_m2 += sample.area_m2;
    of_sliver += sample.triangle == 1;
  }
  const auto area = [&](int a, int b, int c) {
    const auto& v = mesh.W_vertices_m;
    return (v[b] - v[a]).cross(v[c] - v[a]).norm() / 2;
  };
  // Voxels with less than 1/16 face are left out, at the rim.
  EXPECT_NEAR(area_m2, area(0, 1, 2) + area(0, 1, 3), 0.03 * area_m2);
  EXPECT_LT(of_sliver, 60u);
}

TEST(SampleSurface, KeepsOnlyVoxelsWithEnoughSurface) {
  sim::Mesh mesh;
  const auto square = [&](double x, double side_m) {
    mesh.add_quad({x, 0.1, 0.5}, {x + side_m, 0.1, 0.5}, {x + side_m, 0.1 + side_m, 0.5},
                  {x, 0.1 + side_m, 0.5});
  };
  square(0.1, 0.26);  // 0.0676 of a face: just enough.
  square(1.1, 0.24);  // 0.0576: not enough.
  std::set<std::uint64_t> voxels;
  for (const auto& sample : sim::sample_surface(mesh, {{0, 0, 0}, 1, 3, 1, 1}))
    voxels.insert(sample.voxel);
  EXPECT_EQ(voxels, std::set<std::uint64_t>{0});
}

TEST(SampleSurface, ClipsWhatLeavesTheGrid) {
  const auto samples = sim::sample_surface(sim_test::plain(1e5), {{-2, -2, -0.5}, 1, 4, 4, 2});
  double area_m2 = 0;
  for (const auto& sample : samples) area_m2 += sample.area_m2;
  EXPECT_NEAR(area_m2, 16, 1e-3);
}

TEST(SampleSurface, RefusesAGridWithoutSize) {
  EXPECT_THROW(sim::sample_surface(sim_test::plain(1), {{0, 0, 0}, 0, 1, 1, 1}),
               std::invalid_argument);
  EXPECT_THROW(sim::sample_surface(sim_test::plain(1), {{0, 0, 0}, 1, 1, 0, 1}),
               std::invalid_argument);
}

// A wall of 10 x 4 m at y = 0.5, seen from one position 6 m in front of its middle.
struct Wall {
  sim::Mesh mesh;
  sim::TruthGrid grid{{0, 0, 0}, 1, 10, 10, 4};
  std::vector<Vector3d> positions{{5, 6.5, 2}};

  Wall() { mesh.add_quad({0, 0.5, 0}, {10, 0.5, 0}, {10, 0.5, 4}, {0, 0.5, 4}); }
  sim::SurfaceTruth judge(const sim::TruthLimits& limits) const {
    return sim::judge_surface(mesh, sim::Scene(mesh), grid, limits, positions, 0, nothing_seen, 1);
  }
};

TEST(JudgeSurface, SeesAWholeFreeWall) {
  const auto truth = Wall().judge({});
  EXPECT_EQ(truth.surface, 40u);
  EXPECT_EQ(truth.visible, 40u);
  EXPECT_EQ(truth.visible_seen, 0u);
  EXPECT_EQ(truth.missed.size(), 40u);
}

TEST(JudgeSurface, SeesBothSides) {
  Wall wall;
  wall.positions = {{5, -5.5, 2}};
  EXPECT_EQ(wall.judge({}).visible, 40u);
}

TEST(JudgeSurface, KeepsToTheRangeLimits) {
  Wall wall;
  sim::TruthLimits limits;
  limits.range_max_m = 6.5;  // sqrt(6.5^2 - 6^2) = 2.5 m around the foot of the perpendicular.
  int expected = 0;
  for (int x = 0; x < 10; ++x)
    for (int z = 0; z < 4; ++z) {
      bool within = false;  // Any of the 4 x 4 samples at eighths.
      for (int i = 0; i < 4; ++i)
        for (int k = 0; k < 4; ++k)
          within = within || std::hypot(x + (i + .5) / 4 - 5, z + (k + .5) / 4 - 2) <= 2.5;
      expected += within;
    }
  EXPECT_NEAR(static_cast<double>(wall.judge(limits).visible), expected, 2)
      << "the lattice starts at a triangle's own side";
  limits.range_max_m = 100;
  limits.range_min_m = 7.9;  // Only the far ends: sqrt(7.9^2 - 6^2) = 5.14 m.
  const auto truth = wall.judge(limits);
  ASSERT_GT(truth.visible, 0u);
  for (const auto& voxel : truth.missed) EXPECT_TRUE(voxel.x == 0 || voxel.x == 9) << voxel.x;
}

TEST(JudgeSurface, KeepsToTheGrazingLimit) {
  Wall wall;
  sim::TruthLimits limits;
  limits.grazing_max_rad = std::atan(3 / 6.0);  // Within 3 m of the foot.
  const auto truth = wall.judge(limits);
  for (const auto& voxel : truth.missed) {
    EXPECT_GE(voxel.x, 2);
    EXPECT_LE(voxel.x, 7);
  }
  EXPECT_EQ(truth.visible, 24u);
}

TEST(JudgeSurface, KeepsToTheElevationLimits) {
  Wall wall;
  sim::TruthLimits limits;
  limits.elevation_min_rad = -5 * kDegree;  // 0.52 m down at 6 m, less than 1 m at the ends.
  limits.elevation_max_rad = 2 * kDegree;   // 0.21 m up at 6 m.
  for (const auto& voxel : wall.judge(limits).missed) {
    EXPECT_GE(voxel.z, 1);
    EXPECT_LE(voxel.z, 2);
  }
  EXPECT_EQ(wall.judge(limits).visible, 20u);
}

TEST(JudgeSurface, ASlabInBetweenHidesItsShadowOnly) {
  Wall wall;
  // At half way, x from 4.5 to 5.5: hides x from 4 to 6 on the wall. High enough for all of it.
  wall.mesh.add_quad({4.5, 3.5, -9}, {5.5, 3.5, -9}, {5.5, 3.5, 9}, {4.5, 3.5, 9});
  const auto truth = wall.judge({});
  std::map<int, int> missed;
  for (const auto& voxel : truth.missed)
    if (voxel.y == 0) ++missed[voxel.x];
  for (int x = 0; x < 10; ++x) EXPECT_EQ(missed[x], x == 4 || x == 5 ? 0 : 4) << x;
}

TEST(JudgeSurface, AClosedRoomHidesItsInside) {
  sim::Mesh mesh = sim_test::plain(20);
  sim_test::add_box(mesh, {-3, -3, 0}, {3, 3, 3});
  sim_test::add_box(mesh, {-1.2, -1.2, 0.2}, {1.2, 1.2, 2.2});  // Inside it.
  std::vector<Vector3d> positions;
  for (double x = -15; x <= 15; x += 1)
    for (double y = -15; y <= 15; y += 1)
      if (std::max(std::abs(x), std::abs(y)) > 3.6) positions.push_back({x, y, 1.8});
  const sim::TruthGrid grid{{-5.5, -5.5, -0.5}, 1, 11, 11, 5};
  const auto truth =
      sim::judge_surface(mesh, sim::Scene(mesh), grid, {}, positions, 0, nothing_seen, 1);
  std::set<std::tuple<int, int, int>> missed;
  for (const auto& voxel : truth.missed) missed.insert({voxel.x, voxel.y, voxel.z});
  EXPECT_FALSE(missed.contains({5, 5, 1})) << "the inner box";
  EXPECT_FALSE(missed.contains({5, 5, 3})) << "the roof, from below";
  EXPECT_TRUE(missed.contains({2, 5, 1})) << "the outer wall";
  EXPECT_TRUE(missed.contains({1, 5, 0})) << "the ground outside";
}

TEST(JudgeSurface, CountsWhatWasSeen) {
  Wall wall;
  const auto left_half = [](int x, int, int) { return x < 5; };
  const auto truth = sim::judge_surface(wall.mesh, sim::Scene(wall.mesh), wall.grid, {},
                                        wall.positions, 1, left_half, 1);
  EXPECT_EQ(truth.visible, 40u);
  EXPECT_EQ(truth.visible_seen, 20u);
  EXPECT_EQ(truth.seen_not_visible, 0u);
  EXPECT_EQ(truth.missed.size(), 20u);
}

TEST(JudgeSurface, WithoutPositionsNothingIsVisible) {
  Wall wall;
  wall.positions.clear();
  const auto truth = sim::judge_surface(
      wall.mesh, sim::Scene(wall.mesh), wall.grid, {}, {}, 0, [](int, int, int) { return true; },
      1);
  EXPECT_EQ(truth.visible, 0u);
  EXPECT_EQ(truth.seen_not_visible, 40u);
}

// The definition, word by word and without any shortcut.
std::set<std::uint64_t> visible_by_definition(const sim::Mesh& mesh, const sim::TruthGrid& grid,
                                              const sim::TruthLimits& limits,
                                              const std::vector<Vector3d>& positions) {
  const sim::Scene scene(mesh);
  std::set<std::uint64_t> visible;
  for (const auto& sample : sim::sample_surface(mesh, grid))
    for (const Vector3d& position : positions) {
      if (visible.contains(sample.voxel)) break;
      const Vector3d at = grid.W_min_m + sample.W_point_m.cast<double>();
      const Vector3d way = position - at;
      const double length_m = way.norm();
      const auto corners = scene.corners_m(sample.triangle);
      const Vector3d normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalized();
      const double elevation_rad = std::asin(-way.z() / length_m);
      if (length_m < limits.range_min_m || length_m > limits.range_max_m) continue;
      if (elevation_rad < limits.elevation_min_rad || elevation_rad > limits.elevation_max_rad)
        continue;
      if (std::acos(std::min(1.0, std::abs(normal.dot(way)) / length_m)) > limits.grazing_max_rad)
        continue;
      if (!scene.cast(at, way / length_m, 1e-3, length_m)) visible.insert(sample.voxel);
    }
  return visible;
}

TEST(JudgeSurface, AgreesWithTheDefinitionOnRandomSites) {
  std::mt19937_64 random(1);
  const auto uniform = [&](double low, double high) {
    return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53;
  };
  // Drawn in this order whatever the compiler.
  const auto point = [&](double low, double high, double z_low, double z_high) -> Vector3d {
    const double z = uniform(z_low, z_high), y = uniform(low, high);
    return {uniform(low, high), y, z};
  };
  for (int site = 0; site < 12; ++site) {
    sim::Mesh mesh = sim_test::plain(12);
    for (int i = 0; i < 5; ++i) {
      const Vector3d low = point(-10, 6, -0.5, 2);
      sim_test::add_box(mesh, low, low + point(.3, 6, .3, 6));
    }
    for (int i = 0; i < 40; ++i) {  // Loose shards.
      const Vector3d at = point(-10, 10, 0, 8);
      for (int k = 0; k < 3; ++k) mesh.W_vertices_m.push_back(at + point(-2, 2, -2, 2));
      const auto n = static_cast<std::uint32_t>(mesh.W_vertices_m.size());
      mesh.triangles.push_back({n - 3, n - 2, n - 1});
    }
    std::vector<Vector3d> positions;
    for (int i = 0; i < 150; ++i) positions.push_back({uniform(-12, 12), uniform(-12, 12), 1.8});
    const sim::TruthGrid grid{{-12.3, -12.1, -0.7}, 1, 25, 25, 10};
    const sim::TruthLimits limits{1, 12, 65 * kDegree, -50 * kDegree, 70 * kDegree};
    const auto expected = visible_by_definition(mesh, grid, limits, positions);
    const sim::Scene scene(mesh);
    for (const int threads : {1, 2}) {
      const auto truth =
          sim::judge_surface(mesh, scene, grid, limits, positions, 3, nothing_seen, threads);
      std::set<std::uint64_t> found;
      for (const auto& v : truth.missed)
        found.insert(static_cast<std::uint64_t>(v.x + grid.nx * (v.y + grid.ny * v.z)));
      EXPECT_EQ(found, expected) << "site " << site;
      EXPECT_GT(truth.surface, truth.visible);
    }
  }
}

}  // namespace
