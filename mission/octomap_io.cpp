#include "mission/octomap_io.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>

namespace mission {
namespace {

using planning::Voxel;
using planning::VoxelGrid;
using planning::VoxelMap;
using planning::VoxelState;
using StateAt = std::function<VoxelState(Voxel)>;

constexpr std::size_t kVoxelsMax = std::size_t{1} << 29;
constexpr std::size_t kBytesMax = std::size_t{1} << 28;
constexpr std::string_view kFirstLine = "# Octomap OcTree file";
constexpr std::string_view kFirstLineBinary = "# Octomap OcTree binary file";

// The OctoMap key of our voxel (0, 0, 0).
OctomapKey first_key(const VoxelGrid& grid) {
  const int size[3] = {grid.nx, grid.ny, grid.nz};
  OctomapKey key{};
  for (int axis = 0; axis < 3; ++axis) {
    const int room = kOctomapKeys - size[axis];
    const double nearest = std::round(grid.W_min_m[axis] / grid.voxel_m) + kOctomapKeys / 2;
    const bool fits = nearest >= 0 && nearest <= room;
    key[static_cast<std::size_t>(axis)] = fits ? static_cast<int>(nearest) : room / 2;
  }
  return key;
}

std::string file_header(const VoxelGrid& grid, std::size_t nodes, OctomapFormat format) {
  const Eigen::Vector3d offset_m = octomap_offset_m(grid);
  return fmt::format(
      "{}\n# (feel free to add / change comments, but leave the first line as it is!)\n"
      "# vantage W_min_m {} {} {}\n# vantage voxels {} {} {}\n# vantage offset_m {} {} {}\n"
      "# A point in the site frame W is the point in this file plus offset_m.\n"
      "id OcTree\nsize {}\nres {}\ndata\n",
      format == OctomapFormat::full ? kFirstLine : kFirstLineBinary, grid.W_min_m.x(),
      grid.W_min_m.y(), grid.W_min_m.z(), grid.nx, grid.ny, grid.nz, offset_m.x(), offset_m.y(),
      offset_m.z(), nodes, grid.voxel_m);
}

std::string bytes_of(const VoxelGrid& grid, const StateAt& state_at, OctomapFormat format,
                     std::size_t& nodes) {
  const OctomapTree tree = write_tree(grid, first_key(grid), state_at, format);
  nodes = tree.nodes;
  return file_header(grid, nodes, format) + tree.bytes;
}

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kBlank = " \t\r";
  const auto first = text.find_first_not_of(kBlank);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlank) - first + 1);
}

// The whole text as N numbers between blanks.
template <class T, std::size_t N>
std::optional<std::array<T, N>> numbers(std::string_view text) {
  std::array<T, N> result{};
  for (T& number : result) {
    text = trimmed(text);
    const auto parsed = std::from_chars(text.data(), text.data() + text.size(), number);
    if (parsed.ec != std::errc{}) return std::nullopt;
    text.remove_prefix(static_cast<std::size_t>(parsed.ptr - text.data()));
  }
  return trimmed(text).empty() ? std::optional(result) : std::nullopt;
}

// What the header says; the comments of ours may be missing.
struct FileHeader {
  OctomapFormat format = OctomapFormat::full;
  std::string id;
  std::optional<std::array<double, 1>> resolution_m;
  std::optional<std::array<std::size_t, 1>> nodes;
  std::optional<std::array<double, 3>> W_min_m;
  std::optional<std::array<int, 3>> voxels;

  void take(std::string_view line) {
    const auto value_of = [line](std::string_view key) -> std::optional<std::string_view> {
      if (!line.starts_with(key)) return std::nullopt;
      return line.substr(key.size());
    };
    if (const auto text = value_of("# vantage W_min_m ")) W_min_m = numbers<double, 3>(*text);
    if (const auto text = value_of("# vantage voxels ")) voxels = numbers<int, 3>(*text);
    if (const auto text = value_of("id ")) id = trimmed(*text);
    if (const auto text = value_of("res ")) resolution_m = numbers<double, 1>(*text);
    if (const auto text = value_of("size ")) nodes = numbers<std::size_t, 1>(*text);
  }
};

