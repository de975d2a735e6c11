// A plan's preview for scripts: everything that preview_text tells, unshortened.
#include <numbers>

#include "mission/json_text.hpp"
#include "mission/plan_preview.hpp"
#include "mission/report_parts.hpp"
#include "nav/polygons.hpp"

namespace mission {
namespace {

namespace json = boost::json;

json::object cost_json(const PlanCost& cost) {
  return {{"drive", rounded(cost.drive_s / 60, 2)},
          {"scan", rounded(cost.scan_s / 60, 2)},
          {"placement", rounded(cost.placement_s / 60, 2)},
          {"total", rounded(cost.total_s() / 60, 2)}};
}

json::object battery_json(const BatteryConfig& battery, const PlanCost& cost) {
  return {{"used_wh", rounded(cost.battery_wh, 2)},
          {"capacity_wh", battery.capacity_wh},
          {"share", rounded(cost.battery_wh / battery.capacity_wh, 4)}};
}

json::value share(std::optional<double> value) {
  return value ? json::value(rounded(*value, 5)) : json::value(nullptr);
}

void add_coverage(json::object& to, const Coverage& coverage) {
  to["target_m"] = rounded(coverage.target_m, 3);
  to["coverable_m"] = rounded(coverage.coverable_m, 3);
  to["covered_m"] = rounded(coverage.covered_m, 3);
  to["covered_of_target"] = share(coverage.of_target());
  to["covered_of_coverable"] = share(coverage.of_coverable());
}

json::array stations_json(const AreaPlan& plan) {
  json::array stations;
  for (const int s : plan.tour) {
    const planning::Station& station = plan.cover.stations[static_cast<std::size_t>(s)];
    const hal::Pose2 pose = pose_of(station.at);
    stations.push_back({{"name", station_name(plan, s)},
                        {"x_m", pose.position_m.x()},
                        {"y_m", pose.position_m.y()},
                        {"heading_deg", pose.heading_rad * 180 / std::numbers::pi},
                        {"chosen", s + 1},
                        {"sees_m", rounded(station.sees_m, 3)},
                        {"adds_m", rounded(station.adds_m, 3)},
                        {"overlaps_m", rounded(station.overlaps_m, 3)}});
  }
  return stations;
}

json::array uncovered_json(const std::vector<GapStretch>& stretches) {
  json::array pieces;
  for (const GapStretch& gap : stretches) {
    if (gap.length_m <= kGapToldM) break;  // Longest first.
    const Why why = why_text(gap.why);
    pieces.push_back({{"from_m", {rounded(gap.from_m.x(), 3), rounded(gap.from_m.y(), 3)}},
                      {"to_m", {rounded(gap.to_m.x(), 3), rounded(gap.to_m.y(), 3)}},
                      {"length_m", rounded(gap.length_m, 3)},
                      {"reason", why.word},
                      {"meaning", why.meaning},
                      {"remedy", why.remedy}});
  }
  return pieces;
}

json::array unreachable_json(const std::vector<DroppedStation>& dropped, const AreaPlan& plan) {
  json::array list;
  for (const DroppedStation& station : dropped)
    if (station.area == plan.area.name)
      list.push_back({{"name", station.name}, {"reason", station.reason}});
  return list;
}

// Which scans can be registered against each other, and on which links alone others hang.
json::object overlap_json(const AreaPlan& plan) {
  json::array links;
  for (const planning::OverlapLink& link : plan.cover.overlap.links)
    links.push_back({{"a", station_name(plan, link.a)},
                     {"b", station_name(plan, link.b)},
                     {"shared_m", rounded(link.shared_m, 3)},
                     {"weak", link.bridge}});
  return {{"parts", plan.cover.overlap.parts},
          {"weak_links", plan.cover.overlap.weak_links()},
          {"links", std::move(links)}};
}

int stations_at_least(const RunRecord& record) {
  int at_least = 0;
  for (const AreaPlan& plan : record.plans) at_least += plan.cover.stations_at_least;
  return at_least;
}

json::object area_json(const MissionConfig& config, const PlanPreview& preview,
                       const report::Facts& facts, std::size_t i) {
  const AreaPlan& plan = preview.record.plans[i];
  json::object area{{"name", plan.area.name},
                    {"region", plan.area.region},
                    {"mode", plan.mode},
                    {"area_m2", rounded(nav::area_m2(plan.area.standable), 2)},
                    {"candidates", plan.cover.candidates.size()},
                    {"stations_planned", plan.cover.stations.size()}};
  add_coverage(area, coverage_of(plan, facts.areas[i]));
  area["tour_m"] = rounded(plan.tour_m, 3);
  area["minutes"] = cost_json(preview.costs[i]);
  area["battery"] = battery_json(config.robot.battery, preview.costs[i]);
  area["stations"] = stations_json(plan);
  area["unreachable"] = unreachable_json(preview.record.dropped, plan);
  area["uncovered_over_0.5_m"] = uncovered_json(gap_stretches(plan, facts.areas[i].gaps));
  area["end"] = plan.cover.end;
  area["stations_greedy"] = plan.cover.stations_greedy;
  area["stations_at_least"] = plan.cover.stations_at_least;
  area["bound"] = plan.cover.bound;
  area["overlap"] = overlap_json(plan);
  return area;
}

}  // namespace

json::object preview_json(const MissionConfig& config, const PlanPreview& preview) {
  const auto facts = report::Facts::as_planned(preview.record);
  json::array areas;
  for (std::size_t i = 0; i < preview.record.plans.size(); ++i)
    areas.push_back(area_json(config, preview, facts, i));
  json::object total{{"stations", preview.stations()},
                     {"stations_at_least", stations_at_least(preview.record)}};
  add_coverage(total, facts.all);
  total["tour_m"] = rounded(preview.tours_m(), 3);
  total["minutes"] = cost_json(preview.cost);
  total["battery"] = battery_json(config.robot.battery, preview.cost);
  return {{"ok", true},
          {"mission", preview.record.mission},
          {"site", preview.record.site},
          {"robot", preview.record.robot},
          {"seed", preview.record.seed},
          {"total", std::move(total)},
          {"areas", std::move(areas)}};
}

}  // namespace mission
