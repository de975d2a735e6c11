#include "mission/main_sim.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/asio/co_spawn.hpp>
#include <cmath>

#include "hal/angles.hpp"
#include "hal/together.hpp"
#include "mission/files.hpp"
#include "nav/polygons.hpp"
#include "nav/raster.hpp"
#include "nav/roadmap.hpp"
#include "sim/ground.hpp"
#include "sim/reachable.hpp"
#include "sim/surface_truth.hpp"

namespace mission {
namespace {

// A ground sample every so far is enough to tell whether a model has a ground.
constexpr double kGroundSampleM = 4.0;
// Ways are looked for in steps of this: a gap that leaves the robot this much play is a way.
constexpr double kReachCellM = 0.25;
// People walk so fast, and do not begin where the robot stands.
constexpr double kWalkMps = 1.2, kWalkersAwayM = 3;
constexpr std::uint64_t kWalkersDraw = 4711, kWalkersDrawsMax = 10'000;

constexpr std::size_t kEventsMax = 200;

sim::ScannerModel scanner_model(const RobotConfig& robot) {
  const ScannerConfig& scanner = robot.scanner;
  return {.height_m = scanner.height_m,
          .range_min_m = scanner.range_min_m,
          .range_max_m = scanner.range_max_m,
          .fov_rad = hal::radians(scanner.fov_deg),
          .azimuth_step_rad = hal::radians(scanner.azimuth_step_deg),
          .elevation_min_rad = hal::radians(scanner.elevation_min_deg),
          .elevation_max_rad = hal::radians(scanner.elevation_max_deg),
          .elevation_step_rad = hal::radians(scanner.elevation_step_deg),
          .scan_s = scanner.scan_s,
          .range_sigma_m = robot.sim.range_sigma_m};
}

double start_ground_z_m(const SiteTasks& tasks) {
  if (tasks.start_area < 0) return 0;
  return tasks.tasks[static_cast<std::size_t>(tasks.start_area)].area.ground_z_m;
}

// Each to and fro between two places, along the roads: they know the site.
std::vector<sim::Person> walkers(const MissionConfig& config, const SiteTasks& tasks) {
  std::vector<sim::Person> people;
  if (tasks.start_area < 0 || config.robot.sim.people == 0) return people;
  const nav::FreeArea& area = tasks.tasks[static_cast<std::size_t>(tasks.start_area)].area;
  Eigen::AlignedBox2d box;
  for (const nav::SegmentMm& edge : nav::edges(area.standable)) box.extend(nav::to_m(edge.a));
  const nav::Roadmap roads = nav::Roadmap::build(area, config.robot.body.radius_m);
  const auto place = [&](std::uint64_t number) -> Eigen::Vector2d {
    const auto share = [&](std::uint64_t axis) {
      const std::uint64_t drawn =
          sim::mix(sim::mix(config.seed + kWalkersDraw) ^ (2 * number + axis));
      return static_cast<double>(drawn >> 11) * 0x1.0p-53;
    };
    return box.min() + box.sizes().cwiseProduct(Eigen::Vector2d(share(0), share(1)));
  };
  for (std::uint64_t draw = 0;
       draw < kWalkersDrawsMax && std::ssize(people) < config.robot.sim.people; ++draw) {
    const Eigen::Vector2d from_m = place(2 * draw), to_m = place(2 * draw + 1);
    if ((from_m - tasks.start.position_m).norm() < kWalkersAwayM) continue;
    if (const auto route = roads.route(from_m, to_m))
      people.push_back({.way_m = route->points_m, .speed_mps = kWalkMps});
  }
  return people;
}

sim::WorldConfig world_config(const MissionConfig& config, const SiteTasks& tasks, int threads) {
  const RobotConfig& robot = config.robot;
  sim::WorldConfig world;
  world.seed = config.seed;
  world.threads = threads;
  world.radius_m = robot.body.radius_m;
  world.track_m = robot.body.track_m;
  world.speed_max_mps = robot.body.speed_max_mps;
  world.turn_max_radps = hal::radians(robot.body.turn_max_degps);
  world.slip_sigma = robot.sim.slip_sigma;
  world.gyro_sigma_radps = hal::radians(robot.sim.gyro_sigma_degps);
  world.gyro_bias_sigma_radps = hal::radians(robot.sim.gyro_bias_degps);
  world.gnss_sigma_m = robot.sim.gnss_sigma_m;
  for (const AreaTask& task : tasks.tasks) {
    if (robot.sim.gnss_outage.empty() || task.area.region != robot.sim.gnss_outage) continue;
    for (const nav::Polygon& polygon : task.area.drivable) {
      auto& outline = world.gnss_outages.emplace_back();
      for (const nav::PointMm vertex : polygon.outer) outline.push_back(nav::to_m(vertex));
    }
  }
  world.placement_sigma_m = robot.sim.placement_sigma_m;
  world.placement_heading_sigma_rad = hal::radians(robot.sim.placement_heading_sigma_deg);
  world.placement_s = robot.sim.placement_s;
  world.scanner = scanner_model(robot);
  world.ground_z_m = start_ground_z_m(tasks);
  world.people = walkers(config, tasks);
  for (const AreaTask& task : tasks.tasks)
    world.region_ground_z_m[task.area.name] = task.area.ground_z_m;
  return world;
}

// Centres of a grid of cells on the standable ground.
std::vector<Eigen::Vector3d> ground_samples(const std::vector<AreaTask>& tasks) {
  std::vector<Eigen::Vector3d> samples;
  for (const AreaTask& task : tasks) {
    if (task.mode == AreaMode::skip) continue;
    Eigen::AlignedBox2d box;
    for (const nav::SegmentMm& edge : nav::edges(task.area.standable))
      box.extend(nav::to_m(edge.a));
    const Eigen::Vector2d size = box.sizes() / kGroundSampleM;
    const nav::RasterGrid grid{box.min(), kGroundSampleM, static_cast<int>(size.x()) + 1,
                               static_cast<int>(size.y()) + 1};
    const auto inside = nav::rasterize(task.area.standable, grid);
    for (int y = 0; y < grid.ny; ++y)
      for (int x = 0; x < grid.nx; ++x)
        if (inside[grid.index(x, y)])
          samples.emplace_back(grid.center_m(x, y).x(), grid.center_m(x, y).y(),
                               task.area.ground_z_m);
  }
  return samples;
}

GatedDrive::Config sim_gate_config(const RobotConfig& robot, const RobotDrivers& drivers,
                                   std::vector<std::string>& events,
                                   const std::function<void(const std::string&)>& on_event) {
  GatedDrive::Config config = gate_config(robot, drivers);
  config.tell = [&events, &on_event](const std::string& what) {
    if (events.size() >= kEventsMax) return;  // Later ones are not kept.
    events.push_back(what);
    if (on_event) on_event(what);
  };
  return config;
}

}  // namespace

SimSite load_sim_site(const std::filesystem::path& model_file) {
  sim::ParsedMesh parsed = sim::load_obj(model_file);
  return {.mesh = std::move(parsed.mesh), .notes = {}, .errors = std::move(parsed.errors)};
}

void assume_ground(SimSite& site, nav::SiteMap& map) {
  const auto ground_z_m = sim::estimate_ground_z_m(site.mesh);
  if (!ground_z_m) {
    site.notes.push_back(
        "neither the map (ground_z_m) nor the model's walls tell the height of the ground: 0 m");
    return;
  }
  map.ground_z_m = *ground_z_m;
  for (nav::Region& region : map.regions) region.ground_z_m = *ground_z_m;
  site.notes.push_back(
      fmt::format("the map has no ground_z_m: ground assumed at {:.2f} m, where most of the "
                  "model's walls stand",
                  *ground_z_m));
}

void complete_ground(SimSite& site, const nav::SiteMap& map, const std::vector<AreaTask>& tasks) {
  const std::vector<Eigen::Vector3d> samples = ground_samples(tasks);
  if (samples.empty()) return;
  Eigen::AlignedBox2d box;
  for (const nav::SegmentMm& edge : nav::edges(map.boundary)) box.extend(nav::to_m(edge.a));
  const sim::GroundReport report = sim::ensure_ground(site.mesh, samples, box);
  if (report.added)
    site.notes.push_back(
        fmt::format("the model has ground under {} of {} sample points only: a level ground was "
                    "added at {:.2f} m",
                    report.with_ground, report.samples, report.added_z_m));
}

SimWorld::SimWorld(const MissionConfig& config, const SiteTasks& tasks, SimSite site, int threads)
    : site_(std::move(site)),
      scene_(site_.mesh),
      world_(scene_, world_config(config, tasks, threads)) {
  if (tasks.start_area < 0) return;
  if (!world_.put_robot(tasks.start, start_ground_z_m(tasks)))
    throw std::runtime_error(fmt::format(
        "the robot cannot stand at its start ({:.2f}, {:.2f}): the model has something there, or "
        "no ground near {:.2f} m; move the map's `start`",
        tasks.start.position_m.x(), tasks.start.position_m.y(), start_ground_z_m(tasks)));
}

SimBackend::SimBackend(const MissionConfig& config, const SiteTasks& tasks, SimSite site,
                       int threads)
    : config_(config),
      threads_(threads),
      true_site_(config, tasks, std::move(site), threads),
      robot_(config.robot, kSimAnchor, config.seed, threads, true_site_.world(), clock_),
      gate_(sim_gate_config(config.robot, robot_.drivers(), events_, on_event_), clock_,
            robot_.drivers().drive()),
      scanner_(robot_.drivers().scanner(), true_site_.world(), clock_),
      placement_(true_site_.world(), clock_),
      devices_{gate_,      robot_.drivers().imu(),          robot_.drivers().gnss(),     scanner_,
               placement_, [this] { return complaints(); }, robot_.drivers().obstacles()} {}

Survey::Truths SimBackend::truths() const {
  const sim::World& world = true_site_.world();
  Survey::Truths truths{world.robot().pose, world.robot().ground_z_m, std::nullopt};
  if (!world.scans().empty()) truths.scan = world.scans().back().at.pose;
  return truths;
}

void SimBackend::put_robot(const hal::Pose2& pose, double ground_z_m) {
  if (!true_site_.world().put_robot(pose, ground_z_m))
    throw std::runtime_error("the robot cannot stand where the run left it");
}

std::string SimBackend::complaints() {
  const std::string gate = gate_.why(), all = robot_.drivers().complaints();
  return gate + (gate.empty() || all.empty() ? "" : "; ") + all;
}

hal::Task<void> SimBackend::run_robot() {
  std::vector<hal::Task<void>> both;
  both.push_back(robot_.run());
  both.push_back(gate_.run());
  co_await hal::together(std::move(both));
}

bool SimBackend::run(const std::function<bool()>& done) {
  if (!started_)
    boost::asio::co_spawn(executor(), run_robot(), [this](std::exception_ptr error) {
      try {
        if (error) std::rethrow_exception(error);
        failure_ = "the robot's devices ended by themselves";
      } catch (const std::exception& e) {
        failure_ = e.what();
      }
    });
  started_ = true;
  return clock_.run([&] { return done() || !failure_.empty(); }) && done();
}

Truth SimBackend::judge(RunRecord& record, const SiteModel& model,
                        const std::vector<AreaTask>& tasks,
                        const std::filesystem::path& cells_file) const {
  Truth truth;
  judge_poses(record, truth);
  const std::vector<Eigen::Vector3d> positions = scanner_positions(record, model, tasks);
  judge_surface(record, model, positions, truth);
  if (!cells_file.empty()) {
    std::string text;
    for (const Eigen::Vector3d& p : positions)
      text += fmt::format("{},{},{}\n", p.x(), p.y(), p.z());
    write_file(cells_file, {text}).value();
  }
  return truth;
}

void SimBackend::judge_poses(RunRecord& record, Truth& truth) const {
  double squares_m2 = 0, nees = 0;
  for (ScanRecord& scan : record.scans) {
    // Not every scan taken is one that counts; those of an earlier part of the run bring it along.
    if (!scan.truth)
      scan.truth = std::ranges::find(true_site_.world().scans(), scan.stamp, &sim::ScanTruth::stamp)
                       ->at.pose;
    const hal::Pose2& at = *scan.truth;
    Eigen::Vector3d error;
    error << scan.believed.position_m - at.position_m,
        hal::wrapped(scan.believed.heading_rad - at.heading_rad);
    const double distance_m = error.head<2>().norm();
    truth.position_error_max_m = std::max(truth.position_error_max_m, distance_m);
    truth.heading_error_max_rad = std::max(truth.heading_error_max_rad, std::abs(error.z()));
    squares_m2 += distance_m * distance_m;
    if (!scan.by_hand && scan.fit.verdict != ScanVerdict::off) {
      const hal::Pose2& before = scan.fit.before;
      truth.before_error_max_m =
          std::max(truth.before_error_max_m, (before.position_m - at.position_m).norm());
      truth.before_error_max_rad = std::max(
          truth.before_error_max_rad, std::abs(hal::wrapped(before.heading_rad - at.heading_rad)));
    }
    nees += error.dot(scan.covariance.inverse() * error);
  }
  const double scans = static_cast<double>(std::max<std::size_t>(record.scans.size(), 1));
  truth.position_error_rms_m = std::sqrt(squares_m2 / scans);
  truth.nees_mean = nees / scans;
}

// The ground of an area that can really be reached from where its scans were taken: what the map
// lacks may close off a part of it, and the inside of a shed is nobody's to stand in. Without any
// scan there, all of it counts.
std::function<bool(const Eigen::Vector2d&)> SimBackend::reachable_ground(
    const RunRecord& record, const AreaTask& task) const {
  const double ground_z_m = task.area.ground_z_m;
  const auto stands = [this, ground_z_m](const Eigen::Vector2d& W_point_m) {
    return true_site_.world()
        .standing({W_point_m, 0}, ground_z_m, config_.robot.body.radius_m)
        .has_value();
  };
  std::vector<Eigen::Vector2d> seeds;
  for (const ScanRecord& scan : record.scans)
    if (scan.area == task.area.name) seeds.push_back(scan.truth->position_m);
  if (seeds.empty()) return stands;

  Eigen::AlignedBox2d box;
  for (const nav::SegmentMm& edge : nav::edges(task.area.standable)) box.extend(nav::to_m(edge.a));
  const Eigen::Vector2d size = box.sizes() / kReachCellM;
  const nav::RasterGrid raster{box.min(), kReachCellM, static_cast<int>(size.x()) + 1,
                               static_cast<int>(size.y()) + 1};
  const sim::GroundCells cells{raster.W_min_m, raster.cell_m, raster.nx, raster.ny};
  const auto inside = nav::rasterize(task.area.standable, raster);
  const auto reached = sim::reachable(cells, seeds, [&](const Eigen::Vector2d& W_point_m) {
    return inside[static_cast<std::size_t>(cells.index_at(W_point_m))] && stands(W_point_m);
  });
  return [=](const Eigen::Vector2d& W_point_m) {
    const std::int64_t index = cells.index_at(W_point_m);
    return index >= 0 && reached[static_cast<std::size_t>(index)] && stands(W_point_m);
  };
}

// Where the scans were taken, then every cell on which the robot or a tripod could really stand in
// the areas that were surveyed.
std::vector<Eigen::Vector3d> SimBackend::scanner_positions(
    const RunRecord& record, const SiteModel& model, const std::vector<AreaTask>& tasks) const {
  std::vector<Eigen::Vector3d> positions;
  for (const ScanRecord& scan : record.scans)
    positions.emplace_back(scan.truth->position_m.x(), scan.truth->position_m.y(),
                           scan.ground_z_m + config_.robot.scanner.height_m);
  std::vector<std::function<bool(const Eigen::Vector2d&)>> reachable;
  for (const AreaTask& task : tasks) reachable.push_back(reachable_ground(record, task));
  for (const ViewCell& cell : model.cells()) {
    const Eigen::Vector3d position_m = model.cell_position_m(cell);
    if (reachable[static_cast<std::size_t>(cell.task)](position_m.head<2>()))
      positions.push_back(position_m);
  }
  return positions;
}

void SimBackend::judge_surface(const RunRecord& record, const SiteModel& model,
                               const std::vector<Eigen::Vector3d>& positions, Truth& truth) const {
  const ScannerConfig& scanner = config_.robot.scanner;
  const planning::VoxelGrid& grid = model.map().grid();
  const sim::SurfaceTruth surface = sim::judge_surface(
      true_site_.mesh(), true_site_.scene(),
      {.W_min_m = grid.W_min_m,
       .voxel_m = grid.voxel_m,
       .nx = grid.nx,
       .ny = grid.ny,
       .nz = grid.nz},
      {.range_min_m = scanner.range_min_m,
       .range_max_m = scanner.range_max_m,
       .grazing_max_rad = hal::radians(scanner.grazing_max_deg),
       .elevation_min_rad = hal::radians(scanner.elevation_min_deg),
       .elevation_max_rad = hal::radians(scanner.elevation_max_deg)},
      positions, record.scans.size(),
      [&](int x, int y, int z) {
        return model.map().at({x, y, z}) == planning::VoxelState::seen_occupied;
      },
      threads_);
  truth.surface_visible = surface.visible;
  truth.surface_seen = surface.visible_seen;
}

}  // namespace mission
