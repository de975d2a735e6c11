// The ground of models that come without one: shells cut off at their feet.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <span>

#include "sim/mesh.hpp"

namespace sim {

// What ensure_ground found and did.
struct GroundReport {
  std::size_t samples = 0;
  std::size_t with_ground = 0;  // A surface lies within 0.5 m of the expected height.
  bool added = false;           // A level plane was added ...
  double added_z_m = 0;         // ... at this height in W.
};

// Adds one level plane over W_box_m unless at least half of the samples have a surface within 0.5 m
// above or below them. A sample is a point of the ground where a robot or a person may stand, at
// the height expected there; the plane gets the median of these heights. Throws
// std::invalid_argument without samples or with an empty box.
GroundReport ensure_ground(Mesh& mesh, std::span<const Eigen::Vector3d> W_ground_samples_m,
                           const Eigen::AlignedBox2d& W_box_m);

// The most common foot height of a model without ground, in W: the level lowest edges of upright
// faces vote by their length in bins of 0.25 m, unless another surface lies below them (window
// sills, walls on ledges). Only the lowest 30 % of the model (at least 3 m) votes; the result is
// the weighted mean of the best bin and its neighbours. Empty when no face has such a foot.
std::optional<double> estimate_ground_z_m(const Mesh& mesh);

}  // namespace sim
