#include "mission/plan_preview.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <numbers>

#include "mission/pilot.hpp"
#include "mission/progress.hpp"
#include "mission/report_parts.hpp"
#include "nav/polygons.hpp"

namespace mission {
namespace {

constexpr std::size_t kGapsShown = 10;  // Of each reason, in text.
constexpr double kSecondsPerHour = 3600;

double degrees(double angle_rad) {
  return angle_rad * 180 / std::numbers::pi;
}

const planning::Station& station_at(const AreaPlan& plan, int station) {
  return plan.cover.stations[static_cast<std::size_t>(station)];
}

// From the start through the tour, and home where the mission says so; notes the way.
double drive_s(const MissionConfig& config, PlannedArea& planned, const hal::Pose2& start) {
  std::vector<hal::Pose2> stops{start};
  for (const int s : planned.plan.tour) stops.push_back(pose_of(station_at(planned.plan, s).at));
  if (config.return_home && !planned.plan.tour.empty()) stops.push_back(start);
  double total_s = 0;
  for (std::size_t i = 1; i < stops.size(); ++i) {
    const auto route = planned.roads.roadmap().route(stops[i - 1].position_m, stops[i].position_m);
    if (!route) continue;
    total_s += drive_time_s(config.robot.body, *route, stops[i - 1], stops[i]);
    planned.plan.way_m.push_back(route->points_m);
  }
  return total_s;
}

PlanCost cost_of(const MissionConfig& config, PlannedArea& planned, const hal::Pose2& start) {
  const RobotConfig& robot = config.robot;
  const auto scans = static_cast<double>(planned.plan.tour.size());
  PlanCost cost;
  cost.scan_s = scans * robot.scanner.scan_s;
  if (planned.plan.mode == "robot") {
    cost.drive_s = drive_s(config, planned, start);
    cost.battery_wh = (cost.drive_s * robot.battery.drive_w + cost.scan_s * robot.battery.scan_w) /
                      kSecondsPerHour;
  } else {
    cost.placement_s = scans * robot.sim.placement_s;
    cost.battery_wh = cost.total_s() * robot.battery.idle_w / kSecondsPerHour;
  }
  return cost;
}

std::string percent(std::optional<double> value) {
  return value ? fmt::format("{:.1f} %", 100 * *value) : "none";
}

std::string cost_text(const PlanCost& cost) {
  std::string text = duration_text(cost.total_s()) + " (";
  if (cost.drive_s > 0) text += "drive " + duration_text(cost.drive_s) + ", ";
  text += "scan " + duration_text(cost.scan_s);
  if (cost.placement_s > 0) text += ", set up by hand " + duration_text(cost.placement_s);
  return text + ")";
}

std::string coverage_text(const Coverage& coverage) {
  return fmt::format("{} of {:.1f} m target wall, {} of the {:.1f} m that can be covered",
                     percent(coverage.of_target()), coverage.target_m,
                     percent(coverage.of_coverable()), coverage.coverable_m);
}

std::string stations_text(const AreaPlan& plan) {
  if (plan.tour.empty()) return "";
  std::size_t width = 7;
  for (const int s : plan.tour) width = std::max(width, station_name(plan, s).size());
  std::string text = fmt::format("   # {:<{}}       x m       y m   sees m   adds m  overlaps m\n",
                                 "station", width);
  int number = 0;
  for (const int s : plan.tour) {
    const planning::Station& station = station_at(plan, s);
    const Eigen::Vector2d at_m = nav::to_m(station.at.position);
    text += fmt::format("{:4} {:<{}} {:9.2f} {:9.2f} {:8.1f} {:8.1f} {:11.1f}\n", ++number,
                        station_name(plan, s), width, at_m.x(), at_m.y(), station.sees_m,
                        station.adds_m, station.overlaps_m);
  }
  return text;
}

// Reason by reason, that with the most wall first; of each its longest pieces.
std::string uncovered_text(const std::vector<GapStretch>& stretches) {
  struct Group {
    double length_m{};
    std::vector<const GapStretch*> pieces;
  };
  std::map<std::string_view, Group> by_reason;
  for (const GapStretch& gap : stretches) {
    if (gap.length_m <= kGapToldM) break;  // Longest first.
    Group& group = by_reason[why_text(gap.why).word];
    group.length_m += gap.length_m;
    group.pieces.push_back(&gap);
  }
  std::vector<Group> groups;
  for (auto& [word, group] : by_reason) groups.push_back(std::move(group));
  std::ranges::stable_sort(groups, std::ranges::greater{}, &Group::length_m);
  std::string text;
  for (const Group& group : groups) {
    const Why why = why_text(group.pieces.front()->why);
    text += fmt::format("  not covered, {}: {:.1f} m in {} piece{}. {}\n    {}\n", why.word,
                        group.length_m, group.pieces.size(), group.pieces.size() == 1 ? "" : "s",
                        why.meaning, why.remedy);
    for (std::size_t i = 0; i < std::min(group.pieces.size(), kGapsShown); ++i) {
      const GapStretch& gap = *group.pieces[i];
      text += fmt::format("    {:6.1f} m from ({:.1f}, {:.1f}) to ({:.1f}, {:.1f})\n", gap.length_m,
                          gap.from_m.x(), gap.from_m.y(), gap.to_m.x(), gap.to_m.y());
    }
    if (group.pieces.size() > kGapsShown)
      text += fmt::format("    and {} shorter ones; --json names every one\n",
                          group.pieces.size() - kGapsShown);
  }
  return text;
}

std::string area_text(const PlanPreview& preview, const report::Facts& facts, std::size_t i) {
  const AreaPlan& plan = preview.record.plans[i];
  std::string text = fmt::format(
      "\n{} ({}, {:.0f} m2): {} station{}{}\n", plan.area.name,
      plan.mode == "robot" ? "by the robot" : "by hand", nav::area_m2(plan.area.standable),
      plan.tour.size(), plan.tour.size() == 1 ? "" : "s",
      plan.mode == "robot" ? fmt::format(", tour {:.1f} m", plan.tour_m) : "");
  text += "  covers " + coverage_text(coverage_of(plan, facts.areas[i])) + "\n";
  text += "  takes " + cost_text(preview.costs[i]) + "\n" + "  " + plan.cover.end + "\n";
  if (!plan.cover.bound.empty()) text += "  " + plan.cover.bound + "\n";
  for (const planning::OverlapLink& link : plan.cover.overlap.links)
    if (link.bridge)
      text += fmt::format(
          "  weak link: only {} - {} joins their scans to the others'; {:.1f} m "
          "shared\n",
          station_name(plan, link.a), station_name(plan, link.b), link.shared_m);
  text += stations_text(plan);
  for (const DroppedStation& station : preview.record.dropped)
    if (station.area == plan.area.name)
      text += fmt::format("  {} cannot be visited: {}\n", station.name, station.reason);
  return text + uncovered_text(gap_stretches(plan, facts.areas[i].gaps));
}

SavedStation saved(const std::string& area, const std::string& name, const hal::Pose2& pose) {
  SavedStation station;
  station.area = area;
  station.name = name;
  station.x_m = pose.position_m.x();
  station.y_m = pose.position_m.y();
  station.heading_deg = degrees(pose.heading_rad);
  return station;
}

SavedPlan empty_plan(const RunRecord& record, const std::string& made_by) {
  SavedPlan plan;
  plan.site = record.site;
  plan.made_by = made_by;
  plan.seed = record.seed;
  return plan;
}

}  // namespace

PlanCost& PlanCost::operator+=(const PlanCost& other) {
  drive_s += other.drive_s;
  scan_s += other.scan_s;
  placement_s += other.placement_s;
  battery_wh += other.battery_wh;
  return *this;
}

std::size_t PlanPreview::stations() const {
  std::size_t stations = 0;
  for (const AreaPlan& plan : record.plans) stations += plan.tour.size();
  return stations;
}

double PlanPreview::tours_m() const {
  double tour_m = 0;
  for (const AreaPlan& plan : record.plans)
    if (plan.mode == "robot") tour_m += plan.tour_m;
  return tour_m;
}

PlanPreview preview_plan(const MissionConfig& config, const nav::SiteMap& map,
                         const SiteTasks& tasks, int threads) {
  PlanPreview preview;
  preview.record.mission = config.name;
  preview.record.site = map.name;
  preview.record.robot = config.robot.name;
  preview.record.seed = config.seed;
  preview.record.map = map;
  preview.record.notes = tasks.notes;
  for (PlannedArea& planned : plan_areas(config, map, tasks, threads)) {
    preview.costs.push_back(cost_of(config, planned, tasks.start));
    preview.cost += preview.costs.back();
    for (DroppedStation& station : planned.unreachable)
      preview.record.dropped.push_back(std::move(station));
    preview.record.plans.push_back(std::move(planned.plan));
  }
  return preview;
}

std::string preview_text(const MissionConfig& config, const PlanPreview& preview) {
  const auto facts = report::Facts::as_planned(preview.record);
  const BatteryConfig& battery = config.robot.battery;
  std::string text = fmt::format("{}: {} stations in {} area{}, seed {}\n", preview.record.site,
                                 preview.stations(), preview.record.plans.size(),
                                 preview.record.plans.size() == 1 ? "" : "s", preview.record.seed);
  text += "  covers " + coverage_text(facts.all) + "\n";
  text += fmt::format("  drives {:.1f} m; takes {}\n", preview.tours_m(), cost_text(preview.cost));
  text += fmt::format("  battery {:.0f} of {:.0f} Wh ({:.0f} %){}\n", preview.cost.battery_wh,
                      battery.capacity_wh, 100 * preview.cost.battery_wh / battery.capacity_wh,
                      preview.cost.battery_wh > battery.capacity_wh
                          ? ": NOT enough; plan to charge or split the mission"
                          : "");
  for (std::size_t i = 0; i < preview.record.plans.size(); ++i)
    text += area_text(preview, facts, i);
  return text;
}

std::string preview_svg(const PlanPreview& preview) {
  const auto facts = report::Facts::as_planned(preview.record);
  return report::site_map_svg(
      facts, preview.record.site + ": plan of Phase I",
      fmt::format(
          "{} stations, {} of the coverable wall, {:.0f} m to drive, {:.0f} minutes; seed {}",
          preview.stations(), percent(facts.all.of_coverable()), preview.tours_m(),
          preview.cost.total_s() / 60, preview.record.seed));
}

SavedPlan plan_of(const PlanPreview& preview) {
  SavedPlan result = empty_plan(preview.record, "vantage plan");
  for (const AreaPlan& plan : preview.record.plans)
    for (std::size_t s = 0; s < plan.cover.stations.size(); ++s) {
      const int station = static_cast<int>(s);
      if (std::ranges::find(plan.tour, station) == plan.tour.end()) continue;
      result.stations.push_back(
          saved(plan.area.name, station_name(plan, station), pose_of(plan.cover.stations[s].at)));
    }
  return result;
}

SavedPlan plan_of(const RunRecord& record) {
  SavedPlan result = empty_plan(record, "vantage rehearse");
  for (const AreaPlan& plan : record.plans) {
    int views = 0;
    for (const ScanRecord& scan : record.scans) {
      if (scan.area != plan.area.name) continue;
      const std::string name =
          scan.next_best_view ? fmt::format("{} view {}", plan.area.name, ++views) : scan.name;
      result.stations.push_back(saved(plan.area.name, name, scan.planned));
    }
  }
  return result;
}

}  // namespace mission
