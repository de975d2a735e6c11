#include "mission/octomap_io.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <optional>

namespace mission {
namespace {

using planning::Voxel;
using planning::VoxelGrid;
using planning::VoxelState;
using StateAt = std::function<VoxelState(Voxel)>;

static_assert(std::endian::native == std::endian::little, "OctoMap files are little-endian");

constexpr int kDepth = 16;
constexpr int kKeys = 1 << kDepth;  // Voxels per axis of an OctoMap; key 0 is at -kKeys / 2.
constexpr float kOccupied = 3.5F, kEmpty = -2.0F;
constexpr std::size_t kVoxelsMax = std::size_t{1} << 29;
constexpr std::string_view kFirstLine = "# Octomap OcTree file";

using Corner = std::array<int, 3>;

Corner size_of(const VoxelGrid& grid) {
  return {grid.nx, grid.ny, grid.nz};
}

// The OctoMap key of our voxel (0, 0, 0).
Corner first_key(const VoxelGrid& grid) {
  Corner key{};
  for (int axis = 0; axis < 3; ++axis) {
    const int room = kKeys - size_of(grid)[static_cast<std::size_t>(axis)];
    const double nearest = std::round(grid.W_min_m[axis] / grid.voxel_m) + kKeys / 2;
    const bool fits = nearest >= 0 && nearest <= room;
    key[static_cast<std::size_t>(axis)] = fits ? static_cast<int>(nearest) : room / 2;
  }
  return key;
}

// Writes the cube of keys of side 2^level whose lowest corner is `low` as a subtree: value and
// children in OctoMap's order. Log-odds of an inner node are its children's maximum; eight equal
// leaves become one.
class TreeWriter {
 public:
  TreeWriter(const VoxelGrid& grid, const StateAt& state_at)
      : size_(size_of(grid)), first_(first_key(grid)), state_at_(state_at) {}

  std::string take() { return std::move(out_); }
  std::size_t nodes() const { return nodes_; }

  // False (and nothing written) when nothing of the cube has been seen.
  bool write(Corner low, int level, float& value, bool& leaf) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const int from = low[axis] - first_[axis];
      if (from >= size_[axis] || from + (1 << level) <= 0) return false;
    }
    leaf = level == 0;
    return leaf ? write_voxel(low, value) : write_inner(low, level, value, leaf);
  }

 private:
  bool write_voxel(const Corner& low, float& value) {
    const VoxelState state =
        state_at_({low[0] - first_[0], low[1] - first_[1], low[2] - first_[2]});
    if (state == VoxelState::unseen) return false;
    value = state == VoxelState::seen_occupied ? kOccupied : kEmpty;
    append(value, 0);
    return true;
  }

