// Holds the robot to the map where satellites are not seen: the walls that a scan shows at the
// height of a body, laid over the obstacles of the site's map.
#pragma once

#include <vector>

#include "mission/config.hpp"
#include "nav/scan_match.hpp"
#include "nav/site_map.hpp"

namespace mission {

// The outlines of its obstacles.
std::vector<nav::WallSegment> walls_of(const nav::SiteMap& map);

class MapMatcher {
 public:
  // Of a site whose obstacles span up to 4 km x 4 km; throws std::invalid_argument beyond.
  MapMatcher(const nav::SiteMap& map, const ScannerConfig& scanner);

  // S_points_m: of one scan. `good` says whether the walls are those of the map; directions that
  // they leave free have a large covariance.
  nav::ScanMatch match(const std::vector<Eigen::Vector3f>& S_points_m,
                       const hal::Pose2& guess) const;

 private:
  const ScannerConfig scanner_;
  const nav::WallMap walls_;
};

}  // namespace mission
