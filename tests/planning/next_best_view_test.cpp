#include "planning/next_best_view.hpp"

#include <gtest/gtest.h>

#include "tests/planning/view_cases.hpp"
#include "tests/planning/voxel_oracle.hpp"
#include "tests/support/voxel_worlds.hpp"

namespace {

using planning::BoundaryVoxel;
using planning::ViewLimits;
using planning::Voxel;
using planning::VoxelGrid;
using planning::VoxelMap;
using planning::VoxelState;
using worlds::Random;
using worlds::random_candidates;
using worlds::random_limits;
using worlds::Site;
using worlds::uniform_int;

using Tally = std::vector<std::uint32_t>;

// A box that is seen-empty everywhere.
VoxelMap empty_map(int nx, int ny, int nz) {
  return worlds::noise(nx, ny, nz, 0, 0, 1);
}

ViewLimits all_round(double range_max_m = 1000) {
  return {0, range_max_m, 90};
}

void expect_equal(const Tally& fast, const Tally& slow, const std::vector<Voxel>& candidates,
                  const std::string& what) {
  ASSERT_EQ(fast.size(), slow.size()) << what;
  for (std::size_t i = 0; i < fast.size(); ++i)
    ASSERT_EQ(fast[i], slow[i]) << what << ": candidate " << i << " at (" << candidates[i].x << ", "
                                << candidates[i].y << ", " << candidates[i].z << ")";
}

TEST(Sight, WalkingEqualsTheSortedCrossings) {
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    Random random(seed);
    const int n = uniform_int(random, 1, 14);
    const VoxelMap map = worlds::noise(n, n, n, 0.02, 0.02, seed);
    for (int i = 0; i < 200; ++i) {
      const auto any = [&] { return uniform_int(random, 0, n - 1); };
      const Voxel u{any(), any(), any()}, p{any(), any(), any()};
      const bool expected = oracle::visible_by_crossings(map, u, p);
      ASSERT_EQ(oracle::visible(map, u, p), expected);
      ASSERT_EQ(planning::clear_between(map, u, p), expected);
      ASSERT_EQ(planning::clear_between(map, p, u), expected) << "sight is mutual";
    }
  }
}

TEST(Sight, PassesBetweenVoxelsThatTouchInAnEdge) {
  VoxelMap map = empty_map(2, 2, 1);
  map.set({1, 0, 0}, VoxelState::seen_occupied);
  map.set({0, 1, 0}, VoxelState::unseen);
  EXPECT_TRUE(planning::clear_between(map, {0, 0, 0}, {1, 1, 0}));
}

TEST(ViewRule, TakesLimitsThatAreWholeVoxelsAsInclusive) {
  EXPECT_EQ(planning::ViewRule({1, 100, 70}, 1).distance2_max(), 10000);
  EXPECT_EQ(planning::ViewRule({1, 100, 70}, 1).distance2_min(), 1);
  EXPECT_EQ(planning::ViewRule({0.3, 30, 70}, 0.3).distance2_max(), 10000);
  EXPECT_EQ(planning::ViewRule({0.3, 30, 70}, 0.3).distance2_min(), 1);
  EXPECT_EQ(planning::ViewRule({0.25, 100, 70}, 0.25).distance2_max(), 160000);
  EXPECT_EQ(planning::ViewRule({1.1, 1.5, 70}, 1).distance2_min(), 2);
  EXPECT_EQ(planning::ViewRule({1.1, 1.5, 70}, 1).distance2_max(), 2);
}

TEST(ViewRule, RefusesLimitsThatNoScannerHas) {
  EXPECT_THROW(planning::ViewRule({-1, 100, 70}, 1), std::invalid_argument);
  EXPECT_THROW(planning::ViewRule({2, 1, 70}, 1), std::invalid_argument);
  EXPECT_THROW(planning::ViewRule({1, 100, 91}, 1), std::invalid_argument);
  EXPECT_THROW(planning::ViewRule({1, 1e6, 70}, 1), std::invalid_argument);
  EXPECT_THROW(planning::ViewRule({1, std::nan(""), 70}, 1), std::invalid_argument);
}

TEST(ViewRule, SeesAFaceOnlyFromItsOuterSideAndWithinTheGrazingAngle) {
  const planning::ViewRule rule({0, 100, 45}, 1);
  const BoundaryVoxel u{{10, 10, 10}, planning::kFaceXPlus};
  EXPECT_TRUE(rule.admits(u, {15, 10, 10}));
  EXPECT_FALSE(rule.admits(u, {5, 10, 10}));
  EXPECT_FALSE(rule.admits(u, {10, 15, 10}));
  EXPECT_TRUE(rule.admits(u, {15, 14, 10}));
  EXPECT_FALSE(rule.admits(u, {15, 16, 10}));
  EXPECT_FALSE(rule.admits(u, {15, 14, 14}));
}

