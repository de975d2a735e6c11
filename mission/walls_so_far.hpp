// The walls that a robot can hold on to while it drives: those of the map, and what the scans in
// hand show at the height at which it looks ahead. Values only.
#pragma once

#include <Eigen/Core>
#include <map>
#include <vector>

#include "nav/scan_match.hpp"
#include "nav/site_map.hpp"

namespace mission {

class WallsSoFar {
 public:
  // height_m: of the scanner that looks ahead, above the ground. uses_map: the map is to be
  // trusted. Throws std::invalid_argument as MapMatcher does.
  WallsSoFar(const nav::SiteMap& map, bool uses_map, double height_m);

  // What a scan shows that was taken from there, on ground at ground_z_m: whatever stands upright
  // about that height, up to kFarM away.
  static constexpr double kFarM = 40;
  void add(int scan, const std::vector<Eigen::Vector3f>& W_points_m,
           const Eigen::Vector2d& W_scanner_m, double ground_z_m);
  void clear() { shown_m_.clear(); }

  // Of all that was added; takes some tens of milliseconds.
  nav::WallMap map() const;

 private:
  std::vector<nav::WallSegment> drawn_;
  double height_m_;
  std::map<int, std::vector<Eigen::Vector2d>> shown_m_;  // By scan.
};

}  // namespace mission
