// A mesh made ready for ray casting (Embree). Both sides of every triangle are solid.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "sim/mesh.hpp"

struct RTCDeviceTy;
struct RTCSceneTy;

namespace sim {

struct Hit {
  double distance_m{};
  std::uint32_t triangle{};
};

struct Sight {
  Eigen::Vector3d from, to;
};

// Answers do not depend on how many threads ask. Single precision inside, relative to the middle of
// the mesh: 0.01 mm at a few hundred metres, wherever W has its origin.
class Scene {
 public:
  // Throws std::invalid_argument for an empty mesh, std::runtime_error when Embree fails.
  explicit Scene(const Mesh& mesh);

  // First surface from `W_from` along `W_direction` (unit) between near_m and far_m.
  std::optional<Hit> cast(const Eigen::Vector3d& W_from, const Eigen::Vector3d& W_direction,
                          double near_m, double far_m) const;

  // The first of at most 16 segments that no surface crosses, near_m from its first end aside; -1
  // when all are crossed. Throws std::length_error above 16.
  int first_clear(std::span<const Sight> W_segments, double near_m) const;

  // Every surface straight below a point within depth_m: their heights in W, highest first.
  std::vector<double> heights_below(const Eigen::Vector3d& W_from, double depth_m) const;

  // Horizontal distance from a point to the nearest surface between two heights, at most limit_m.
  // Exact: no thin pole slips through.
  double clearance_m(const Eigen::Vector2d& W_point, double low_z_m, double high_z_m,
                     double limit_m) const;

  std::size_t triangle_count() const { return triangles_.size(); }
  std::array<Eigen::Vector3d, 3> corners_m(std::uint32_t triangle) const;
  const Eigen::Vector3d& origin_m() const { return W_origin_m_; }  // Of Embree's coordinates.
  RTCSceneTy* embree() const { return scene_.get(); }

 private:
  // The scene before its device: Embree reads the device once more after a scene that was the last
  // to hold it.
  struct Release {
    void operator()(RTCDeviceTy* device) const;
    void operator()(RTCSceneTy* scene) const;
  };

  Eigen::Vector3d W_origin_m_;
  std::vector<Eigen::Vector3d> W_vertices_m_;
  std::vector<std::array<std::uint32_t, 3>> triangles_;
  std::unique_ptr<RTCDeviceTy, Release> device_;
  std::unique_ptr<RTCSceneTy, Release> scene_;
};

}  // namespace sim