TEST(Tally, CountsAFreeStandingVoxelFromEverywhereInRange) {
  VoxelMap map = empty_map(21, 21, 1);
  map.set({10, 10, 0}, VoxelState::unseen);
  const std::vector<BoundaryVoxel> boundary = planning::boundary_unseen(map);
  ASSERT_EQ(boundary.size(), 1U);
  const std::vector<Voxel> candidates{{10, 10, 0}, {11, 10, 0}, {15, 10, 0}, {16, 10, 0},
                                      {13, 14, 0}, {14, 14, 0}, {12, 10, 0}};
  const Tally expected{0, 0, 1, 0, 1, 0, 1};
  EXPECT_EQ(planning::tally(map, boundary, candidates, {2, 5, 90}), expected);
}

TEST(Tally, DoesNotSeeThroughOccupiedOrUnseenVoxels) {
  VoxelMap map = empty_map(9, 1, 1);
  map.set({0, 0, 0}, VoxelState::unseen);
  map.set({4, 0, 0}, VoxelState::seen_occupied);
  const std::vector<BoundaryVoxel> boundary = planning::boundary_unseen(map);
  const std::vector<Voxel> candidates{{3, 0, 0}, {5, 0, 0}, {8, 0, 0}};
  EXPECT_EQ(planning::tally(map, boundary, candidates, all_round()), (Tally{1, 0, 0}));
  map.set({4, 0, 0}, VoxelState::unseen);
  EXPECT_EQ(planning::tally(map, boundary, candidates, all_round()), (Tally{1, 0, 0}));
  map.set({4, 0, 0}, VoxelState::seen_empty);
  EXPECT_EQ(planning::tally(map, boundary, candidates, all_round()), (Tally{1, 1, 1}));
}

TEST(Tally, LetsACandidateStandInAVoxelThatIsNotEmpty) {
  VoxelMap map = empty_map(9, 1, 1);
  map.set({0, 0, 0}, VoxelState::unseen);
  map.set({4, 0, 0}, VoxelState::seen_occupied);
  const std::vector<BoundaryVoxel> boundary = planning::boundary_unseen(map);
  EXPECT_EQ(planning::tally(map, boundary, {{4, 0, 0}, {5, 0, 0}}, all_round()), (Tally{1, 0}));
}

TEST(Tally, GivesEveryCandidateItsOwnInAnyOrderAndRepeated) {
  VoxelMap map = empty_map(5, 5, 2);
  map.set({0, 0, 0}, VoxelState::unseen);
  map.set({1, 1, 0}, VoxelState::seen_occupied);
  const std::vector<BoundaryVoxel> boundary = planning::boundary_unseen(map);
  const std::vector<Voxel> candidates{{4, 4, 1}, {4, 4, 0}, {0, 4, 0},
                                      {4, 4, 0}, {1, 1, 0}, {4, 4, 1}};
  EXPECT_EQ(planning::tally(map, boundary, candidates, all_round()),
            oracle::tally(map, boundary, candidates, all_round()));
}

TEST(Tally, IsEmptyWithoutCandidatesAndZeroWithoutBoundary) {
  const VoxelMap map = empty_map(3, 3, 3);
  EXPECT_TRUE(planning::tally(map, {}, {}, {}).empty());
  EXPECT_EQ(planning::tally(map, {}, {{1, 1, 1}}, {}), Tally{0});
  EXPECT_THROW(planning::tally(map, {}, {{3, 1, 1}}, {}), std::invalid_argument);
  EXPECT_THROW(planning::tally(map, {{{0, -1, 0}, 1}}, {}, {}), std::invalid_argument);
}

