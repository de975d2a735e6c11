#include "sim/surface_truth.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <stdexcept>

#include "sim/facets.hpp"
#include "sim/parallel.hpp"
#include "sim/position_tree.hpp"

namespace sim {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;

constexpr double kNudge_m = 1e-3;
constexpr std::size_t kChunk = 256;  // Voxels; each chunk starts without memory of others.

// The samples of one triangle in one voxel, and a rectangle in their plane that holds them.
struct Patch {
  std::span<const SurfaceSample> samples;
  Vector3d normal;
  std::array<Vector3d, 4> corners;
  AlignedBox3d box;
};

constexpr double kMargin_m = 1e-3;  // Of a facet: leaves its edges to Embree.

bool crosses(const Facet& facet, const Vector3d& point) {
  for (int i = 0; i < facet.count; ++i)
    if (!(facet.inward[i].dot(point - facet.corners_m[i]) >= kMargin_m)) return false;
  return true;
}

// Whether a facet crosses every segment between the patch and a position or a box. That holds when
// it crosses every segment between their corners: for a fixed end the crossing point is a
// projective image of the other end, so it stays in the hull of the corners' images.
bool shadows(const Facet& facet, const Patch& patch, const Vector3d& position) {
  const double beyond = facet.normal.dot(position - facet.corners_m[0]);
  if (std::abs(beyond) < kMargin_m) return false;
  const double side = beyond > 0 ? -1 : 1;  // The patch's.
  for (const Vector3d& a : patch.corners) {
    const double before = facet.normal.dot(a - facet.corners_m[0]);
    if (side * before < 2 * kNudge_m) return false;
    if (!crosses(facet, a + (position - a) * (before / (before - beyond)))) return false;
  }
  return true;
}

bool shadows(const Facet& facet, const Patch& patch, const AlignedBox3d& box) {
  const int corners = box.min().z() == box.max().z() ? 4 : 8;  // The lower ones come first.
  for (int i = 0; i < corners; ++i)
    if (!shadows(facet, patch, Vector3d(box.corner(static_cast<AlignedBox3d::CornerType>(i)))))
      return false;
  return true;
}

struct Judge {
  const Mesh& mesh;
  const Scene& scene;
  const TruthGrid& grid;
  const TruthLimits& limits;
  const PositionTree& positions;
  const Facets& facets;
  std::span<const Vector3d> stations;
};

// Searches for one visible pair per voxel. Remembers what helped the voxel before: useful facets
// and the last position with a view, which change how fast an answer comes and never the answer.
class Search {
 public:
  explicit Search(const Judge& judge)
      : judge_(judge),
        cos_grazing_(std::cos(judge.limits.grazing_max_rad)),
        sin_low_(std::sin(judge.limits.elevation_min_rad)),
        sin_high_(std::sin(judge.limits.elevation_max_rad)) {}

  bool visible(std::span<const SurfaceSample> samples, bool seen) {
    make_patches(samples);
    if (witness_ && any_sees(*witness_)) return true;
    if (seen && seen_from_a_station()) return true;
    if (judge_.positions.empty()) return false;
    for (const Patch& patch : patches_)
      if (search(patch, 0)) return true;
    return false;
  }

 private:
  Vector3d point(const SurfaceSample& sample) const {
    return judge_.grid.W_min_m + sample.W_point_m.cast<double>();
  }

  void make_patches(std::span<const SurfaceSample> samples) {
    patches_.clear();
    for (std::size_t first = 0; first < samples.size();) {
      std::size_t last = first;
      while (last < samples.size() && samples[last].triangle == samples[first].triangle) ++last;
      patches_.push_back(make_patch(samples.subspan(first, last - first)));
      first = last;
    }
  }

  Patch make_patch(std::span<const SurfaceSample> samples) const {
    Patch patch;
    patch.samples = samples;
    const auto& t = judge_.mesh.triangles[samples[0].triangle];
    const auto& vertices = judge_.mesh.W_vertices_m;
    const Vector3d edge = vertices[t[1]] - vertices[t[0]];
    patch.normal = edge.cross(vertices[t[2]] - vertices[t[0]]).normalized();
    const Vector3d u = edge.normalized();
    const Vector3d v = patch.normal.cross(u);
    const Vector3d origin = point(samples[0]);
    Eigen::AlignedBox2d flat;
    for (const SurfaceSample& sample : samples) {
      const Vector3d from_origin = point(sample) - origin;
      flat.extend(Eigen::Vector2d(from_origin.dot(u), from_origin.dot(v)));
    }
    for (int i = 0; i < 4; ++i) {
      const Eigen::Vector2d c = flat.corner(static_cast<Eigen::AlignedBox2d::CornerType>(i));
      patch.corners[i] = origin + c.x() * u + c.y() * v;
      patch.box.extend(patch.corners[i]);
    }
    return patch;
  }

