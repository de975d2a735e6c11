// A static tree of axis-aligned boxes, for "what is near this segment". Any one unit of length.
#pragma once

#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "nav/segment_distance.hpp"

namespace nav {

struct Box2 {
  Eigen::Vector2d min{0, 0};
  Eigen::Vector2d max{0, 0};
};

inline Box2 box_of(const Segment2& s) {
  return {s.a.cwiseMin(s.b), s.a.cwiseMax(s.b)};
}

// Item i is the i-th box given. The same boxes give the same tree and the same order of visits.
class BoxTree {
 public:
  BoxTree() = default;
  explicit BoxTree(const std::vector<Box2>& boxes);

  bool empty() const { return nodes_.empty(); }

  // Calls visit(item) for the items whose box may lie within `radius` of the segment (it misses
  // none, and shows some that lie farther), nearest first by rule of thumb. visit returns the
  // radius to go on with: smaller to narrow the search, negative to end it.
  template <class Visit>
  void near(const Segment2& segment, double radius, Visit&& visit) const {
    std::array<int, 64> stack{};
    int depth = 0;
    if (!nodes_.empty()) stack[static_cast<std::size_t>(depth++)] = 0;
    while (depth > 0 && radius >= 0) {
      const Node& node = nodes_[static_cast<std::size_t>(stack[static_cast<std::size_t>(--depth)])];
      if (!may_meet(segment, node.box, radius)) continue;
      if (node.count == 0) {
        const bool left_first = nearer(segment, child(node.first), child(node.first + 1));
        stack[static_cast<std::size_t>(depth++)] = left_first ? node.first + 1 : node.first;
        stack[static_cast<std::size_t>(depth++)] = left_first ? node.first : node.first + 1;
        continue;
      }
      for (int i = node.first; i < node.first + node.count && radius >= 0; ++i)
        if (may_meet(segment, boxes_[static_cast<std::size_t>(i)], radius))
          radius = std::min(radius, visit(items_[static_cast<std::size_t>(i)]));
    }
  }

  // Calls visit(item) for all items but those in boxes that hidden(box) is true of, those nearest
  // to the point first by rule of thumb. hidden() is asked of boxes of many items and may answer
  // differently as visits go on.
  template <class Hidden, class Visit>
  void from_near(const Eigen::Vector2d& point, Hidden&& hidden, Visit&& visit) const {
    std::array<int, 64> stack{};
    int depth = 0;
    if (!nodes_.empty()) stack[static_cast<std::size_t>(depth++)] = 0;
    while (depth > 0) {
      const Node& node = nodes_[static_cast<std::size_t>(stack[static_cast<std::size_t>(--depth)])];
      if (hidden(node.box)) continue;
      if (node.count == 0) {
        const bool left_first = box_distance_squared(point, child(node.first)) <=
                                box_distance_squared(point, child(node.first + 1));
        stack[static_cast<std::size_t>(depth++)] = left_first ? node.first + 1 : node.first;
        stack[static_cast<std::size_t>(depth++)] = left_first ? node.first : node.first + 1;
        continue;
      }
      for (int i = node.first; i < node.first + node.count; ++i)
        visit(items_[static_cast<std::size_t>(i)]);
    }
  }

  struct Found {
    int item = -1;
    double distance = std::numeric_limits<double>::infinity();
  };

  // The item nearest to the segment by distance_to(item), if closer than `limit`. Ties: lowest
  // item.
  template <class DistanceTo>
  Found nearest(const Segment2& segment, double limit, DistanceTo&& distance_to) const {
    Found best;
    near(segment, limit, [&](int item) {
      const double d = distance_to(item);
      const bool closer = d < best.distance || (d == best.distance && item < best.item);
      if (d < limit && closer) best = {item, d};
      return std::min(limit, best.distance);
    });
    return best;
  }

 private:
  struct Node {
    Box2 box;
    int first{};  // First item of a leaf, or the left child (the right one follows it).
    int count{};  // Items of a leaf; 0 for an inner node.
  };

  const Box2& child(int node) const { return nodes_[static_cast<std::size_t>(node)].box; }
  void build(int node, int first, int count, const std::vector<Box2>& boxes);

  // False only where the segment stays farther than `radius` from the box (separating axes of the
  // segment and the box grown by radius).
  static bool may_meet(const Segment2& s, const Box2& box, double radius) {
    const Eigen::Vector2d half = (box.max - box.min) / 2 + Eigen::Vector2d(radius, radius);
    const Eigen::Vector2d u = (s.b - s.a) / 2;
    const Eigen::Vector2d c = (s.a + s.b) / 2 - (box.max + box.min) / 2;
    if (std::abs(c.x()) > half.x() + std::abs(u.x())) return false;
    if (std::abs(c.y()) > half.y() + std::abs(u.y())) return false;
    if (std::isinf(radius)) return true;
    return std::abs(cross2(u, c)) <= half.x() * std::abs(u.y()) + half.y() * std::abs(u.x());
  }

  static double box_distance_squared(const Eigen::Vector2d& p, const Box2& box) {
    const Eigen::Vector2d outside = (box.min - p).cwiseMax(p - box.max).cwiseMax(0.0);
    return outside.squaredNorm();
  }

  static bool nearer(const Segment2& s, const Box2& left, const Box2& right) {
    const Eigen::Vector2d middle = (s.a + s.b) / 2;
    return box_distance_squared(middle, left) <= box_distance_squared(middle, right);
  }

  std::vector<Node> nodes_;
  std::vector<Box2> boxes_;  // In the order of items_.
  std::vector<int> items_;
};

}  // namespace nav
