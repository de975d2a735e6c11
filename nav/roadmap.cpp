#include "nav/roadmap.hpp"

#include <algorithm>

#include "nav/polygons.hpp"

namespace nav {
namespace {

using Eigen::Vector2d;

// Standable polygons round corners off by chords (10 mm) on a grid of 1 mm: roads this much closer
// than the radius are kept, so that the roads hang together wherever the standable part does.
constexpr double kStandableErrorM = 0.012;
constexpr double kArcErrorM = 0.01;
constexpr double kRoadStepM = 1.0;
constexpr std::size_t kLooseBlocksMin = 32;
constexpr double kRoundingM = 1e-9;

BoxTree tree_of(const std::vector<Segment2>& segments) {
  std::vector<Box2> boxes;
  boxes.reserve(segments.size());
  for (const Segment2& s : segments) boxes.push_back(box_of(s));
  return BoxTree(boxes);
}

}  // namespace

std::string_view name(NoRoute reason) {
  switch (reason) {
    case NoRoute::none:
      return "there is a route";
    case NoRoute::from_outside:
      return "the start lies outside the drivable area";
    case NoRoute::to_outside:
      return "the goal lies outside the drivable area";
    case NoRoute::to_too_close:
      return "the goal is closer to an obstacle than the robot's radius";
    case NoRoute::from_enclosed:
      return "the robot cannot get from the start on to any road";
    case NoRoute::to_enclosed:
      return "the robot cannot get from any road to the goal";
    case NoRoute::blocked:
      return "every way is blocked by obstacles that the map lacks";
    case NoRoute::not_connected:
      return "the robot does not fit through anywhere between start and goal";
  }
  return "unknown";
}

Roadmap Roadmap::build(const FreeArea& area, double robot_radius_m) {
  auto fixed = std::make_shared<Fixed>();
  fixed->radius_m = robot_radius_m;
  fixed->drivable = area.drivable;
  fixed->axis =
      medial_axis(area.drivable, {robot_radius_m - kStandableErrorM, kArcErrorM, kRoadStepM});
  for (const OutlinePiece& p : fixed->axis.outline)
    fixed->outline_m.push_back({to_m(p.a), to_m(p.b)});
  fixed->outline_tree = tree_of(fixed->outline_m);

  const std::vector<MedialAxis::Edge>& edges = fixed->axis.edges;
  std::vector<int>& first = fixed->first_half_edge;
  first.assign(fixed->axis.nodes_m.size() + 1, 0);
  std::vector<Segment2> roads_m;
  for (const MedialAxis::Edge& e : edges) {
    roads_m.push_back({item(fixed->axis.nodes_m, e.a), item(fixed->axis.nodes_m, e.b)});
    ++first[static_cast<std::size_t>(e.a) + 1];
    ++first[static_cast<std::size_t>(e.b) + 1];
  }
  fixed->edge_tree = tree_of(roads_m);
  for (std::size_t i = 1; i < first.size(); ++i) first[i] += first[i - 1];
  fixed->half_edges.resize(edges.size() * 2);
  std::vector<int> next(first.begin(), first.end() - 1);
  const auto append = [&](int from, int to, int edge, double length_m) {
    const int slot = next[static_cast<std::size_t>(from)]++;
    fixed->half_edges[static_cast<std::size_t>(slot)] = {to, edge, length_m};
  };
  for (int i = 0; i < static_cast<int>(edges.size()); ++i) {
    const double length_m = (item(roads_m, i).b - item(roads_m, i).a).norm();
    append(item(edges, i).a, item(edges, i).b, i, length_m);
    append(item(edges, i).b, item(edges, i).a, i, length_m);
  }

  Roadmap roadmap;
  roadmap.edge_blocked_.assign(edges.size(), 0);
  roadmap.fixed_ = std::move(fixed);
  return roadmap;
}

void Roadmap::block(const Vector2d& center_m, double radius_m) {
  add_block({center_m, center_m, radius_m});
}

void Roadmap::block_cell(const Vector2d& min_m, const Vector2d& max_m) {
  add_block({min_m, max_m, 0});
}

void Roadmap::unblock_all() {
  blocks_.clear();
  block_tree_ = BoxTree();
  in_tree_ = 0;
  std::fill(edge_blocked_.begin(), edge_blocked_.end(), 0);
}

void Roadmap::add_block(const Block& block) {
  blocks_.push_back(block);
  const int index = static_cast<int>(blocks_.size()) - 1;
  const Vector2d center = (block.min + block.max) / 2;
  const double reach_m = (block.max - block.min).norm() / 2 + block.radius_m + limit_m();
  fixed_->edge_tree.near({center, center}, reach_m, [&](int edge) {
    if (block_distance(index, edge_segment(edge)) < limit_m())
      edge_blocked_[static_cast<std::size_t>(edge)] = 1;
    return reach_m;
  });
  if (blocks_.size() - in_tree_ < std::max(kLooseBlocksMin, in_tree_ / 4)) return;
  std::vector<Box2> boxes;
  boxes.reserve(blocks_.size());
  for (const Block& b : blocks_) {
    const Vector2d round(b.radius_m, b.radius_m);
    boxes.push_back({b.min - round, b.max + round});
  }
  block_tree_ = BoxTree(boxes);
  in_tree_ = blocks_.size();
}

double Roadmap::block_distance(int block, const Segment2& piece_m) const {
  const Block& b = item(blocks_, block);
  return std::max(0.0, distance_to_box(piece_m, b.min, b.max) - b.radius_m);
}

// As BoxTree::near.
template <class Visit>
void Roadmap::blocks_near(const Segment2& piece_m, double radius_m, Visit&& visit) const {
  block_tree_.near(piece_m, radius_m, [&](int i) { return radius_m = visit(i); });
  for (std::size_t i = in_tree_; i < blocks_.size() && radius_m >= 0; ++i)
    radius_m = std::min(radius_m, visit(static_cast<int>(i)));
}

bool Roadmap::blocked(const Vector2d& point_m) const {
  bool found = false;
  blocks_near({point_m, point_m}, limit_m(), [&](int i) {
    found = found || block_distance(i, {point_m, point_m}) < limit_m();
    return found ? -1.0 : limit_m();
  });
  return found;
}

double Roadmap::clearance_m(const Segment2& piece_m, double cap_m) const {
  double least_m = cap_m;
  fixed_->outline_tree.near(piece_m, least_m, [&](int i) {
    return least_m = std::min(least_m, distance(piece_m, item(fixed_->outline_m, i)));
  });
  blocks_near(piece_m, least_m,
              [&](int i) { return least_m = std::min(least_m, block_distance(i, piece_m)); });
  return least_m;
}

double Roadmap::clearance_m(const Vector2d& point_m) const {
  return clearance_m({point_m, point_m}, std::numeric_limits<double>::infinity());
}

bool Roadmap::is_free(const Segment2& piece_m, double keep_m, const Vector2d* leaving) const {
  bool free = true;
  const auto judge = [&](double of_piece_m, auto&& of_leaving_m) {
    if (of_piece_m >= keep_m - kRoundingM) return keep_m;
    if (leaving != nullptr && of_piece_m >= of_leaving_m() - kRoundingM) return keep_m;
    free = false;
    return -1.0;
  };
  fixed_->outline_tree.near(piece_m, keep_m, [&](int i) {
    const Segment2& wall = item(fixed_->outline_m, i);
    return judge(distance(piece_m, wall), [&] { return distance(wall, *leaving); });
  });
  if (!free) return false;
  blocks_near(piece_m, keep_m, [&](int i) {
    return judge(block_distance(i, piece_m), [&] {
      return block_distance(i, {*leaving, *leaving});
    });
  });
  return free;
}

bool Roadmap::sees(const Vector2d& from_m, const Vector2d& to_m) const {
  const double from_clearance_m = clearance_m(Segment2{from_m, from_m}, comfort_m());
  const double to_clearance_m = clearance_m(Segment2{to_m, to_m}, comfort_m());
  const double keep_m = std::min(std::max(from_clearance_m, limit_m()), to_clearance_m);
  return is_free({from_m, to_m}, keep_m, from_clearance_m < limit_m() ? &from_m : nullptr);
}

Segment2 Roadmap::edge_segment(int edge) const {
  const MedialAxis::Edge& e = item(fixed_->axis.edges, edge);
  return {item(fixed_->axis.nodes_m, e.a), item(fixed_->axis.nodes_m, e.b)};
}

double Roadmap::length_m() const {
  double total_m = 0;
  for (const HalfEdge& half : fixed_->half_edges) total_m += half.length_m / 2;
  return total_m;
}

std::vector<std::vector<Vector2d>> Roadmap::polylines() const {
  const auto degree = [&](int node) {
    return item(fixed_->first_half_edge, node + 1) - item(fixed_->first_half_edge, node);
  };
  std::vector<char> drawn(fixed_->axis.edges.size(), 0);
  std::vector<std::vector<Vector2d>> lines;
  const auto draw_from = [&](int node) {
    for (int h = item(fixed_->first_half_edge, node); h < item(fixed_->first_half_edge, node + 1);
         ++h) {
      if (item(drawn, item(fixed_->half_edges, h).edge)) continue;
      std::vector<Vector2d> line{item(fixed_->axis.nodes_m, node)};
      for (int next = h; next >= 0;) {
        const HalfEdge& step = item(fixed_->half_edges, next);
        drawn[static_cast<std::size_t>(step.edge)] = 1;
        line.push_back(item(fixed_->axis.nodes_m, step.to));
        next = -1;
        if (degree(step.to) != 2) break;
        for (int k = 0; k < 2; ++k) {
          const int onward = item(fixed_->first_half_edge, step.to) + k;
          if (!item(drawn, item(fixed_->half_edges, onward).edge)) next = onward;
        }
      }
      lines.push_back(std::move(line));
    }
  };
  const int nodes = static_cast<int>(fixed_->axis.nodes_m.size());
  for (int node = 0; node < nodes; ++node)
    if (degree(node) != 2) draw_from(node);
  for (int node = 0; node < nodes; ++node) draw_from(node);  // What is left are rings.
  return lines;
}

}  // namespace nav
