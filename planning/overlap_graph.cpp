#include "planning/overlap_graph.hpp"

#include <algorithm>

#include "nav/words.hpp"
#include "planning/greedy.hpp"

namespace planning {
namespace {

// Depth-first search without recursion: a tree edge is a bridge if nothing below it leads back.
class Walk {
 public:
  Walk(int nodes, const std::vector<std::pair<int, int>>& edges)
      : edges_(edges),
        at_(static_cast<std::size_t>(nodes)),
        entered_(at_.size(), -1),
        low_(at_.size(), -1) {
    result_.part_of_node.assign(at_.size(), -1);
    for (std::size_t e = 0; e < edges.size(); ++e) {
      at_[static_cast<std::size_t>(edges[e].first)].push_back(e);
      at_[static_cast<std::size_t>(edges[e].second)].push_back(e);
    }
  }

  GraphParts run() {
    for (std::size_t root = 0; root < at_.size(); ++root) {
      if (entered_[root] >= 0) continue;
      enter(root, kNone);
      while (!path_.empty()) step();
      ++result_.parts;
    }
    std::ranges::sort(result_.bridges);
    return std::move(result_);
  }

 private:
  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);
  struct Visit {
    std::size_t node, by_edge, next;
  };

  void enter(std::size_t node, std::size_t by_edge) {
    entered_[node] = low_[node] = time_++;
    result_.part_of_node[node] = result_.parts;
    path_.push_back({node, by_edge, 0});
  }

  void step() {
    Visit& visit = path_.back();
    if (visit.next == at_[visit.node].size()) return leave();
    const std::size_t edge = at_[visit.node][visit.next++];
    if (edge == visit.by_edge) return;
    const auto [a, b] = edges_[edge];
    const auto other = static_cast<std::size_t>(a) == visit.node ? static_cast<std::size_t>(b)
                                                                 : static_cast<std::size_t>(a);
    if (entered_[other] < 0) return enter(other, edge);
    low_[visit.node] = std::min(low_[visit.node], entered_[other]);
  }

  void leave() {
    const Visit done = path_.back();
    path_.pop_back();
    if (path_.empty()) return;
    const std::size_t above = path_.back().node;
    low_[above] = std::min(low_[above], low_[done.node]);
    if (low_[done.node] > entered_[above])
      result_.bridges.push_back(static_cast<int>(done.by_edge));
  }

  const std::vector<std::pair<int, int>>& edges_;
  std::vector<std::vector<std::size_t>> at_;  // Edges by node.
  std::vector<int> entered_, low_;
  int time_ = 0;
  std::vector<Visit> path_;
  GraphParts result_;
};

}  // namespace

GraphParts parts_of(int nodes, const std::vector<std::pair<int, int>>& edges) {
  return Walk(nodes, edges).run();
}

std::int64_t shared_nm(const std::vector<Span>& a, const std::vector<Span>& b) {
  std::int64_t sum = 0;
  for (std::size_t i = 0, j = 0; i < a.size() && j < b.size();) {
    if (a[i].wall == b[j].wall)
      sum += std::max<std::int64_t>(
          0, std::min(a[i].to_nm, b[j].to_nm) - std::max(a[i].from_nm, b[j].from_nm));
    const bool a_ends_first = std::pair(a[i].wall, a[i].to_nm) < std::pair(b[j].wall, b[j].to_nm);
    a_ends_first ? ++i : ++j;
  }
  return sum;
}

bool linked(std::int64_t a_sees_nm, std::int64_t b_sees_nm, std::int64_t shared_nm,
            double overlap_min) {
  return shared_nm > 0 && overlaps_enough(std::min(a_sees_nm, b_sees_nm), shared_nm, overlap_min);
}

OverlapGraph overlap_graph(const std::vector<std::vector<Span>>& views, double overlap_min) {
  OverlapGraph graph;
  std::vector<std::pair<int, int>> edges;
  for (std::size_t a = 0; a < views.size(); ++a) {
    for (std::size_t b = a + 1; b < views.size(); ++b) {
      const std::int64_t shared = shared_nm(views[a], views[b]);
      if (!linked(length_nm(views[a]), length_nm(views[b]), shared, overlap_min)) continue;
      edges.emplace_back(a, b);
      graph.links.push_back(
          {static_cast<int>(a), static_cast<int>(b), nm_to_m(shared), /*bridge=*/false});
    }
  }
  GraphParts parts = parts_of(static_cast<int>(views.size()), edges);
  for (const int edge : parts.bridges) graph.links[static_cast<std::size_t>(edge)].bridge = true;
  graph.part_of_station = std::move(parts.part_of_node);
  graph.parts = parts.parts;
  return graph;
}

int OverlapGraph::weak_links() const {
  return static_cast<int>(
      std::ranges::count_if(links, [](const OverlapLink& link) { return link.bridge; }));
}

std::vector<std::string> weaknesses(const OverlapGraph& graph) {
  std::vector<std::string> texts;
  if (graph.parts > 1)
    texts.push_back("the stations fall into " + std::to_string(graph.parts) +
                    " parts that share too little wall to be registered against each other");
  for (const OverlapLink& link : graph.links)
    if (link.bridge)
      texts.push_back("weak link: station " + std::to_string(link.a + 1) + " - station " +
                      std::to_string(link.b + 1) + " hangs on one link; " +
                      nav::decimal(link.shared_m, 1) + " m shared");
  return texts;
}

}  // namespace planning
