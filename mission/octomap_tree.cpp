#include "mission/octomap_tree.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>

namespace mission {
namespace {

using planning::VoxelGrid;
using planning::VoxelState;
using StateAt = std::function<VoxelState(planning::Voxel)>;
using Visit = std::function<bool(const OctomapLeaf&)>;

static_assert(std::endian::native == std::endian::little, "OctoMap files are little-endian");

constexpr float kOccupied = 3.5F, kEmpty = -2.0F;
// What two bits say of a child in .bt; 0 is unseen.
constexpr unsigned kFreeBits = 1, kOccupiedBits = 2, kInnerBits = 3;

OctomapKey child_of(const OctomapKey& low, unsigned child, int level) {
  const int half = level - 1;
  return {low[0] + static_cast<int>((child & 1) << half),
          low[1] + static_cast<int>((child >> 1 & 1) << half),
          low[2] + static_cast<int>((child >> 2 & 1) << half)};
}

// Writes the cube of keys of side 2^level whose lowest corner is `low` as a subtree: value and
// children in OctoMap's order. Log-odds of an inner node are its children's maximum; eight equal
// leaves become one.
class TreeWriter {
 public:
  TreeWriter(const VoxelGrid& grid, const OctomapKey& first, const StateAt& state_at)
      : size_{grid.nx, grid.ny, grid.nz}, first_(first), state_at_(state_at) {}

  OctomapTree take() { return {std::move(out_), nodes_}; }

  // False (and nothing written) when nothing of the cube has been seen.
  bool write(const OctomapKey& low, int level, float& value, bool& leaf) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const int from = low[axis] - first_[axis];
      if (from >= size_[axis] || from + (1 << level) <= 0) return false;
    }
    leaf = level == 0;
    return leaf ? write_voxel(low, value) : write_inner(low, level, value, leaf);
  }

 private:
  bool write_voxel(const OctomapKey& low, float& value) {
    const VoxelState state =
        state_at_({low[0] - first_[0], low[1] - first_[1], low[2] - first_[2]});
    if (state == VoxelState::unseen) return false;
    value = state == VoxelState::seen_occupied ? kOccupied : kEmpty;
    append(value, 0);
    return true;
  }

  bool write_inner(const OctomapKey& low, int level, float& value, bool& leaf) {
    const std::size_t begin = out_.size(), nodes_before = nodes_;
    append(0, 0);
    unsigned children = 0;
    bool equal = true;
    for (unsigned child = 0; child < 8; ++child) {
      float child_value{};
      bool child_leaf{};
      if (!write(child_of(low, child, level), level - 1, child_value, child_leaf)) continue;
      equal = equal && child_leaf && (children == 0 || child_value == value);
      value = children == 0 ? child_value : std::max(value, child_value);
      children |= 1U << child;
    }
    leaf = children == 0xFF && equal;
    out_.resize(leaf || children == 0 ? begin : out_.size());
    nodes_ = leaf || children == 0 ? nodes_before : nodes_;
    if (leaf) append(value, 0);
    if (!leaf && children != 0) patch(begin, value, children);
    return children != 0;
  }

  void append(float value, unsigned children) {
    out_.append(5, '\0');
    patch(out_.size() - 5, value, children);
    ++nodes_;
  }
  void patch(std::size_t at, float value, unsigned children) {
    std::memcpy(&out_[at], &value, sizeof(value));
    out_[at + 4] = static_cast<char>(children);
  }

  OctomapKey size_, first_;
  const StateAt& state_at_;
  std::string out_;
  std::size_t nodes_ = 0;
};

struct FullNode {
  float value{};
  unsigned children{};
};

// Takes a node off the front; false at the end of the bytes.
bool take(std::string_view& bytes, FullNode& node) {
  if (bytes.size() < 5) return false;
  std::memcpy(&node.value, bytes.data(), sizeof(node.value));
  node.children = static_cast<unsigned char>(bytes[4]);
  bytes.remove_prefix(5);
  return true;
}

