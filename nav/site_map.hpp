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
  std::vector<std::vector<Eigen::Vector2d>> lines_m;  // target, obstacle (thin wall)
  std::optional<Eigen::Vector2d> point_m;             // start
  std::optional<double> heading_deg;                  // start
  std::optional<double> ground_z_m;                   // region, boundary
  bool wall{};  // boundary only: its edge is a real wall that occludes and counts
};

struct RawSite {
  std::string name;
  std::vector<RawFeature> features;
  std::optional<double> ground_z_m;  // Of the site; a boundary's own goes before it.
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
  std::vector<SegmentMm> targets;   // Lines along the walls that count, as drawn; see on_target.
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

// How near a wall must run to a target line, or to the boundary, to count.
inline constexpr double kTargetReachM = 0.05;

// An outline that crosses itself is an error where it leaves more than this in doubt: 0.5 % of its
// area, but never less than 0.01 m^2 nor more than 1 m^2. Below, it is a slip of the pen.
double self_crossing_allowed_m2(double ring_area_m2);

// Overlaps and gaps below this are not worth a word.
inline constexpr double kAreaToleranceM2 = 0.01;

// What a boundary with `wall` and an obstacle drawn as a line become.
inline constexpr std::int64_t kBoundaryWallMm = 500;
inline constexpr std::int64_t kLineWallHalfMm = 50;

// Turns the site as drawn into one to plan on; says what it changed. Never throws for what is
// drawn.
//
// - Outlines that are left open, repeat vertices, run the wrong way round, touch themselves or have
//   zero-width spikes are repaired; rings without area are dropped; see self_crossing_allowed_m2.
// - Obstacles that overlap, touch or are drawn twice are united; so are keep-outs and boundaries.
// - Without a boundary, the bounding box of the obstacles grown by margin_m is assumed. A boundary
//   with `wall` gets an obstacle kBoundaryWallMm thick around its outside.
// - Regions are cut to the boundary; where two overlap, the one drawn first keeps the ground. Two
// of
//   one name are one region.
// - Obstacle edges are cut where target lines end, or without targets where the boundary passes, so
//   that each counts as a whole or not at all: see on_target.
RepairedSite repair_site(const RawSite& raw, double margin_m);

// Whether an edge of map.obstacles (or a part of one) counts for coverage: with targets, if it runs
// within kTargetReachM of one along its whole length, at an angle below 30 deg; without, if it lies
// inside the boundary or within kTargetReachM of it.
bool on_target(const SiteMap& map, const SegmentMm& edge);

}  // namespace nav
