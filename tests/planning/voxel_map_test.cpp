#include "planning/voxel_map.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <set>

#include "planning/voxel_beams.hpp"
#include "tests/planning/voxel_oracle.hpp"
#include "tests/planning/voxel_worlds.hpp"

namespace {

using planning::BeamFan;
using planning::InsertConfig;
using planning::InsertReport;
using planning::LatticePoint;
using planning::Voxel;
using planning::VoxelGrid;
using planning::VoxelMap;
using planning::VoxelState;
using worlds::kDegree;
using worlds::Random;
using worlds::uniform;
using worlds::uniform_int;

std::string text(Voxel v) {
  return "(" + std::to_string(v.x) + ", " + std::to_string(v.y) + ", " + std::to_string(v.z) + ")";
}

// Fails with the first voxels that differ.
void expect_same(const VoxelMap& fast, const VoxelMap& slow, const std::string& what) {
  if (fast == slow) return;
  int told = 0;
  for (int z = 0; z < fast.grid().nz; ++z)
    for (int y = 0; y < fast.grid().ny; ++y)
      for (int x = 0; x < fast.grid().nx; ++x)
        if (fast.at({x, y, z}) != slow.at({x, y, z}) && told++ < 5)
          ADD_FAILURE() << what << ": voxel " << text({x, y, z}) << " is "
                        << static_cast<int>(fast.at({x, y, z})) << ", walked "
                        << static_cast<int>(slow.at({x, y, z}));
  ASSERT_GT(told, 0) << what << ": padding bits differ";
  ADD_FAILURE() << what << ": " << told << " voxels differ";
}

// One beam along +x of S with the given range.
hal::ScanCloud beam(float range_m, double elevation_rad = 0) {
  hal::ScanCloud scan;
  scan.pattern.columns = scan.pattern.rows = 1;
  scan.pattern.elevation_first_rad = elevation_rad;
  scan.ranges_m = {range_m};
  return scan;
}

InsertConfig literal(double range_max_m = 100) {
  InsertConfig config;
  config.range_min_m = 0;
  config.range_max_m = range_max_m;
  config.no_return_window = 0;
  return config;
}

// A pattern, ranges and pose of any kind that a scanner could have, and worse.
struct RandomScan {
  VoxelGrid grid;
  hal::ScanCloud scan;
  Eigen::Isometry3d T_W_S = Eigen::Isometry3d::Identity();
  InsertConfig config;
};

hal::ScanPattern random_pattern(Random& random) {
  hal::ScanPattern pattern;
  pattern.columns = static_cast<std::uint32_t>(uniform_int(random, 1, 90));
  pattern.rows = static_cast<std::uint32_t>(uniform_int(random, 1, 60));
  pattern.azimuth_first_rad = uniform(random, -7, 7);
  pattern.elevation_first_rad = uniform(random, -1.6, 0.5);
  const double sign = uniform_int(random, 0, 1) != 0 ? 1 : -1;
  switch (uniform_int(random, 0, 3)) {
    case 0:
      pattern.azimuth_step_rad = sign * 2 * M_PI / pattern.columns;
      break;
    case 1:
      pattern.azimuth_step_rad = sign * uniform(random, 0.001, 0.02);
      break;
    case 2:
      pattern.azimuth_step_rad = sign * uniform(random, 0.02, 0.2);
      break;
    default:
      pattern.azimuth_step_rad = sign * M_PI / 64;
      pattern.azimuth_first_rad = 0;
  }
  pattern.elevation_step_rad = uniform(random, 0.002, 0.08);
  if (uniform_int(random, 0, 3) == 0) pattern.elevation_step_rad = M_PI / 64;
  if (uniform_int(random, 0, 3) == 0) {
    pattern.elevation_first_rad = 1.57;
    pattern.elevation_step_rad *= -1;
  }
  return pattern;
}

Eigen::Isometry3d random_pose(Random& random, const VoxelGrid& grid) {
  Eigen::Vector3d q;
  for (int i = 0; i < 3; ++i) q[i] = uniform(random, -3, std::max({grid.nx, grid.ny, grid.nz}) + 3);
  if (uniform_int(random, 0, 2) == 0) q = q.array().round();  // On corners of voxels.
  if (uniform_int(random, 0, 2) == 0)
    q = q.cwiseMin(Eigen::Vector3d(grid.nx, grid.ny, grid.nz) * 0.7).cwiseMax(0.3);
  Eigen::Isometry3d pose = worlds::upright(grid.W_min_m + grid.voxel_m * q, uniform(random, -4, 4));
  const int kind = uniform_int(random, 0, 3);
  if (kind == 0) pose.linear().setIdentity();
  if (kind == 1)
    pose.rotate(Eigen::AngleAxisd(uniform(random, -0.2, 0.2), Eigen::Vector3d::UnitX()));
  if (kind == 2)
    pose.linear() = Eigen::Quaterniond(uniform(random, -1, 1), uniform(random, -1, 1),
                                       uniform(random, -1, 1), uniform(random, 0.1, 1))
                        .normalized()
                        .toRotationMatrix();
  return pose;
}

RandomScan random_scan(Random& random) {
  RandomScan result;
  const int sides[] = {1, 2, 7, 20, 33, 63, 64, 65, 130};
  result.grid.voxel_m = uniform_int(random, 0, 1) != 0 ? 1.0 : uniform(random, 0.2, 2);
  result.grid.W_min_m = {uniform(random, -50, 50), uniform(random, -50, 50),
                         uniform(random, -5, 5)};
  result.grid.nx = sides[uniform_int(random, 0, 8)];
  result.grid.ny = sides[uniform_int(random, 0, 6)];
  result.grid.nz = sides[uniform_int(random, 0, 4)];
  result.scan.pattern = random_pattern(random);
  result.T_W_S = random_pose(random, result.grid);
  InsertConfig& config = result.config;
  config.range_min_m = uniform(random, 0, 3);
  config.range_max_m = uniform(random, 4, 60);
  config.carve_no_return = uniform_int(random, 0, 4) != 0;
  config.no_return_window = uniform_int(random, 0, 3);
  config.threads = uniform_int(random, 1, 3);
  if (uniform_int(random, 0, 1) != 0)
    config.ground_z_m = result.grid.W_min_m.z() + uniform(random, -2, 5);
  const double lost = uniform(random, 0, 1), smooth = uniform(random, 0, 1);
  float range_m = 5;
  for (std::size_t i = 0; i < result.scan.pattern.beams(); ++i) {
    if (uniform(random, 0, 1) > smooth) range_m = static_cast<float>(uniform(random, 0.01, 70));
    float out = uniform(random, 0, 1) < lost ? 0.0F : range_m;
    if (uniform_int(random, 0, 200) == 0) out = std::numeric_limits<float>::quiet_NaN();
    if (uniform_int(random, 0, 200) == 0) out = -1;
    result.scan.ranges_m.push_back(out);
  }
  return result;
}

TEST(VoxelWalk, SteppingEqualsTheSortedCrossings) {
  Random random(1);
  for (int i = 0; i < 20000; ++i) {
    const auto odd = [&](int limit) {
      return std::int64_t{2} * uniform_int(random, -limit, limit) + 1;
    };
    // Small sides make ties; a side of 2048 is the real lattice.
    const std::int64_t side = i % 3 == 0 ? 2 : i % 3 == 1 ? 8 : 2048;
    const int limit = side == 2048 ? 9000 : 40;
    const oracle::Point a{odd(limit), odd(limit), odd(limit)};
    oracle::Point b{odd(limit), odd(limit), odd(limit)};
    if (i % 5 == 0) b.x = a.x;
    if (i % 7 == 0) b = {a.x + b.x - 1, a.y + b.x - 1, a.z - b.x + 1};
    std::vector<Voxel> stepped;
    oracle::walk(a, b, side, [&](Voxel v) {
      stepped.push_back(v);
      return true;
    });
    ASSERT_EQ(stepped, oracle::voxels_by_crossings(a, b, side)) << i;
  }
}

TEST(VoxelWalk, MeetsExactlyTheVoxelsOfTheCrossings) {
  Random random(2);
  for (int i = 0; i < 1500; ++i) {
    const auto odd = [&] { return std::int64_t{2} * uniform_int(random, -2500, 2500) + 1; };
    const LatticePoint a{odd(), odd(), odd()};
    LatticePoint b{odd(), odd(), odd()};
    if (i % 4 == 0) b.y = a.y;
    if (i % 4 == 1) b = {a.x + b.x - 1, a.y + b.x - 1, a.z - b.x + 1};
    const std::vector<Voxel> crossed =
        oracle::voxels_by_crossings({a.x, a.y, a.z}, {b.x, b.y, b.z}, 2048);
    const std::set<Voxel> met(crossed.begin(), crossed.end());
    for (int z = -5; z <= 5; ++z)
      for (int y = -5; y <= 5; ++y)
        for (int x = -5; x <= 5; ++x)
          ASSERT_EQ(planning::meets(a, b, {x, y, z}), met.contains({x, y, z})) << text({x, y, z});
  }
}

TEST(BeamFan, EndsWhereTheTransformedPointIs) {
  Random random(3);
  for (int i = 0; i < 200; ++i) {
    const RandomScan s = random_scan(random);
    const BeamFan fan(s.grid, s.scan.pattern, s.T_W_S);
    const auto column = static_cast<std::uint32_t>(
        uniform_int(random, 0, static_cast<int>(s.scan.pattern.columns) - 1));
    const auto row = static_cast<std::uint32_t>(
        uniform_int(random, 0, static_cast<int>(s.scan.pattern.rows) - 1));
    const float range_m = static_cast<float>(uniform(random, 0, 100));
    const double azimuth =
        s.scan.pattern.azimuth_first_rad + column * s.scan.pattern.azimuth_step_rad;
    const double elevation =
        s.scan.pattern.elevation_first_rad + row * s.scan.pattern.elevation_step_rad;
    const Eigen::Vector3d direction(std::cos(elevation) * std::cos(azimuth),
                                    std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
    const Eigen::Vector3d q =
        (s.T_W_S * (range_m * direction) - s.grid.W_min_m) / s.grid.voxel_m * 2048;
    const LatticePoint end = fan.end(column, row, range_m);
    EXPECT_NEAR(static_cast<double>(end.x), q.x(), 1.0001);
    EXPECT_NEAR(static_cast<double>(end.y), q.y(), 1.0001);
    EXPECT_NEAR(static_cast<double>(end.z), q.z(), 1.0001);
    EXPECT_TRUE((end.x & 1) != 0 && (end.y & 1) != 0 && (end.z & 1) != 0);
    EXPECT_NEAR(fan.climb(column, row), (s.T_W_S.linear() * direction).z(), 1e-12);
  }
}

TEST(VoxelMap, StartsUnseenAndIsUnseenOutside) {
  const VoxelMap map({{0, 0, 0}, 1, 70, 3, 2});
  EXPECT_EQ(map.counts(), (planning::VoxelCounts{420, 0, 0}));
  EXPECT_EQ(map.at({69, 2, 1}), VoxelState::unseen);
  EXPECT_EQ(map.at({-1, 0, 0}), VoxelState::unseen);
  EXPECT_EQ(map.at({70, 0, 0}), VoxelState::unseen);
}

TEST(VoxelMap, TakesAtMostOneBytePerVoxel) {
  const VoxelMap map({{0, 0, 0}, 1, 300, 300, 30});
  const std::size_t bytes = 2 * 8 * static_cast<std::size_t>(map.row_words()) * 300 * 30;
  EXPECT_LE(bytes, map.grid().size());
}

TEST(VoxelMap, MarksThePointAndCarvesTheWayToTheScanner) {
  VoxelMap map({{0, 0, 0}, 1, 10, 1, 1});
  const InsertReport report =
      map.insert(beam(5.0F), worlds::upright({2.5, 0.5, 0.5}, 0), literal());
  const VoxelState u = VoxelState::unseen, e = VoxelState::seen_empty,
                   o = VoxelState::seen_occupied;
  const VoxelState expected[] = {u, u, e, e, e, e, e, o, u, u};
  for (int x = 0; x < 10; ++x) EXPECT_EQ(map.at({x, 0, 0}), expected[x]) << x;
  EXPECT_EQ(report.returns, 1U);
  EXPECT_EQ(report.new_occupied, 1U);
  EXPECT_EQ(report.new_empty, 5U);
}

TEST(VoxelMap, KeepsOccupiedForGoodAndLetsBeamsPass) {
  VoxelMap map({{0, 0, 0}, 1, 10, 1, 1});
  const Eigen::Isometry3d pose = worlds::upright({0.5, 0.5, 0.5}, 0);
  map.insert(beam(3.0F), pose, literal());
  const InsertReport report = map.insert(beam(6.0F), pose, literal());
  EXPECT_EQ(map.at({3, 0, 0}), VoxelState::seen_occupied);
  EXPECT_EQ(map.at({5, 0, 0}), VoxelState::seen_empty);
  EXPECT_EQ(map.at({6, 0, 0}), VoxelState::seen_occupied);
  EXPECT_EQ(report.emptied_to_occupied, 0U);
}

TEST(VoxelMap, TurnsSeenEmptyIntoOccupiedWhenAPointFallsThere) {
  VoxelMap map({{0, 0, 0}, 1, 10, 1, 1});
  const Eigen::Isometry3d pose = worlds::upright({0.5, 0.5, 0.5}, 0);
  map.insert(beam(6.0F), pose, literal());
  const InsertReport report = map.insert(beam(3.0F), pose, literal());
  EXPECT_EQ(map.at({3, 0, 0}), VoxelState::seen_occupied);
  EXPECT_EQ(report.emptied_to_occupied, 1U);
  EXPECT_EQ(report.new_empty, 0U);
}

TEST(VoxelMap, CarvesBeamsWithoutReturnToTheirRangeOnlyWhenAsked) {
  const Eigen::Isometry3d pose = worlds::upright({0.5, 0.5, 0.5}, 0);
  VoxelMap map({{0, 0, 0}, 1, 10, 1, 1});
  InsertConfig config = literal(4);
  config.carve_no_return = false;
  EXPECT_EQ(map.insert(beam(0), pose, config).new_empty, 0U);
  config.carve_no_return = true;
  const InsertReport report = map.insert(beam(0), pose, config);
  EXPECT_EQ(report.new_empty, 5U);
  EXPECT_EQ(report.no_returns, 1U);
  EXPECT_EQ(report.no_returns_carved, 1U);
  EXPECT_EQ(map.at({4, 0, 0}), VoxelState::seen_empty);
  EXPECT_EQ(map.at({5, 0, 0}), VoxelState::unseen);
}

TEST(VoxelMap, IgnoresAndReportsReturnsOutOfRange) {
  VoxelMap map({{0, 0, 0}, 1, 10, 1, 1});
  const Eigen::Isometry3d pose = worlds::upright({0.5, 0.5, 0.5}, 0);
  InsertConfig config = literal(6);
  config.range_min_m = 2;
  EXPECT_EQ(map.insert(beam(1.5F), pose, config).returns_too_near, 1U);
  EXPECT_EQ(map.insert(beam(7.0F), pose, config).returns_too_far, 1U);
  EXPECT_EQ(map.insert(beam(-2.0F), pose, config).returns_invalid, 1U);
  EXPECT_EQ(map.insert(beam(std::nanf("")), pose, config).returns_invalid, 1U);
  EXPECT_EQ(map.counts().unseen, 10U);
}

TEST(VoxelMap, WalksBeamsThatLeaveTheBoxAsInAnEndlessGrid) {
  const Eigen::Isometry3d pose = worlds::upright({0.5, 0.5, 0.5}, 0);
  VoxelMap map({{0, 0, 0}, 1, 10, 1, 1});
  const InsertReport report = map.insert(beam(50.0F), pose, literal());
  EXPECT_EQ(report.returns_outside, 1U);
  EXPECT_EQ(report.new_empty, 10U);
  VoxelMap from_outside({{0, 0, 0}, 1, 10, 1, 1});
  const InsertReport second =
      from_outside.insert(beam(8.0F), worlds::upright({-3.5, 0.5, 0.5}, 0), literal());
  EXPECT_EQ(second.new_empty, 4U);
  EXPECT_EQ(from_outside.at({4, 0, 0}), VoxelState::seen_occupied);
}

TEST(VoxelMap, EqualsTheWalkInEveryVoxelForAnyScan) {
  for (std::uint64_t seed = 1; seed <= 1500; ++seed) {
    Random random(seed);
    RandomScan s = random_scan(random);
    VoxelMap fast(s.grid);
    const int scans = uniform_int(random, 1, 3);
    VoxelMap slow(s.grid);
    for (int i = 0; i < scans; ++i) {
      fast.insert(s.scan, s.T_W_S, s.config);
      oracle::insert(slow, s.scan, s.T_W_S, s.config);
      expect_same(fast, slow, "seed " + std::to_string(seed) + " scan " + std::to_string(i));
      const VoxelGrid grid = s.grid;
      s = random_scan(random);
      s.grid = grid;
      s.T_W_S.translation() = random_pose(random, grid).translation();
    }
    if (HasFailure()) return;
  }
}

TEST(VoxelMap, EqualsTheWalkOnASiteForAnyNumberOfThreads) {
  const worlds::World world = worlds::fort(120, 5);
  Random random(6);
  const VoxelGrid grid{{0, 0, -0.5}, 1.0, 120, 120, 20};
  VoxelMap fast[3] = {VoxelMap(grid), VoxelMap(grid), VoxelMap(grid)}, slow(grid);
  for (const Eigen::Isometry3d& pose : worlds::stations(world, 120, 4, 7)) {
    const hal::ScanCloud scan = world.scan(worlds::sphere(0.5, 0.4), pose, 60, random, 0.02, 1.5);
    InsertConfig config;
    config.range_max_m = 60;
    config.ground_z_m = 0;
    InsertReport reports[3];
    for (int i = 0; i < 3; ++i) {
      config.threads = i + 1;
      reports[i] = fast[i].insert(scan, pose, config);
    }
    EXPECT_EQ(reports[0], reports[1]);
    EXPECT_EQ(reports[0], reports[2]);
    oracle::insert(slow, scan, pose, config);
    for (const VoxelMap& map : fast) expect_same(map, slow, "site");
  }
  EXPECT_GT(slow.counts().seen_empty, 100000U);
  EXPECT_GT(slow.counts().seen_occupied, 5000U);
}

TEST(VoxelMap, EqualsTheWalkWithFineVoxelsAndCoarseBeams) {
  const worlds::World world = worlds::fort(40, 8);
  Random random(9);
  VoxelMap fast({{0, 0, -0.1}, 0.2, 200, 200, 40}), slow(fast.grid());
  for (Eigen::Isometry3d pose : worlds::stations(world, 40, 2, 10)) {
    pose.rotate(Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitY()));
    const hal::ScanCloud scan = world.scan(worlds::sphere(1.5, 1.25), pose, 30, random);
    InsertConfig config;
    config.range_max_m = 30;
    fast.insert(scan, pose, config);
    oracle::insert(slow, scan, pose, config);
    expect_same(fast, slow, "fine");
  }
}

TEST(VoxelMap, ReportsWhatChanged) {
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    Random random(seed + 5000);
    RandomScan s = random_scan(random);
    VoxelMap map(s.grid);
    const InsertReport report = map.insert(s.scan, s.T_W_S, s.config);
    EXPECT_EQ(report.new_occupied, map.counts().seen_occupied);
    EXPECT_EQ(report.new_empty, map.counts().seen_empty);
    EXPECT_EQ(report.returns + report.returns_too_near + report.returns_too_far +
                  report.returns_invalid + report.no_returns,
              s.scan.pattern.beams());
  }
}

