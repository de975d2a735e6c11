#include "mission/ply.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <stdexcept>
#include <unordered_map>

namespace mission {
namespace {

static_assert(std::endian::native == std::endian::little, "PLY is written little-endian");
static_assert(sizeof(Eigen::Vector3f) == 12);

constexpr float kFarthest_m =
    500'000;  // Beyond is no point of a site; also keeps cells in 64 bits.

constexpr std::string_view kProperties =
    "property float x\nproperty float y\nproperty float z\nend_header\n";

std::string_view bytes_of(const std::vector<Eigen::Vector3f>& points) {
  return {reinterpret_cast<const char*>(points.data()), points.size() * sizeof(points[0])};
}

// One line stays one line, whatever the operator called the station.
std::string one_line(std::string text) {
  for (char& c : text) {
    if (static_cast<unsigned char>(c) < 0x20) c = ' ';
  }
  return text;
}

std::string pose_comment(const Eigen::Isometry3d& T_W_S) {
  std::string text = "comment T_W_S";
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < 4; ++column) {
      fmt::format_to(std::back_inserter(text), " {}", T_W_S.matrix()(row, column));
    }
  }
  return text + "\n";
}

std::string header(std::string_view comments, std::size_t count) {
  return fmt::format("ply\nformat binary_little_endian 1.0\n{}element vertex {}\n{}", comments,
                     count, kProperties);
}

// Takes the next line off the text; false when there is none that ends.
bool take_line(std::string_view& text, std::string_view& line) {
  const auto end = text.find('\n');
  if (end == std::string_view::npos) return false;
  line = text.substr(0, end);
  text.remove_prefix(end + 1);
  return true;
}

std::optional<Eigen::Isometry3d> parse_pose(std::string_view numbers) {
  Eigen::Isometry3d pose;
  for (int i = 0; i < 16; ++i) {
    while (!numbers.empty() && numbers.front() == ' ') numbers.remove_prefix(1);
    double value{};
    const auto [end, problem] =
        std::from_chars(numbers.data(), numbers.data() + numbers.size(), value);
    if (problem != std::errc{}) return std::nullopt;
    pose.matrix()(i / 4, i % 4) = value;
    numbers.remove_prefix(static_cast<std::size_t>(end - numbers.data()));
  }
  return numbers.empty() ? std::optional(pose) : std::nullopt;
}

// The header's free part: comments, then the number of points.
FileResult<std::size_t> parse_comments(std::string_view& text, PlyCloud& cloud,
                                       const std::filesystem::path& path) {
  constexpr std::string_view kComment = "comment ", kPose = "T_W_S ", kVertex = "element vertex ";
  std::string_view line;
  while (take_line(text, line)) {
    if (line.starts_with(kComment)) {
      line.remove_prefix(kComment.size());
      cloud.comments.emplace_back(line);
      if (!line.starts_with(kPose)) continue;
      cloud.T_W_S = parse_pose(line.substr(kPose.size()));
      if (!cloud.T_W_S) return unreadable(path, "the pose in its header is not 16 numbers");
    } else if (line.starts_with(kVertex)) {
      std::size_t count{};
      const auto end = line.data() + line.size();
      const auto parsed = std::from_chars(line.data() + kVertex.size(), end, count);
      if (parsed.ec != std::errc{} || parsed.ptr != end) break;
      return count;
    } else {
      break;
    }
  }
  return unreadable(path, fmt::format("unexpected header line '{}'", line.substr(0, 40)));
}

}  // namespace

namespace {

std::vector<Eigen::Vector3f> points_of_beams(const hal::ScanCloud& cloud,
                                             const Eigen::Isometry3d& T_W_S) {
  std::vector<Eigen::Vector3f> points;
  points.reserve(cloud.ranges_m.size());
  for (std::size_t i = 0; i < cloud.beams.size(); ++i) {
    if (!(cloud.ranges_m[i] > 0)) continue;
    const hal::Beam& beam = cloud.beams[i];
    const Eigen::Vector3d S_point_m =
        beam.S_origin_m.cast<double>() + cloud.ranges_m[i] * beam.S_direction.cast<double>();
    points.push_back((T_W_S * S_point_m).cast<float>());
  }
  return points;
}

}  // namespace