  bool within_limits(const Patch& patch, const Vector3d& at, const Vector3d& position) const {
    const Vector3d way = position - at;
    const double length_m = way.norm();
    return length_m >= judge_.limits.range_min_m && length_m <= judge_.limits.range_max_m &&
           -way.z() >= sin_low_ * length_m && -way.z() <= sin_high_ * length_m &&
           std::abs(patch.normal.dot(way)) >= cos_grazing_ * length_m;
  }

  // Some sample of the patch from this position; `sights_` collects full packets.
  bool sees(const Patch& patch, const Vector3d& position) {
    for (const SurfaceSample& sample : patch.samples) {
      const Vector3d at = point(sample);
      if (!within_limits(patch, at, position)) continue;
      sights_.push_back({at, position});
      if (sights_.size() == kPacket && look()) return true;
    }
    return false;
  }

  // Whether something is seen along the collected lines.
  bool look() {
    const int found = judge_.scene.first_clear(sights_, kNudge_m);
    if (found >= 0) witness_ = sights_[static_cast<std::size_t>(found)].to;
    sights_.clear();
    return found >= 0;
  }

  bool any_sees(const Vector3d& position) {
    return std::any_of(patches_.begin(), patches_.end(),
                       [&](const Patch& patch) { return sees(patch, position); }) ||
           look();
  }

  bool seen_from_a_station() {
    return std::any_of(judge_.stations.begin(), judge_.stations.end(),
                       [&](const Vector3d& position) { return any_sees(position); });
  }

  bool search(const Patch& patch, int index) {
    const PositionTree::Node& node = judge_.positions.node(index);
    if (out_of_limits(patch, node.box) || in_shadow(patch, node.box)) return false;
    if (node.leaf()) {
      for (const Vector3d& position : judge_.positions.of(node))
        if (!in_shadow(patch, position) && sees(patch, position)) return true;
      return look();
    }
    const auto distance = [&](int child) {
      return judge_.positions.node(child).box.squaredExteriorDistance(patch.box.center());
    };
    const auto [low, high] = node.children;
    const bool high_first = distance(high) < distance(low);
    return search(patch, high_first ? high : low) || search(patch, high_first ? low : high);
  }

  // No pair of a sample and a position in the box can be within the sensor's limits.
  bool out_of_limits(const Patch& patch, const AlignedBox3d& box) const {
    const double near_m = patch.box.exteriorDistance(box);
    const AlignedBox3d both = patch.box.merged(box);
    if (near_m > judge_.limits.range_max_m) return true;
    if (both.diagonal().norm() < judge_.limits.range_min_m) return true;
    double height_max_m = 0;
    for (int i = 0; i < 8; ++i) {
      const Vector3d corner = box.corner(static_cast<AlignedBox3d::CornerType>(i));
      height_max_m = std::max(height_max_m, std::abs(patch.normal.dot(corner - patch.corners[0])));
    }
    if (height_max_m + kNudge_m < cos_grazing_ * near_m) return true;
    const double far_flat_m = both.diagonal().head<2>().norm();
    const double below_m = box.min().z() - patch.box.max().z();  // The surface below the scanner.
    const double above_m = patch.box.min().z() - box.max().z();
    return too_steep(below_m, far_flat_m, -judge_.limits.elevation_min_rad) ||
           too_steep(above_m, far_flat_m, judge_.limits.elevation_max_rad);
  }

  static bool too_steep(double height_m, double flat_m, double limit_rad) {
    if (height_m <= 0 || limit_rad <= 0 || limit_rad >= std::numbers::pi / 2) return false;
    return height_m > flat_m * std::tan(limit_rad) + kNudge_m;
  }

  // One facet stands between the whole patch and the whole box, or a position.
  bool in_shadow(const Patch& patch, const AlignedBox3d& box) {
    return in_shadow(patch, box, box.center());
  }
  bool in_shadow(const Patch& patch, const Vector3d& position) {
    return in_shadow(patch, position, position);
  }

