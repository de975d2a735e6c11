#include "mission/site_model.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>
#include <stdexcept>
#include <utility>

#include "hal/angles.hpp"
#include "nav/polygons.hpp"
#include "nav/terrain.hpp"

namespace mission {
namespace {

// The ground lies this far up in its layer (in voxels).
constexpr double kGroundInLayer = 0.9;

// Obstacles that the map lacks: points at the height of the robot's body, seen from near enough
// that a heading error of 0.5 deg stays below the distance kept from known walls.
constexpr double kBodyLowM = 0.3;
constexpr double kBodyHighM = 1.6;
constexpr float kObstacleRangeMaxM = 40.0F;
constexpr std::int64_t kKnownWallMarginMm = 600;
constexpr std::uint8_t kObstacleHitsMin = 4;

// How far a wall may stand from where map and pose put it, as seen by the scanner.
constexpr double kWallsMarginM = 0.15;

constexpr double kGroundRangeM = 12;  // Of points that tell how rough the ground is.

// The part of a grid around a place.
struct Window {
  Window(const nav::RasterGrid& of, const Eigen::Vector2d& W_center_m, double reach_m) : all(of) {
    const auto at = [&](double reach) -> Eigen::Vector2i {
      const Eigen::Vector2d q = (W_center_m.array() + reach - of.W_min_m.array()) / of.cell_m;
      return q.array().floor().cast<int>().max(0).min(Eigen::Array2i(of.nx, of.ny));
    };
    low = at(-reach_m);
    const Eigen::Vector2i size = at(reach_m) - low;
    grid = {of.W_min_m + of.cell_m * low.cast<double>(), of.cell_m, size.x(), size.y()};
  }
  int x(std::size_t i) const { return static_cast<int>(i) % grid.nx; }
  int y(std::size_t i) const { return static_cast<int>(i) / grid.nx; }
  std::size_t cell(std::size_t i) const { return all.index(low.x() + x(i), low.y() + y(i)); }
  Eigen::Vector2d center_m(std::size_t i) const { return grid.center_m(x(i), y(i)); }

  const nav::RasterGrid& all;
  Eigen::Vector2i low{0, 0};
  nav::RasterGrid grid;
};

struct Bounds {
  Eigen::Vector2d low{1e18, 1e18}, high{-1e18, -1e18};

