// Scanner positions in a tree of boxes, so that a surface patch can refuse many at once.
#pragma once

#include <Eigen/Geometry>
#include <span>
#include <vector>

namespace sim {

class PositionTree {
 public:
  static constexpr int kLeafMax = 16;

  struct Node {
    Eigen::AlignedBox3d box;
    int first{}, count{};     // Of positions().
    int children[2]{-1, -1};  // -1: a leaf.
    bool leaf() const { return children[0] < 0; }
  };

  explicit PositionTree(std::span<const Eigen::Vector3d> positions)
      : positions_(positions.begin(), positions.end()) {
    if (!positions_.empty()) split(0, static_cast<int>(positions_.size()));
  }

  bool empty() const { return nodes_.empty(); }
  const Node& node(int index) const { return nodes_[index]; }  // 0 is the root.
  std::span<const Eigen::Vector3d> of(const Node& node) const {
    return std::span(positions_)
        .subspan(static_cast<std::size_t>(node.first), static_cast<std::size_t>(node.count));
  }

 private:
  int split(int first, int count);

  std::vector<Eigen::Vector3d> positions_;  // Sorted by leaf.
  std::vector<Node> nodes_;
};

}  // namespace sim