// Appends the inner node whose children come next in `full` as .bt has it: the two bits of all
// children, then the subtrees of those that have children.
void to_binary(std::string_view& full, unsigned children, std::string& out) {
  const std::size_t at = out.size();
  out.append(2, '\0');
  unsigned bits = 0;
  for (unsigned child = 0; child < 8; ++child) {
    if ((children >> child & 1) == 0) continue;
    FullNode node;
    take(full, node);
    const unsigned code = node.children != 0 ? kInnerBits
                          : node.value >= 0  ? kOccupiedBits
                                             : kFreeBits;
    bits |= code << (2 * child);
    if (code == kInnerBits) to_binary(full, node.children, out);
  }
  out[at] = static_cast<char>(bits & 0xFF);
  out[at + 1] = static_cast<char>(bits >> 8);
}

class TreeReader {
 public:
  TreeReader(std::string_view bytes, OctomapFormat format, const Visit& visit)
      : bytes_(bytes), all_(bytes.size()), format_(format), visit_(visit) {}

  std::string read() {
    if (bytes_.empty()) return "";
    const bool good = format_ == OctomapFormat::full ? full({0, 0, 0}, kOctomapDepth)
                                                     : binary({0, 0, 0}, kOctomapDepth);
    if (good && !bytes_.empty() && wrong_.empty())
      return fmt::format("{} bytes follow the end of its tree", bytes_.size());
    return std::move(wrong_);
  }
  std::size_t nodes() const { return nodes_; }

 private:
  bool fail(std::string_view what) {
    wrong_ = fmt::format("{} (node {}, byte {} after the header)", what, nodes_ + 1,
                         all_ - bytes_.size());
    return false;
  }

  bool full(const OctomapKey& low, int level) {
    FullNode node;
    if (!take(bytes_, node)) return fail("its tree is cut short");
    if (std::isnan(node.value)) return fail("a log-odds is not a number");
    ++nodes_;
    if (node.children == 0) return visit_({low, level, node.value >= 0});
    if (level == 0) return fail("its tree is deeper than 16 levels");
    for (unsigned child = 0; child < 8; ++child)
      if ((node.children >> child & 1) != 0 && !full(child_of(low, child, level), level - 1))
        return false;
    return true;
  }

  bool binary(const OctomapKey& low, int level) {
    if (bytes_.size() < 2) return fail("its tree is cut short");
    if (level == 0) return fail("its tree is deeper than 16 levels");
    const unsigned bits = static_cast<unsigned char>(bytes_[0]) |
                          static_cast<unsigned>(static_cast<unsigned char>(bytes_[1])) << 8;
    bytes_.remove_prefix(2);
    ++nodes_;
    for (unsigned child = 0; child < 8; ++child) {
      const unsigned code = bits >> (2 * child) & 3;
      if (code == 0) continue;
      const OctomapKey at = child_of(low, child, level);
      if (code == kInnerBits) {
        if (!binary(at, level - 1)) return false;
        continue;
      }
      ++nodes_;
      if (!visit_({at, level - 1, code == kOccupiedBits})) return false;
    }
    return true;
  }

  std::string_view bytes_;
  std::size_t all_;
  OctomapFormat format_;
  const Visit& visit_;
  std::size_t nodes_ = 0;
  std::string wrong_;
};

}  // namespace

OctomapTree write_tree(const VoxelGrid& grid, const OctomapKey& first, const StateAt& state_at,
                       OctomapFormat format) {
  TreeWriter writer(grid, first, state_at);
  float value{};
  bool leaf{};
  writer.write({0, 0, 0}, kOctomapDepth, value, leaf);
  OctomapTree tree = writer.take();
  if (format == OctomapFormat::full || tree.nodes == 0) return tree;
  std::string_view full = tree.bytes;
  FullNode root;
  take(full, root);
  std::string binary;
  to_binary(full, root.children, binary);
  return {std::move(binary), tree.nodes};
}

std::string read_tree(std::string_view bytes, OctomapFormat format, std::size_t& nodes,
                      const Visit& visit) {
  TreeReader reader(bytes, format, visit);
  std::string wrong = reader.read();
  nodes = reader.nodes();
  return wrong;
}

}  // namespace mission
