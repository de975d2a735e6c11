// A room whose ranges can be computed by hand, and other small sites.
#pragma once

#include "sim/mesh.hpp"

namespace sim_test {

inline void add_box(sim::Mesh& mesh, const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  const auto at = [&](int x, int y, int z) {
    return Eigen::Vector3d(x ? high.x() : low.x(), y ? high.y() : low.y(), z ? high.z() : low.z());
  };
  for (const int end : {0, 1}) {
    mesh.add_quad(at(end, 0, 0), at(end, 1, 0), at(end, 1, 1), at(end, 0, 1));
    mesh.add_quad(at(0, end, 0), at(1, end, 0), at(1, end, 1), at(0, end, 1));
    mesh.add_quad(at(0, 0, end), at(1, 0, end), at(1, 1, end), at(0, 1, end));
  }
}

// Floor at z = 0.
inline sim::Mesh room(double half_width_m, double half_depth_m, double height_m) {
  sim::Mesh mesh;
  add_box(mesh, {-half_width_m, -half_depth_m, 0}, {half_width_m, half_depth_m, height_m});
  return mesh;
}

inline sim::Mesh plain(double half_width_m) {
  sim::Mesh mesh;
  const double w = half_width_m;
  mesh.add_quad({-w, -w, 0}, {w, -w, 0}, {w, w, 0}, {-w, w, 0});
  return mesh;
}

}  // namespace sim_test
