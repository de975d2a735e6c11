// Routes over a roadmap: on to the roads, along them, off again.
#include <algorithm>
#include <queue>
#include <tuple>

#include "nav/polygons.hpp"
#include "nav/roadmap.hpp"
#include "nav/shortcuts.hpp"

namespace nav {
namespace {

using Eigen::Vector2d;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr int kEdgesTried = 24;  // Straight ways on to the roads are tried to that many edges.
constexpr int kEdgesAtTop = 4;   // The same where climbing away from the nearest wall met a road.
constexpr double kClimbErrorM = 1e-4;
constexpr double kTopReachM = 0.2;

}  // namespace

struct Roadmap::Tree {
  std::vector<double> length_m;  // To each node; infinite where not reached.
  std::vector<int> parent;       // Node before it; -1 where a link from the start ends.
  std::vector<int> link;         // That link, else -1.
  int nodes_searched = 0;
};

std::vector<int> Roadmap::nearest_edges(const Vector2d& point_m, int count) const {
  std::vector<std::pair<double, int>> found;
  fixed_->edge_tree.near({point_m, point_m}, kInfinity, [&](int edge) {
    if (!edge_blocked(edge)) {
      const std::pair<double, int> entry(distance(edge_segment(edge), point_m), edge);
      found.insert(std::lower_bound(found.begin(), found.end(), entry), entry);
      if (found.size() > static_cast<std::size_t>(count)) found.pop_back();
    }
    return found.size() < static_cast<std::size_t>(count) ? kInfinity : found.back().first;
  });
  std::vector<int> edges;
  for (const auto& [_, edge] : found) edges.push_back(edge);
  return edges;
}

// Straight away from the nearest wall, up to where another wall is as near: a point of the diagram.
std::optional<Vector2d> Roadmap::climb(const Vector2d& point_m) const {
  const auto wall_m = [&](const Vector2d& p) {
    return fixed_->outline_tree.nearest(
        {p, p}, kInfinity, [&](int i) { return distance(item(fixed_->outline_m, i), p); });
  };
  const BoxTree::Found wall = wall_m(point_m);
  if (wall.item < 0 || wall.distance == 0) return std::nullopt;
  const Vector2d foot = closest_point(item(fixed_->outline_m, wall.item), point_m);
  const Vector2d up = (point_m - foot) / wall.distance;
  const auto still_nearest = [&](double height_m) {
    return wall_m(foot + height_m * up).distance >= height_m - kClimbErrorM / 100;
  };
  double low_m = wall.distance;
  double high_m = 2 * wall.distance;
  while (still_nearest(high_m)) {
    low_m = high_m;
    high_m *= 2;
    if (high_m > 1e6) return std::nullopt;  // Outside of everything.
  }
  while (high_m - low_m > kClimbErrorM) {
    const double middle_m = (low_m + high_m) / 2;
    (still_nearest(middle_m) ? low_m : high_m) = middle_m;
  }
  return foot + low_m * up;
}

std::optional<Roadmap::Link> Roadmap::link_to(const Vector2d& point_m, const Vector2d* by_m,
                                              int edge, bool is_start) const {
  const Segment2 road = edge_segment(edge);
  const double share = closest_share(road, by_m != nullptr ? *by_m : point_m);
  const Vector2d foot = road.a + share * (road.b - road.a);
  Link link{{point_m}, 0, edge, share * (road.b - road.a).norm()};
  if (by_m != nullptr) link.way_m.push_back(*by_m);
  link.way_m.push_back(foot);
  for (std::size_t i = 1; i < link.way_m.size(); ++i)
    if (!is_free({link.way_m[i - 1], link.way_m[i]}, limit_m(), is_start ? &point_m : nullptr))
      return std::nullopt;
  link.length_m = polyline_length_m(link.way_m);
  return link;
}

std::vector<Roadmap::Link> Roadmap::links(const Vector2d& point_m, bool is_start) const {
  std::vector<Link> found;
  for (const int edge : nearest_edges(point_m, kEdgesTried))
    if (auto link = link_to(point_m, nullptr, edge, is_start)) found.push_back(std::move(*link));
  const std::optional<Vector2d> top_m = climb(point_m);
  if (!top_m) return found;
  for (const int edge : nearest_edges(*top_m, kEdgesAtTop)) {
    if (distance(edge_segment(edge), *top_m) > kTopReachM) break;
    if (auto link = link_to(point_m, &*top_m, edge, is_start)) found.push_back(std::move(*link));
  }
  return found;
}

NoRoute Roadmap::check_ends(const Vector2d& from_m, const Vector2d& to_m) const {
  if (!contains(fixed_->drivable, to_mm(from_m))) return NoRoute::from_outside;
  if (!contains(fixed_->drivable, to_mm(to_m))) return NoRoute::to_outside;
  const double to_clearance_m = clearance_m(Segment2{to_m, to_m}, limit_m());
  return to_clearance_m < limit_m() ? NoRoute::to_too_close : NoRoute::none;
}

// A* towards to_m, or Dijkstra where that is null; ends when no shorter way to a goal is left, so
// without goals it reaches every node. Ties: lowest node first.
Roadmap::Tree Roadmap::search(const std::vector<Link>& starts, const std::vector<Link>& goals,
                              const Vector2d* to_m) const {
  const std::size_t nodes = fixed_->axis.nodes_m.size();
  Tree tree{std::vector<double>(nodes, kInfinity), std::vector<int>(nodes, -1),
            std::vector<int>(nodes, -1), 0};
  using Entry = std::tuple<double, double, int>;  // Estimate through the node, length to it, node.
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
  const auto reach = [&](int node, double length_m, int parent, int link) {
    double& known_m = tree.length_m[static_cast<std::size_t>(node)];
    if (length_m >= known_m) return;
    known_m = length_m;
    tree.parent[static_cast<std::size_t>(node)] = parent;
    tree.link[static_cast<std::size_t>(node)] = link;
    const double rest_m = to_m != nullptr ? (*to_m - item(fixed_->axis.nodes_m, node)).norm() : 0;
    open.emplace(length_m + rest_m, length_m, node);
  };
  for (int i = 0; i < static_cast<int>(starts.size()); ++i) {
    const Link& link = item(starts, i);
    const MedialAxis::Edge& e = item(fixed_->axis.edges, link.edge);
    const Segment2 road = edge_segment(link.edge);
    reach(e.a, link.length_m + link.along_m, -1, i);
    reach(e.b, link.length_m + (road.b - road.a).norm() - link.along_m, -1, i);
  }
  std::vector<std::pair<int, double>> exits;  // Node, and the length from it to the goal.
  for (const Link& link : goals) {
    const MedialAxis::Edge& e = item(fixed_->axis.edges, link.edge);
    const Segment2 road = edge_segment(link.edge);
    exits.emplace_back(e.a, link.length_m + link.along_m);
    exits.emplace_back(e.b, link.length_m + (road.b - road.a).norm() - link.along_m);
  }
  std::sort(exits.begin(), exits.end());
  double best_m = kInfinity;
  while (!open.empty()) {
    const auto [estimate_m, length_m, node] = open.top();
    open.pop();
    if (length_m > item(tree.length_m, node)) continue;
    if (estimate_m >= best_m) break;
    ++tree.nodes_searched;
    for (auto exit = std::lower_bound(exits.begin(), exits.end(), std::pair(node, 0.0));
         exit != exits.end() && exit->first == node; ++exit)
      best_m = std::min(best_m, length_m + exit->second);
    for (int h = item(fixed_->first_half_edge, node); h < item(fixed_->first_half_edge, node + 1);
         ++h) {
      const HalfEdge& half = item(fixed_->half_edges, h);
      if (!edge_blocked(half.edge)) reach(half.to, length_m + half.length_m, node, -1);
    }
  }
  return tree;
}

// To nowhere: the foot is the node itself. The node has an edge that is not blocked.
Roadmap::Link Roadmap::link_at_node(int node) const {
  int h = item(fixed_->first_half_edge, node);
  while (edge_blocked(item(fixed_->half_edges, h).edge)) ++h;
  const HalfEdge& half = item(fixed_->half_edges, h);
  const bool at_start = item(fixed_->axis.edges, half.edge).a == node;
  return {{item(fixed_->axis.nodes_m, node)}, 0, half.edge, at_start ? 0 : half.length_m};
}

Roadmap::AlongRoads Roadmap::along_roads(int from_node, int to_node, Search search) const {
  const auto cut_off = [&](int node) {
    for (int h = item(fixed_->first_half_edge, node); h < item(fixed_->first_half_edge, node + 1);
         ++h)
      if (!edge_blocked(item(fixed_->half_edges, h).edge)) return false;
    return true;
  };
  if (from_node == to_node) return {0, 0};
  if (cut_off(from_node) || cut_off(to_node)) return {};
  const Vector2d& to_m = item(fixed_->axis.nodes_m, to_node);
  const Tree tree = this->search({link_at_node(from_node)}, {link_at_node(to_node)},
                                 search == Search::a_star ? &to_m : nullptr);
  return {item(tree.length_m, to_node), tree.nodes_searched};
}

// The shortest way that ends with one of the goal's links.
std::optional<std::vector<Vector2d>> Roadmap::trace(const Tree& tree,
                                                    const std::vector<Link>& starts,
                                                    const std::vector<Link>& goals) const {
  double best_m = kInfinity;
  int exit_node = -1;
  const Link* start = nullptr;  // Set where start and goal share an edge and use only that.
  const Link* goal = nullptr;
  const auto consider = [&](double length_m, int node, const Link* from, const Link* to) {
    if (length_m >= best_m) return;
    best_m = length_m;
    exit_node = node;
    start = from;
    goal = to;
  };
  for (const Link& link : goals) {
    const MedialAxis::Edge& e = item(fixed_->axis.edges, link.edge);
    const Segment2 road = edge_segment(link.edge);
    const double rest_m = (road.b - road.a).norm() - link.along_m;
    consider(item(tree.length_m, e.a) + link.along_m + link.length_m, e.a, nullptr, &link);
    consider(item(tree.length_m, e.b) + rest_m + link.length_m, e.b, nullptr, &link);
    for (const Link& from : starts)
      if (from.edge == link.edge)
        consider(from.length_m + std::abs(from.along_m - link.along_m) + link.length_m, -1, &from,
                 &link);
  }
  if (goal == nullptr) return std::nullopt;

  std::vector<Vector2d> backwards = goal->way_m;
  for (int node = exit_node; node >= 0; node = item(tree.parent, node)) {
    backwards.push_back(item(fixed_->axis.nodes_m, node));
    if (item(tree.link, node) >= 0) start = &item(starts, item(tree.link, node));
  }
  backwards.insert(backwards.end(), start->way_m.rbegin(), start->way_m.rend());
  std::reverse(backwards.begin(), backwards.end());
  backwards.erase(std::unique(backwards.begin(), backwards.end()), backwards.end());
  return backwards;
}

NoRoute Roadmap::why_not_joined(const std::vector<Link>& starts, const std::vector<Link>& goals) {
  if (starts.empty()) return NoRoute::from_enclosed;
  return goals.empty() ? NoRoute::to_enclosed : NoRoute::not_connected;
}

std::optional<std::vector<Vector2d>> Roadmap::way(const Vector2d& from_m, const Vector2d& to_m,
                                                  NoRoute& why) const {
  why = check_ends(from_m, to_m);
  if (why != NoRoute::none) return std::nullopt;
  if (sees(from_m, to_m)) return std::vector<Vector2d>{from_m, to_m};
  const std::vector<Link> starts = links(from_m, true);
  const std::vector<Link> goals = links(to_m, false);
  auto found = trace(search(starts, goals, &to_m), starts, goals);
  if (found) return found;
  why = why_not_joined(starts, goals);
  if (blocks_.empty()) return std::nullopt;
  Roadmap unblocked = *this;
  unblocked.unblock_all();
  NoRoute without_blocks{};
  if (unblocked.way(from_m, to_m, without_blocks)) why = NoRoute::blocked;
  return std::nullopt;
}

Route Roadmap::finish(std::vector<Vector2d> points_m, Smoothing smoothing) const {
  if (smoothing == Smoothing::shortcut)
    points_m = take_shortcuts(
        std::move(points_m), comfort_m(),
        [this](const Segment2& piece_m, double cap_m) { return clearance_m(piece_m, cap_m); });
  Route route;
  route.points_m = std::move(points_m);
  route.length_m = polyline_length_m(route.points_m);
  for (std::size_t i = 0; i < route.points_m.size(); ++i) {
    const Vector2d& a = route.points_m[i];
    const Vector2d& b = route.points_m[std::min(i + 1, route.points_m.size() - 1)];
    const double piece_clearance_m = clearance_m(Segment2{a, b}, kInfinity);
    route.clearance_min_m = std::min(route.clearance_min_m, piece_clearance_m);
    if (i + 1 < route.points_m.size()) route.clearance_m.push_back(piece_clearance_m);
  }
  return route;
}

std::optional<Route> Roadmap::route(const Vector2d& from_m, const Vector2d& to_m, NoRoute* why,
                                    Smoothing smoothing) const {
  NoRoute reason{};
  auto points_m = way(from_m, to_m, reason);
  if (why != nullptr) *why = reason;
  if (!points_m) return std::nullopt;
  return finish(std::move(*points_m), smoothing);
}

std::vector<NoRoute> Roadmap::why_not(const Vector2d& from_m,
                                      const std::vector<Vector2d>& to_m) const {
  const std::vector<Link> starts = links(from_m, true);
  const Tree tree = search(starts, {}, nullptr);
  std::vector<NoRoute> all;
  for (const Vector2d& goal_m : to_m) {
    NoRoute why = check_ends(from_m, goal_m);
    if (why == NoRoute::none && !sees(from_m, goal_m)) {
      const std::vector<Link> goals = links(goal_m, false);
      if (!trace(tree, starts, goals)) why = why_not_joined(starts, goals);
      if (why != NoRoute::none && !blocks_.empty()) (void)way(from_m, goal_m, why);
    }
    all.push_back(why);
  }
  return all;
}

Eigen::MatrixXd Roadmap::lengths_m(const std::vector<Vector2d>& points_m,
                                   Smoothing smoothing) const {
  const auto n = static_cast<Eigen::Index>(points_m.size());
  Eigen::MatrixXd lengths = Eigen::MatrixXd::Constant(n, n, kInfinity);
  std::vector<std::vector<Link>> goals;
  std::vector<char> roomy;  // Between two such points the way back is the way there.
  for (const Vector2d& p : points_m) {
    goals.push_back(links(p, false));
    roomy.push_back(clearance_m(Segment2{p, p}, limit_m()) >= limit_m());
  }
  for (Eigen::Index i = 0; i < n; ++i) {
    const Vector2d& from_m = points_m[static_cast<std::size_t>(i)];
    const std::vector<Link> starts = links(from_m, true);
    const Tree tree = search(starts, {}, nullptr);
    for (Eigen::Index j = 0; j < n; ++j) {
      const auto column = static_cast<std::size_t>(j);
      const Vector2d& to_m = points_m[column];
      if (i == j) {
        lengths(i, j) = 0;
      } else if (j < i && roomy[static_cast<std::size_t>(i)] && roomy[column]) {
        lengths(i, j) = lengths(j, i);
      } else if (check_ends(from_m, to_m) != NoRoute::none) {
        continue;
      } else if (sees(from_m, to_m)) {
        lengths(i, j) = (to_m - from_m).norm();
      } else if (auto way = trace(tree, starts, goals[column])) {
        lengths(i, j) = finish(std::move(*way), smoothing).length_m;
      }
    }
  }
  return lengths;
}

}  // namespace nav
