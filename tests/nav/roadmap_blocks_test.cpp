// Roads closed one obstacle at a time, against roads closed by looking at every one anew.
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <queue>
#include <vector>

#include "nav/roadmap.hpp"
#include "tests/support/random_site.hpp"

namespace nav {
namespace {

using Eigen::Vector2d;
using support::Dice;
using support::random_area;
using support::random_point;

constexpr double kBlocksRadiusM = 0.5;
constexpr double kBlocksKeepM = kBlocksRadiusM - Roadmap::kSlackM;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct Obstacle {
  Vector2d min, max;
  double radius_m{};  // 0: a cell; else a disc round min.

  double distance_m(const Segment2& s) const {
    return radius_m > 0 ? distance(s, min) - radius_m : distance_to_box(s, min, max);
  }
  void put_on(Roadmap& roadmap) const {
    if (radius_m > 0)
      roadmap.block(min, radius_m);
    else
      roadmap.block_cell(min, max);
  }
};

std::vector<Obstacle> random_obstacles(Dice& dice, const FreeArea& area, int count) {
  std::vector<Obstacle> obstacles;
  for (int i = 0; i < count; ++i) {
    const Vector2d p = random_point(dice, area.drivable, 60);
    const double size_m = dice.uniform(0.1, 2);
    if (dice.below(2) == 0)
      obstacles.push_back({p, p, size_m});
    else
      obstacles.push_back({p, p + Vector2d(size_m, size_m), 0});
  }
  return obstacles;
}

Segment2 segment(const MedialAxis& graph, const MedialAxis::Edge& e) {
  return {graph.nodes_m[static_cast<std::size_t>(e.a)],
          graph.nodes_m[static_cast<std::size_t>(e.b)]};
}

// The edges that stay open, asked of every obstacle.
std::vector<char> open_edges(const MedialAxis& graph, const std::vector<Obstacle>& obstacles) {
  std::vector<char> open;
  for (const auto& e : graph.edges)
    open.push_back(std::none_of(obstacles.begin(), obstacles.end(), [&](const Obstacle& o) {
      return o.distance_m(segment(graph, e)) < kBlocksKeepM;
    }));
  return open;
}

// Bellman and Ford: no heap, no estimate, no early end.
std::vector<double> lengths_from(const MedialAxis& graph, const std::vector<char>& open, int node) {
  std::vector<double> length_m(graph.nodes_m.size(), kInfinity);
  length_m[static_cast<std::size_t>(node)] = 0;
  for (bool changed = true; changed;) {
    changed = false;
    for (std::size_t i = 0; i < graph.edges.size(); ++i) {
      if (!open[i]) continue;
      const Segment2 s = segment(graph, graph.edges[i]);
      double& a = length_m[static_cast<std::size_t>(graph.edges[i].a)];
      double& b = length_m[static_cast<std::size_t>(graph.edges[i].b)];
      const double edge_m = (s.b - s.a).norm();
      if (a + edge_m < b) b = a + edge_m, changed = true;
      if (b + edge_m < a) a = b + edge_m, changed = true;
    }
  }
  return length_m;
}

void expect_lengths(Dice& dice, const Roadmap& roadmap, const std::vector<char>& open) {
  const int nodes = static_cast<int>(roadmap.graph().nodes_m.size());
  for (int i = 0; i < 2; ++i) {
    const int from = dice.below(nodes);
    const auto slow = lengths_from(roadmap.graph(), open, from);
    for (int k = 0; k < 25; ++k) {
      const int to = dice.below(nodes);
      const auto a_star = roadmap.along_roads(from, to);
      const auto dijkstra = roadmap.along_roads(from, to, Roadmap::Search::dijkstra);
      const double expected_m = slow[static_cast<std::size_t>(to)];
      ASSERT_EQ(std::isfinite(a_star.length_m), std::isfinite(expected_m));
      if (!std::isfinite(expected_m)) continue;
      EXPECT_LE(a_star.nodes_searched, dijkstra.nodes_searched);
      EXPECT_NEAR(a_star.length_m, expected_m, 1e-9);
      EXPECT_NEAR(dijkstra.length_m, expected_m, 1e-9);
    }
  }
}

TEST(RoadmapBlocks, CloseExactlyTheRoadsThatComeTooClose) {
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    SCOPED_TRACE(seed);
    Dice dice(seed);
    const FreeArea area = random_area(dice, {60, 15, 6, 9}, kBlocksRadiusM);
    Roadmap roadmap = Roadmap::build(area, kBlocksRadiusM);
    const auto obstacles = random_obstacles(dice, area, 60);
    std::vector<Obstacle> so_far;
    for (const Obstacle& obstacle : obstacles) {
      obstacle.put_on(roadmap);
      so_far.push_back(obstacle);
      if (so_far.size() % 20 != 0) continue;
      const auto open = open_edges(roadmap.graph(), so_far);
      int closed = 0;
      for (std::size_t i = 0; i < open.size(); ++i) {
        ASSERT_EQ(roadmap.edge_blocked(static_cast<int>(i)), !open[i]) << "edge " << i;
        closed += !open[i];
      }
      EXPECT_GT(closed, 0);
      expect_lengths(dice, roadmap, open);
    }
  }
}

TEST(RoadmapBlocks, OrderAndRebuildingMakeNoDifference) {
  int routes = 0;
  for (std::uint64_t seed = 1; seed <= 15; ++seed) {
    SCOPED_TRACE(seed);
    Dice dice(seed);
    const FreeArea area = random_area(dice, {60, 15, 6, 9}, kBlocksRadiusM);
    auto obstacles = random_obstacles(dice, area, 50);
    Roadmap grown = Roadmap::build(area, kBlocksRadiusM);
    for (const Obstacle& obstacle : obstacles) obstacle.put_on(grown);
    Roadmap rebuilt = Roadmap::build(area, kBlocksRadiusM);
    std::reverse(obstacles.begin(), obstacles.end());
    for (const Obstacle& obstacle : obstacles) obstacle.put_on(rebuilt);
    for (int i = 0; i < 20; ++i) {
      const Vector2d from = random_point(dice, area.standable, 60);
      const Vector2d to = random_point(dice, area.standable, 60);
      NoRoute why_grown{}, why_rebuilt{};
      const auto one = grown.route(from, to, &why_grown);
      const auto other = rebuilt.route(from, to, &why_rebuilt);
      ASSERT_EQ(why_grown, why_rebuilt);
      if (!one) continue;
      ++routes;
      EXPECT_EQ(one->points_m, other->points_m);
      EXPECT_EQ(one->clearance_m, other->clearance_m);
    }
    grown.unblock_all();
    const Roadmap never = Roadmap::build(area, kBlocksRadiusM);
    for (std::size_t i = 0; i < never.graph().edges.size(); ++i)
      EXPECT_FALSE(grown.edge_blocked(static_cast<int>(i)));
  }
  EXPECT_GT(routes, 40);
}

}  // namespace
}  // namespace nav
