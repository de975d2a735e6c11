#include "sim/facets.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <tuple>

namespace sim {
namespace {

using Eigen::Vector3d;

constexpr double kFlat_m = 1e-6;

Facet make_facet(int count, const std::array<Vector3d, 4>& corners) {
  Facet facet{count, corners, Vector3d::Zero(), {}};
  const Vector3d normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
  if (!(normal.norm() > 0)) return facet;
  facet.normal = normal.normalized();
  for (int i = 0; i < count; ++i)
    facet.inward[i] = facet.normal.cross(corners[(i + 1) % count] - corners[i]).normalized();
  return facet;
}

bool flat_and_convex(const Facet& facet) {
  if (facet.normal.isZero()) return false;
  for (int i = 0; i < facet.count; ++i) {
    if (std::abs(facet.normal.dot(facet.corners_m[i] - facet.corners_m[0])) > kFlat_m) return false;
    for (int k = 0; k < facet.count; ++k)
      if (facet.inward[i].dot(facet.corners_m[k] - facet.corners_m[i]) < -kFlat_m) return false;
  }
  return true;
}

using Point = std::tuple<double, double, double>;
using Edge = std::pair<Point, Point>;

Edge edge(const Vector3d& a, const Vector3d& b) {
  const Point p{a.x(), a.y(), a.z()};
  const Point q{b.x(), b.y(), b.z()};
  return {std::min(p, q), std::max(p, q)};
}

// The quadrilateral of two triangles that share the edge from corner `side` of the first.
std::optional<Facet> joined(const Facet& one, int side, const Facet& other) {
  const Vector3d& a = one.corners_m[side];
  const Vector3d& b = one.corners_m[(side + 1) % 3];
  for (int k = 0; k < 3; ++k) {
    const Vector3d& apex = other.corners_m[k];
    if (apex == a || apex == b) continue;
    const Facet quad = make_facet(4, {one.corners_m[(side + 2) % 3], a, apex, b});
    if (flat_and_convex(quad)) return quad;
  }
  return std::nullopt;
}

}  // namespace

Facets join_facets(const Mesh& mesh) {
  Facets facets;
  std::map<Edge, std::uint32_t> open;  // Single triangles by their edges.
  for (const auto& t : mesh.triangles) {
    const auto& v = mesh.W_vertices_m;
    const Facet single = make_facet(3, {v[t[0]], v[t[1]], v[t[2]], Vector3d::Zero()});
    std::optional<std::uint32_t> joined_to;
    for (int side = 0; side < 3 && !joined_to; ++side) {
      const auto found = open.find(edge(single.corners_m[side], single.corners_m[(side + 1) % 3]));
      if (found == open.end() || facets.all[found->second].count != 3) continue;
      if (const auto quad = joined(single, side, facets.all[found->second])) {
        facets.all[found->second] = *quad;
        joined_to = found->second;
      }
    }
    if (!joined_to) {
      joined_to = static_cast<std::uint32_t>(facets.all.size());
      facets.all.push_back(single);
      for (int side = 0; side < 3; ++side)
        open[edge(single.corners_m[side], single.corners_m[(side + 1) % 3])] = *joined_to;
    }
    facets.of_triangle.push_back(*joined_to);
  }
  return facets;
}

}  // namespace sim
