#include "mission/map_match.hpp"

#include <algorithm>

#include "nav/polygons.hpp"
#include "nav/registration/cloud.hpp"

namespace mission {
namespace {

// Above the ground: over kerbs and grass, below eaves and arches.
constexpr double kLowM = 0.5, kHighM = 1.6;
constexpr double kThinnedM = 0.2;
// Far walls are met by few beams, and at a flat angle.
constexpr double kFarM = 40;
// Maps lack stairs, sheds, parked cars: of what a scan shows, so much must be theirs. The localizer
// judges the pose besides.
constexpr double kFitMin = 0.4;

nav::WallMapConfig wall_config() {
  nav::WallMapConfig config;
  config.cell_m = 0.25;
  config.cells_max = 300'000'000;
  return config;
}

}  // namespace

std::vector<nav::WallSegment> walls_of(const nav::SiteMap& map) {
  std::vector<nav::WallSegment> walls;
  for (const nav::SegmentMm& edge : nav::edges(map.obstacles))
    walls.push_back({nav::to_m(edge.a), nav::to_m(edge.b)});
  return walls;
}

MapMatcher::MapMatcher(const nav::SiteMap& map, const ScannerConfig& scanner)
    : scanner_(scanner), walls_(walls_of(map), wall_config()) {}

nav::ScanMatch MapMatcher::match(const std::vector<Eigen::Vector3f>& S_points_m,
                                 const hal::Pose2& guess) const {
  nav::Points band;
  const double near_m = std::max(0.5, scanner_.range_min_m);
  for (const Eigen::Vector3f& point : S_points_m) {
    const double above_m = point.z() + scanner_.height_m;
    const double away_m = point.head<2>().norm();
    if (above_m > kLowM && above_m < kHighM && away_m > near_m && away_m < kFarM)
      band.push_back({point.x(), point.y(), 0});
  }
  std::vector<Eigen::Vector2d> B_points_m;
  for (const Eigen::Vector3f& point : nav::thinned(band, kThinnedM))
    B_points_m.emplace_back(point.head<2>().cast<double>());
  nav::ScanMatchConfig config;
  config.fit_min = kFitMin;
  return nav::match_scan(walls_, B_points_m, guess, config);
}

}  // namespace mission
