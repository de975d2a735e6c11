#include "nav/scan_match.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <unordered_set>

#include "nav/linear.hpp"

namespace nav {
namespace {

constexpr std::int32_t kNone = -1;

Eigen::Rotation2Dd turn_of(const hal::Pose2& pose) {
  return Eigen::Rotation2Dd(pose.heading_rad);
}

}  // namespace

std::vector<WallMap::Wall> WallMap::drawn(std::span<const WallSegment> walls, double spacing_m) {
  std::vector<Wall> points;
  for (const WallSegment& wall : walls) {
    const Eigen::Vector2d along = wall.to_m - wall.from_m;
    const double length_m = along.norm();
    if (!std::isfinite(length_m) || length_m <= 0) continue;
    const int pieces = std::max(1, static_cast<int>(std::ceil(length_m / spacing_m)));
    for (int i = 0; i <= pieces; ++i)
      points.push_back({wall.from_m + along * (static_cast<double>(i) / pieces),
                        Eigen::Vector2d(-along.y(), along.x()) / length_m});
  }
  return points;
}

WallMap::WallMap(std::span<const WallSegment> walls, const WallMapConfig& config)
    : walls_(drawn(walls, config.spacing_m)) {
  index(config);
}

WallMap::WallMap(std::span<const WallSegment> walls, std::span<const Eigen::Vector2d> W_points_m,
                 const WallMapConfig& config)
    : WallMap(W_points_m, config) {
  std::vector<Wall> beside;
  for (const Wall& wall : drawn(walls, config.spacing_m)) {
    const Wall* shown = nearest(wall.point_m);
    if (shown == nullptr || (shown->point_m - wall.point_m).norm() > kShownM)
      beside.push_back(wall);
  }
  walls_.insert(walls_.end(), beside.begin(), beside.end());
  index(config);
}

WallMap::WallMap(std::span<const Eigen::Vector2d> W_points_m, const WallMapConfig& config) {
  std::unordered_set<std::uint64_t> taken;
  const double grain_m = config.cell_m / 4;
  for (const auto& p : W_points_m) {
    if (!p.allFinite() || p.cwiseAbs().maxCoeff() > 1e6) continue;
    const auto x = static_cast<std::int64_t>(std::floor(p.x() / grain_m));
    const auto y = static_cast<std::int64_t>(std::floor(p.y() / grain_m));
    const auto key =
        (static_cast<std::uint64_t>(x) << 32U) ^ (static_cast<std::uint64_t>(y) & 0xffffffffU);
    if (taken.insert(key).second) walls_.push_back({p, {0, 0}});
  }
  index(config);
  find_normals(config);
}

std::size_t WallMap::cell_of(const Eigen::Vector2d& W_point_m) const {
  const Eigen::Vector2d at = (W_point_m - corner_m_) / cell_m_;
  const bool inside = at.x() >= 0 && at.y() >= 0 && at.x() < static_cast<double>(columns_) &&
                      at.y() < static_cast<double>(rows_);
  if (!inside) return nearest_.size();
  return static_cast<std::size_t>(static_cast<std::int64_t>(at.y()) * columns_ +
                                  static_cast<std::int64_t>(at.x()));
}

const WallMap::Wall* WallMap::nearest(const Eigen::Vector2d& W_point_m) const {
  const std::size_t cell = cell_of(W_point_m);
  if (cell >= nearest_.size() || nearest_[cell] == kNone) return nullptr;
  return &walls_[static_cast<std::size_t>(nearest_[cell])];
}

// Each cell learns of near walls from its neighbours, row by row forth and back (8SED): the
// nearest, or one that is farther by a small part of a cell.
void WallMap::index(const WallMapConfig& config) {
  cell_m_ = config.cell_m;
  reach_m_ = config.reach_m;
  if (walls_.empty()) return;
  Eigen::Vector2d low = walls_[0].point_m, high = low;
  for (const Wall& wall : walls_) {
    low = low.cwiseMin(wall.point_m);
    high = high.cwiseMax(wall.point_m);
  }
  corner_m_ = low - Eigen::Vector2d::Constant(reach_m_);
  const Eigen::Vector2d size = (high - low) / cell_m_;
  const double margin = 2 * reach_m_ / cell_m_ + 2;
  if ((size.x() + margin) * (size.y() + margin) > static_cast<double>(config.cells_max))
    throw std::invalid_argument("the walls span too many cells: take larger cells");
  columns_ = static_cast<std::int64_t>(size.x() + margin);
  rows_ = static_cast<std::int64_t>(size.y() + margin);
  nearest_.assign(static_cast<std::size_t>(columns_ * rows_), kNone);

  const auto centre = [&](std::int64_t x, std::int64_t y) {
    return Eigen::Vector2d(corner_m_ + cell_m_ * Eigen::Vector2d(static_cast<double>(x) + 0.5,
                                                                 static_cast<double>(y) + 0.5));
  };
  const auto offer = [&](std::int64_t x, std::int64_t y, std::int32_t wall) {
    if (x < 0 || y < 0 || x >= columns_ || y >= rows_ || wall == kNone) return;
    std::int32_t& had = nearest_[static_cast<std::size_t>(y * columns_ + x)];
    const auto off_m = [&](std::int32_t one) {
      return (walls_[static_cast<std::size_t>(one)].point_m - centre(x, y)).norm();
    };
    if (off_m(wall) <= reach_m_ && (had == kNone || off_m(wall) < off_m(had))) had = wall;
  };
  for (std::size_t i = 0; i < walls_.size(); ++i) {
    const std::size_t cell = cell_of(walls_[i].point_m);
    const auto x = static_cast<std::int64_t>(cell) % columns_;
    offer(x, static_cast<std::int64_t>(cell) / columns_, static_cast<std::int32_t>(i));
  }
  const auto sweep = [&](std::int64_t x, std::int64_t y, std::int64_t back) {
    for (std::int64_t dy : {std::int64_t{0}, back})
      for (std::int64_t dx = -1; dx <= 1; ++dx) {
        const std::int64_t from_x = x + dx, from_y = y + dy;
        if (from_x < 0 || from_y < 0 || from_x >= columns_ || from_y >= rows_) continue;
        offer(x, y, nearest_[static_cast<std::size_t>(from_y * columns_ + from_x)]);
      }
  };
  for (std::int64_t y = 0; y < rows_; ++y) {
    for (std::int64_t x = 0; x < columns_; ++x) sweep(x, y, -1);
    for (std::int64_t x = columns_; x-- > 0;) sweep(x, y, -1);
  }
  for (std::int64_t y = rows_; y-- > 0;) {
    for (std::int64_t x = columns_; x-- > 0;) sweep(x, y, 1);
    for (std::int64_t x = 0; x < columns_; ++x) sweep(x, y, 1);
  }
}

// The line through the points around, where they are more of a line than of a heap.
void WallMap::find_normals(const WallMapConfig& config) {
  std::vector<std::vector<std::int32_t>> by_cell(nearest_.size());
  for (std::size_t i = 0; i < walls_.size(); ++i)
    by_cell[cell_of(walls_[i].point_m)].push_back(static_cast<std::int32_t>(i));
  const auto reach = static_cast<std::int64_t>(std::ceil(config.normal_m / cell_m_));
  for (Wall& wall : walls_) {
    const auto cell = static_cast<std::int64_t>(cell_of(wall.point_m));
    Eigen::Vector2d sum(0, 0);
    Eigen::Matrix2d products = Eigen::Matrix2d::Zero();
    int count = 0;
    for (std::int64_t dy = -reach; dy <= reach; ++dy)
      for (std::int64_t dx = -reach; dx <= reach; ++dx) {
        const std::int64_t x = cell % columns_ + dx, y = cell / columns_ + dy;
        if (x < 0 || y < 0 || x >= columns_ || y >= rows_) continue;
        for (const auto i : by_cell[static_cast<std::size_t>(y * columns_ + x)]) {
          const Eigen::Vector2d d = walls_[static_cast<std::size_t>(i)].point_m - wall.point_m;
          if (d.norm() > config.normal_m) continue;
          sum += d;
          products += d * d.transpose();
          ++count;
        }
      }
    if (count < 4) continue;
    const Axes<2> axes =
        axes_of(Eigen::Matrix2d(products / count - sum * sum.transpose() / (count * count)));
    const Eigen::Array2d length = axes.values.array().max(0).sqrt();
    if (length[0] < 0.4 * length[1]) wall.normal = axes.vectors.col(0);
  }
}

namespace {

struct Equations {
  Eigen::Matrix3d H = Eigen::Matrix3d::Zero();  // Per weight, rotations measured at radius_m.
  Eigen::Vector3d g = Eigen::Vector3d::Zero();
  double radius_m = 1, weight{}, sigma_m{};
};

struct Row {
  Eigen::Vector3d slope;
  double residual_m;
};

// One row a beam on a line, two on a point without one.
std::vector<Row> rows_of(const WallMap& map, std::span<const Eigen::Vector2d> B_points_m,
                         const hal::Pose2& pose, double reach_m, double radius_m) {
  std::vector<Row> rows;
  const Eigen::Matrix2d R = turn_of(pose).toRotationMatrix();
  for (const auto& B_point : B_points_m) {
    const Eigen::Vector2d arm = R * B_point;
    const Eigen::Vector2d off = pose.position_m + arm;
    const WallMap::Wall* wall = map.nearest(off);
    if (wall == nullptr) continue;
    const Eigen::Vector2d way = off - wall->point_m;
    if (way.norm() > reach_m) continue;
    const Eigen::Vector2d swing = Eigen::Vector2d(-arm.y(), arm.x()) / radius_m;
    const auto add = [&](const Eigen::Vector2d& normal) {
      rows.push_back({{normal.x(), normal.y(), normal.dot(swing)}, normal.dot(way)});
    };
    if (!wall->normal.isZero()) {
      add(wall->normal);
    } else {
      add({1, 0});
      add({0, 1});
    }
  }
  return rows;
}

Equations equations_of(const std::vector<Row>& rows, double radius_m, double noise_m,
                       const ScanMatchConfig& config) {
  Equations e;
  e.radius_m = radius_m;
  std::vector<double> sizes;
  for (const Row& row : rows) sizes.push_back(std::abs(row.residual_m));
  const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
  std::nth_element(sizes.begin(), middle, sizes.end());
  e.sigma_m = std::max(1.4826 * *middle, noise_m);
  const double scale2 = std::pow(config.kernel_scale * e.sigma_m, 2);
  for (const Row& row : rows) {
    const double w = std::pow(scale2 / (scale2 + row.residual_m * row.residual_m), 2);
    e.H += w * row.slope * row.slope.transpose();
    e.g += w * row.residual_m * row.slope;
    e.weight += w;
  }
  e.H /= e.weight;
  e.g /= e.weight;
  return e;
}

Eigen::Matrix3d covariance_of(const Equations& e, const ScanMatchConfig& config, bool& free) {
  const Axes<3> axes = axes_of(e.H);
  const double information = e.weight / config.correlated_beams / (e.sigma_m * e.sigma_m);
  Eigen::Matrix3d scaled = Eigen::Matrix3d::Zero();
  const double free_m = std::max(config.free_sigma_m, config.free_sigma_rad * e.radius_m);
  free = false;
  for (int i = 0; i < 3; ++i) {
    const bool held = axes.values[i] >= config.free_below;
    free = free || !held;
    const double variance = held ? 1 / (information * axes.values[i]) : free_m * free_m;
    scaled += variance * axes.vectors.col(i) * axes.vectors.col(i).transpose();
  }
  const Eigen::Vector3d unscale(1, 1, 1 / e.radius_m);
  Eigen::Matrix3d covariance = unscale.asDiagonal() * scaled * unscale.asDiagonal();
  covariance.diagonal() +=
      Eigen::Vector3d(config.map_sigma_m, config.map_sigma_m, config.map_sigma_rad).cwiseAbs2();
  return covariance;
}

void judge(const WallMap& map, std::span<const Eigen::Vector2d> B_points_m,
           const ScanMatchConfig& config, ScanMatch& match) {
  std::size_t on_walls = 0;
  double squares = 0;
  for (const auto& B_point : B_points_m) {
    const Eigen::Vector2d at = match.pose.position_m + turn_of(match.pose) * B_point;
    const WallMap::Wall* wall = map.nearest(at);
    if (wall == nullptr) continue;
    const double near = (at - wall->point_m).norm() / config.fit_within_m;
    match.score += std::exp(-near * near / 2);
    if (near > 1) continue;
    const double off_m = wall->normal.isZero() ? (at - wall->point_m).norm()
                                               : std::abs(wall->normal.dot(at - wall->point_m));
    squares += off_m * off_m;
    ++on_walls;
  }
  match.fit = static_cast<double>(on_walls) / static_cast<double>(B_points_m.size());
  match.score /= static_cast<double>(B_points_m.size());
  match.rms_m = std::sqrt(squares / static_cast<double>(std::max<std::size_t>(1, on_walls)));
  match.good = match.reason.empty() && match.fit >= config.fit_min;
  if (!match.good && match.reason.empty())
    match.reason = fmt::format("{:.0f} % of the beams lie on walls of the map, fewer than {:.0f} %",
                               100 * match.fit, 100 * config.fit_min);
}

ScanMatch match_from(const WallMap& map, std::span<const Eigen::Vector2d> B_points_m,
                     const hal::Pose2& guess, double radius_m, const ScanMatchConfig& config) {
  ScanMatch match;
  match.pose = guess;
  double reach_m = config.reach_start_m;
  double noise_m = std::max(config.noise_start_m, config.noise_floor_m);
  Equations e;
  for (int step = 0; step < config.steps_max; ++step) {
    const auto rows = rows_of(map, B_points_m, match.pose, reach_m, radius_m);
    if (rows.size() < config.beams_min) {
      match.reason = fmt::format("only {} beams end near walls of the map", rows.size());
      break;
    }
    e = equations_of(rows, radius_m, noise_m, config);
    const Axes<3> axes = axes_of(e.H);
    Eigen::Vector3d motion = Eigen::Vector3d::Zero();
    for (int i = 0; i < 3; ++i)
      if (axes.values[i] >= config.free_below)
        motion -= axes.vectors.col(i) * (axes.vectors.col(i).dot(e.g) / axes.values[i]);
    match.pose.position_m += motion.head<2>();
    match.pose.heading_rad =
        std::remainder(match.pose.heading_rad + motion[2] / radius_m, 2 * std::numbers::pi);
    const bool narrow = reach_m <= config.reach_end_m && noise_m <= config.noise_floor_m;
    if (narrow && motion.norm() < 1e-3) break;
    noise_m = std::max(config.noise_floor_m, 0.7 * noise_m);
    reach_m = std::max(config.reach_end_m, 0.8 * reach_m);
  }
  if (match.reason.empty()) match.covariance = covariance_of(e, config, match.free);
  judge(map, B_points_m, config, match);
  return match;
}

}  // namespace

ScanMatch match_scan(const WallMap& map, std::span<const Eigen::Vector2d> B_points_m,
                     const hal::Pose2& guess, const ScanMatchConfig& config) {
  if (B_points_m.size() < config.beams_min) {
    ScanMatch none;
    none.pose = guess;
    none.reason = fmt::format("only {} beams came back", B_points_m.size());
    return none;
  }
  double squares = 0;
  for (const auto& point : B_points_m) squares += point.squaredNorm();
  const double radius_m =
      std::max(0.1, std::sqrt(squares / static_cast<double>(B_points_m.size())));
  ScanMatch best = match_from(map, B_points_m, guess, radius_m, config);
  const auto sure = [&] { return best.good && best.score >= config.score_sure; };
  if (sure() || !config.searches) return best;
  // Where the robot may be, before the turns that it may have made.
  std::vector<Eigen::Vector2d> places;
  for (int x = -1; x <= 1; ++x)
    for (int y = -1; y <= 1; ++y)
      places.push_back(guess.position_m + config.search_m * Eigen::Vector2d(x, y));
  const auto search = [&](int from, int to) {
    for (int turn = from; turn <= to; ++turn)
      for (const auto& place : places) {
        const hal::Pose2 other{place, guess.heading_rad + turn * config.search_rad};
        const ScanMatch found = match_from(map, B_points_m, other, radius_m, config);
        if (found.good > best.good || (found.good == best.good && found.score > best.score))
          best = found;
      }
  };
  search(-1, 1);
  if (best.good && best.score >= config.score_lost) return best;
  search(2, static_cast<int>(2 * std::numbers::pi / config.search_rad) - 1);
  return best;
}

std::vector<Eigen::Vector2d> profile_points(const hal::Profile& profile, const hal::Pose2& T_B_L,
                                            double near_m, double far_m) {
  std::vector<Eigen::Vector2d> points;
  for (std::size_t i = 0; i < profile.ranges_m.size(); ++i) {
    const double range_m = profile.ranges_m[i];
    if (!(range_m >= near_m && range_m <= far_m)) continue;
    const double angle = profile.angle_first_rad + static_cast<double>(i) * profile.angle_step_rad;
    points.push_back(T_B_L.position_m +
                     turn_of(T_B_L) *
                         Eigen::Vector2d(range_m * std::cos(angle), range_m * std::sin(angle)));
  }
  return points;
}

}  // namespace nav
