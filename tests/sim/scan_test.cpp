#include "sim/scan.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "sim/noise.hpp"
#include "tests/sim/room.hpp"

namespace {

using Eigen::Vector3d;
constexpr double kDeg = std::numbers::pi / 180;

sim::ScannerModel perfect() {
  sim::ScannerModel model;
  model.azimuth_step_rad = 2 * kDeg;
  model.elevation_min_rad = -90 * kDeg;
  model.elevation_step_rad = 1 * kDeg;
  model.range_min_m = 0.5;
  model.range_sigma_m = 0;
  model.lost_share_max = 0;
  return model;
}

Eigen::Isometry3d pose(double x, double y, double z, double heading_rad) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() << x, y, z;
  T.linear() = Eigen::AngleAxisd(heading_rad, Vector3d::UnitZ()).toRotationMatrix();
  return T;
}

Vector3d direction(const hal::ScanPattern& pattern, std::uint32_t column, std::uint32_t row) {
  const double azimuth = pattern.azimuth_first_rad + column * pattern.azimuth_step_rad;
  const double elevation = pattern.elevation_first_rad + row * pattern.elevation_step_rad;
  return {std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth),
          std::sin(elevation)};
}

// From inside a box the nearest crossing of the six planes.
double range_in_room(const Vector3d& from, const Vector3d& along, const Vector3d& low,
                     const Vector3d& high) {
  double range_m = 1e9;
  for (int axis = 0; axis < 3; ++axis)
    if (std::abs(along[axis]) > 1e-12)
      range_m =
          std::min(range_m, ((along[axis] > 0 ? high : low)[axis] - from[axis]) / along[axis]);
  return range_m;
}

TEST(ScanPattern, FillsTheSphereOnceWithTheDefaultScanner) {
  const auto pattern = sim::make_pattern({});
  EXPECT_EQ(pattern.columns, 1800u);
  EXPECT_EQ(pattern.rows, 1500u);
  EXPECT_NEAR(pattern.azimuth_first_rad, -179.9 * kDeg, 1e-12);
  EXPECT_NEAR(pattern.azimuth_first_rad + 1799 * pattern.azimuth_step_rad, 179.9 * kDeg, 1e-9);
  EXPECT_NEAR(pattern.elevation_first_rad, -59.95 * kDeg, 1e-12);
  EXPECT_NEAR(pattern.elevation_first_rad + 1499 * pattern.elevation_step_rad, 89.95 * kDeg, 1e-9);
}

TEST(ScanPattern, CentresANarrowFieldOfViewOnTheHeading) {
  sim::ScannerModel model;
  model.fov_rad = 100 * kDeg;
  const auto pattern = sim::make_pattern(model);
  EXPECT_EQ(pattern.columns, 500u);
  EXPECT_NEAR(pattern.azimuth_first_rad, -49.9 * kDeg, 1e-12);
}

TEST(ScanPattern, RefusesStepsThatMakeNoSense) {
  for (const double step_rad : {0.0, -1.0, 1e-12, std::nan("")}) {
    sim::ScannerModel model;
    model.azimuth_step_rad = step_rad;
    EXPECT_THROW(sim::make_pattern(model), std::invalid_argument) << step_rad;
  }
  sim::ScannerModel model;
  model.elevation_max_rad = model.elevation_min_rad;
  EXPECT_THROW(sim::make_pattern(model), std::invalid_argument);
}