TEST(VoxelMap, GrownAfterwardsEqualsHighFromTheStart) {
  const Eigen::Isometry3d pose = worlds::upright({5.5, 5.5, 1.5}, 0);
  worlds::World world;
  world.boxes.push_back({{8, 0, 0}, {9, 10, 12.2}});
  Random random(11);
  const hal::ScanCloud scan = world.scan(worlds::sphere(2, 1), pose, 20, random);
  InsertConfig config;
  config.range_max_m = 20;
  VoxelMap low({{0, 0, -0.5}, 1, 10, 10, 4}), high({{0, 0, -0.5}, 1, 10, 10, 13});
  const InsertReport report = low.insert(scan, pose, config);
  EXPECT_EQ(report.layers_needed, 13);
  low.grow_z(report.layers_needed);
  EXPECT_EQ(low.grid().nz, 13);
  EXPECT_EQ(low.insert(scan, pose, config).returns_outside,
            high.insert(scan, pose, config).returns_outside);
  expect_same(low, high, "grown");
  EXPECT_THROW(low.grow_z(12), std::invalid_argument);
}

TEST(VoxelMap, RefusesWhatCannotBe) {
  EXPECT_THROW(VoxelMap({{0, 0, 0}, 1, 0, 1, 1}), std::invalid_argument);
  EXPECT_THROW(VoxelMap({{0, 0, 0}, 0, 1, 1, 1}), std::invalid_argument);
  EXPECT_THROW(VoxelMap({{0, 0, 0}, 1, 1, 1, 1 << 20}), std::invalid_argument);
  VoxelMap map({{0, 0, 0}, 1, 4, 4, 4});
  hal::ScanCloud scan = beam(1);
  scan.ranges_m.push_back(1);
  const Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  EXPECT_THROW(map.insert(scan, pose, {}), std::invalid_argument);
  scan = beam(1);
  EXPECT_THROW(map.insert(scan, worlds::upright({1e9, 0, 0}, 0), {}), std::invalid_argument);
  scan.pattern.columns = 2;
  scan.ranges_m.push_back(1);
  EXPECT_THROW(map.insert(scan, pose, {}), std::invalid_argument)
      << "two columns a step of 0 apart";
  InsertConfig config;
  config.range_max_m = std::nan("");
  EXPECT_THROW(map.insert(beam(1), pose, config), std::invalid_argument);
  EXPECT_EQ(map.counts().unseen, 64U);
}

