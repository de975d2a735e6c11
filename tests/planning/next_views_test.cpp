#include "planning/next_views.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <numeric>

#include "planning/best_heading.hpp"
#include "tests/planning/view_cases.hpp"
#include "tests/planning/voxel_oracle.hpp"

namespace {

using planning::BoundaryVoxel;
using planning::NextViewsConfig;
using planning::PlannedView;
using planning::ViewLimits;
using planning::ViewTargets;
using planning::Voxel;
using planning::VoxelMap;
using planning::VoxelState;

// Every count anew for every view, pair by pair.
std::vector<PlannedView> plain_greedy(const VoxelMap& map, std::vector<BoundaryVoxel> left,
                                      const std::vector<Voxel>& candidates,
                                      const ViewLimits& limits, const NextViewsConfig& config) {
  const std::vector<std::uint32_t> alone = oracle::tally(map, left, candidates, limits);
  std::vector<PlannedView> views;
  while (views.size() < config.views_max) {
    const std::vector<std::uint32_t> counts = oracle::tally(map, left, candidates, limits);
    std::size_t most = 0;
    for (std::size_t i = 0; i < counts.size(); ++i)
      if (counts[i] > counts[most]) most = i;
    if (counts.empty() || counts[most] == 0 || counts[most] < config.adds_min_voxels) break;
    views.push_back({most, alone[most], counts[most]});
    std::erase_if(left, [&](const BoundaryVoxel& u) {
      return oracle::counts_geometrically(u, candidates[most], limits, map.grid().voxel_m) &&
             oracle::visible(map, u.v, candidates[most]);
    });
  }
  return views;
}

TEST(NextViews, EqualPlainGreedyWithAFullRecountOnRandomMaps) {
  std::size_t found = 0;
  for (std::uint64_t seed = 1; seed <= 150; ++seed) {
    const worlds::ViewCase c = worlds::random_case(seed);
    NextViewsConfig config;
    config.views_max = seed % 5 == 0 ? 100 : seed % 7;
    config.adds_min_voxels = static_cast<std::uint32_t>(seed % 4);
    const auto slow = plain_greedy(c.map, c.boundary, c.candidates, c.limits, config);
    const auto counts = planning::tally(c.map, c.boundary, c.candidates, c.limits);
    for (const int threads : {1, 3}) {
      config.threads = threads;
      ASSERT_EQ(planning::next_views(c.map, c.boundary, c.candidates, counts, c.limits, config),
                slow)
          << "seed " << seed << ", threads " << threads;
    }
    found += slow.size();
  }
  EXPECT_GT(found, 500U);
}

// Who is seen by every candidate from its best heading, anew for every view.
std::vector<PlannedView> plain_faced_greedy(const VoxelMap& map,
                                            const std::vector<ViewTargets>& all,
                                            const std::vector<Voxel>& candidates,
                                            const NextViewsConfig& config) {
  const planning::HorizontalView horizontal(config.fov_deg);
  std::vector<ViewTargets> left = all;
  const auto seen = [&](const std::vector<ViewTargets>& targets, Voxel p) {
    std::vector<Voxel> voxels;
    for (const ViewTargets& some : targets)
      for (const BoundaryVoxel& u : some.voxels)
        if (oracle::counts_geometrically(u, p, some.limits, map.grid().voxel_m) &&
            oracle::visible(map, u.v, p))
          voxels.push_back(u.v);
    return voxels;
  };
  std::vector<PlannedView> views;
  while (views.size() < config.views_max) {
    PlannedView most;
    for (std::size_t i = 0; i < candidates.size(); ++i) {
      const auto [heading_rad, adds] = horizontal.best(candidates[i], seen(left, candidates[i]));
      if (adds > most.adds_voxels) most = {i, 0, adds, heading_rad};
    }
    if (most.adds_voxels < std::max(config.adds_min_voxels, 1U)) break;
    const Voxel p = candidates[most.candidate];
    for (const Voxel v : seen(all, p)) most.sees_voxels += horizontal.faces(p, most.heading_rad, v);
    views.push_back(most);
    for (ViewTargets& some : left)
      std::erase_if(some.voxels, [&](const BoundaryVoxel& u) {
        return oracle::counts_geometrically(u, p, some.limits, map.grid().voxel_m) &&
               oracle::visible(map, u.v, p) && horizontal.faces(p, most.heading_rad, u.v);
      });
  }
  return views;
}

TEST(NextViews, FaceWhereTheyAddTheMostAsPlainGreedyWouldHaveIt) {
  std::size_t found = 0;
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    const worlds::ViewCase c = worlds::random_case(seed);
    NextViewsConfig config{
        .views_max = 1 + seed % 7,
        .adds_min_voxels = static_cast<std::uint32_t>(seed % 3),
        .fov_deg = seed % 4 == 0 ? 360.0 : 30.0 * static_cast<double>(seed % 11 + 1)};
    // Some of the boundary has to be seen more steeply and from nearer.
    std::vector<ViewTargets> targets{{{}, c.limits}, {{}, c.limits}};
    targets[1].limits.grazing_max_deg *= 0.7;
    targets[1].limits.range_max_m = std::max(0.7 * c.limits.range_max_m, c.limits.range_min_m);
    for (std::size_t i = 0; i < c.boundary.size(); ++i)
      targets[i % 3 == 0 ? 1 : 0].voxels.push_back(c.boundary[i]);
    std::vector<std::uint32_t> counts(c.candidates.size());
    for (const ViewTargets& some : targets) {
      const auto part = planning::tally(c.map, some.voxels, c.candidates, some.limits);
      for (std::size_t i = 0; i < counts.size(); ++i) counts[i] += part[i];
    }
    const auto slow = plain_faced_greedy(c.map, targets, c.candidates, config);
    for (const int threads : {1, 3}) {
      config.threads = threads;
      const auto fast = planning::next_views(c.map, targets, c.candidates, counts, config);
      ASSERT_EQ(fast.size(), slow.size()) << "seed " << seed;
      for (std::size_t i = 0; i < slow.size(); ++i)
        ASSERT_EQ(fast[i], slow[i]) << "seed " << seed << ", view " << i;
    }
    found += slow.size();
  }
  EXPECT_GT(found, 250U);
}

