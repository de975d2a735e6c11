#include "planning/near_walls.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "nav/segment_distance.hpp"

namespace planning {
namespace {

using Eigen::Vector2d;

double distance_m(const Vector2d& point_m, const WallLine& line) {
  const Vector2d along_m = line.W_to_m - line.W_from_m, to_m = point_m - line.W_from_m;
  const double length2 = along_m.squaredNorm();
  const double share = length2 > 0 ? std::clamp(to_m.dot(along_m) / length2, 0.0, 1.0) : 0.0;
  return (to_m - share * along_m).norm();
}

// Where each has its ends on both sides of the other. Touching ends have the distance 0 anyway.
bool cross_each_other(const WallLine& a, const WallLine& b) {
  const auto apart = [](const WallLine& line, const Vector2d& p, const Vector2d& q) {
    const Vector2d along = line.W_to_m - line.W_from_m;
    return nav::cross2(along, p - line.W_from_m) * nav::cross2(along, q - line.W_from_m) < 0;
  };
  return apart(a, b.W_from_m, b.W_to_m) && apart(b, a.W_from_m, a.W_to_m);
}

double distance_m(const WallLine& a, const WallLine& b) {
  if (cross_each_other(a, b)) return 0;
  return std::min({distance_m(a.W_from_m, b), distance_m(a.W_to_m, b), distance_m(b.W_from_m, a),
                   distance_m(b.W_to_m, a)});
}

}  // namespace

NearWalls::NearWalls(const VoxelGrid& grid, const Eigen::Isometry3d& T_W_S, double offset_max_m,
                     const InsertConfig& config)
    : grid_(grid), margin_m_(config.walls_margin_m) {
  if (!(margin_m_ >= 0) || !std::isfinite(margin_m_))
    throw std::invalid_argument("scan limits: walls_margin_m must be 0 or more");
  constexpr double kLatticeVoxels = 1.0 / 256;  // Many times what the lattice rounds.
  const double reach_m =
      config.range_min_m + offset_max_m + margin_m_ + kLatticeVoxels * grid.voxel_m;
  const Vector2d W_scanner_m = T_W_S.translation().head<2>();
  for (const WallLine& wall : config.walls)
    if (distance_m(W_scanner_m, wall) <= reach_m) near_.push_back(wall);
}

Eigen::Vector2d NearWalls::W_at_m(const LatticePoint& p) const {
  const double step_m = grid_.voxel_m / (1 << kLatticeShift);
  return grid_.W_min_m.head<2>() +
         step_m * Vector2d(static_cast<double>(p.x), static_cast<double>(p.y));
}

bool NearWalls::meets(const LatticePoint& from, const LatticePoint& to) const {
  const WallLine way{W_at_m(from), W_at_m(to)};
  return std::ranges::any_of(
      near_, [&](const WallLine& wall) { return distance_m(way, wall) <= margin_m_; });
}

}  // namespace planning