  void add(const nav::Polygons& polygons) {
    for (const nav::Polygon& polygon : polygons)
      for (const nav::PointMm vertex : polygon.outer) {
        low = low.cwiseMin(nav::to_m(vertex));
        high = high.cwiseMax(nav::to_m(vertex));
      }
  }
};

bool scanned(const AreaTask& task) {
  return task.mode != AreaMode::skip;
}

// Layers that the map has to keep, so that the box can grow: as high as scans can see from the
// highest ground, at most height_max_m above the lowest, and no more than the largest box has
// voxels (check.cpp).
int layers_kept(const MissionConfig& config, const planning::VoxelGrid& grid,
                const std::vector<AreaTask>& tasks) {
  constexpr double kVoxelsMax = 400e6;
  const double ground_low_m = grid.W_min_m.z() + kGroundInLayer * grid.voxel_m;
  double ground_high_m = ground_low_m;
  for (const AreaTask& task : tasks) ground_high_m = std::max(ground_high_m, task.area.ground_z_m);
  const ScannerConfig& scanner = config.robot.scanner;
  const double sight_m = ground_high_m - ground_low_m + scanner.height_m + scanner.range_max_m;
  const double layers = std::ceil(std::min(config.phase2.height_max_m, sight_m) / grid.voxel_m) + 1;
  const double most = kVoxelsMax / (static_cast<double>(grid.nx) * grid.ny);
  return std::max(static_cast<int>(std::min(layers, most)), grid.nz);
}

void check_box(const planning::VoxelGrid& grid, const planning::VoxelGrid& wanted) {
  const bool same = grid.voxel_m == wanted.voxel_m && grid.W_min_m == wanted.W_min_m &&
                    grid.nx == wanted.nx && grid.ny == wanted.ny;
  if (same) return;
  const auto text = [](const planning::VoxelGrid& g) {
    return fmt::format("{} x {} voxels of {} m from ({}, {}, {}) m", g.nx, g.ny, g.voxel_m,
                       g.W_min_m.x(), g.W_min_m.y(), g.W_min_m.z());
  };
  throw std::invalid_argument(
      fmt::format("the voxel map's box, {}, is not this mission's, {}; give the mission, the robot "
                  "and the site "
                  "that the map was made with",
                  text(grid), text(wanted)));
}

}  // namespace

Eigen::Isometry3d scanner_pose(const hal::Pose2& pose, double ground_z_m, double height_m) {
  Eigen::Isometry3d T_W_S = Eigen::Isometry3d::Identity();
  T_W_S.translation() << pose.position_m, ground_z_m + height_m;
  T_W_S.linear() = Eigen::AngleAxisd(pose.heading_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  return T_W_S;
}

planning::VoxelGrid voxel_grid(const MissionConfig& config, const nav::SiteMap& map,
                               const std::vector<AreaTask>& tasks) {
  const double voxel_m = config.phase2.voxel_m;
  Bounds bounds;
  bounds.add(map.boundary);
  bounds.add(map.obstacles);
  double ground_low_m = map.ground_z_m;
  for (const AreaTask& task : tasks) {
    bounds.add(task.area.drivable);
    ground_low_m = std::min(ground_low_m, task.area.ground_z_m);
  }
  planning::VoxelGrid grid;
  grid.voxel_m = voxel_m;
  grid.W_min_m << voxel_m * (std::floor(bounds.low.x() / voxel_m) - 1),
      voxel_m * (std::floor(bounds.low.y() / voxel_m) - 1), ground_low_m - kGroundInLayer * voxel_m;
  grid.nx = static_cast<int>(std::ceil((bounds.high.x() - grid.W_min_m.x()) / voxel_m)) + 1;
  grid.ny = static_cast<int>(std::ceil((bounds.high.y() - grid.W_min_m.y()) / voxel_m)) + 1;
  grid.nz = static_cast<int>(std::ceil(config.phase2.height_m / voxel_m)) + 1;
  return grid;
}

std::vector<Eigen::Vector2d> ScanEffect::closed_m() const {
  std::vector<Eigen::Vector2d> closed = new_obstacles_m;
  closed.insert(closed.end(), rough_ground_m.begin(), rough_ground_m.end());
  return closed;
}

SiteModel::SiteModel(const MissionConfig& config, const nav::SiteMap& map,
                     std::vector<AreaTask> tasks, int threads)
    : SiteModel(config, map, tasks, threads,
                planning::VoxelMap(voxel_grid(config, map, tasks),
                                   layers_kept(config, voxel_grid(config, map, tasks), tasks))) {}

SiteModel::SiteModel(const MissionConfig& config, const nav::SiteMap& map,
                     std::vector<AreaTask> tasks, int threads, planning::VoxelMap seen)
    : config_(config),
      tasks_(std::move(tasks)),
      threads_(threads),
      map_(std::move(seen)),
      tally_(view_limits(config.robot.scanner), threads),
      density_(config.robot.scanner, config.phase2.density_min_ppm2, threads) {
  check_box(map_.grid(), voxel_grid(config, map, tasks_));
  if (config_.phase2.foliage) beams_.emplace(map_);
  find_cells();
  const planning::VoxelGrid& grid = map_.grid();
  const nav::RasterGrid columns{grid.W_min_m.head<2>(), grid.voxel_m, grid.nx, grid.ny};
  in_site_ = nav::rasterize(map.boundary, columns);
  for (const nav::SegmentMm& wall : nav::edges(map.obstacles))
    walls_.push_back({nav::to_m(wall.a), nav::to_m(wall.b)});
  find_ground(columns);
  excluded_.assign(cells_.size(), 0);
  obstacle_grid_ = {grid.W_min_m.head<2>(), kObstacleCellM,
                    static_cast<int>(std::ceil(grid.nx * grid.voxel_m / kObstacleCellM)),
                    static_cast<int>(std::ceil(grid.ny * grid.voxel_m / kObstacleCellM))};
  open_.assign(obstacle_grid_.size(), 0);
  hits_.assign(obstacle_grid_.size(), 0);
  rough_.assign(obstacle_grid_.size(), 0);
  for (const AreaTask& task : tasks_) {
    const auto open =
        nav::rasterize(nav::offset(task.area.drivable, -kKnownWallMarginMm), obstacle_grid_);
    for (std::size_t i = 0; i < open.size(); ++i) open_[i] |= open[i];
  }
  find_boundary();
}

// Every voxel at scanner height whose centre is a place to stand.
void SiteModel::find_cells() {
  const planning::VoxelGrid& grid = map_.grid();
  const nav::RasterGrid raster{grid.W_min_m.head<2>(), grid.voxel_m, grid.nx, grid.ny};
  for (std::size_t t = 0; t < tasks_.size(); ++t) {
    if (!scanned(tasks_[t])) continue;
    const nav::FreeArea& area = tasks_[t].area;
    const double scanner_z_m = area.ground_z_m + config_.robot.scanner.height_m;
    const int z = grid.voxel_at({grid.W_min_m.x(), grid.W_min_m.y(), scanner_z_m}).z;
    if (z < 0 || z >= grid.nz) continue;
    const auto inside = nav::rasterize(area.standable, raster);
    for (int y = 0; y < grid.ny; ++y)
      for (int x = 0; x < grid.nx; ++x)
        if (inside[raster.index(x, y)]) cells_.push_back({{x, y, z}, static_cast<int>(t)});
  }
}

// The voxels that hold the mapped ground: their tops are air, so beams that skim it cross them.
void SiteModel::find_ground(const nav::RasterGrid& columns) {
  const planning::VoxelGrid& grid = map_.grid();
  for (const AreaTask& task : tasks_) {
    const int z = grid.voxel_at({grid.W_min_m.x(), grid.W_min_m.y(), task.area.ground_z_m}).z;
    const auto inside = nav::rasterize(task.area.drivable, columns);
    for (int y = 0; y < grid.ny; ++y)
      for (int x = 0; x < grid.nx; ++x)
        if (inside[columns.index(x, y)]) ground_.push_back({x, y, z});
  }
}

// A beam over the ground proves nothing of the ground: what it carved there is unseen again.
void SiteModel::restore_ground() {
  for (const planning::Voxel& v : ground_)
    if (map_.at(v) == planning::VoxelState::seen_empty) map_.set(v, planning::VoxelState::unseen);
}

// The frontier of what is seen, as far as it lies within the site's boundary.
void SiteModel::find_boundary() {
  boundary_ = planning::boundary_unseen(map_);
  std::erase_if(boundary_, [&](const planning::BoundaryVoxel& u) { return !is_in_site(u.v); });
}

bool SiteModel::is_in_site(const planning::Voxel& v) const {
  const auto columns = static_cast<std::size_t>(map_.grid().nx);
  return in_site_[static_cast<std::size_t>(v.y) * columns + static_cast<std::size_t>(v.x)] != 0;
}

bool SiteModel::is_set_aside(const planning::Voxel& v) const {
  const auto tries = tries_.find(v);
  return tries != tries_.end() && tries->second >= kTriesMax;
}

Eigen::Vector3d SiteModel::cell_position_m(const ViewCell& cell) const {
  Eigen::Vector3d position_m = map_.grid().center_m(cell.voxel);
  position_m.z() =
      tasks_[static_cast<std::size_t>(cell.task)].area.ground_z_m + config_.robot.scanner.height_m;
  return position_m;
}

ScanEffect SiteModel::add(const hal::ScanCloud& scan,
                          const std::vector<Eigen::Vector3f>& W_points_m,
                          const Eigen::Isometry3d& T_W_S, double ground_z_m) {
  planning::InsertConfig insert;
  insert.range_min_m = config_.robot.scanner.range_min_m;
  insert.range_max_m = config_.robot.scanner.range_max_m;
  insert.carve_no_return = config_.phase2.carve_no_return;
  insert.ground_z_m = ground_z_m;
  insert.walls = walls_;
  insert.walls_margin_m = kWallsMarginM;
  insert.threads = threads_;
  const planning::InsertReport report = map_.insert(scan, T_W_S, insert);
  if (beams_) beams_->add(scan, T_W_S, insert);
  restore_ground();
  ScanEffect effect;
  effect.layers_added = grow(report);
  const auto new_layers =
      std::span(report.returns_above)
          .first(std::min<std::size_t>(report.returns_above.size(),
                                       static_cast<std::size_t>(effect.layers_added)));
  effect.points_outside_box =
      report.returns_outside - std::accumulate(new_layers.begin(), new_layers.end(), 0ULL);
  find_boundary();
  look_through();
  density_.add(planner_map(), scan.pattern, T_W_S);
  const Eigen::Vector3f W_scanner_m = T_W_S.translation().cast<float>();
  for (const Eigen::Vector3f& W_point_m : W_points_m)
    if ((W_point_m - W_scanner_m).squaredNorm() < kObstacleRangeMaxM * kObstacleRangeMaxM)
      note_obstacle(W_point_m, ground_z_m, effect);
  note_ground(W_points_m, T_W_S.translation().head<2>(), ground_z_m, effect);
  return effect;
}

// Around the scanner only: farther off, points lie too far apart to tell a step. The robot stands
// where it stands: the ground under it is good enough.
void SiteModel::note_ground(const std::vector<Eigen::Vector3f>& W_points_m,
                            const Eigen::Vector2d& W_scanner_m, double ground_z_m,
                            ScanEffect& effect) {
  const BodyConfig& body = config_.robot.body;
  const Window around(obstacle_grid_, W_scanner_m, kGroundRangeM);
  const nav::TerrainLimits limits{.slope_max_rad = hal::radians(body.slope_max_deg),
                                  .step_max_m = body.step_max_m,
                                  .footprint_m = body.radius_m,
                                  .range_max_m = kGroundRangeM,
                                  .overhead_m = kBodyHighM,
                                  .ground_z_m = ground_z_m};
  std::vector<float> heights_m = nav::ground_heights(W_points_m, W_scanner_m, around.grid, limits);
  for (std::size_t i = 0; i < heights_m.size(); ++i)
    if (!open_[around.cell(i)]) heights_m[i] = std::numeric_limits<float>::quiet_NaN();
  const std::vector<nav::Ground> ground = nav::judge_ground(heights_m, around.grid, limits);
  for (std::size_t i = 0; i < ground.size(); ++i) {
    const Eigen::Vector2d center_m = around.center_m(i);
    const bool is_rough = ground[i] == nav::Ground::step || ground[i] == nav::Ground::slope;
    const bool under_robot = (center_m - W_scanner_m).norm() < body.radius_m + kObstacleCellM;
    if (!is_rough || under_robot || !open_[around.cell(i)] || rough_[around.cell(i)]) continue;
    rough_[around.cell(i)] = 1;
    effect.rough_ground_m.push_back(center_m);
  }
}

double SiteModel::rough_ground_m2() const {
  return kObstacleCellM * kObstacleCellM * static_cast<double>(std::ranges::count(rough_, 1));
}

void SiteModel::take_up(const SiteModel& before) {
  tries_ = before.tries_;
  set_aside_ = before.set_aside_;
  excluded_ = before.excluded_;
  density_.take_up(before.density_);
}

// How many layers were added to the box: up to the highest one that is kept and has enough returns
// in it and above, so that a stray return adds none.
int SiteModel::grow(const planning::InsertReport& report) {
  const auto before = static_cast<std::size_t>(map_.grid().nz);
  points_outside_ += report.returns_outside;
  returns_above_.resize(std::max(returns_above_.size(), before + report.returns_above.size()));
  for (std::size_t i = 0; i < report.returns_above.size(); ++i)
    returns_above_[before + i] += report.returns_above[i];

  std::size_t nz = std::min(returns_above_.size(), static_cast<std::size_t>(map_.nz_kept()));
  std::uint64_t in_or_above = 0;
  for (; nz > before; --nz)
    if ((in_or_above += returns_above_[nz - 1]) >= kReturnsToGrow) break;
  if (nz <= before) return 0;
  for (std::size_t z = before; z < nz; ++z) points_outside_ -= returns_above_[z];
  map_.grow_z(static_cast<int>(nz));
  return static_cast<int>(nz - before);
}

std::uint64_t SiteModel::points_above_box() const {
  std::uint64_t sum = 0;
  for (auto z = static_cast<std::size_t>(map_.grid().nz); z < returns_above_.size(); ++z)
    sum += returns_above_[z];
  return sum;
}

// Known ground stays ground: beams that skim it pass its voxels by the hundred.
void SiteModel::look_through() {
  if (!beams_) return;
  see_through_ =
      planning::see_through(map_, *beams_, {.share_min = config_.phase2.foliage_share_min});
  for (const planning::Voxel& v : ground_) see_through_->set(v, map_.at(v));
}

std::size_t SiteModel::voxel_bytes() const {
  return map_.storage_bytes() + (beams_ ? beams_->storage_bytes() : 0) +
         (see_through_ ? see_through_->storage_bytes() : 0);
}

void SiteModel::note_obstacle(const Eigen::Vector3f& W_point_m, double ground_z_m,
                              ScanEffect& effect) {
  const double above_m = W_point_m.z() - ground_z_m;
  if (above_m < kBodyLowM || above_m > kBodyHighM) return;
  const Eigen::Vector2d q =
      (W_point_m.head<2>().cast<double>() - obstacle_grid_.W_min_m) / obstacle_grid_.cell_m;
  const int x = static_cast<int>(std::floor(q.x()));
  const int y = static_cast<int>(std::floor(q.y()));
  if (!obstacle_grid_.contains(x, y)) return;
  const std::size_t cell = obstacle_grid_.index(x, y);
  if (!open_[cell] || hits_[cell] >= kObstacleHitsMin) return;
  if (++hits_[cell] == kObstacleHitsMin)
    effect.new_obstacles_m.push_back(obstacle_grid_.center_m(x, y));
}

std::vector<planning::BoundaryVoxel> SiteModel::worth_seeing() const {
  std::vector<planning::BoundaryVoxel> worth;
  worth.reserve(boundary_.size());
  for (const planning::BoundaryVoxel& u : boundary_)
    if (!is_set_aside(u.v)) worth.push_back(u);
  return worth;
}

namespace {

std::vector<planning::Voxel> voxels_of(const std::vector<CellTally>& tallies) {
  std::vector<planning::Voxel> voxels;
  voxels.reserve(tallies.size());
  for (const CellTally& at : tallies) voxels.push_back(at.cell.voxel);
  return voxels;
}

}  // namespace

std::vector<CellTally> SiteModel::tally() {
  std::vector<CellTally> open;
  for (std::size_t i = 0; i < cells_.size(); ++i)
    if (!excluded_[i] && planner_map().at(cells_[i].voxel) == planning::VoxelState::seen_empty)
      open.push_back({cells_[i], 0});
  const std::vector<planning::Voxel> voxels = voxels_of(open);
  const std::vector<std::uint32_t>& counts = tally_.update(planner_map(), worth_seeing(), voxels);
  for (std::size_t i = 0; i < open.size(); ++i) open[i].voxels = counts[i];
  if (!density_.is_set()) return open;
  const std::vector<std::uint32_t> thin =
      planning::tally(planner_map(), density_.thin(), voxels, density_.limits(), threads_);
  for (std::size_t i = 0; i < open.size(); ++i) open[i].voxels += thin[i];
  return open;
}

std::vector<NextView> SiteModel::next_views() {
  last_tally_ = tally();
  best_voxels_ = 0;
  std::vector<NextView> views;
  for (const auto& [cell, voxels] : last_tally_) {
    best_voxels_ = std::max<std::uint64_t>(best_voxels_, voxels);
    if (voxels < static_cast<std::uint32_t>(config_.phase2.gain_min_voxels)) continue;
    views.push_back({.cell = cell,
                     .pose = {cell_position_m(cell).head<2>(), 0},
                     .ground_z_m = tasks_[static_cast<std::size_t>(cell.task)].area.ground_z_m,
                     .voxels = voxels});
  }
  std::ranges::stable_sort(views, std::ranges::greater{}, &NextView::voxels);
  return faced(std::move(views));
}

std::vector<ViewAhead> SiteModel::views_ahead(const std::vector<CellTally>& tallies,
                                              std::size_t count) const {
  std::vector<std::uint32_t> counts;
  for (const CellTally& at : tallies) counts.push_back(at.voxels);
  std::vector<planning::ViewTargets> targets{{worth_seeing(), view_limits(config_.robot.scanner)}};
  if (density_.is_set()) targets.push_back({density_.thin(), density_.limits()});
  std::vector<ViewAhead> views;
  for (const planning::PlannedView& view :
       planning::next_views(planner_map(), std::move(targets), voxels_of(tallies), counts,
                            {.views_max = count,
                            .adds_min_voxels = 1,
                            .threads = threads_,
                            .fov_deg = config_.robot.scanner.fov_deg}))
    views.push_back(
        {tallies[view.candidate].cell, view.sees_voxels, view.adds_voxels, view.heading_rad});
  return views;
}

std::uint64_t SiteModel::settle() {
  std::uint64_t resolved = density_.settle();
  for (const planning::Voxel& v : expected_) {
    if (map_.at(v) != planning::VoxelState::unseen) {
      ++resolved;
    } else if (++tries_[v] == kTriesMax) {
      ++set_aside_;
    }
  }
  expected_.clear();
  return resolved;
}

std::uint64_t SiteModel::number_of(const planning::Voxel& v) const {
  const auto nx = static_cast<std::uint64_t>(map_.grid().nx);
  const auto ny = static_cast<std::uint64_t>(map_.grid().ny);
  return (static_cast<std::uint64_t>(v.z) * ny + static_cast<std::uint64_t>(v.y)) * nx +
         static_cast<std::uint64_t>(v.x);
}

planning::Voxel SiteModel::numbered(std::uint64_t number) const {
  const auto nx = static_cast<std::uint64_t>(map_.grid().nx);
  const auto ny = static_cast<std::uint64_t>(map_.grid().ny);
  return {static_cast<int>(number % nx), static_cast<int>(number / nx % ny),
          static_cast<int>(number / nx / ny)};
}

std::vector<std::uint64_t> SiteModel::voxels_set_aside() const {
  std::vector<std::uint64_t> voxels;
  for (const auto& [v, tries] : tries_)
    if (tries >= kTriesMax) voxels.push_back(number_of(v));
  std::ranges::sort(voxels);
  return voxels;
}

void SiteModel::set_aside(const std::vector<std::uint64_t>& voxels) {
  for (const std::uint64_t i : voxels)
    if (std::exchange(tries_[numbered(i)], kTriesMax) < kTriesMax) ++set_aside_;
}

std::vector<std::uint64_t> SiteModel::thin_set_aside() const {
  std::vector<std::uint64_t> voxels;
  for (const planning::Voxel& v : density_.set_aside()) voxels.push_back(number_of(v));
  return voxels;
}

std::vector<std::uint64_t> SiteModel::foliage() const {
  std::vector<std::uint64_t> voxels;
  const planning::VoxelGrid& grid = map_.grid();
  for (int z = 0; see_through_ && z < grid.nz; ++z)
    for (int y = 0; y < grid.ny; ++y)
      for (int x = 0; x < grid.nx; ++x)
        if (see_through_->at({x, y, z}) != map_.at({x, y, z}))
          voxels.push_back(number_of({x, y, z}));
  return voxels;
}

void SiteModel::restore(const std::vector<std::uint64_t>& foliage,
                        const std::vector<DensityGoal::PastScan>& scans,
                        const std::vector<std::uint64_t>& thin_set_aside) {
  if (config_.phase2.foliage) {
    see_through_ = map_;
    for (const std::uint64_t i : foliage)
      see_through_->set(numbered(i), planning::VoxelState::seen_empty);
  }
  std::vector<planning::Voxel> thin;
  for (const std::uint64_t i : thin_set_aside) thin.push_back(numbered(i));
  density_.restore(planner_map(), scans, thin);
}

void SiteModel::exclude(const planning::Voxel& cell) {
  for (std::size_t i = 0; i < cells_.size(); ++i)
    if (cells_[i].voxel == cell) excluded_[i] = 1;
}

void SiteModel::include(const planning::Voxel& cell) {
  for (std::size_t i = 0; i < cells_.size(); ++i)
    if (cells_[i].voxel == cell) excluded_[i] = 0;
}

VoxelCounts SiteModel::counts() const {
  const auto counts = map_.counts();
  return {.seen_empty = counts.seen_empty,
          .seen_occupied = counts.seen_occupied,
          .unseen = counts.unseen,
          .boundary_unseen = boundary_.size()};
}

}  // namespace mission
