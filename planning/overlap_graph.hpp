// Which scans can be registered against each other, as a graph, and what it hangs on.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "planning/spans.hpp"

namespace planning {

struct GraphParts {
  std::vector<int> part_of_node;  // 0, 1, ... in order of the least node.
  int parts{};
  std::vector<int> bridges;  // Indices of edges whose removal makes one part two; ascending.
};

// Connected parts and bridges of the graph with these nodes and edges, in linear time. Of edges
// between the same nodes, none is a bridge.
GraphParts parts_of(int nodes, const std::vector<std::pair<int, int>>& edges);

struct OverlapLink {
  int a{}, b{};  // Indices of stations, a < b.
  double shared_m{};
  bool bridge{};  // Without it, some stations hang on nothing but the robot's own position.
};

// Stations are nodes. Two are linked if they share wall, and at least overlap_min of what the one
// that sees less sees: that is what its scan needs to be registered against the other's.
struct OverlapGraph {
  std::vector<OverlapLink> links;
  std::vector<int> part_of_station;  // 0 for the part of the first station, and so on.
  int parts{};

  int weak_links() const;
};

// Wall that both see; each is disjoint and in order of wall and place.
std::int64_t shared_nm(const std::vector<Span>& a, const std::vector<Span>& b);

bool linked(std::int64_t a_sees_nm, std::int64_t b_sees_nm, std::int64_t shared_nm,
            double overlap_min);

// views[i]: what station i sees.
OverlapGraph overlap_graph(const std::vector<std::vector<Span>>& views, double overlap_min);

// One sentence per bridge, stations numbered from 1 as in the plan: "weak link: station 7 - station
// 12 hangs on one link; 3.2 m shared". And one if there is more than one part.
std::vector<std::string> weaknesses(const OverlapGraph& graph);

}  // namespace planning