TEST(NextViews, EqualPlainGreedyOnASite) {
  const worlds::Site site;
  const auto boundary = planning::boundary_unseen(site.map);
  std::vector<Voxel> candidates;
  for (const Voxel p : worlds::cells(site.map, site.world, 2))
    if (p.x % 4 == 0 && p.y % 3 == 0) candidates.push_back(p);
  const ViewLimits limits{1, 60, 70};
  const NextViewsConfig config{.views_max = 8, .adds_min_voxels = 1, .threads = 2};
  const auto views =
      planning::next_views(site.map, boundary, candidates,
                           planning::tally(site.map, boundary, candidates, limits), limits, config);
  ASSERT_EQ(views.size(), 8U);
  EXPECT_EQ(views, plain_greedy(site.map, boundary, candidates, limits, config));
  std::uint32_t adds = 0, sees = 0;
  for (const PlannedView& view : views) {
    adds += view.adds_voxels;
    sees += view.sees_voxels;
  }
  EXPECT_LT(adds, sees) << "views that share nothing test nothing";
}

TEST(NextViews, BeginWithTheNextBestViewAndStopBelowTheLeastGain) {
  // Two pockets of one and two voxels at the ends of a corridor with a wall in its middle.
  VoxelMap map = worlds::noise(11, 3, 1, 0, 0, 1);
  for (int y = 0; y < 3; ++y) map.set({5, y, 0}, VoxelState::seen_occupied);
  map.set({0, 1, 0}, VoxelState::unseen);
  map.set({10, 0, 0}, VoxelState::unseen);
  map.set({10, 2, 0}, VoxelState::unseen);
  const auto boundary = planning::boundary_unseen(map);
  const std::vector<Voxel> candidates{{3, 1, 0}, {7, 1, 0}, {8, 1, 0}};
  const ViewLimits limits{0, 100, 90};
  const auto counts = planning::tally(map, boundary, candidates, limits);
  ASSERT_EQ(counts, (std::vector<std::uint32_t>{1, 2, 2}));
  const auto views = [&](std::uint32_t least) {
    return planning::next_views(map, boundary, candidates, counts, limits, {5, least, 1});
  };
  EXPECT_EQ(views(1), (std::vector<PlannedView>{{1, 2, 2}, {0, 1, 1}}));
  EXPECT_EQ(views(2), (std::vector<PlannedView>{{1, 2, 2}}));
  EXPECT_TRUE(views(3).empty());
}

TEST(NextViews, RefuseCountsThatAreNotOfTheCandidates) {
  const VoxelMap map = worlds::noise(3, 3, 3, 0.5, 0, 1);
  EXPECT_THROW(planning::next_views(map, std::vector<ViewTargets>{}, {{0, 0, 0}}, {}),
               std::invalid_argument);
}

TEST(VisitingOrder, IsTheCheapestOfAllPermutations) {
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    worlds::Random random(seed);
    const int n = worlds::uniform_int(random, 1, 6);
    const auto size = static_cast<std::size_t>(n) + 1;
    std::vector<std::vector<double>> cost(size, std::vector<double>(size));
    for (auto& row : cost)
      for (double& leg : row) leg = worlds::uniform(random, 1, 100);
    std::vector<std::size_t> order(size - 1);
    std::iota(order.begin(), order.end(), 0U);
    const auto total = [&](const std::vector<std::size_t>& views) {
      double sum = 0;
      std::size_t at = 0;
      for (const std::size_t view : views) {
        sum += cost[at][view + 1];
        at = view + 1;
      }
      return sum;
    };
    double least = std::numeric_limits<double>::infinity();
    do {
      least = std::min(least, total(order));
    } while (std::next_permutation(order.begin(), order.end()));
    const std::vector<std::size_t> found = planning::visiting_order(cost);
    ASSERT_EQ(found.size(), order.size());
    EXPECT_NEAR(total(found), least, 1e-9) << "seed " << seed;
  }
}

TEST(VisitingOrder, LeavesOutWhatCannotBeReached) {
  constexpr double kNoWay = std::numeric_limits<double>::infinity();
  EXPECT_EQ(planning::visiting_order({{0, 5, kNoWay}, {5, 0, kNoWay}, {1, 1, 0}}),
            std::vector<std::size_t>{0});
  EXPECT_TRUE(planning::visiting_order({}).empty());
  EXPECT_TRUE(planning::visiting_order({{0}}).empty());
}

}  // namespace
