// Point clouds as binary PLY, in the site frame W.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "hal/values.hpp"
#include "mission/files.hpp"

namespace mission {

// What a scan's PLY header says about it, besides the pose.
struct ScanInfo {
  int number{};         // 1, 2, ...
  std::string station;  // "inner 3", "NBV 2"
  double time_s{};      // Mission time at its end.
  std::uint64_t seed{};
};

// The points of a scan in W, in beam order; beams without a return are left out. Single precision:
// 0.03 mm at 500 m from W's origin. Throws std::invalid_argument when ranges and pattern disagree.
std::vector<Eigen::Vector3f> scan_points(const hal::ScanCloud& cloud,
                                         const Eigen::Isometry3d& T_W_S);

// Writes the scan's points (float x, y, z in W, metres, little-endian) with the pose T_W_S, row by
// row and round-trip exact, in the header's comments. Durable when it returns: see write_file.
FileResult<void> write_scan_ply(const std::filesystem::path& path, const hal::ScanCloud& cloud,
                                const Eigen::Isometry3d& T_W_S, const ScanInfo& info);

// The same from points that are there already (scan_points), to save making them twice.
FileResult<void> write_scan_ply(const std::filesystem::path& path,
                                const std::vector<Eigen::Vector3f>& W_points_m,
                                const Eigen::Isometry3d& T_W_S, const ScanInfo& info);

// A PLY file of ours, read back.
struct PlyCloud {
  std::vector<Eigen::Vector3f> W_points_m;
  std::vector<std::string> comments;       // Without the word "comment".
  std::optional<Eigen::Isometry3d> T_W_S;  // Scans have one, the merged cloud has none.
};

// Reads what this module writes; any other PLY, and a file that is cut short, is an error.
FileResult<PlyCloud> read_ply(const std::filesystem::path& path);
// The same from bytes; `path` is for the error's text.
FileResult<PlyCloud> parse_ply(std::string_view bytes, const std::filesystem::path& path);

// All scans of a run in one cloud, thinned on a grid: the first point in a cell stays. The result
// depends on the points and their order only. Memory is bounded: when points_max points are kept
// and one more arrives, the grid is doubled and the kept points are thinned again, which leaves
// exactly what the doubled grid would have kept from the start. About 12 bytes per point kept and
// 100 bytes per occupied block of 8 x 8 x 8 cells: some 200 MB at 10 M points on surfaces.
class CloudMerger {
 public:
  // grid_m >= 0.01; points_max is at least 8.
  explicit CloudMerger(double grid_m = 0.10, std::size_t points_max = 10'000'000);
  ~CloudMerger();
  CloudMerger(CloudMerger&&) noexcept;
  CloudMerger& operator=(CloudMerger&&) noexcept;

  // Points that are not finite, or farther than 500 km from W's origin, are left out.
  void add(const std::vector<Eigen::Vector3f>& W_points_m);

  const std::vector<Eigen::Vector3f>& points() const { return W_points_m_; }
  std::uint64_t points_in() const { return points_in_; }
  double grid_m() const { return grid_m_; }
  int doublings() const { return doublings_; }  // > 0: say so in the report.

  // Durable when it returns.
  FileResult<void> write(const std::filesystem::path& path) const;

 private:
  class Cells;
  void keep(const Eigen::Vector3f& W_point_m);
  void double_grid();

  double grid_m_;
  std::size_t points_max_;
  int doublings_ = 0;
  std::uint64_t points_in_ = 0;
  std::unique_ptr<Cells> cells_;
  std::vector<Eigen::Vector3f> W_points_m_;
};

}  // namespace mission
