// A triangle model built from closed solids and open ground surfaces. Metres in W, z up; what is
// kept is whole millimetres, so that the file is the same on every machine.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "tools/make_sites_triangulate.hpp"

namespace sites {

// Vertices in metres, closed without repeating the first.
using Path = std::vector<Eigen::Vector2d>;
using Path3 = std::vector<Eigen::Vector3d>;

// An area with holes; the sense of rotation does not matter.
struct Shape {
  Path outer;
  std::vector<Path> holes;
};

// A cut through a solid: a shape in the x-y plane of its own frame.
struct Section {
  Shape shape;
  Eigen::Isometry3d T_W_section = Eigen::Isometry3d::Identity();
};

// One solid (closed, faces outward) or one surface (open, faces up or to the free side).
struct Solid {
  std::string part;
  bool closed{};
  std::vector<std::array<std::int64_t, 3>> vertices_mm;
  std::vector<Triangle> triangles;
};

class Model {
 public:
  // A closed solid through the sections, which follow one another along their own +z and have
  // equally many vertices and holes. Edges may shrink to a point. Throws std::logic_error when the
  // result is inside out.
  void loft(const std::string& part, const std::vector<Section>& sections);
  // An open horizontal surface that faces up.
  void surface(const std::string& part, const Shape& shape, double z_m);
  // An open band between two closed rings with equally many vertices. It faces the side from which
  // `low` runs clockwise and lies above `high`'s left: the inside of counter-clockwise rings.
  void band_facing_inside(const std::string& part, const Path3& low, const Path3& high);

  const std::vector<Solid>& solids() const { return solids_; }
  // Wavefront OBJ, one group per solid.
  std::string obj(const std::string& title) const;

 private:
  std::vector<Solid> solids_;
};

// "-12.345" for -12345.
std::string metres_text(std::int64_t millimetres);

}  // namespace sites
