// Phase I for a whole site: every free area gets its stations, its roadmap and its tour. Pure.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "mission/config.hpp"
#include "mission/record.hpp"
#include "mission/roads.hpp"

namespace mission {

// How an area is scanned, after the map and the mission have had their say.
enum class AreaMode { robot, manual, skip };

struct AreaTask {
  nav::FreeArea area;
  AreaMode mode{};
};

struct SiteTasks {
  std::vector<AreaTask> tasks;  // Robot areas first, then manual, then skipped; by name within.
  hal::Pose2 start;             // Where the robot stands before the mission.
  int start_area = -1;          // tasks[start_area] holds the start; -1 without a robot area.
  std::vector<std::string> notes;
};

// Decides who scans which area. Regions named in the mission get what it says; where it is silent,
// the robot takes the area it stands in and a person carries the scanner into the others that are
// at least manual_area_min_m2 large (with a plan file: that it has stations in). Without a start in
// the map the robot is assumed at a point of the largest robot area, and a note says so.
SiteTasks assign_areas(const MissionConfig& config, const nav::SiteMap& map,
                       const std::vector<nav::FreeArea>& areas);

struct PlannedArea {
  AreaPlan plan;  // What the report shows.
  Roads roads;
  std::vector<DroppedStation> unreachable;  // Planned, but no road leads there from the start.
};

// Plans one area (paper, Algorithm 1 and section 5.2.1), or takes its stations from config.plan.
// `start` is where the robot stands; empty for a person, whose tour then begins at the first
// station. The tour is closed when config.return_home is set and the robot drives it.
PlannedArea plan_area(const MissionConfig& config, const nav::SiteMap& map, const AreaTask& task,
                      const std::optional<Eigen::Vector2d>& start_m, std::uint64_t seed,
                      int threads);

// What the config says, as planning takes it.
planning::SensorLimits sensor_limits(const ScannerConfig& scanner);
planning::CoverConfig cover_config(const Phase1Config& phase1);

hal::Pose2 pose_of(const planning::Candidate& candidate);

// "inner 3", or as the plan file calls it.
std::string station_name(const AreaPlan& plan, int station);

// Every area that is scanned, in the order of the tasks; each draws with its own seed.
std::vector<PlannedArea> plan_areas(const MissionConfig& config, const nav::SiteMap& map,
                                    const SiteTasks& tasks, int threads);

// The same stations, so that the way from here to all of them, and home if there is one, is the
// shortest; those that no road leads to come last.
std::vector<int> tour_from(const Eigen::Vector2d& here_m, const AreaPlan& plan,
                           const std::vector<int>& stations, const nav::Roadmap& roadmap,
                           const std::optional<Eigen::Vector2d>& home_m);

}  // namespace mission