TEST(CastScan, MeasuresABoxRoomExactly) {
  // Far from the origin, as a site in national coordinates is.
  const Vector3d offset(678'000, 5'403'000, 400);
  sim::Mesh mesh = sim_test::room(6, 4, 3);
  for (auto& vertex : mesh.W_vertices_m) vertex += offset;
  const sim::Scene scene(mesh);
  const auto model = perfect();
  const auto pattern = sim::make_pattern(model);
  const double heading_rad = 0.3;
  const Vector3d at(1, -2, 1.8);
  const auto T_W_S = pose(offset.x() + 1, offset.y() - 2, offset.z() + 1.8, heading_rad);
  const auto ranges_m = sim::cast_scan(scene, T_W_S, pattern, model, 1, 1, 1);
  ASSERT_EQ(ranges_m.size(), pattern.beams());
  for (std::uint32_t column = 0; column < pattern.columns; ++column)
    for (std::uint32_t row = 0; row < pattern.rows; ++row) {
      const Vector3d along =
          Eigen::AngleAxisd(heading_rad, Vector3d::UnitZ()) * direction(pattern, column, row);
      const double expected_m = range_in_room(at, along, {-6, -4, 0}, {6, 4, 3});
      ASSERT_NEAR(ranges_m[column * pattern.rows + row], expected_m, 1e-4) << column << " " << row;
    }
}

TEST(CastScan, LosesWhatIsTooNearOrTooFar) {
  const sim::Scene scene(sim_test::room(6, 4, 3));
  auto model = perfect();
  model.range_min_m = 2.5;
  model.range_max_m = 5;
  const auto pattern = sim::make_pattern(model);
  const auto ranges_m = sim::cast_scan(scene, pose(0, 0, 1.5, 0), pattern, model, 1, 1, 1);
  int near = 0, far = 0, kept = 0;
  for (std::uint32_t column = 0; column < pattern.columns; ++column)
    for (std::uint32_t row = 0; row < pattern.rows; ++row) {
      const double true_m =
          range_in_room({0, 0, 1.5}, direction(pattern, column, row), {-6, -4, 0}, {6, 4, 3});
      const float range_m = ranges_m[column * pattern.rows + row];
      const bool lost = true_m < 2.5 || true_m > 5;
      ASSERT_EQ(range_m == 0, lost) << true_m;
      near += true_m < 2.5;
      far += true_m > 5;
      kept += !lost;
    }
  EXPECT_GT(std::min({near, far, kept}), 1000);
}

TEST(CastScan, SeesTrianglesFromBothSides) {
  const Vector3d a(5, -50, -50), b(5, 50, -50), c(5, 0, 50);
  for (const bool flipped : {false, true}) {
    sim::Mesh mesh;
    mesh.W_vertices_m = {a, b, c};
    mesh.triangles = {flipped ? std::array{0u, 2u, 1u} : std::array{0u, 1u, 2u}};
    const sim::Scene scene(mesh);
    auto model = perfect();
    model.fov_rad = 2 * kDeg;
    const auto pattern = sim::make_pattern(model);
    const auto ranges_m = sim::cast_scan(scene, pose(0, 0, 0, 0), pattern, model, 1, 1, 1);
    EXPECT_NEAR(ranges_m[90], 5, 1e-3);
  }
}

TEST(CastScan, DoesNotDependOnThreads) {
  const sim::Scene scene(sim_test::room(6, 4, 3));
  auto model = perfect();
  model.range_sigma_m = 0.01;
  model.lost_share_max = 0.95;
  const auto pattern = sim::make_pattern(model);
  const auto T = pose(1, 1, 1.8, 1);
  const auto one = sim::cast_scan(scene, T, pattern, model, 7, 3, 1);
  EXPECT_EQ(one, sim::cast_scan(scene, T, pattern, model, 7, 3, 2));
  EXPECT_EQ(one, sim::cast_scan(scene, T, pattern, model, 7, 3, 5));
  EXPECT_NE(one, sim::cast_scan(scene, T, pattern, model, 8, 3, 1)) << "another seed";
  EXPECT_NE(one, sim::cast_scan(scene, T, pattern, model, 7, 4, 1)) << "another scan";
}

TEST(CastScan, RangeNoiseIsAsWideAsClaimed) {
  const sim::Scene scene(sim_test::room(6, 4, 3));
  auto model = perfect();
  model.azimuth_step_rad = 0.5 * kDeg;
  const auto pattern = sim::make_pattern(model);
  const auto T = pose(0, 0, 1.5, 0);
  const auto exact_m = sim::cast_scan(scene, T, pattern, model, 1, 1, 2);
  model.range_sigma_m = 0.02;
  const auto noisy_m = sim::cast_scan(scene, T, pattern, model, 1, 1, 2);
  double sum = 0, squares = 0, fourths = 0, lagged = 0, before = 0;
  const auto n = static_cast<double>(exact_m.size());
  for (std::size_t i = 0; i < exact_m.size(); ++i) {
    ASSERT_GT(noisy_m[i], 0);
    const double z = (noisy_m[i] - exact_m[i]) / 0.02;
    sum += z;
    squares += z * z;
    fourths += z * z * z * z;
    lagged += z * before;
    before = z;
  }
  EXPECT_NEAR(sum / n, 0, 5 / std::sqrt(n));
  EXPECT_NEAR(squares / n, 1, 5 * std::sqrt(2 / n));
  EXPECT_NEAR(fourths / n, 3, 5 * std::sqrt(96 / n)) << "not normal";
  EXPECT_NEAR(lagged / n, 0, 5 / std::sqrt(n)) << "neighbouring beams are not independent";
}

TEST(LostShare, RisesSmoothlyFromTheGrazingLimit) {
  const sim::ScannerModel model;
  EXPECT_EQ(sim::lost_share(model, 0), 0);
  EXPECT_EQ(sim::lost_share(model, 80 * kDeg), 0);
  EXPECT_NEAR(sim::lost_share(model, 84.5 * kDeg), 0.475, 1e-12);
  EXPECT_NEAR(sim::lost_share(model, 89 * kDeg), 0.95, 1e-12);
  EXPECT_NEAR(sim::lost_share(model, 90 * kDeg), 0.95, 1e-12);
}

TEST(CastScan, LosesTheShareOfGrazingBeamsThatTheModelSays) {
  const sim::Scene scene(sim_test::plain(10'000));
  auto model = perfect();
  model.elevation_min_rad = -40 * kDeg;
  model.elevation_max_rad = 0;
  model.elevation_step_rad = 0.5 * kDeg;
  model.azimuth_step_rad = 0.05 * kDeg;
  model.lost_share_max = 0.95;
  model.range_max_m = 1000;
  const auto pattern = sim::make_pattern(model);
  const auto ranges_m = sim::cast_scan(scene, pose(0, 0, 1.8, 0), pattern, model, 1, 1, 2);
  for (std::uint32_t row = 0; row < pattern.rows; ++row) {
    const double elevation_rad = pattern.elevation_first_rad + row * pattern.elevation_step_rad;
    const double share = sim::lost_share(model, 90 * kDeg + elevation_rad);
    const double n = pattern.columns;
    int lost = 0;
    for (std::uint32_t column = 0; column < pattern.columns; ++column)
      lost += ranges_m[column * pattern.rows + row] == 0;
    EXPECT_NEAR(lost / n, share, 5 * std::sqrt(share * (1 - share) / n)) << elevation_rad / kDeg;
  }
}

TEST(NormalQuantile, InvertsTheNormalDistribution) {
  EXPECT_NEAR(sim::normal_quantile(0.5), 0, 1e-9);
  EXPECT_NEAR(sim::normal_quantile(0.975), 1.959963984540054, 1e-8);
  EXPECT_NEAR(sim::normal_quantile(0.001), -3.090232306167813, 1e-8);
  for (double p = 1e-6; p < 1; p += 0.01013)
    EXPECT_NEAR(0.5 * std::erfc(-sim::normal_quantile(p) / std::sqrt(2)), p, 1e-8);
}

TEST(WanderingNoise, KeepsItsSigmaAndForgetsOverItsLength) {
  sim::WanderingNoise noise(1, 1, 2.0, 10.0);
  double squares = 0, lagged = 0, before = noise.value();
  constexpr int kSteps = 400'000;
  for (int i = 0; i < kSteps; ++i) {
    const double now = noise.step(5.0);
    squares += now * now;
    lagged += now * before;
    before = now;
  }
  EXPECT_NEAR(squares / kSteps, 4, 0.1);
  EXPECT_NEAR(lagged / kSteps, 4 * std::exp(-0.5), 0.1);
}

}  // namespace