// Takes the header off the bytes. "" or what is wrong with it.
std::string take_header(std::string_view& bytes, FileHeader& header) {
  if (bytes.starts_with(kFirstLineBinary))
    header.format = OctomapFormat::binary;
  else if (!bytes.starts_with(kFirstLine))
    return fmt::format("not an OctoMap file: the first line must be '{}' or '{}'", kFirstLine,
                       kFirstLineBinary);
  for (std::string_view line; line != "data";) {
    const auto end = bytes.find('\n');
    if (end == std::string_view::npos) return "its header has no line 'data'";
    line = trimmed(bytes.substr(0, end));
    bytes.remove_prefix(end + 1);
    header.take(line);
  }
  if (header.id != "OcTree")
    return fmt::format(
        "its tree is of type '{}', only OcTree can be read; octomap-tools' "
        "convert_octree makes one of it",
        header.id);
  if (!header.resolution_m || !((*header.resolution_m)[0] > 0 && (*header.resolution_m)[0] < 1e6))
    return "its line 'res' is missing or not a positive number of metres";
  if (!header.nodes) return "its line 'size' is missing or not a number of nodes";
  return "";
}

// The box of all leaves.
struct Span {
  OctomapKey low{kOctomapKeys, kOctomapKeys, kOctomapKeys}, high{0, 0, 0};

  void add(const OctomapLeaf& leaf) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], leaf.low[axis]);
      high[axis] = std::max(high[axis], leaf.low[axis] + (1 << leaf.level));
    }
  }
  bool empty() const { return low[0] >= high[0]; }
  VoxelGrid grid(double voxel_m) const {
    VoxelGrid box{{0, 0, 0}, voxel_m, high[0] - low[0], high[1] - low[1], high[2] - low[2]};
    for (int axis = 0; axis < 3; ++axis)
      box.W_min_m[axis] = (low[static_cast<std::size_t>(axis)] - kOctomapKeys / 2) * voxel_m;
    return box;
  }
};

// The grid our own header describes; empty when it does not, or not sensibly.
std::optional<VoxelGrid> described_grid(const FileHeader& header) {
  if (!header.W_min_m || !header.voxels) return std::nullopt;
  const auto& n = *header.voxels;
  const auto& low = *header.W_min_m;
  if (std::any_of(n.begin(), n.end(), [](int k) { return k < 1 || k > kOctomapKeys; }) ||
      !std::all_of(low.begin(), low.end(), [](double m) { return std::isfinite(m); }))
    return std::nullopt;
  return VoxelGrid{{low[0], low[1], low[2]}, (*header.resolution_m)[0], n[0], n[1], n[2]};
}

// "" or why a map of this grid would be too large.
std::string too_large(const VoxelGrid& grid) {
  const std::size_t row_bytes = (static_cast<std::size_t>(grid.nx) + 63) / 64 * 16;
  const std::size_t rows = static_cast<std::size_t>(grid.ny) * static_cast<std::size_t>(grid.nz);
  if (grid.size() <= kVoxelsMax && rows <= kBytesMax / row_bytes) return "";
  return fmt::format(
      "it spans {} x {} x {} voxels of {} m, more than 2^29 or than 256 MB hold; "
      "crop it, or write it again with a coarser resolution",
      grid.nx, grid.ny, grid.nz, grid.voxel_m);
}

