// Point clouds made ready for registration: thinned, indexed, with normals.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "nav/registration/pieces.hpp"

namespace nav {

using Points = std::vector<Eigen::Vector3f>;  // Metres.

// Without points that are not finite, that lie within near_m of the origin (an empty return is
// often written as 0 0 0), or farther than far_m from it. far_m <= 20 km.
Points usable_points(std::span<const Eigen::Vector3f> points_m, double near_m, double far_m);

// The mean of the points in every occupied voxel, ordered by voxel. points_m within 20 km of the
// origin; voxel_m >= 0.02.
Points thinned(std::span<const Eigen::Vector3f> points_m, double voxel_m);

struct Neighbour {
  std::uint32_t index{};
  float distance2_m2{};
};

// Nearest neighbours among fixed points (a k-d tree). Many may ask at once.
class NearestPoints {
 public:
  explicit NearestPoints(Points points_m);
  ~NearestPoints();
  NearestPoints(NearestPoints&&) noexcept;
  NearestPoints& operator=(NearestPoints&&) noexcept;

  const Points& points_m() const;
  // False where there is none nearer than `within_m`.
  bool nearest(const Eigen::Vector3f& to, float within_m, Neighbour& found) const;
  // The nearest ones, nearest first; returns how many were found.
  std::size_t nearest(const Eigen::Vector3f& to, std::span<Neighbour> found) const;

 private:
  struct Tree;
  std::unique_ptr<Tree> tree_;
};

// A cloud whose points know the surface around them.
struct Surface {
  NearestPoints points;
  // Of length 1, towards the origin; zero where the points around do not show one plane (an edge, a
  // single line of a scanner, leaves).
  std::vector<Eigen::Vector3f> normals;
};

struct NormalConfig {
  std::size_t neighbours = 12;  // At most 32, the point among them.
  double flat_max = 0.4;        // Thickness over width beyond which it is not a plane.
  double line_max = 0.1;        // Width over length below which it is only a line.
};

Surface make_surface(Points points_m, const NormalConfig& config, const RunPieces& run = {});

}  // namespace nav
