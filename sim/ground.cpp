#include "sim/ground.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>
#include <vector>

#include "sim/scene.hpp"

namespace sim {
namespace {

constexpr double kReach_m = 0.5;
constexpr double kBin_m = 0.25;
constexpr double kLevel_m = 0.05;           // A foot edge rises less than this.
constexpr double kUprightCosine_max = 0.3;  // Of the normal against the vertical.

double median_z_m(std::span<const Eigen::Vector3d> points) {
  std::vector<double> heights_m;
  for (const Eigen::Vector3d& point : points) heights_m.push_back(point.z());
  const auto middle = heights_m.begin() + static_cast<std::ptrdiff_t>(heights_m.size() / 2);
  std::nth_element(heights_m.begin(), middle, heights_m.end());
  return *middle;
}

struct Foot {
  double z_m{};
  double length_m{};
  Eigen::Vector3d W_middle_m;
};

// The level lowest edge of an upright triangle.
std::optional<Foot> foot(std::array<Eigen::Vector3d, 3> corner) {
  const Eigen::Vector3d normal = (corner[1] - corner[0]).cross(corner[2] - corner[0]);
  if (!(std::abs(normal.z()) <= kUprightCosine_max * normal.norm()) || normal.isZero(0))
    return std::nullopt;
  std::sort(corner.begin(), corner.end(),
            [](const auto& a, const auto& b) { return a.z() < b.z(); });
  if (corner[1].z() - corner[0].z() > kLevel_m) return std::nullopt;
  const Eigen::Vector3d middle = (corner[0] + corner[1]) / 2;
  return Foot{middle.z(), (corner[1] - corner[0]).norm(), middle};
}

// A wall on a ledge or a window sill has its foot above other surfaces; the ground has nothing
// below.
bool stands_on_something(const Scene& scene, const Foot& foot) {
  constexpr double kBelow_m = 0.1;
  return scene
      .cast(foot.W_middle_m - kBelow_m * Eigen::Vector3d::UnitZ(), -Eigen::Vector3d::UnitZ(), 0,
            1e4)
      .has_value();
}

}  // namespace

GroundReport ensure_ground(Mesh& mesh, std::span<const Eigen::Vector3d> W_ground_samples_m,
                           const Eigen::AlignedBox2d& W_box_m) {
  if (W_ground_samples_m.empty() || W_box_m.isEmpty())
    throw std::invalid_argument("ensure_ground needs samples and a box");
  GroundReport report;
  report.samples = W_ground_samples_m.size();
  if (!mesh.triangles.empty()) {
    const Scene scene(mesh);
    for (const Eigen::Vector3d& sample : W_ground_samples_m)
      if (scene.cast(sample + kReach_m * Eigen::Vector3d::UnitZ(), -Eigen::Vector3d::UnitZ(), 0,
                     2 * kReach_m))
        ++report.with_ground;
  }
  if (2 * report.with_ground >= report.samples) return report;
  report.added = true;
  report.added_z_m = median_z_m(W_ground_samples_m);
  const auto corner = [&](double x, double y) { return Eigen::Vector3d(x, y, report.added_z_m); };
  const Eigen::Vector2d low = W_box_m.min();
  const Eigen::Vector2d high = W_box_m.max();
  mesh.add_quad(corner(low.x(), low.y()), corner(high.x(), low.y()), corner(high.x(), high.y()),
                corner(low.x(), high.y()));
  return report;
}

std::optional<double> estimate_ground_z_m(const Mesh& mesh) {
  const Eigen::AlignedBox3d box = mesh.bounds_m();
  if (box.isEmpty()) return std::nullopt;
  const double top_m = box.min().z() + std::max(3.0, 0.3 * box.sizes().z());
  const Scene scene(mesh);
  std::vector<Foot> feet;
  std::map<long, double> votes;
  for (const auto& t : mesh.triangles) {
    const auto found =
        foot({mesh.W_vertices_m[t[0]], mesh.W_vertices_m[t[1]], mesh.W_vertices_m[t[2]]});
    if (!found || found->z_m > top_m || stands_on_something(scene, *found)) continue;
    feet.push_back(*found);
    votes[std::lround(found->z_m / kBin_m)] += found->length_m;
  }
  if (votes.empty()) return std::nullopt;
  const auto best = std::max_element(
      votes.begin(), votes.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
  double sum_m2 = 0;
  double length_m = 0;
  for (const Foot& one : feet)
    if (std::abs(std::lround(one.z_m / kBin_m) - best->first) <= 1) {
      sum_m2 += one.z_m * one.length_m;
      length_m += one.length_m;
    }
  return length_m > 0 ? std::optional(sum_m2 / length_m) : std::nullopt;
}

}  // namespace sim
