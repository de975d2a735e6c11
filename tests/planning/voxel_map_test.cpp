#include "planning/voxel_map.hpp"

#include <gtest/gtest.h>

#include <set>

#include "planning/voxel_beams.hpp"
#include "tests/planning/voxel_oracle.hpp"
#include "tests/planning/voxel_scans.hpp"
#include "tests/support/voxel_worlds.hpp"

namespace {

using planning::BeamFan;
using planning::InsertConfig;
using planning::InsertReport;
using planning::LatticePoint;
using planning::Voxel;
using planning::VoxelGrid;
using planning::VoxelMap;
using planning::VoxelState;
using worlds::beam;
using worlds::kDegree;
using worlds::literal;
using worlds::Random;
using worlds::random_pose;
using worlds::random_scan;
using worlds::RandomScan;
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
    RandomScan s = random_scan(random);
    s.scan.beams.clear();
    const BeamFan fan(s.grid, s.scan, s.T_W_S);
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

TEST(BeamFan, TakesEachBeamFromItsOwnStart) {
  Random random(4);
  for (int i = 0; i < 200; ++i) {
    RandomScan s = random_scan(random);
    s.scan.beams.clear();
    worlds::bend(s.scan, random);
    const BeamFan fan(s.grid, s.scan, s.T_W_S);
    const auto column = static_cast<std::uint32_t>(
        uniform_int(random, 0, static_cast<int>(s.scan.pattern.columns) - 1));
    const auto row = static_cast<std::uint32_t>(
        uniform_int(random, 0, static_cast<int>(s.scan.pattern.rows) - 1));
    const hal::Beam& beam = s.scan.beams[std::size_t{column} * s.scan.pattern.rows + row];
    const double range_m = uniform(random, 0, 100);
    const auto expect_at = [&](const LatticePoint& point, double along_m) {
      const Eigen::Vector3d S_point_m =
          beam.S_origin_m.cast<double>() + along_m * beam.S_direction.cast<double>();
      const Eigen::Vector3d q = (s.T_W_S * S_point_m - s.grid.W_min_m) / s.grid.voxel_m * 2048;
      EXPECT_NEAR(static_cast<double>(point.x), q.x(), 1.1);
      EXPECT_NEAR(static_cast<double>(point.y), q.y(), 1.1);
      EXPECT_NEAR(static_cast<double>(point.z), q.z(), 1.1);
    };
    expect_at(fan.start(column, row), 0);
    expect_at(fan.end(column, row, static_cast<float>(range_m)), range_m);
    EXPECT_NEAR(fan.climb(column, row), (s.T_W_S.linear() * beam.S_direction.cast<double>()).z(),
                1e-12);
    EXPECT_NEAR(fan.start_up_m(column, row),
                (s.T_W_S.linear() * beam.S_origin_m.cast<double>()).z(), 1e-12);
  }
}

TEST(BeamFan, RefusesBeamsThatMakeNoSense) {
  hal::ScanCloud scan = beam(5);
  const VoxelGrid grid{{0, 0, 0}, 1, 10, 10, 10};
  const Eigen::Isometry3d pose = worlds::upright({5, 5, 5}, 0);
  scan.beams.resize(2);
  EXPECT_THROW(BeamFan(grid, scan, pose), std::invalid_argument) << "one too many";
  scan.beams = {{{0, 0, 0}, {0.9F, 0, 0}}};
  EXPECT_THROW(BeamFan(grid, scan, pose), std::invalid_argument) << "not of length 1";
  scan.beams = {{{0, 0, NAN}, {1, 0, 0}}};
  EXPECT_THROW(BeamFan(grid, scan, pose), std::invalid_argument) << "starts nowhere";
  scan.beams = {{{3, 0, 0}, {1, 0, 0}}};
  EXPECT_THROW(BeamFan(grid, scan, pose), std::invalid_argument) << "starts elsewhere";
  scan.beams = {{{1, 0, 0}, {1, 0, 0}}};
  EXPECT_NO_THROW(BeamFan(grid, scan, pose));
}

TEST(VoxelMap, StartsUnseenAndIsUnseenOutside) {
  const VoxelMap map({{0, 0, 0}, 1, 70, 3, 2});
  EXPECT_EQ(map.counts(), (planning::VoxelCounts{420, 0, 0}));
  EXPECT_EQ(map.at({69, 2, 1}), VoxelState::unseen);
  EXPECT_EQ(map.at({-1, 0, 0}), VoxelState::unseen);
  EXPECT_EQ(map.at({70, 0, 0}), VoxelState::unseen);
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

TEST(VoxelMap, GrownIntoKeptLayersEqualsHighFromTheStartForAllScansBefore) {
  const worlds::World world = worlds::fort(60, 5);  // Up to 14 m high.
  Random random(6);
  const int heights[] = {3, 3, 6, 11, 11, 16, 19};
  VoxelMap low({{0, 0, -0.5}, 1, 60, 60, 3}, 16), high({{0, 0, -0.5}, 1, 60, 60, 3});
  std::vector<hal::ScanCloud> scans;
  const std::vector<Eigen::Isometry3d> poses = worlds::stations(world, 60, 5, 7);
  for (const Eigen::Isometry3d& pose : poses)
    scans.push_back(world.scan(worlds::sphere(1, 1), pose, 40, random));
  InsertConfig config;
  config.range_max_m = 40;
  config.threads = 2;
  for (std::size_t i = 0; i < scans.size(); ++i) {
    low.grow_z(heights[i]);
    high = VoxelMap({{0, 0, -0.5}, 1, 60, 60, heights[i]});
    InsertReport last;
    for (std::size_t k = 0; k <= i; ++k) last = high.insert(scans[k], poses[k], config);
    EXPECT_EQ(low.insert(scans[i], poses[i], config), last) << i;
    expect_same(low, high, "scan " + std::to_string(i));
    EXPECT_EQ(low.counts(), high.counts());
    EXPECT_EQ(planning::boundary_unseen(low), planning::boundary_unseen(high));
  }
  for (const int nz : {16, 19}) {  // 19: three layers that were not kept, so all unseen.
    low.grow_z(nz);
    high = VoxelMap({{0, 0, -0.5}, 1, 60, 60, 16});
    for (std::size_t k = 0; k < scans.size(); ++k) high.insert(scans[k], poses[k], config);
    high.grow_z(nz);
    expect_same(low, high, "grown to " + std::to_string(nz));
  }
}

TEST(VoxelMap, CountsTheReturnsInEachLayerAboveTheBox) {
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    Random random(seed + 7000);
    RandomScan s = random_scan(random);
    const int nz_kept = uniform_int(random, 1, 80);
    const BeamFan fan(s.grid, s.scan, s.T_W_S);
    std::vector<std::uint64_t> above;
    std::size_t outside = 0;
    for (std::uint32_t c = 0; c < s.scan.pattern.columns; ++c)
      for (std::uint32_t r = 0; r < s.scan.pattern.rows; ++r) {
        const float range_m = s.scan.ranges_m[std::size_t{c} * s.scan.pattern.rows + r];
        if (!(range_m > 0) || range_m < s.config.range_min_m || range_m > s.config.range_max_m)
          continue;
        const Voxel v = planning::voxel_of(fan.end(c, r, range_m));
        outside += !s.grid.contains(v);
        if (!s.grid.contains({v.x, v.y, 0}) || v.z < s.grid.nz) continue;
        above.resize(std::max(above.size(), static_cast<std::size_t>(v.z - s.grid.nz) + 1));
        ++above[static_cast<std::size_t>(v.z - s.grid.nz)];
      }
    VoxelMap map(s.grid, nz_kept);
    const InsertReport report = map.insert(s.scan, s.T_W_S, s.config);
    EXPECT_EQ(report.returns_above, above) << seed;
    EXPECT_EQ(report.returns_outside, outside) << seed;
    EXPECT_EQ(report.layers_needed, s.grid.nz + static_cast<int>(above.size())) << seed;
  }
}

TEST(VoxelMap, TakesAtMostAByteForEachVoxelOfTheBox) {
  for (const int nx : {16, 17, 64, 65, 129, 300, 1000}) {
    const VoxelMap map({{0, 0, 0}, 1, nx, 40, 10}), higher(map.grid(), 25);
    EXPECT_LE(map.storage_bytes(), map.grid().size()) << nx;
    EXPECT_LE(higher.storage_bytes(), map.grid().size() / 10 * 25) << nx;
  }
  EXPECT_EQ(VoxelMap({{0, 0, 0}, 1, 320, 300, 30}).storage_bytes(), 320u * 300 * 30 / 4);
}

TEST(VoxelMap, SetsARunAsItSetsItsVoxels) {
  Random random(13);
  VoxelMap runs({{0, 0, 0}, 1, 200, 2, 2}), single(runs.grid());
  for (int i = 0; i < 2000; ++i) {
    const int x = uniform_int(random, 0, 199), count = uniform_int(random, 0, 200 - x);
    const auto state = static_cast<VoxelState>(uniform_int(random, 0, 2));
    const int y = uniform_int(random, 0, 1), z = uniform_int(random, 0, 1);
    runs.set_run({x, y, z}, count, state);
    for (int k = 0; k < count; ++k) single.set({x + k, y, z}, state);
    ASSERT_EQ(runs, single) << i;
  }
  EXPECT_THROW(runs.set_run({150, 0, 0}, 51, VoxelState::unseen), std::out_of_range);
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