std::vector<Eigen::Vector3f> scan_points(const hal::ScanCloud& cloud,
                                         const Eigen::Isometry3d& T_W_S) {
  const hal::ScanPattern& pattern = cloud.pattern;
  if (cloud.ranges_m.size() != pattern.beams() ||
      (!cloud.beams.empty() && cloud.beams.size() != pattern.beams())) {
    throw std::invalid_argument("a scan's ranges do not match its pattern");
  }
  if (!cloud.beams.empty()) return points_of_beams(cloud, T_W_S);
  const std::size_t rows = pattern.rows;
  std::vector<double> cosine(rows), sine(rows);
  for (std::size_t row = 0; row < rows; ++row) {
    const double elevation_rad =
        pattern.elevation_first_rad + static_cast<double>(row) * pattern.elevation_step_rad;
    cosine[row] = std::cos(elevation_rad);
    sine[row] = std::sin(elevation_rad);
  }
  std::vector<Eigen::Vector3f> points;
  points.reserve(cloud.ranges_m.size());
  const Eigen::Vector3d W_origin = T_W_S.translation();
  const Eigen::Vector3d W_up = T_W_S.linear().col(2);
  for (std::size_t first = 0, column = 0; column < pattern.columns; ++column, first += rows) {
    const double azimuth_rad =
        pattern.azimuth_first_rad + static_cast<double>(column) * pattern.azimuth_step_rad;
    const Eigen::Vector3d W_out =
        T_W_S.linear() * Eigen::Vector3d(std::cos(azimuth_rad), std::sin(azimuth_rad), 0);
    for (std::size_t row = 0; row < rows; ++row) {
      const double range_m = cloud.ranges_m[first + row];
      if (!(range_m > 0)) continue;
      const Eigen::Vector3d W_beam = cosine[row] * W_out + sine[row] * W_up;
      points.push_back((W_origin + range_m * W_beam).cast<float>());
    }
  }
  return points;
}

FileResult<void> write_scan_ply(const std::filesystem::path& path, const hal::ScanCloud& cloud,
                                const Eigen::Isometry3d& T_W_S, const ScanInfo& info) {
  return write_scan_ply(path, scan_points(cloud, T_W_S), T_W_S, info);
}

FileResult<void> write_scan_ply(const std::filesystem::path& path,
                                const std::vector<Eigen::Vector3f>& W_points_m,
                                const Eigen::Isometry3d& T_W_S, const ScanInfo& info) {
  const std::string comments = fmt::format(
      "comment vantage scan {}\ncomment station {}\ncomment time_s {}\ncomment seed {}\n"
      "comment frame W: x east, y north, z up, metres; T_W_S maps scanner to W, row by row\n{}",
      info.number, one_line(info.station), info.time_s, info.seed, pose_comment(T_W_S));
  return write_file(path, {header(comments, W_points_m.size()), bytes_of(W_points_m)});
}

FileResult<PlyCloud> parse_ply(std::string_view bytes, const std::filesystem::path& path) {
  constexpr std::string_view kStart = "ply\nformat binary_little_endian 1.0\n";
  if (!bytes.starts_with(kStart)) return unreadable(path, "not a binary little-endian PLY file");
  bytes.remove_prefix(kStart.size());
  PlyCloud cloud;
  const auto count = parse_comments(bytes, cloud, path);
  if (!count) return count.error();
  if (!bytes.starts_with(kProperties)) return unreadable(path, "its points are not float x, y, z");
  bytes.remove_prefix(kProperties.size());
  if (bytes.size() % 12 != 0 || bytes.size() / 12 != *count) {
    return unreadable(path, fmt::format("its header promises {} points, {} bytes follow (12 each)",
                                        *count, bytes.size()));
  }
  cloud.W_points_m.resize(*count);
  if (*count > 0) {
    std::memcpy(static_cast<void*>(cloud.W_points_m.data()), bytes.data(), bytes.size());
  }
  return cloud;
}