  bool write_inner(const Corner& low, int level, float& value, bool& leaf) {
    const std::size_t begin = out_.size(), nodes_before = nodes_;
    append(0, 0);
    unsigned children = 0;
    bool equal = true;
    for (unsigned child = 0; child < 8; ++child) {
      const int half = level - 1;
      const Corner at{low[0] + static_cast<int>((child & 1) << half),
                      low[1] + static_cast<int>((child >> 1 & 1) << half),
                      low[2] + static_cast<int>((child >> 2 & 1) << half)};
      float child_value{};
      bool child_leaf{};
      if (!write(at, half, child_value, child_leaf)) continue;
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

  Corner size_, first_;
  const StateAt& state_at_;
  std::string out_;
  std::size_t nodes_ = 0;
};

std::string file_header(const VoxelGrid& grid, std::size_t nodes) {
  const Eigen::Vector3d offset_m = octomap_offset_m(grid);
  return fmt::format(
      "{}\n# (feel free to add / change comments, but leave the first line as it is!)\n"
      "# vantage W_min_m {} {} {}\n# vantage voxels {} {} {}\n# vantage offset_m {} {} {}\n"
      "# A point in the site frame W is the point in this file plus offset_m.\n"
      "id OcTree\nsize {}\nres {}\ndata\n",
      kFirstLine, grid.W_min_m.x(), grid.W_min_m.y(), grid.W_min_m.z(), grid.nx, grid.ny, grid.nz,
      offset_m.x(), offset_m.y(), offset_m.z(), nodes, grid.voxel_m);
}

template <class T>
std::optional<std::array<T, 3>> three(std::string_view text) {
  std::array<T, 3> numbers{};
  for (T& number : numbers) {
    while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
    const auto parsed = std::from_chars(text.data(), text.data() + text.size(), number);
    if (parsed.ec != std::errc{}) return std::nullopt;
    text.remove_prefix(static_cast<std::size_t>(parsed.ptr - text.data()));
  }
  return text.empty() ? std::optional(numbers) : std::nullopt;
}

// What the header says; the comments of ours may be missing.
struct Header {
  std::string id;
  double resolution_m = 0;
  std::optional<std::array<double, 3>> W_min_m, offset_m;
  std::optional<std::array<int, 3>> voxels;

  void take(std::string_view line) {
    const auto value_of = [line](std::string_view key) -> std::optional<std::string_view> {
      if (!line.starts_with(key)) return std::nullopt;
      return line.substr(key.size());
    };
    if (const auto text = value_of("# vantage W_min_m ")) W_min_m = three<double>(*text);
    if (const auto text = value_of("# vantage offset_m ")) offset_m = three<double>(*text);
    if (const auto text = value_of("# vantage voxels ")) voxels = three<int>(*text);
    if (const auto text = value_of("id ")) id = *text;
    if (const auto text = value_of("res ")) {
      std::from_chars(text->data(), text->data() + text->size(), resolution_m);
    }
  }
};

// Takes the header off the bytes; false when it has no "data" line or no first line of OctoMap's.
bool take_header(std::string_view& bytes, Header& header) {
  if (!bytes.starts_with(kFirstLine)) return false;
  while (true) {
    const auto end = bytes.find('\n');
    if (end == std::string_view::npos) return false;
    const std::string_view line = bytes.substr(0, end);
    bytes.remove_prefix(end + 1);
    if (line == "data") return true;
    header.take(line);
  }
}

struct Leaf {
  Corner low;  // Keys.
  int level;
  bool occupied;
};

// Reads a subtree's leaves; false when the bytes end before it does or it is deeper than OctoMap's.
bool read_leaves(std::string_view& bytes, Corner low, int level, std::vector<Leaf>& leaves) {
  if (bytes.size() < 5 || level < 0) return false;
  float value{};
  std::memcpy(&value, bytes.data(), sizeof(value));
  const auto children = static_cast<unsigned char>(bytes[4]);
  bytes.remove_prefix(5);
  if (children == 0 && (value > 0 || value < 0)) leaves.push_back({low, level, value > 0});
  for (unsigned child = 0; child < 8; ++child) {
    if ((children >> child & 1) == 0) continue;
    const int half = level - 1;
    if (half < 0) return false;
    const Corner at{low[0] + static_cast<int>((child & 1) << half),
                    low[1] + static_cast<int>((child >> 1 & 1) << half),
                    low[2] + static_cast<int>((child >> 2 & 1) << half)};
    if (!read_leaves(bytes, at, half, leaves)) return false;
  }
  return true;
}

VoxelGrid box_of(const std::vector<Leaf>& leaves, double voxel_m) {
  Corner low{kKeys, kKeys, kKeys}, high{0, 0, 0};
  for (const Leaf& leaf : leaves) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], leaf.low[axis]);
      high[axis] = std::max(high[axis], leaf.low[axis] + (1 << leaf.level));
    }
  }
  if (leaves.empty()) low = high = {kKeys / 2, kKeys / 2, kKeys / 2};
  VoxelGrid grid{{0, 0, 0}, voxel_m, high[0] - low[0], high[1] - low[1], high[2] - low[2]};
  for (int axis = 0; axis < 3; ++axis) {
    grid.W_min_m[axis] = (low[static_cast<std::size_t>(axis)] - kKeys / 2) * voxel_m;
  }
  return grid;
}

// The grid our own header describes; empty when it does not, or not sensibly.
std::optional<VoxelGrid> described_grid(const Header& header) {
  if (!header.W_min_m || !header.offset_m || !header.voxels) return std::nullopt;
  const auto& n = *header.voxels;
  if (std::any_of(n.begin(), n.end(), [](int k) { return k < 0 || k > kKeys; })) {
    return std::nullopt;
  }
  const auto& low = *header.W_min_m;
  return VoxelGrid{{low[0], low[1], low[2]}, header.resolution_m, n[0], n[1], n[2]};
}

