// The generalised Voronoi diagram of a free space (paper 5.2.1), as a graph of straight edges.
#pragma once

#include <vector>

#include "nav/geometry.hpp"
#include "nav/noding.hpp"

namespace nav {

struct MedialAxis {
  struct Edge {
    int a{}, b{};  // Nodes.
  };
  std::vector<Eigen::Vector2d> nodes_m;
  std::vector<double> clearance_m;    // Of each node: distance to the nearest outline.
  std::vector<Edge> edges;            // Along an edge the least clearance is at one of its ends.
  std::vector<OutlinePiece> outline;  // What it is the diagram of.
};

struct MedialConfig {
  double clearance_min_m = 0.5;  // Parts of the diagram closer to an outline are cut off.
  double arc_error_m = 0.01;     // Parabolic arcs become chords that stray this far at most.
  double step_max_m = 1.0;       // No edge is longer.
};

// Builds the diagram of the edges of `free_space` (coordinates within kCoordinateMax) with
// Boost.Polygon and keeps what lies inside. O(n log n).
MedialAxis medial_axis(const Polygons& free_space, const MedialConfig& config);

}  // namespace nav