TEST(TrustedNoReturns, EqualTheLiteralWindow) {
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    Random random(seed + 9000);
    const RandomScan s = random_scan(random);
    const hal::ScanPattern& p = s.scan.pattern;
    const double step = std::abs(p.azimuth_step_rad);
    const bool wraps = std::abs(p.columns * step - 2 * M_PI) < step / 2;
    const std::vector<float> fast = planning::trusted_no_returns(
        s.scan, s.config.no_return_window, s.config.range_max_m, s.config.threads);
    for (std::uint32_t c = 0; c < p.columns; ++c)
      for (std::uint32_t r = 0; r < p.rows; ++r)
        ASSERT_EQ(
            fast[std::size_t{c} * p.rows + r],
            oracle::trusted(s.scan, c, r, s.config.no_return_window, s.config.range_max_m, wraps));
  }
}

TEST(TrustedNoReturns, StopAtTheNearestReturnNearbyAndWrapOnlyAroundAFullCircle) {
  hal::ScanCloud scan;
  scan.pattern.columns = 8;
  scan.pattern.rows = 1;
  scan.pattern.azimuth_step_rad = M_PI / 4;
  scan.ranges_m = {7, 0, 0, 0, 0, 0, 0, 0};
  const std::vector<float> full{0, 7, 7, 50, 50, 50, 7, 7};
  EXPECT_EQ(planning::trusted_no_returns(scan, 2, 50), full);
  scan.pattern.azimuth_step_rad = M_PI / 5;
  const std::vector<float> open{0, 7, 7, 50, 50, 50, 50, 50};
  EXPECT_EQ(planning::trusted_no_returns(scan, 2, 50), open);
  const std::vector<float> all{0, 50, 50, 50, 50, 50, 50, 50};
  EXPECT_EQ(planning::trusted_no_returns(scan, 0, 50), all);
}

