// Phase I (Algorithm 1 of the paper): which stations cover the walls. Values in, values out.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "nav/free_space.hpp"
#include "nav/geometry.hpp"

namespace planning {

// What the scanner can image (paper 3.1.1). Angles in degrees as in the config.
struct SensorLimits {
  double range_min_m = 1.0;
  double range_max_m = 100.0;
  double grazing_max_deg = 70.0;  // Between the beam and the surface normal.
  double fov_deg = 360.0;         // Horizontal field of view, centred on the heading.
};

// A straight piece of obstacle boundary; the free side is on the right of a -> b... see cover.cpp.
struct Wall {
  nav::PointMm a, b;
  bool target = true;  // Counts for coverage; occludes either way.
};

// A part of walls[wall], in metres from its end a.
struct WallPiece {
  int wall{};
  double from_m{};
  double to_m{};
};

struct Candidate {
  nav::PointMm position;
  double heading_rad{};
};

struct Station {
  Candidate at;
  std::vector<WallPiece> sees;  // Target pieces only.
  double sees_m{};
  double adds_m{};     // New when it was chosen.
  double overlaps_m{}; // Already seen when it was chosen.
};

enum class Excluded { occluded, range_max, range_min, grazing, field_of_view, overlap, gain, goal };
std::string_view name(Excluded reason);

struct UncoveredPiece {
  WallPiece piece;
  Excluded reason{};
};

struct CoverConfig {
  int candidates = 1000;
  double coverage_goal = 0.98;  // Share of the coverable target length.
  double gain_min = 0.02;       // Stop when the next view adds less than this share of the target.
  double overlap_min = 0.2;     // Share of what a station sees that must be seen already.
};

struct CoverPlan {
  std::vector<Candidate> candidates;
  std::vector<Station> stations;  // In the order chosen.
  std::vector<UncoveredPiece> uncovered;
  double target_m{};     // All target wall of this area.
  double coverable_m{};  // What the candidates together can see.
  double covered_m{};
  std::string end;  // Why it stopped.
};

}  // namespace planning
