#include "planning/scan_density.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/planning/view_cases.hpp"
#include "tests/planning/voxel_oracle.hpp"

namespace {

using Eigen::Vector3d;
using planning::BoundaryVoxel;
using planning::ViewLimits;
using planning::Voxel;
using planning::VoxelGrid;
using planning::VoxelMap;
using planning::VoxelState;

TEST(SurfaceVoxels, AreSeenOccupiedBesideSeenEmpty) {
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    const worlds::ViewCase c = worlds::random_case(seed);
    EXPECT_EQ(planning::surface_voxels(c.map), oracle::exposed(c.map, VoxelState::seen_occupied));
  }
}

// Beams of the pattern that meet the square of side_m about the face's centre, by casting them all.
double counted_ppm2(const Vector3d& center_m, const Vector3d& normal, double side_m,
                    const hal::ScanPattern& pattern, const Eigen::Isometry3d& T_W_S) {
  const Vector3d from = T_W_S.translation();
  double count = 0;
  for (std::uint32_t c = 0; c < pattern.columns; ++c)
    for (std::uint32_t r = 0; r < pattern.rows; ++r) {
      const double azimuth = pattern.azimuth_first_rad + c * pattern.azimuth_step_rad;
      const double elevation = pattern.elevation_first_rad + r * pattern.elevation_step_rad;
      const Vector3d beam =
          T_W_S.linear() * Vector3d(std::cos(elevation) * std::cos(azimuth),
                                    std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
      const double approach = -beam.dot(normal);
      if (approach <= 0) continue;
      const Vector3d off = from + beam * ((from - center_m).dot(normal) / approach) - center_m;
      count += off.cwiseAbs().maxCoeff() < side_m / 2;
    }
  return count / (side_m * side_m);
}

// The square lies through the voxel's centre, as the density is defined there.
TEST(ExpectedDensity, IsWhatCountingTheBeamsOnASquareGives) {
  worlds::Random random(3);
  const VoxelGrid grid{{0, 0, 0}, 1.0, 40, 40, 20};
  const hal::ScanPattern pattern = worlds::sphere(0.2, 0.1);
  int tried = 0;
  for (int i = 0; i < 60; ++i) {
    const BoundaryVoxel u{{20, 20, worlds::uniform_int(random, 2, 15)},
                          static_cast<std::uint8_t>(1U << worlds::uniform_int(random, 0, 5))};
    const Vector3d at(worlds::uniform(random, 5, 35), worlds::uniform(random, 5, 35),
                      worlds::uniform(random, 0, 18));
    const Eigen::Isometry3d pose = worlds::upright(at, worlds::uniform(random, 0, 6.28));
    const double expected = planning::expected_density_ppm2(grid, u, pattern, pose);
    int face = 0;
    while (u.faces >> face != 1) ++face;
    const Vector3d normal = (face % 2 == 0 ? -1 : 1) * Vector3d::Unit(face / 2);
    const Vector3d d = grid.center_m(u.v) - at;
    const bool steep = d.head<2>().norm() < 3 || -d.normalized().dot(normal) < 0.2;
    if (expected == 0) {  // From behind, or below the lowest beam.
      EXPECT_LE(std::min(-d.dot(normal), d.z() / d.norm() + std::sin(M_PI / 3)), 0);
    }
    if (expected == 0 || steep) continue;
    const double counted = counted_ppm2(grid.center_m(u.v), normal, 0.8, pattern, pose);
    EXPECT_NEAR(counted, expected, 0.15 * expected + 20) << i;
    ++tried;
  }
  EXPECT_GT(tried, 12);
}

TEST(ExpectedDensity, HasNoBeamsOutsideThePattern) {
  const VoxelGrid grid{{0, 0, 0}, 1.0, 40, 40, 20};
  hal::ScanPattern ahead = worlds::sphere(1, 1, -30, 30);
  ahead.columns = 91;
  ahead.azimuth_first_rad = -45 * worlds::kDegree;
  const auto density = [&](Voxel v, double heading_rad) {
    return planning::expected_density_ppm2(grid, {v, 63}, ahead,
                                           worlds::upright({20.5, 20.5, 5.5}, heading_rad));
  };
  EXPECT_GT(density({30, 20, 5}, 0), 0);
  EXPECT_EQ(density({10, 20, 5}, 0), 0) << "behind";
  EXPECT_GT(density({10, 20, 5}, M_PI), 0) << "turned round";
  EXPECT_GT(density({10, 20, 5}, 3 * M_PI), 0) << "and once more";
  EXPECT_EQ(density({23, 20, 15}, 0), 0) << "above the highest beam";
  EXPECT_THROW(planning::beams_per_sr({}), std::invalid_argument);
}

TEST(ScanDensity, IsTheExpectedOneWhereTheLiteralLoopSeesTheVoxel) {
  std::size_t seen = 0;
  const hal::ScanPattern pattern = worlds::sphere(1, 1);
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    worlds::ViewCase c = worlds::random_case(seed);
    worlds::Random random(seed);
    const VoxelGrid& grid = c.map.grid();
    const auto surface = planning::surface_voxels(c.map);
    const Eigen::Isometry3d pose =
        worlds::upright({worlds::uniform(random, 0, grid.nx), worlds::uniform(random, 0, grid.ny),
                         worlds::uniform(random, 0, grid.nz)},
                        1);
    const Voxel p = grid.voxel_at(pose.translation());
    for (const int threads : {1, 2}) {
      const std::vector<float> found =
          planning::scan_density(c.map, surface, pattern, pose, c.limits, threads);
      ASSERT_EQ(found.size(), surface.size());
      for (std::size_t i = 0; i < surface.size(); ++i) {
        const bool sees = oracle::counts_geometrically(surface[i], p, c.limits, 1) &&
                          oracle::visible(c.map, surface[i].v, p);
        const double expected =
            sees ? planning::expected_density_ppm2(grid, surface[i], pattern, pose) : 0;
        ASSERT_EQ(found[i], static_cast<float>(expected));
        seen += found[i] > 0;
      }
    }
  }
  EXPECT_GT(seen, 1000U);
}