  template <class Place>
  bool in_shadow(const Patch& patch, const Place& place, const Vector3d& middle) {
    for (auto blocker = blockers_.begin(); blocker != blockers_.end(); ++blocker)
      if (shadows(**blocker, patch, place)) {
        std::rotate(blockers_.begin(), blocker, blocker + 1);
        return true;
      }
    const Vector3d from = point(patch.samples[patch.samples.size() / 2]);
    const Vector3d way = middle - from;
    const double length_m = way.norm();
    if (length_m < 2 * kNudge_m) return false;
    const auto hit = judge_.scene.cast(from, way / length_m, kNudge_m, length_m);
    if (!hit) return false;
    const Facet& blocker = judge_.facets.all[judge_.facets.of_triangle[hit->triangle]];
    if (!shadows(blocker, patch, place)) return false;
    if (blockers_.size() == kBlockersMax) blockers_.pop_back();
    blockers_.insert(blockers_.begin(), &blocker);
    return true;
  }

  static constexpr std::size_t kBlockersMax = 6;
  static constexpr std::size_t kPacket = 16;

  const Judge& judge_;
  const double cos_grazing_, sin_low_, sin_high_;
  std::vector<Patch> patches_;
  std::vector<const Facet*> blockers_;
  std::vector<Sight> sights_;
  std::optional<Vector3d> witness_;
};

struct VoxelRange {
  std::size_t first{}, last{};  // Of the samples.
  TruthVoxel voxel;
  bool seen{};
};

std::vector<VoxelRange> surface_voxels(const std::vector<SurfaceSample>& samples,
                                       const TruthGrid& grid,
                                       const std::function<bool(int, int, int)>& seen_occupied) {
  std::vector<VoxelRange> voxels;
  for (std::size_t first = 0; first < samples.size();) {
    std::size_t last = first;
    while (last < samples.size() && samples[last].voxel == samples[first].voxel) ++last;
    const std::uint64_t index = samples[first].voxel;
    const auto nx = static_cast<std::uint64_t>(grid.nx);
    const auto ny = static_cast<std::uint64_t>(grid.ny);
    const TruthVoxel voxel{static_cast<int>(index % nx), static_cast<int>(index / nx % ny),
                           static_cast<int>(index / nx / ny)};
    voxels.push_back({first, last, voxel, seen_occupied(voxel.x, voxel.y, voxel.z)});
    first = last;
  }
  return voxels;
}

}  // namespace

SurfaceTruth judge_surface(const Mesh& mesh, const Scene& scene, const TruthGrid& grid,
                           const TruthLimits& limits,
                           std::span<const Vector3d> W_scanner_positions_m, std::size_t stations,
                           const std::function<bool(int, int, int)>& seen_occupied, int threads) {
  if (!(limits.range_min_m >= 0) || !(limits.range_max_m > limits.range_min_m) ||
      !(limits.grazing_max_rad > 0) || stations > W_scanner_positions_m.size())
    throw std::invalid_argument("judge_surface: limits or stations make no sense");
  const auto samples = sample_surface(mesh, grid);
  const auto voxels = surface_voxels(samples, grid, seen_occupied);
  const PositionTree positions(W_scanner_positions_m);
  const Facets facets = join_facets(mesh);
  const Judge judge{
      mesh, scene, grid, limits, positions, facets, W_scanner_positions_m.first(stations)};
  std::vector<char> visible(voxels.size());
  for_each_chunk((voxels.size() + kChunk - 1) / kChunk, threads, [&](std::size_t chunk) {
    Search search(judge);
    for (std::size_t i = chunk * kChunk; i < std::min(voxels.size(), (chunk + 1) * kChunk); ++i)
      visible[i] = search.visible(
          std::span(samples).subspan(voxels[i].first, voxels[i].last - voxels[i].first),
          voxels[i].seen);
  });
  SurfaceTruth truth;
  truth.surface = voxels.size();
  for (std::size_t i = 0; i < voxels.size(); ++i) {
    truth.visible += visible[i] ? 1 : 0;
    truth.visible_seen += visible[i] && voxels[i].seen ? 1 : 0;
    truth.seen_not_visible += !visible[i] && voxels[i].seen ? 1 : 0;
    if (visible[i] && !voxels[i].seen) truth.missed.push_back(voxels[i].voxel);
  }
  return truth;
}

}  // namespace sim
