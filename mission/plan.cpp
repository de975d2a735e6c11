#include "mission/plan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <numbers>

#include "mission/plan_file.hpp"
#include "nav/innermost.hpp"
#include "nav/polygons.hpp"
#include "planning/tour.hpp"

namespace mission {
namespace {

// A pocket this small is not worth carrying a scanner into unless the mission names its region.
constexpr double kManualAreaMinM2 = 25.0;
constexpr double kRoomiestWithinM = 0.25;  // Of an assumed start.

std::optional<AreaMode> mode_named(const MissionConfig& config, const std::string& region) {
  const auto found = config.regions.find(region);
  if (found == config.regions.end()) return std::nullopt;
  if (found->second == "robot") return AreaMode::robot;
  return found->second == "manual" ? AreaMode::manual : AreaMode::skip;
}

int largest(const std::vector<nav::FreeArea>& areas, auto&& wanted) {
  int best = -1;
  double best_m2 = 0;
  for (std::size_t i = 0; i < areas.size(); ++i) {
    if (!wanted(areas[i])) continue;
    const double m2 = nav::area_m2(areas[i].standable);
    if (m2 > best_m2) {
      best_m2 = m2;
      best = static_cast<int>(i);
    }
  }
  return best;
}

// The area the robot stands in: the one that holds the start, else the largest that it may scan.
int home_area(const MissionConfig& config, const nav::SiteMap& map,
              const std::vector<nav::FreeArea>& areas) {
  if (map.start) return nav::area_at(areas, nav::to_mm(map.start->position_m));
  const auto named_robot = [&](const nav::FreeArea& area) {
    return mode_named(config, area.region) == AreaMode::robot;
  };
  if (const int named = largest(areas, named_robot); named >= 0) return named;
  return largest(areas,
                 [&](const nav::FreeArea& area) { return !mode_named(config, area.region); });
}

AreaMode mode_of(const MissionConfig& config, const nav::FreeArea& area, bool is_home) {
  if (const auto named = mode_named(config, area.region)) return *named;
  if (is_home) return AreaMode::robot;
  if (!config.plan.stations.empty())
    return stations_in(config.plan, area.name).empty() ? AreaMode::skip : AreaMode::manual;
  return nav::area_m2(area.standable) >= kManualAreaMinM2 ? AreaMode::manual : AreaMode::skip;
}

void order_tasks(SiteTasks& tasks, int home) {
  std::vector<std::size_t> order(tasks.tasks.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::ranges::stable_sort(order, {}, [&](std::size_t i) { return tasks.tasks[i].mode; });
  std::vector<AreaTask> sorted;
  for (const std::size_t i : order) {
    if (static_cast<int>(i) == home) tasks.start_area = static_cast<int>(sorted.size());
    sorted.push_back(std::move(tasks.tasks[i]));
  }
  tasks.tasks = std::move(sorted);
}

planning::Candidate candidate_at(const SavedStation& station) {
  return {nav::to_mm(Eigen::Vector2d(station.x_m, station.y_m)),
          station.heading_deg * std::numbers::pi / 180};
}

// Searches the area's stations, or takes them from the plan file.
void choose_stations(const MissionConfig& config, std::uint64_t seed, int threads, AreaPlan& plan) {
  planning::CoverConfig cover = cover_config(config.phase1);
  const auto saved = stations_in(config.plan, plan.area.name);
  if (!config.plan.stations.empty()) {
    cover.given.emplace();
    for (const SavedStation& station : saved) cover.given->push_back(candidate_at(station));
  }
  plan.cover = planning::plan_cover(plan.area, plan.walls, sensor_limits(config.robot.scanner),
                                    cover, seed, threads);
  for (const SavedStation& station : saved) plan.names.push_back(station.name);
}

// Costs between all stops in metres of road; infinite where no road leads.
std::vector<std::vector<double>> road_lengths(const nav::Roadmap& roadmap,
                                              const std::vector<Eigen::Vector2d>& stops_m) {
  const Eigen::MatrixXd lengths_m = roadmap.lengths_m(stops_m);
  std::vector cost(stops_m.size(), std::vector<double>(stops_m.size()));
  for (Eigen::Index i = 0; i < lengths_m.rows(); ++i)
    for (Eigen::Index j = 0; j < lengths_m.cols(); ++j)
      cost[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)] = lengths_m(i, j);
  return cost;
}

void plan_tour(PlannedArea& planned, const std::optional<Eigen::Vector2d>& start_m, bool closed) {
  AreaPlan& plan = planned.plan;
  const int first_station = start_m ? 1 : 0;
  std::vector<Eigen::Vector2d> stops_m;
  if (start_m) stops_m.push_back(*start_m);
  for (const auto& station : plan.cover.stations) stops_m.push_back(nav::to_m(station.at.position));
  if (stops_m.empty()) return;

  const planning::Tour tour = planning::solve_tour(
      {.cost = road_lengths(planned.roads.roadmap(), stops_m), .start = 0, .closed = closed});
  plan.tour_m = tour.cost;
  for (const int stop : tour.order)
    if (stop >= first_station) plan.tour.push_back(stop - first_station);
  for (const int stop : tour.unreachable) {
    if (stop < first_station) continue;
    const int station = stop - first_station;
    planned.unreachable.push_back(
        {.name = station_name(plan, station),
         .area = plan.area.name,
         .planned = pose_of(plan.cover.stations[static_cast<std::size_t>(station)].at),
         .reason = "no road with the robot's clearance leads there from the start"});
  }
}

}  // namespace

SiteTasks assign_areas(const MissionConfig& config, const nav::SiteMap& map,
                       const std::vector<nav::FreeArea>& areas) {
  SiteTasks result;
  const int home = home_area(config, map, areas);
  for (std::size_t i = 0; i < areas.size(); ++i) {
    const AreaMode mode = mode_of(config, areas[i], static_cast<int>(i) == home);
    result.tasks.push_back({areas[i], mode});
    if (mode_named(config, areas[i].region) || static_cast<int>(i) == home) continue;
    const std::string_view why = mode == AreaMode::manual ? "a person carries the scanner there"
                                 : config.plan.stations.empty()
                                     ? "too small to carry a scanner into; left out"
                                     : "the plan file has no station there; left out";
    result.notes.push_back(fmt::format("area '{}' ({:.0f} m2) is not connected to the robot's: {}",
                                       areas[i].name, nav::area_m2(areas[i].standable), why));
  }
  order_tasks(result, home);
  if (map.start) {
    result.start = *map.start;
  } else if (home >= 0) {
    const nav::FreeArea& area = areas[static_cast<std::size_t>(home)];
    result.start.position_m = nav::to_m(nav::innermost(area.standable, kRoomiestWithinM));
    result.notes.push_back(
        fmt::format("the map has no start: the robot is assumed at ({:.2f}, {:.2f}) in area '{}', "
                    "heading 0 deg",
                    result.start.position_m.x(), result.start.position_m.y(), area.name));
  }
  return result;
}

planning::SensorLimits sensor_limits(const ScannerConfig& scanner) {
  return {.range_min_m = scanner.range_min_m,
          .range_max_m = scanner.range_max_m,
          .grazing_max_deg = scanner.grazing_max_deg,
          .fov_deg = scanner.fov_deg};
}

planning::CoverConfig cover_config(const Phase1Config& phase1) {
  return {.method = phase1.cover == "greedy" ? planning::CoverMethod::greedy
                                             : planning::CoverMethod::refined,
          .candidates = phase1.candidates,
          .coverage_goal = phase1.coverage_goal,
          .gain_min = phase1.gain_min,
          .gain_enough_m = phase1.gain_enough_m,
          .overlap_min = phase1.overlap_min,
          .given = std::nullopt};
}

hal::Pose2 pose_of(const planning::Candidate& candidate) {
  return {nav::to_m(candidate.position), candidate.heading_rad};
}

std::string station_name(const AreaPlan& plan, int station) {
  const auto i = static_cast<std::size_t>(station);
  if (i < plan.names.size() && !plan.names[i].empty()) return plan.names[i];
  return fmt::format("{} {}", plan.area.name, station + 1);
}

PlannedArea plan_area(const MissionConfig& config, const nav::SiteMap& map, const AreaTask& task,
                      const std::optional<Eigen::Vector2d>& start_m, std::uint64_t seed,
                      int threads) {
  PlannedArea planned{
      .plan = {}, .roads = {task.area, config.robot.body.radius_m}, .unreachable = {}};
  AreaPlan& plan = planned.plan;
  plan.area = task.area;
  plan.mode = task.mode == AreaMode::robot ? "robot" : "manual";
  plan.walls = planning::walls_of(map, task.area);
  choose_stations(config, seed, threads, plan);
  plan.roadmap_m = planned.roads.roadmap().polylines();
  plan_tour(planned, start_m, config.return_home && task.mode == AreaMode::robot);
  return planned;
}

std::vector<int> tour_from(const Eigen::Vector2d& here_m, const AreaPlan& plan,
                           const std::vector<int>& stations, const nav::Roadmap& roadmap,
                           const std::optional<Eigen::Vector2d>& home_m) {
  std::vector<Eigen::Vector2d> stops_m{here_m};
  for (const int s : stations)
    stops_m.push_back(nav::to_m(plan.cover.stations[static_cast<std::size_t>(s)].at.position));
  if (home_m) stops_m.push_back(*home_m);
  planning::TourProblem problem{
      .cost = road_lengths(roadmap, stops_m), .start = 0, .closed = home_m.has_value()};
  if (home_m) {  // Who comes back to the start has come home.
    for (auto& row : problem.cost) {
      row.front() = row.back();
      row.pop_back();
    }
    problem.cost.pop_back();
  }
  const planning::Tour tour = planning::solve_tour(problem);
  std::vector<int> order;
  for (const auto* stops : {&tour.order, &tour.unreachable})
    for (const int stop : *stops)
      if (stop > 0) order.push_back(stations[static_cast<std::size_t>(stop - 1)]);
  return order;
}

std::vector<PlannedArea> plan_areas(const MissionConfig& config, const nav::SiteMap& map,
                                    const SiteTasks& tasks, int threads) {
  std::vector<PlannedArea> areas;
  for (std::size_t t = 0; t < tasks.tasks.size(); ++t) {
    if (tasks.tasks[t].mode == AreaMode::skip) continue;
    std::optional<Eigen::Vector2d> start_m;
    if (static_cast<int>(t) == tasks.start_area) start_m = tasks.start.position_m;
    areas.push_back(plan_area(config, map, tasks.tasks[t], start_m, config.seed + t, threads));
  }
  return areas;
}

}  // namespace mission