// Sets the leaf's voxels; false when it leaves the grid.
bool fill(VoxelMap& map, const OctomapKey& first, const OctomapLeaf& leaf) {
  const int side = 1 << leaf.level;
  const Voxel low{leaf.low[0] - first[0], leaf.low[1] - first[1], leaf.low[2] - first[2]};
  if (!map.grid().contains(low) ||
      !map.grid().contains({low.x + side - 1, low.y + side - 1, low.z + side - 1}))
    return false;
  const auto state = leaf.occupied ? VoxelState::seen_occupied : VoxelState::seen_empty;
  for (int z = low.z; z < low.z + side; ++z)
    for (int y = low.y; y < low.y + side; ++y) map.set_run({low.x, y, z}, side, state);
  return true;
}

}  // namespace

Eigen::Vector3d octomap_offset_m(const VoxelGrid& grid) {
  const OctomapKey first = first_key(grid);
  constexpr int kZero = kOctomapKeys / 2;
  return grid.W_min_m -
         grid.voxel_m * Eigen::Vector3d(first[0] - kZero, first[1] - kZero, first[2] - kZero);
}

std::string octomap_bytes(const VoxelMap& map, OctomapFormat format) {
  std::size_t nodes{};
  return bytes_of(
      map.grid(), [&map](Voxel v) { return map.at(v); }, format, nodes);
}

FileResult<OctomapWritten> write_octomap(const std::filesystem::path& path, const VoxelGrid& grid,
                                         const StateAt& state_at) {
  if (std::max({grid.nx, grid.ny, grid.nz}) > kOctomapKeys) {
    return FileError{path, "write", make_error_code(boost::system::errc::argument_out_of_domain),
                     fmt::format("OctoMap holds 65536 voxels per axis, the map has {} x {} x {}: "
                                 "raise voxel_m",
                                 grid.nx, grid.ny, grid.nz)};
  }
  const auto format = path.extension() == ".bt" ? OctomapFormat::binary : OctomapFormat::full;
  OctomapWritten written;
  const std::string bytes = bytes_of(grid, state_at, format, written.nodes);
  written.offset_m = octomap_offset_m(grid);
  const auto done = write_file(path, {bytes});
  if (!done) return done.error();
  return written;
}

FileResult<OctomapWritten> write_octomap(const std::filesystem::path& path, const VoxelMap& map) {
  return write_octomap(path, map.grid(), [&map](Voxel v) { return map.at(v); });
}

FileResult<OctomapMap> parse_octomap(std::string_view bytes, const std::filesystem::path& path) {
  FileHeader header;
  if (auto wrong = take_header(bytes, header); !wrong.empty())
    return unreadable(path, std::move(wrong));
  // Twice through the tree, so that only the map itself takes memory.
  Span span;
  std::size_t nodes{};
  const auto add = [&span](const OctomapLeaf& leaf) { return span.add(leaf), true; };
  if (auto wrong = read_tree(bytes, header.format, nodes, add); !wrong.empty())
    return unreadable(path, std::move(wrong));
  if (nodes != (*header.nodes)[0])
    return unreadable(path, fmt::format("its tree has {} nodes, its line 'size' says {}", nodes,
                                        (*header.nodes)[0]));
  const auto described = described_grid(header);
  if (!described && span.empty())
    return unreadable(path, "it holds no known voxel, so it has no size");
  const VoxelGrid grid = described ? *described : span.grid((*header.resolution_m)[0]);
  if (auto wrong = too_large(grid); !wrong.empty()) return unreadable(path, std::move(wrong));

  OctomapMap read{VoxelMap(grid), {0, 0, 0}, described.has_value()};
  if (described) read.offset_m = octomap_offset_m(grid);
  const OctomapKey first = described ? first_key(grid) : span.low;
  bool within = true;
  const auto set = [&](const OctomapLeaf& leaf) { return within = fill(read.map, first, leaf); };
  read_tree(bytes, header.format, nodes, set);
  if (!within) return unreadable(path, "a voxel lies outside the box that its header gives");
  return read;
}

FileResult<OctomapMap> read_octomap(const std::filesystem::path& path) {
  const auto bytes = read_file(path);
  if (!bytes) return bytes.error();
  return parse_octomap(*bytes, path);
}

}  // namespace mission
