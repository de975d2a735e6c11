#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "sim/surface_truth.hpp"

namespace sim {
namespace {

constexpr double kSpacing_voxels = 0.25;
constexpr double kAreaMin_faces = 1.0 / 16;
constexpr std::size_t kSamplesMax = 200'000'000;

// Grid coordinates: voxels, from W_min_m.
using Polygon = std::vector<Eigen::Vector3d>;

Polygon clipped(const Polygon& polygon, int axis, double limit, double side) {
  Polygon kept;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Eigen::Vector3d& a = polygon[i];
    const Eigen::Vector3d& b = polygon[(i + 1) % polygon.size()];
    const double inside_a = side * (a[axis] - limit);
    const double inside_b = side * (b[axis] - limit);
    if (inside_a >= 0) kept.push_back(a);
    if ((inside_a > 0 && inside_b < 0) || (inside_a < 0 && inside_b > 0))
      kept.push_back(a + (b - a) * (inside_a / (inside_a - inside_b)));
  }
  return kept;
}

class Sampler {
 public:
  Sampler(const Mesh& mesh, const TruthGrid& grid)
      : mesh_(mesh), grid_(grid), size_(grid.nx, grid.ny, grid.nz) {}

  std::vector<SurfaceSample> sample() {
    for (std::uint32_t t = 0; t < mesh_.triangles.size(); ++t) {
      Polygon polygon;
      for (const std::uint32_t vertex : mesh_.triangles[t])
        polygon.push_back((mesh_.W_vertices_m[vertex] - grid_.W_min_m) / grid_.voxel_m);
      for (int axis = 0; axis < 3 && !polygon.empty(); ++axis)
        polygon = clipped(clipped(polygon, axis, 0, 1), axis, size_[axis], -1);
      for (std::size_t i = 2; i < polygon.size(); ++i)
        sample_triangle(t, polygon[0], polygon[i - 1], polygon[i]);
    }
    std::stable_sort(samples_.begin(), samples_.end(),
                     [](const auto& a, const auto& b) { return a.voxel < b.voxel; });
    keep_surface_voxels();
    return std::move(samples_);
  }

 private:
  // Rows parallel to the longest side, each cut into equal pieces: no sliver is sampled too
  // densely.
  void sample_triangle(std::uint32_t t, Eigen::Vector3d a, Eigen::Vector3d b, Eigen::Vector3d c) {
    if ((c - b).squaredNorm() > (b - a).squaredNorm()) std::tie(a, b, c) = std::tuple(b, c, a);
    if ((c - a).squaredNorm() > (b - a).squaredNorm()) std::tie(a, b, c) = std::tuple(c, a, b);
    const double base = (b - a).norm();
    const double area = (b - a).cross(c - a).norm() / 2;
    if (!(area > 0)) return;
    const auto rows = count(2 * area / base);
    for (std::size_t row = 0; row < rows; ++row) {
      const double up = (static_cast<double>(row) + 0.5) / static_cast<double>(rows);
      const auto pieces = count(base * (1 - up));
      const double share = 2 * (1 - up) / static_cast<double>(rows * pieces);
      for (std::size_t piece = 0; piece < pieces; ++piece) {
        const double along = (static_cast<double>(piece) + 0.5) / static_cast<double>(pieces);
        add(t, a + up * (c - a) + (1 - up) * along * (b - a), area * share);
      }
    }
  }

  static std::size_t count(double length) {
    return std::max<std::size_t>(1, static_cast<std::size_t>(std::ceil(length / kSpacing_voxels)));
  }

  void add(std::uint32_t t, const Eigen::Vector3d& point, double area) {
    const auto x = static_cast<std::int64_t>(std::floor(point.x()));
    const auto y = static_cast<std::int64_t>(std::floor(point.y()));
    const auto z = static_cast<std::int64_t>(std::floor(point.z()));
    if (x < 0 || y < 0 || z < 0 || x >= grid_.nx || y >= grid_.ny || z >= grid_.nz) return;
    if (samples_.size() >= kSamplesMax)
      throw std::invalid_argument("the surface has more than 2e8 samples at this voxel size");
    const std::int64_t voxel = x + grid_.nx * (y + grid_.ny * z);
    samples_.push_back({static_cast<std::uint64_t>(voxel), t, (point * grid_.voxel_m).cast<float>(),
                        static_cast<float>(area * grid_.voxel_m * grid_.voxel_m)});
  }

  void keep_surface_voxels() {
    const double area_min_m2 = kAreaMin_faces * grid_.voxel_m * grid_.voxel_m;
    auto kept = samples_.begin();
    for (auto first = samples_.begin(); first != samples_.end();) {
      double area_m2 = 0;
      auto last = first;
      for (; last != samples_.end() && last->voxel == first->voxel; ++last)
        area_m2 += last->area_m2;
      if (area_m2 >= area_min_m2) kept = std::move(first, last, kept);
      first = last;
    }
    samples_.erase(kept, samples_.end());
  }

  const Mesh& mesh_;
  const TruthGrid& grid_;
  const Eigen::Vector3d size_;
  std::vector<SurfaceSample> samples_;
};

}  // namespace

std::vector<SurfaceSample> sample_surface(const Mesh& mesh, const TruthGrid& grid) {
  if (!(grid.voxel_m > 0) || grid.nx <= 0 || grid.ny <= 0 || grid.nz <= 0)
    throw std::invalid_argument("a truth grid needs positive sizes");
  return Sampler(mesh, grid).sample();
}

}  // namespace sim