FileResult<PlyCloud> read_ply(const std::filesystem::path& path) {
  const auto bytes = read_file(path);
  if (!bytes) return bytes.error();
  return parse_ply(*bytes, path);
}

// The occupied cells, as one 512-bit set per block of 8 x 8 x 8 cells. Neighbouring beams mostly
// hit the block that the last one hit.
class CloudMerger::Cells {
 public:
  // True when the cell was free.
  bool take(const Eigen::Vector3f& W_point_m, double grid_m) {
    const auto x = cell(W_point_m.x(), grid_m);
    const auto y = cell(W_point_m.y(), grid_m);
    const auto z = cell(W_point_m.z(), grid_m);
    const std::uint64_t key = part(x) << 42 | part(y) << 21 | part(z);
    if (last_ == nullptr || key != last_key_) {
      last_ = &blocks_[key];
      last_key_ = key;
    }
    std::uint64_t& layer = last_->layers[z & 7];
    const std::uint64_t bit = std::uint64_t{1} << ((y & 7) << 3 | (x & 7));
    const bool free = (layer & bit) == 0;
    layer |= bit;
    return free;
  }

 private:
  struct Block {
    std::uint64_t layers[8] = {};
  };

  static std::int64_t cell(float at_m, double grid_m) {
    return static_cast<std::int64_t>(std::floor(at_m / grid_m));
  }
  // 21 bits of the block's coordinate: 838 km either way at 0.1 m.
  static std::uint64_t part(std::int64_t cell) {
    return static_cast<std::uint64_t>(cell >> 3) & 0x1FFFFF;
  }

  std::unordered_map<std::uint64_t, Block> blocks_;  // Never walked: its order does not matter.
  Block* last_ = nullptr;
  std::uint64_t last_key_ = 0;
};

CloudMerger::CloudMerger(double grid_m, std::size_t points_max)
    : grid_m_(grid_m),
      points_max_(std::max<std::size_t>(points_max, 8)),
      cells_(std::make_unique<Cells>()) {
  W_points_m_.reserve(points_max_);  // Address space only, until points come.
}
CloudMerger::~CloudMerger() = default;
CloudMerger::CloudMerger(CloudMerger&&) noexcept = default;
CloudMerger& CloudMerger::operator=(CloudMerger&&) noexcept = default;

void CloudMerger::add(const std::vector<Eigen::Vector3f>& W_points_m) {
  for (const Eigen::Vector3f& point : W_points_m) {
    if (!point.allFinite() || point.cwiseAbs().maxCoeff() > kFarthest_m) continue;
    ++points_in_;
    keep(point);
  }
}

void CloudMerger::keep(const Eigen::Vector3f& W_point_m) {
  if (!cells_->take(W_point_m, grid_m_)) return;
  if (W_points_m_.size() < points_max_) {
    W_points_m_.push_back(W_point_m);
    return;
  }
  double_grid();
  keep(W_point_m);
}

void CloudMerger::double_grid() {
  grid_m_ *= 2;
  ++doublings_;
  cells_ = std::make_unique<Cells>();
  std::size_t kept = 0;
  for (const Eigen::Vector3f& point : W_points_m_) {
    if (cells_->take(point, grid_m_)) W_points_m_[kept++] = point;
  }
  W_points_m_.resize(kept);
}

FileResult<void> CloudMerger::write(const std::filesystem::path& path) const {
  const std::string comments = fmt::format(
      "comment vantage merged cloud of {} points\ncomment grid_m {}\n"
      "comment frame W: x east, y north, z up, metres\n",
      points_in_, grid_m_);
  return write_file(path, {header(comments, W_points_m_.size()), bytes_of(W_points_m_)});
}

}  // namespace mission
