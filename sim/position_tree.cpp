#include "sim/position_tree.hpp"

#include <algorithm>
#include <tuple>

namespace sim {

int PositionTree::split(int first, int count) {
  const int index = static_cast<int>(nodes_.size());
  nodes_.push_back({{}, first, count, {-1, -1}});
  Eigen::AlignedBox3d box;
  for (int i = first; i < first + count; ++i) box.extend(positions_[i]);
  nodes_[index].box = box;
  if (count <= kLeafMax) return index;
  Eigen::Index axis = 0;
  box.sizes().maxCoeff(&axis);
  const auto begin = positions_.begin() + first;
  // A total order: the same tree from any standard library.
  std::sort(begin, begin + count, [axis](const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    return std::tuple(a[axis], a.x(), a.y(), a.z()) < std::tuple(b[axis], b.x(), b.y(), b.z());
  });
  const int low = split(first, count / 2);
  const int high = split(first + count / 2, count - count / 2);
  nodes_[index].children[0] = low;
  nodes_[index].children[1] = high;
  return index;
}

}  // namespace sim