// The rule that the sweep goes by, against the formula between centres.
TEST(DensityRule, AdmitsWhereTheExpectedDensityReachesTheGoal) {
  worlds::Random random(9);
  const hal::ScanPattern pattern = worlds::sphere(0.7, 0.3, -90, 90);
  std::size_t dense = 0, sparse = 0;
  for (int i = 0; i < 4000; ++i) {
    const double voxel_m = i % 2 == 0 ? 1 : 0.25;
    const VoxelGrid grid{{0, 0, 0}, voxel_m, 60, 60, 30};
    const auto any = [&](int n) { return worlds::uniform_int(random, 0, n - 1); };
    const BoundaryVoxel u{{any(60), any(60), any(30)},
                          static_cast<std::uint8_t>(worlds::uniform_int(random, 1, 63))};
    const Voxel p{any(60), any(60), any(30)};
    if (p.x == u.v.x && p.y == u.v.y) continue;  // Straight above the rule asks for nothing.
    ViewLimits limits{0, 1000, 90};
    if (!planning::ViewRule(limits, voxel_m).admits(u, p)) continue;
    const double expected = planning::expected_density_ppm2(
        grid, u, pattern, worlds::upright(grid.center_m(p), worlds::uniform(random, 0, 6)));
    limits.beams_per_sr = planning::beams_per_sr(pattern);
    for (const double factor : {0.5, 1 - 1e-5, 1 + 1e-5, 3.0}) {
      limits.density_min_ppm2 = expected * factor;
      const bool admits = planning::ViewRule(limits, voxel_m).admits(u, p);
      ASSERT_EQ(admits, factor < 1) << i;
      ++(admits ? dense : sparse);
    }
  }
  EXPECT_GT(dense, 1000U);
  EXPECT_GT(sparse, 1000U);
}

TEST(DensityRule, MakesTheTallyEqualTheLiteralLoop) {
  std::size_t seen = 0, less = 0;
  for (std::uint64_t seed = 1; seed <= 300; ++seed) {
    worlds::Random random(seed);
    worlds::ViewCase c = worlds::random_case(seed, seed % 10 == 0 ? 40 : 18, 200);
    c.limits.beams_per_sr = 5000;
    const auto without = planning::tally(c.map, c.boundary, c.candidates, c.limits);
    c.limits.density_min_ppm2 = std::exp(worlds::uniform(random, 0, 9));
    const auto slow = oracle::tally(c.map, c.boundary, c.candidates, c.limits);
    for (const int threads : {1, 3})
      ASSERT_EQ(planning::tally(c.map, c.boundary, c.candidates, c.limits, threads), slow)
          << "seed " << seed;
    for (std::size_t i = 0; i < slow.size(); ++i) {
      seen += slow[i];
      less += slow[i] < without[i];
    }
  }
  EXPECT_GT(seen, 10000U);
  EXPECT_GT(less, 1000U);
}

TEST(DensityRule, RefusesDensitiesThatCannotBe) {
  ViewLimits limits;
  limits.density_min_ppm2 = -1;
  EXPECT_THROW(planning::ViewRule(limits, 1), std::invalid_argument);
  limits.density_min_ppm2 = std::nan("");
  EXPECT_THROW(planning::ViewRule(limits, 1), std::invalid_argument);
}

}  // namespace
