#include "nav/box_tree.hpp"

#include <algorithm>
#include <numeric>

namespace nav {
namespace {

constexpr int kLeafItems = 4;

}  // namespace

BoxTree::BoxTree(const std::vector<Box2>& boxes) {
  if (boxes.empty()) return;
  items_.resize(boxes.size());
  std::iota(items_.begin(), items_.end(), 0);
  nodes_.reserve(boxes.size());
  nodes_.emplace_back();
  build(0, 0, static_cast<int>(boxes.size()), boxes);
  boxes_.reserve(boxes.size());
  for (const int item : items_) boxes_.push_back(boxes[static_cast<std::size_t>(item)]);
}

// Splits at the median of the box centres along the longer side.
void BoxTree::build(int node, int first, int count, const std::vector<Box2>& boxes) {
  const auto box_at = [&](int i) -> const Box2& {
    return boxes[static_cast<std::size_t>(items_[static_cast<std::size_t>(i)])];
  };
  Box2 box = box_at(first);
  for (int i = first + 1; i < first + count; ++i) {
    box.min = box.min.cwiseMin(box_at(i).min);
    box.max = box.max.cwiseMax(box_at(i).max);
  }
  if (count <= kLeafItems) {
    nodes_[static_cast<std::size_t>(node)] = {box, first, count};
    return;
  }
  const Eigen::Vector2d extent = box.max - box.min;
  const int axis = extent.x() >= extent.y() ? 0 : 1;
  const auto before = [&](int i, int j) {
    const Box2& bi = boxes[static_cast<std::size_t>(i)];
    const Box2& bj = boxes[static_cast<std::size_t>(j)];
    const double ci = bi.min[axis] + bi.max[axis];
    const double cj = bj.min[axis] + bj.max[axis];
    return ci != cj ? ci < cj : i < j;
  };
  const int half = count / 2;
  const auto begin = items_.begin() + first;
  std::nth_element(begin, begin + half, begin + count, before);
  const int left = static_cast<int>(nodes_.size());
  nodes_[static_cast<std::size_t>(node)] = {box, left, 0};
  nodes_.emplace_back();
  nodes_.emplace_back();
  build(left, first, half, boxes);
  build(left + 1, first + half, count - half, boxes);
}

}  // namespace nav