TEST(TrustedNoReturns, KeepADropOutFromTunnellingIntoTheWall) {
  worlds::World world;
  world.boxes.push_back({{10, -20, 0}, {30, 20, 20}});
  Random random(12);
  const Eigen::Isometry3d pose = worlds::upright({0.5, 0.5, 1.8}, 0);
  hal::ScanCloud scan = world.scan(worlds::sphere(1, 1), pose, 60, random);
  scan.ranges_m[61] = 0;  // Column 0, 1 deg above the horizon: a lost beam on the wall.
  InsertConfig config;
  config.range_max_m = 60;
  VoxelMap careful({{0, -20, -0.5}, 1, 40, 40, 20}), gullible(careful.grid());
  careful.insert(scan, pose, config);
  config.no_return_window = 0;
  gullible.insert(scan, pose, config);
  EXPECT_EQ(careful.at({20, 20, 2}), VoxelState::unseen);
  EXPECT_EQ(gullible.at({20, 20, 2}), VoxelState::seen_empty);
}

TEST(GroundRule, ADropOutOnTheGroundIsNoHole) {
  const VoxelGrid grid{{0, 0, -1.5}, 1, 40, 1, 4};  // The ground is in the middle of layer 1.
  const Eigen::Isometry3d pose = worlds::upright({0.5, 0.5, 1.8}, 0);
  const hal::ScanCloud lost = beam(0, -5 * kDegree);
  VoxelMap with(grid), without(grid);
  InsertConfig config = literal();
  without.insert(lost, pose, config);
  config.ground_z_m = 0;
  with.insert(lost, pose, config);
  for (int x = 0; x < 40; ++x) {
    EXPECT_EQ(with.at({x, 0, 1}), VoxelState::unseen) << x;
    EXPECT_EQ(with.at({x, 0, 0}), VoxelState::unseen) << x;
  }
  EXPECT_EQ(with.at({10, 0, 2}), VoxelState::seen_empty);
  EXPECT_EQ(without.at({18, 0, 1}), VoxelState::seen_empty);
  EXPECT_EQ(without.at({30, 0, 0}), VoxelState::seen_empty);
}