// Noise of any density, in boxes of any shape.
TEST(Tally, EqualsTheLiteralLoopInEveryCellOfRandomMaps) {
  const double densities[] = {0, 0.0005, 0.003, 0.01, 0.03, 0.1, 0.3, 0.6, 0.9};
  std::size_t seen = 0;
  for (std::uint64_t seed = 1; seed <= 800; ++seed) {
    Random random(seed);
    const int side = seed % 40 == 0 ? 40 : 22;
    const auto length = [&](int longest) { return uniform_int(random, 1, longest); };
    const VoxelMap map = worlds::noise(
        seed % 7 == 0 ? 130 : length(side), length(side), length(seed % 7 == 0 ? 5 : side),
        densities[uniform_int(random, 1, 8)] / 2, densities[uniform_int(random, 0, 8)] / 2, seed);
    const std::vector<BoundaryVoxel> boundary = planning::boundary_unseen(map);
    const std::vector<Voxel> candidates = random_candidates(random, map, 300);
    const ViewLimits limits = random_limits(random, 40);
    const Tally slow = oracle::tally(map, boundary, candidates, limits);
    for (const int threads : {1, 2, 3})
      expect_equal(planning::tally(map, boundary, candidates, limits, threads), slow, candidates,
                   "seed " + std::to_string(seed) + ", threads " + std::to_string(threads));
    if (HasFatalFailure()) return;
    for (const std::uint32_t count : slow) seen += count;
  }
  EXPECT_GT(seen, 1000000U) << "the maps hide too much to test anything";
}

// Long clear ways with few things in them: ties, slivers, wide windows.
TEST(Tally, EqualsTheLiteralLoopWhereRaysAreLong) {
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    Random random(seed + 100);
    VoxelMap map = empty_map(uniform_int(random, 100, 220), uniform_int(random, 1, 90),
                             uniform_int(random, 1, 6));
    const VoxelGrid& grid = map.grid();
    for (int i = 0; i < 25; ++i) {
      const Voxel v{uniform_int(random, 0, grid.nx - 1), uniform_int(random, 0, grid.ny - 1),
                    uniform_int(random, 0, grid.nz - 1)};
      const int length = uniform_int(random, 1, 20);
      for (int k = 0; k < length && v.x + k < grid.nx; ++k)
        map.set({v.x + k, v.y, v.z}, i % 3 != 0 ? VoxelState::unseen : VoxelState::seen_occupied);
    }
    const std::vector<BoundaryVoxel> boundary = planning::boundary_unseen(map);
    const std::vector<Voxel> candidates = random_candidates(random, map, 1500);
    const ViewLimits limits = random_limits(random, 200);
    expect_equal(planning::tally(map, boundary, candidates, limits, 2),
                 oracle::tally(map, boundary, candidates, limits), candidates,
                 "seed " + std::to_string(seed));
    if (HasFatalFailure()) return;
  }
}

TEST(Tally, EqualsTheLiteralLoopInEveryCellOfASiteForAnyNumberOfThreads) {
  const Site site;
  const std::vector<BoundaryVoxel> boundary = planning::boundary_unseen(site.map);
  std::vector<Voxel> candidates = worlds::cells(site.map, site.world, 2);
  const std::vector<Voxel> higher = worlds::cells(site.map, site.world, 6);
  for (std::size_t i = 0; i < higher.size(); i += 9) candidates.push_back(higher[i]);
  ASSERT_GT(boundary.size(), 4000U);
  ASSERT_GT(candidates.size(), 5000U);
  const ViewLimits limits{1, 60, 70};
  const Tally slow = oracle::tally(site.map, boundary, candidates, limits);
  for (const int threads : {1, 2, 3})
    expect_equal(planning::tally(site.map, boundary, candidates, limits, threads), slow, candidates,
                 "threads " + std::to_string(threads));
  EXPECT_GT(planning::best(slow)->gain_voxels, 100U);
}

TEST(VisibleFrom, ListsExactlyWhatTheTallyCounts) {
  const Site site;
  const std::vector<BoundaryVoxel> boundary = planning::boundary_unseen(site.map);
  const std::vector<Voxel> candidates = worlds::cells(site.map, site.world, 2);
  const ViewLimits limits{1, 60, 70};
  const Tally counts = planning::tally(site.map, boundary, candidates, limits);
  for (std::size_t i = 0; i < candidates.size(); i += 997) {
    const std::vector<std::uint32_t> visible =
        planning::visible_from(site.map, boundary, candidates[i], limits);
    EXPECT_EQ(visible.size(), counts[i]);
    std::vector<std::uint32_t> expected;
    for (std::uint32_t u = 0; u < boundary.size(); ++u)
      if (oracle::counts_geometrically(boundary[u], candidates[i], limits, 1) &&
          oracle::visible(site.map, boundary[u].v, candidates[i]))
        expected.push_back(u);
    EXPECT_EQ(visible, expected);
  }
}

TEST(Best, IsTheLargestAndOfEqualsTheFirst) {
  EXPECT_EQ(planning::best({}), std::nullopt);
  EXPECT_EQ(planning::best({3, 7, 2, 7}), (planning::BestView{1, 7}));
  EXPECT_EQ(planning::best({0, 0}), (planning::BestView{0, 0}));
}

}  // namespace
