#include "mission/walls_so_far.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "mission/map_match.hpp"

namespace mission {
namespace {

constexpr double kBelowM = 0.2, kAboveM = 0.5;  // Of the height: the slice that is looked at.
constexpr double kLowestM = 0.1;                // Above the ground.
constexpr double kCellM = 0.1;
constexpr double kUprightM = 0.2;  // What stands in a cell is so high, in the slice: a wall.

nav::WallMapConfig wall_config() {
  nav::WallMapConfig config;
  config.cell_m = 0.2;
  config.reach_m = 1.2;
  config.cells_max = 300'000'000;
  return config;
}

// What scans show in a cell.
struct InCell {
  std::int32_t x{}, y{};
  Eigen::Vector3f W_point_m;
};

}  // namespace

WallsSoFar::WallsSoFar(const nav::SiteMap& map, bool uses_map, double height_m)
    : drawn_(uses_map ? walls_of(map) : std::vector<nav::WallSegment>{}), height_m_(height_m) {}

// The middle of what is in a cell, where that stands upright.
void WallsSoFar::add(int scan, const std::vector<Eigen::Vector3f>& W_points_m,
                     const Eigen::Vector2d& W_scanner_m, double ground_z_m) {
  const double low_m = ground_z_m + std::max(kLowestM, height_m_ - kBelowM);
  const double high_m = ground_z_m + height_m_ + kAboveM;
  std::vector<InCell> slice;
  for (const Eigen::Vector3f& point : W_points_m) {
    if (!(point.z() >= low_m && point.z() <= high_m)) continue;
    if ((point.head<2>().cast<double>() - W_scanner_m).norm() > kFarM) continue;
    slice.push_back({static_cast<std::int32_t>(std::floor(point.x() / kCellM)),
                     static_cast<std::int32_t>(std::floor(point.y() / kCellM)), point});
  }
  std::ranges::stable_sort(slice, {}, [](const InCell& in) { return std::pair(in.x, in.y); });
  std::vector<Eigen::Vector2d>& shown_m = shown_m_[scan];
  shown_m.clear();
  for (auto begin = slice.begin(); begin != slice.end();) {
    Eigen::Vector2d sum(0, 0);
    float lowest_m = begin->W_point_m.z(), highest_m = lowest_m;
    auto end = begin;
    for (; end != slice.end() && end->x == begin->x && end->y == begin->y; ++end) {
      sum += end->W_point_m.head<2>().cast<double>();
      lowest_m = std::min(lowest_m, end->W_point_m.z());
      highest_m = std::max(highest_m, end->W_point_m.z());
    }
    if (highest_m - lowest_m >= kUprightM)
      shown_m.emplace_back(sum / static_cast<double>(end - begin));
    begin = end;
  }
}

nav::WallMap WallsSoFar::map() const {
  std::vector<Eigen::Vector2d> all_m;
  for (const auto& [_, shown_m] : shown_m_)
    all_m.insert(all_m.end(), shown_m.begin(), shown_m.end());
  return nav::WallMap(drawn_, all_m, wall_config());
}

}  // namespace mission
