// The steps of the registration, for registration.cpp and its tests.
#pragma once

#include <vector>

#include "nav/registration/range_image.hpp"
#include "nav/registration/registration.hpp"

namespace nav {

struct PreparedScan::Parts {
  std::vector<Surface> levels;  // As RegistrationConfig::levels.
  RangeImage seen;
};

// A pair that pulls: the reading's point as it lies now, and the plane it should lie in.
struct PlanePair {
  Eigen::Vector3d point_m, normal;
  double residual_m;  // Along the normal.
};

// Nearest points of the reference that have a normal, within reach; in the order of the points.
std::vector<PlanePair> plane_pairs(const Surface& reference, const Points& reading,
                                   std::size_t points_max, const Eigen::Isometry3d& pose,
                                   double reach_m, const RunPieces& run);

// Gauss-Newton's equations H motion = -g about `centre`, divided by the weights' sum, with
// rotations measured at `radius_m`: everything in metres.
struct PlaneEquations {
  Matrix6d H = Matrix6d::Zero();
  Vector6d g = Vector6d::Zero();
  Eigen::Vector3d centre_m = Eigen::Vector3d::Zero();
  double radius_m = 1;
  double weight{};
  double sigma_m{};           // Robust, of the residuals.
  double rms_m{};             // Of those that the kernel keeps.
  std::size_t pairs{};        // That it keeps ...
  std::size_t pairs_asked{};  // ... of so many.
};
PlaneEquations plane_equations(const std::vector<PlanePair>& pairs,
                               const RegistrationConfig& config, const RunPieces& run);

// Solves them; directions weaker than free_below stay where they are. Moves the pose; returns the
// step as translation of the centre (m) and rotation (rad).
Vector6d plane_step(const PlaneEquations& equations, double free_below, Eigen::Isometry3d& pose);

}  // namespace nav