// Sets the leaf's voxels; false when it leaves the grid.
bool fill(OctomapGrid& map, const Corner& first, const Leaf& leaf) {
  const Corner size = size_of(map.grid);
  Corner from{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    from[axis] = leaf.low[axis] - first[axis];
    if (from[axis] < 0 || from[axis] + (1 << leaf.level) > size[axis]) return false;
  }
  const auto state = leaf.occupied ? VoxelState::seen_occupied : VoxelState::seen_empty;
  const auto nx = static_cast<std::size_t>(size[0]), ny = static_cast<std::size_t>(size[1]);
  for (int z = from[2]; z < from[2] + (1 << leaf.level); ++z) {
    for (int y = from[1]; y < from[1] + (1 << leaf.level); ++y) {
      const auto row = (static_cast<std::size_t>(z) * ny + static_cast<std::size_t>(y)) * nx;
      std::fill_n(&map.states[row + static_cast<std::size_t>(from[0])],
                  std::size_t{1} << leaf.level, state);
    }
  }
  return true;
}

FileError bad(const std::filesystem::path& path, std::string detail) {
  return {path, "read", make_error_code(boost::system::errc::bad_message), std::move(detail)};
}

}  // namespace

Eigen::Vector3d octomap_offset_m(const VoxelGrid& grid) {
  const Corner first = first_key(grid);
  const Eigen::Vector3d octomap_min_m =
      grid.voxel_m *
      Eigen::Vector3d(first[0] - kKeys / 2, first[1] - kKeys / 2, first[2] - kKeys / 2);
  return grid.W_min_m - octomap_min_m;
}

std::string octomap_bytes(const VoxelGrid& grid, const StateAt& state_at, std::size_t& nodes) {
  TreeWriter writer(grid, state_at);
  float value{};
  bool leaf{};
  writer.write({0, 0, 0}, kDepth, value, leaf);
  nodes = writer.nodes();
  return file_header(grid, nodes) + writer.take();
}

FileResult<OctomapWritten> write_octomap(const std::filesystem::path& path, const VoxelGrid& grid,
                                         const StateAt& state_at) {
  if (std::max({grid.nx, grid.ny, grid.nz}) > kKeys) {
    return FileError{path, "write", make_error_code(boost::system::errc::argument_out_of_domain),
                     fmt::format("OctoMap holds 65536 voxels per axis, the map has {} x {} x {}: "
                                 "raise voxel_m",
                                 grid.nx, grid.ny, grid.nz)};
  }
  OctomapWritten written;
  const std::string bytes = octomap_bytes(grid, state_at, written.nodes);
  written.offset_m = octomap_offset_m(grid);
  const auto done = write_file(path, {bytes});
  if (!done) return done.error();
  return written;
}

FileResult<OctomapGrid> parse_octomap(std::string_view bytes, const std::filesystem::path& path) {
  Header header;
  if (!take_header(bytes, header)) return bad(path, "not an OctoMap file");
  if (header.id != "OcTree") return bad(path, "its tree is not of type OcTree");
  if (!(header.resolution_m > 0 && header.resolution_m < 1e6)) {
    return bad(path, "its resolution is missing or not positive");
  }
  std::vector<Leaf> leaves;
  if (!bytes.empty() && !read_leaves(bytes, {0, 0, 0}, kDepth, leaves)) {
    return bad(path, "its tree is cut short or deeper than 16 levels");
  }
  if (!bytes.empty()) return bad(path, "bytes follow the end of its tree");
  OctomapGrid map;
  const auto described = described_grid(header);
  map.grid = described ? *described : box_of(leaves, header.resolution_m);
  if (described) map.offset_m = octomap_offset_m(map.grid);
  if (map.grid.size() > kVoxelsMax) return bad(path, "it spans more than 2^29 voxels");
  map.states.assign(map.grid.size(), VoxelState::unseen);
  const Corner first = first_key(map.grid);
  for (const Leaf& leaf : leaves) {
    if (!fill(map, first, leaf)) return bad(path, "a voxel lies outside the box its header gives");
  }
  return map;
}

FileResult<OctomapGrid> read_octomap(const std::filesystem::path& path) {
  const auto bytes = read_file(path);
  if (!bytes) return bytes.error();
  return parse_octomap(*bytes, path);
}

}  // namespace mission
