// Phase I before anything moves: what the plan covers, takes and uses up. Pure.
#pragma once

#include <boost/json/object.hpp>
#include <string>
#include <vector>

#include "mission/plan.hpp"
#include "mission/plan_file.hpp"
#include "mission/record.hpp"

namespace mission {

// What a tour takes: the follower's own time on every leg, in-place turns included.
struct PlanCost {
  double drive_s{};
  double scan_s{};
  double placement_s{};  // A person carries the scanner there and sets it up.
  double battery_wh{};

  double total_s() const { return drive_s + scan_s + placement_s; }
  PlanCost& operator+=(const PlanCost& other);
};

struct PlanPreview {
  RunRecord record;             // Without scans; stations that no road leads to are `dropped`.
  std::vector<PlanCost> costs;  // One per record.plans.
  PlanCost cost;                // Of all.

  std::size_t stations() const;  // In the tours.
  double tours_m() const;        // Of the robot.
};

// Uncovered stretches of wall up to here are not told one by one.
inline constexpr double kGapToldM = 0.5;

PlanPreview preview_plan(const MissionConfig& config, const nav::SiteMap& map,
                         const SiteTasks& tasks, int threads);

// One screen a site: areas, stations in the order of the tour, what stays uncovered and why.
std::string preview_text(const MissionConfig& config, const PlanPreview& preview);

// {"ok", "site", "seed", "areas": [{"name", ..., "stations": [...], "uncovered_over_0.5_m":
// [...]}],
//  "total": {...}}; lengths in metres, rounded to 1 mm.
boost::json::object preview_json(const MissionConfig& config, const PlanPreview& preview);

// A map of its own, as SVG.
std::string preview_svg(const PlanPreview& preview);

// The stations, to be toured by a mission with `plan`.
SavedPlan plan_of(const PlanPreview& preview);

// What a run visited, next best views after the stations, area by area in the order visited.
SavedPlan plan_of(const RunRecord& record);

}  // namespace mission
