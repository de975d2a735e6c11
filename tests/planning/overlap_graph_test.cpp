#include "planning/overlap_graph.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "tests/planning/cover_problems.hpp"

namespace planning {
namespace {

using support::Dice;
using Edges = std::vector<std::pair<int, int>>;

// Parts by joining names until nothing changes.
std::vector<int> plain_parts(int nodes, const Edges& edges) {
  std::vector<int> part;
  for (int i = 0; i < nodes; ++i) part.push_back(i);
  for (bool changed = true; std::exchange(changed, false);)
    for (const auto& [a, b] : edges) {
      int &of_a = part[static_cast<std::size_t>(a)], &of_b = part[static_cast<std::size_t>(b)];
      changed |= of_a != of_b;
      of_a = of_b = std::min(of_a, of_b);
    }
  return part;
}

int count_parts(int nodes, const Edges& edges) {
  const auto part = plain_parts(nodes, edges);
  return static_cast<int>(std::set<int>(part.begin(), part.end()).size());
}

TEST(PartsOf, BridgesAreWhatPullsPartsApartWhenRemoved) {
  Dice dice(1);
  int bridges = 0, others = 0;
  for (int round = 0; round < 2000; ++round) {
    const int nodes = 1 + dice.below(12);
    Edges edges;
    for (int i = dice.below(18); i > 0 && nodes > 1; --i) {
      const int a = dice.below(nodes), b = dice.below(nodes);
      if (a != b) edges.emplace_back(a, b);  // Some twice.
    }
    const GraphParts parts = parts_of(nodes, edges);
    EXPECT_EQ(parts.parts, count_parts(nodes, edges));
    const auto plain = plain_parts(nodes, edges);
    for (std::size_t i = 0; i < plain.size(); ++i)
      for (std::size_t k = 0; k < i; ++k)
        EXPECT_EQ(parts.part_of_node[i] == parts.part_of_node[k], plain[i] == plain[k]);
    std::vector<int> expected;
    for (std::size_t e = 0; e < edges.size(); ++e) {
      Edges rest = edges;
      rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(e));
      if (count_parts(nodes, rest) > parts.parts) expected.push_back(static_cast<int>(e));
    }
    EXPECT_EQ(parts.bridges, expected);
    bridges += static_cast<int>(expected.size());
    others += static_cast<int>(edges.size() - expected.size());
  }
  EXPECT_GT(bridges, 1000);
  EXPECT_GT(others, 1000);
}

TEST(PartsOf, LongChainsNeedNoRecursion) {
  Edges edges;
  for (int i = 0; i + 1 < 300'000; ++i) edges.emplace_back(i, i + 1);
  EXPECT_EQ(parts_of(300'000, edges).bridges.size(), edges.size());
}

TEST(OverlapGraph, SharedWallIsWhatSpansSay) {
  Dice dice(2);
  for (int round = 0; round < 300; ++round) {
    const auto v = cover_problems::random_views(dice, 2);
    SpanSet seen(v.walls);
    seen.add(v.views[0]);
    EXPECT_EQ(shared_nm(v.views[0], v.views[1]), seen.overlap_nm(v.views[1]));
    EXPECT_EQ(shared_nm(v.views[1], v.views[0]), seen.overlap_nm(v.views[1]));
  }
}

// Along one wall: 0 - 1 - 2 share 20 of 100, 2 and 3 share 10, 4 is elsewhere.
std::vector<std::vector<Span>> in_a_row() {
  const auto metres = [](int wall, int from, int to) {
    return std::vector<Span>{{wall, from * 1'000'000'000LL, to * 1'000'000'000LL}};
  };
  return {metres(0, 0, 100), metres(0, 80, 180), metres(0, 160, 260), metres(0, 250, 350),
          metres(1, 0, 50)};
}

TEST(OverlapGraph, LinksNeedAShareOfTheLesserView) {
  const OverlapGraph graph = overlap_graph(in_a_row(), 0.2);
  ASSERT_EQ(graph.links.size(), 2u);
  EXPECT_EQ(graph.parts, 3);
  EXPECT_EQ(graph.part_of_station, (std::vector<int>{0, 0, 0, 1, 2}));
  EXPECT_EQ(graph.weak_links(), 2);
  EXPECT_DOUBLE_EQ(graph.links[0].shared_m, 20);
  // Without a share any common wall links; no wall links nothing.
  EXPECT_EQ(overlap_graph(in_a_row(), 0).links.size(), 3u);
  EXPECT_EQ(overlap_graph(in_a_row(), 0).parts, 2);
  EXPECT_EQ(overlap_graph({}, 0.2).parts, 0);
}

TEST(OverlapGraph, WeaknessesAreNamed) {
  EXPECT_THAT(weaknesses(overlap_graph(in_a_row(), 0.2)),
              testing::ElementsAre(
                  "the stations fall into 3 parts that share too little wall to be registered "
                  "against each other",
                  "weak link: station 1 - station 2 hangs on one link; 20.0 m shared",
                  "weak link: station 2 - station 3 hangs on one link; 20.0 m shared"));
  EXPECT_TRUE(weaknesses(overlap_graph({in_a_row()[0]}, 0.2)).empty());
}

}  // namespace
}  // namespace planning
