#include "sim/ground.hpp"

#include <gtest/gtest.h>

#include <filesystem>

#include "sim/scene.hpp"

namespace {

using Eigen::Vector3d;

// Four walls without floor or roof.
sim::Mesh walls(double x0, double y0, double x1, double y1, double z0, double z1) {
  sim::Mesh mesh;
  const auto wall = [&](double ax, double ay, double bx, double by) {
    mesh.add_quad({ax, ay, z0}, {bx, by, z0}, {bx, by, z1}, {ax, ay, z1});
  };
  wall(x0, y0, x1, y0);
  wall(x1, y0, x1, y1);
  wall(x1, y1, x0, y1);
  wall(x0, y1, x0, y0);
  return mesh;
}

const Eigen::AlignedBox2d kBox(Eigen::Vector2d(-50, -50), Eigen::Vector2d(50, 50));

TEST(EnsureGround, AddsOneLevelPlaneUnderAShell) {
  sim::Mesh mesh = walls(-5, -5, 5, 5, 2, 10);
  const Vector3d samples[] = {{20, 0, 2}, {0, 20, 2}, {-20, 0, 2}};
  const auto report = sim::ensure_ground(mesh, samples, kBox);
  EXPECT_TRUE(report.added);
  EXPECT_EQ(report.with_ground, 0u);
  EXPECT_EQ(report.added_z_m, 2);
  const sim::Scene scene(mesh);
  EXPECT_EQ(scene.heights_below({49, -49, 5}, 10), std::vector<double>{2.0});
  EXPECT_TRUE(scene.heights_below({51, 0, 5}, 10).empty());
}

TEST(EnsureGround, LeavesAModelThatHasGroundAlone) {
  sim::Mesh mesh = walls(-5, -5, 5, 5, 0, 10);
  mesh.add_quad({-50, -50, 0.4}, {50, -50, 0.4}, {50, 0, 0.4}, {-50, 0, 0.4});
  const Vector3d samples[] = {{20, -20, 0}, {-20, -20, 0}, {0, 20, 0}, {0, 30, 0}};
  const std::size_t before = mesh.triangles.size();
  const auto report = sim::ensure_ground(mesh, samples, kBox);
  EXPECT_FALSE(report.added);
  EXPECT_EQ(report.with_ground, 2u);
  EXPECT_EQ(mesh.triangles.size(), before);
}

TEST(EnsureGround, RoofsAndCellarsAreNotGround) {
  sim::Mesh mesh = walls(-5, -5, 5, 5, 0, 10);
  mesh.add_quad({-50, -50, 0.6}, {50, -50, 0.6}, {50, 50, 0.6}, {-50, 50, 0.6});
  mesh.add_quad({-50, -50, -0.6}, {50, -50, -0.6}, {50, 50, -0.6}, {-50, 50, -0.6});
  const Vector3d samples[] = {{20, -20, 0}};
  EXPECT_TRUE(sim::ensure_ground(mesh, samples, kBox).added);
}

TEST(EnsureGround, RefusesToDecideWithoutSamples) {
  sim::Mesh mesh = walls(-5, -5, 5, 5, 0, 10);
  EXPECT_THROW(sim::ensure_ground(mesh, {}, kBox), std::invalid_argument);
}

TEST(EstimateGround, FindsTheFeetOfMostWalls) {
  sim::Mesh mesh = walls(0, 0, 20, 10, 100.1, 108);
  const sim::Mesh cellar = walls(30, 0, 33, 3, 97, 105);  // Shorter walls, deeper feet.
  for (const auto& t : cellar.triangles) {
    const auto first = static_cast<std::uint32_t>(mesh.W_vertices_m.size());
    for (const auto vertex : t) mesh.W_vertices_m.push_back(cellar.W_vertices_m[vertex]);
    mesh.triangles.push_back({first, first + 1, first + 2});
  }
  ASSERT_TRUE(sim::estimate_ground_z_m(mesh));
  EXPECT_NEAR(*sim::estimate_ground_z_m(mesh), 100.1, 1e-6);
}

TEST(EstimateGround, SaysWhenNothingStandsUpright) {
  sim::Mesh mesh;
  mesh.add_quad({0, 0, 0}, {1, 0, 0}, {1, 1, 0.1}, {0, 1, 0.1});
  EXPECT_FALSE(sim::estimate_ground_z_m(mesh));
  EXPECT_FALSE(sim::estimate_ground_z_m(sim::Mesh{}));
}

TEST(EstimateGround, ComesWithinFourDecimetresOnRealModels) {
  const std::filesystem::path models = VANTAGE_SOURCE_DIR "/../shared/data/models";
  if (!std::filesystem::exists(models)) GTEST_SKIP() << "no shared data at " << models;
  const std::pair<const char*, double> known[] = {
      {"church_ste_anne_dijon/SteAnneDij.obj", 0},
      {"collapsed_police_station/collapsed_police_station.obj", 0},
      {"fort_castle60/castle60x60m.obj", 0},
      {"ingolstadt_lod3_north/ingolstadt_north.obj", 414.86},
      {"office_willow_garage/willowgarage_collision.obj", 0},
      {"school_gazebo/school.obj", 0},
      {"town_hall_arras/MairieArras.obj", 0}};
  for (const auto& [file, ground_z_m] : known) {
    const auto parsed = sim::load_obj(models / file);
    ASSERT_TRUE(parsed.errors.empty()) << parsed.errors[0];
    const auto found_m = sim::estimate_ground_z_m(parsed.mesh);
    ASSERT_TRUE(found_m) << file;
    EXPECT_NEAR(*found_m, ground_z_m, 0.4) << file;
  }
}

}  // namespace
