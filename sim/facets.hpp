// Triangles joined in pairs where they make one flat convex quadrilateral: larger things to hide
// behind.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "sim/mesh.hpp"

namespace sim {

struct Facet {
  int count = 0;  // Of corners: 3 or 4, in order around it.
  std::array<Eigen::Vector3d, 4> corners_m;
  Eigen::Vector3d normal;                 // Zero when the facet has no area.
  std::array<Eigen::Vector3d, 4> inward;  // Unit, in the plane, per edge from corner i to i + 1.
};

struct Facets {
  std::vector<Facet> all;
  std::vector<std::uint32_t> of_triangle;  // Index of the facet that holds each triangle.
};

Facets join_facets(const Mesh& mesh);

}  // namespace sim
