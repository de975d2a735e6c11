// The site's 2-D map: as drawn (RawSite), and as the planner uses it (SiteMap) after repair.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "hal/values.hpp"
#include "nav/geometry.hpp"

namespace nav {

enum class Role { boundary, obstacle, keep_out, target, region, start };

// One feature of the map file, as drawn: metres in W, nothing repaired.
struct RawFeature {
  Role role{};
  std::string name;
  std::string where;  // For messages: "footprint.geojson:12:5 (feature 3 'barracks')".
  std::vector<std::vector<std::vector<Eigen::Vector2d>>> polygons_m;  // polygon -> ring -> vertex
  std::vector<std::vector<Eigen::Vector2d>> lines_m;                  // target edges
  std::optional<Eigen::Vector2d> point_m;                             // start
  std::optional<double> heading_deg;                                  // start
  std::optional<double> ground_z_m;                                   // region, boundary
  bool wall{};  // boundary only: its edge is a real wall that occludes and counts
};

struct RawSite {
  std::string name;
  std::vector<RawFeature> features;
};

struct Region {
  std::string name;
  Polygons area;
  double ground_z_m{};
};

// After repair: on the grid, unions made, rings oriented, nothing overlapping.
struct SiteMap {
  std::string name;
  Polygons boundary;
  Polygons obstacles;               // Occlude; the robot keeps its radius away.
  Polygons keep_out;                // Forbidden to the robot; transparent to the scanner.
  std::vector<SegmentMm> targets;   // Edges that count for coverage; empty: every obstacle edge.
  std::vector<Region> regions;      // Never empty: without any in the map, one named "site".
  std::optional<hal::Pose2> start;  // Empty: the mission chooses.
  double ground_z_m{};
};

// What repair changed, in words fit for the operator.
struct Repair {
  std::string where;
  std::string what;
};

struct RepairedSite {
  SiteMap map;
  std::vector<Repair> repairs;
  std::vector<std::string> errors;  // Not empty: the map cannot be used.
};

// margin_m: distance from the obstacles to the boundary that is assumed where the map draws none.
RepairedSite repair_site(const RawSite& raw, double margin_m);

}  // namespace nav