TEST(GroundRule, EndsAtTheGroundItselfWhereThatIsAFaceOfVoxels) {
  const VoxelGrid grid{{0, 0, -1}, 1, 40, 1, 4};
  VoxelMap map(grid);
  InsertConfig config = literal();
  config.ground_z_m = 0;
  map.insert(beam(0, -5 * kDegree), worlds::upright({0.5, 0.5, 1.8}, 0), config);
  EXPECT_EQ(map.at({20, 0, 1}), VoxelState::seen_empty);
  for (int x = 0; x < 40; ++x) EXPECT_EQ(map.at({x, 0, 0}), VoxelState::unseen) << x;
}

TEST(BoundaryUnseen, EqualsTheDefinition) {
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    Random random(seed);
    const int sides[] = {1, 2, 5, 63, 64, 65, 129};
    const VoxelMap map =
        worlds::noise(sides[seed % 7], 1 + static_cast<int>(seed % 5),
                      1 + static_cast<int>(seed % 4), uniform(random, 0, 1), 0.1, seed);
    EXPECT_EQ(planning::boundary_unseen(map), oracle::boundary_unseen(map));
  }
}

TEST(BoundaryUnseen, DoesNotTakeTheOutsideForEmpty) {
  VoxelMap map({{0, 0, 0}, 1, 2, 1, 1});
  EXPECT_TRUE(planning::boundary_unseen(map).empty());
  map.set({1, 0, 0}, VoxelState::seen_empty);
  const std::vector<planning::BoundaryVoxel> expected{{{0, 0, 0}, planning::kFaceXPlus}};
  EXPECT_EQ(planning::boundary_unseen(map), expected);
}

}  // namespace
