#include "mission/summary.hpp"

#include <algorithm>
#include <boost/json/value_from.hpp>
#include <cmath>
#include <numbers>

#include "mission/json_text.hpp"
#include "mission/leftover.hpp"
#include "mission/report_facts.hpp"

namespace mission {
namespace {

namespace json = boost::json;

double mm(double length_m) {
  return rounded(length_m, 3);
}
double degrees(double angle_rad) {
  return rounded(angle_rad * 180 / std::numbers::pi, 4);
}

json::value share(std::optional<double> value) {
  return value ? json::value(rounded(*value, 5)) : json::value(nullptr);
}

json::object pose_json(const hal::Pose2& pose) {
  return {{"x_m", mm(pose.position_m.x())},
          {"y_m", mm(pose.position_m.y())},
          {"heading_deg", degrees(pose.heading_rad)}};
}

json::object voxels_json(const VoxelCounts& counts) {
  return {{"seen_occupied", counts.seen_occupied},
          {"seen_empty", counts.seen_empty},
          {"unseen", counts.unseen},
          {"boundary_unseen", counts.boundary_unseen}};
}

void add_coverage(json::object& to, const Coverage& coverage) {
  to["target_m"] = mm(coverage.target_m);
  to["coverable_m"] = mm(coverage.coverable_m);
  to["planned_m"] = mm(coverage.planned_m);
  to["covered_m"] = mm(coverage.covered_m);
  to["covered_of_coverable"] = share(coverage.of_coverable());
  to["covered_of_target"] = share(coverage.of_target());
}

json::array uncovered_json(const AreaPlan& plan, const AreaFacts& facts) {
  json::array pieces;
  for (const GapStretch& stretch : gap_stretches(plan, facts.gaps)) {
    if (stretch.length_m <= 0.5) break;  // Longest first.
    pieces.push_back({{"from_m", {mm(stretch.from_m.x()), mm(stretch.from_m.y())}},
                      {"to_m", {mm(stretch.to_m.x()), mm(stretch.to_m.y())}},
                      {"length_m", mm(stretch.length_m)},
                      {"reason", why_text(stretch.why).word}});
  }
  return pieces;
}

json::object overlap_json(const planning::OverlapGraph& graph) {
  json::array weak_links;
  for (const planning::OverlapLink& link : graph.links)
    if (link.bridge)
      weak_links.push_back(
          {{"stations", {link.a + 1, link.b + 1}}, {"shared_m", mm(link.shared_m)}});
  return {{"links", graph.links.size()}, {"parts", graph.parts}, {"weak_links", weak_links}};
}

json::object area_json(const AreaPlan& plan, const AreaFacts& facts) {
  const auto scanned = std::count_if(facts.scan_of_station.begin(), facts.scan_of_station.end(),
                                     [](int scan) { return scan >= 0; });
  json::object area{{"name", plan.area.name},      {"region", plan.area.region},
                    {"mode", plan.mode},           {"stations", plan.cover.stations.size()},
                    {"stations_scanned", scanned}, {"tour_m", mm(plan.tour_m)}};
  add_coverage(area, coverage_of(plan, facts));
  area["end"] = plan.cover.end;
  area["stations_greedy"] = plan.cover.stations_greedy;
  area["stations_at_least"] = plan.cover.stations_at_least;
  area["bound"] = plan.cover.bound;
  area["overlap"] = overlap_json(plan.cover.overlap);
  area["uncovered_over_0.5_m"] = uncovered_json(plan, facts);
  return area;
}

json::object coverage_json(const RunRecord& record) {
  Coverage all;
  json::array areas;
  for (const AreaPlan& plan : record.plans) {
    const AreaFacts facts = area_facts(record, plan);
    all += coverage_of(plan, facts);
    areas.push_back(area_json(plan, facts));
  }
  json::object coverage;
  add_coverage(coverage, all);
  coverage["areas"] = std::move(areas);
  return coverage;
}

// Not rounded, so that what a scan saw can be worked out again as it was.
json::object seen_from_json(const ScanRecord& scan) {
  const hal::ScanPattern& pattern = scan.pattern;
  return {{"x_m", scan.believed.position_m.x()},
          {"y_m", scan.believed.position_m.y()},
          {"ground_z_m", scan.ground_z_m},
          {"heading_rad", scan.believed.heading_rad},
          {"azimuth_first_rad", pattern.azimuth_first_rad},
          {"azimuth_step_rad", pattern.azimuth_step_rad},
          {"elevation_first_rad", pattern.elevation_first_rad},
          {"elevation_step_rad", pattern.elevation_step_rad},
          {"columns", pattern.columns},
          {"rows", pattern.rows}};
}

json::object fit_json(const ScanFit& fit) {
  return {{"verdict", name(fit.verdict)},
          {"reason", fit.reason},
          {"tries", fit.tries},
          {"references", fit.references},
          {"rms_m", rounded(fit.rms_m, 4)},
          {"cloud_to_cloud_m", rounded(fit.cloud_to_cloud_m, 4)},
          {"overlap", rounded(fit.overlap, 4)},
          {"strength_shift", rounded(fit.strength_shift, 4)},
          {"strength_turn", rounded(fit.strength_turn, 4)},
          {"moved_m", rounded(fit.moved_m, 4)},
          {"moved_deg", degrees(fit.moved_rad)},
          {"chi2", rounded(fit.chi2, 3)},
          {"localizer", pose_json(fit.before)}};
}

json::object arrived_json(const ScanRecord& scan) {
  json::object object = pose_json(*scan.arrived);
  object["sigma_position_m"] = rounded(scan.arrived_sigma_m, 4);
  object["sigma_heading_deg"] = degrees(scan.arrived_sigma_rad);
  return object;
}

json::object scan_json(const RunRecord& record, std::size_t index) {
  const ScanRecord& scan = record.scans[index];
  json::object object{{"number", scan.number},
                      {"name", scan.name},
                      {"area", scan.area},
                      {"kind", scan.next_best_view ? "next_best_view" : "station"},
                      {"by_hand", scan.by_hand},
                      {"planned", pose_json(scan.planned)},
                      {"believed", pose_json(scan.believed)},
                      {"sigma_position_m", rounded(scan.sigma_position_m, 4)},
                      {"sigma_heading_deg", degrees(scan.sigma_heading_rad)},
                      {"registration", fit_json(scan.fit)},
                      {"truth", nullptr},
                      {"ground_z_m", mm(scan.ground_z_m)},
                      {"start_s", mm(scan.start_s)},
                      {"end_s", mm(scan.end_s)},
                      {"driven_m", mm(scan.driven_m)},
                      {"beams", scan.beams},
                      {"points", scan.points},
                      {"points_outside_box", scan.points_outside_box}};
  if (scan.arrived) object["arrived"] = arrived_json(scan);
  if (scan.truth) object["truth"] = pose_json(*scan.truth);
  object["seen_from"] = seen_from_json(scan);
  if (scan.next_best_view) {
    object["predicted_voxels"] = scan.predicted_voxels;
    object["resolved_voxels"] = scan.resolved_voxels;
  } else {
    object["adds_m"] = mm(scan.adds_m);
    object["overlaps_m"] = mm(scan.overlaps_m);
  }
  object["occupied_gained"] = occupied_gained(record, index);
  object["after"] = voxels_json(scan.after);
  object["visible_to_next"] = scan.visible_to_next;
  return object;
}

json::array dropped_json(const RunRecord& record) {
  json::array dropped;
  for (const DroppedStation& station : record.dropped) {
    json::object object{{"name", station.name},
                        {"area", station.area},
                        {"planned", pose_json(station.planned)},
                        {"reason", station.reason}};
    if (station.instead)
      object["instead"] = {{"lost_m", mm(station.instead->lost_m)},
                           {"left_m", mm(station.instead->left_m)},
                           {"stations", json::value_from(station.instead->stations)}};
    dropped.push_back(std::move(object));
  }
  return dropped;
}

// "planned" as of what was dropped.
json::array left_out_json(const RunRecord& record) {
  json::array left_out;
  for (const LeftOutView& view : record.left_out)
    left_out.push_back(
        {{"area", view.area}, {"planned", pose_json(view.planned)}, {"voxels", view.voxels}});
  return left_out;
}

json::value truth_json(const std::optional<Truth>& truth) {
  if (!truth) return nullptr;
  const auto visible = static_cast<double>(truth->surface_visible);
  const auto seen = static_cast<double>(truth->surface_seen);
  return {{"surface_visible", truth->surface_visible},
          {"surface_seen", truth->surface_seen},
          {"seen_of_visible", share(visible > 0 ? std::optional(seen / visible) : std::nullopt)},
          {"position_error_max_m", rounded(truth->position_error_max_m, 4)},
          {"position_error_rms_m", rounded(truth->position_error_rms_m, 4)},
          {"heading_error_max_deg", degrees(truth->heading_error_max_rad)},
          {"nees_mean", rounded(truth->nees_mean, 4)},
          {"before_registration_error_max_m", rounded(truth->before_error_max_m, 4)},
          {"before_registration_error_max_deg", degrees(truth->before_error_max_rad)}};
}

json::object files_json(const ProductFacts& products) {
  json::object files{{"cloud_points", products.cloud_points},
                     {"cloud_grid_m", products.cloud_grid_m},
                     {"cloud_grid_doublings", products.cloud_doublings},
                     {"map_ot_offset_m", nullptr}};
  if (const auto& offset_m = products.map_ot_offset_m) {
    files["map_ot_offset_m"] = {offset_m->x(), offset_m->y(), offset_m->z()};
  }
  return files;
}

json::object counts_json(const RunRecord& record) {
  std::size_t planned = 0;
  for (const AreaPlan& plan : record.plans) planned += plan.cover.stations.size();
  const auto views = std::count_if(record.scans.begin(), record.scans.end(),
                                   [](const ScanRecord& scan) { return scan.next_best_view; });
  const auto by_hand = std::count_if(record.scans.begin(), record.scans.end(),
                                     [](const ScanRecord& scan) { return scan.by_hand; });
  return {{"stations_planned", planned},
          {"stations_scanned", static_cast<std::int64_t>(record.scans.size()) - views},
          {"next_best_views", views},
          {"dropped", record.dropped.size()},
          {"by_hand", by_hand}};
}

json::object gnss_json(const GnssCounts& gnss) {
  return {{"fixes", gnss.fixes}, {"refused", gnss.refused}, {"resets", gnss.resets}};
}

json::object profiles_json(const ProfileCounts& profiles) {
  return {{"used", profiles.used}, {"refused", profiles.refused}, {"unlike", profiles.unlike}};
}

json::object registration_json(const RegistrationCounts& counts) {
  return {{"accepted", counts.accepted},
          {"held_in_part", counts.held_in_part},
          {"alone", counts.alone},
          {"refused", counts.refused},
          {"retaken", counts.retaken},
          {"not_followed_by_localizer", counts.unheard},
          {"map_matched", counts.map_matched},
          {"map_unmatched", counts.map_unmatched},
          {"tours_closed", counts.tours_closed},
          {"pairs", counts.pairs},
          {"pairs_at_odds", counts.pairs_odd},
          {"moved_max_m", rounded(counts.moved_max_m, 4)},
          {"moved_max_deg", degrees(counts.moved_max_rad)}};
}

json::object moving_json(const MovingFacts& moving) {
  return {{"legs", moving.legs},
          {"obstacles_met", moving.obstacles_met},
          {"waited_s", mm(moving.waited_s)},
          {"short_of_goal_max_m", mm(moving.short_max_m)}};
}

json::object energy_json(const EnergyFacts& energy) {
  return {{"drive_s", mm(energy.spent.drive_s)},
          {"scan_s", mm(energy.spent.scan_s)},
          {"idle_s", mm(energy.spent.idle_s)},
          {"used_wh", mm(energy.used_wh)},
          {"left_wh", mm(energy.left_wh)},
          {"reserve_wh", mm(energy.reserve_wh)},
          {"forecasts", energy.error.forecasts},
          {"forecast_error_mean_min", mm(energy.error.mean_abs_min)},
          {"forecast_error_max_min", mm(energy.error.max_abs_min)},
          {"forecast_error_mean_share", mm(energy.error.mean_share)}};
}

json::object sensor_json(const ScannerConfig& scanner) {
  return {{"height_m", scanner.height_m},
          {"range_min_m", scanner.range_min_m},
          {"range_max_m", scanner.range_max_m},
          {"grazing_max_deg", scanner.grazing_max_deg},
          {"fov_deg", scanner.fov_deg},
          {"azimuth_step_deg", scanner.azimuth_step_deg},
          {"elevation_step_deg", scanner.elevation_step_deg},
          {"elevation_min_deg", scanner.elevation_min_deg},
          {"elevation_max_deg", scanner.elevation_max_deg}};
}

// Not rounded: the lower corner of the voxel box decides which voxel a point lies in.
json::object grid_json(const planning::VoxelGrid& grid) {
  return {{"min_m", {grid.W_min_m.x(), grid.W_min_m.y(), grid.W_min_m.z()}},
          {"nx", grid.nx},
          {"ny", grid.ny},
          {"nz", grid.nz}};
}

}  // namespace

json::object summarise(const RunRecord& record, const ProductFacts& products) {
  json::object summary{{"mission", record.mission},
                       {"site", record.site},
                       {"robot", record.robot},
                       {"seed", record.seed},
                       {"completed", record.completed},
                       {"end", record.end},
                       {"mission_s", mm(record.mission_s)},
                       {"resumed", record.resumed},
                       {"driven_m", mm(record.driven_total_m)},
                       {"voxel_m", record.voxel_m},
                       {"gain_min_voxels", record.gain_min_voxels},
                       {"gnss", gnss_json(record.gnss)},
                       {"profiles", profiles_json(record.profiles)},
                       {"registration", registration_json(record.registration)},
                       {"moving", moving_json(record.moving)},
                       {"energy", energy_json(record.energy)}};
  summary["sensor"] = sensor_json(record.scanner);
  summary["radius_m"] = record.radius_m;
  summary["margin_m"] = record.margin_m;
  summary["grid"] = grid_json(record.grid);
  summary["density_min_ppm2"] = record.density_min_ppm2;
  summary["foliage"] = record.looks_through_foliage;
  summary["foliage_share_min"] = record.foliage_share_min;
  summary["voxels_set_aside"] = json::value_from(record.set_aside);
  summary["voxels_thin_set_aside"] = json::value_from(record.thin_set_aside);
  summary["voxels_foliage"] = json::value_from(record.foliage);
  summary["counts"] = counts_json(record);
  summary["coverage"] = coverage_json(record);
  summary["voxels"] =
      record.scans.empty() ? json::value(nullptr) : voxels_json(record.scans.back().after);
  summary["leftover"] = leftover_json(record);
  summary["density"] = density_json(record.density);
  json::array scans;
  for (std::size_t i = 0; i < record.scans.size(); ++i) scans.push_back(scan_json(record, i));
  summary["scans"] = std::move(scans);
  summary["dropped"] = dropped_json(record);
  summary["left_out"] = left_out_json(record);
  json::array repairs;
  for (const auto& repair : record.repairs) {
    repairs.push_back({{"where", repair.where}, {"what", repair.what}});
  }
  summary["repairs"] = std::move(repairs);
  summary["notes"] = json::value_from(record.notes);
  summary["truth"] = truth_json(record.truth);
  summary["files"] = files_json(products);
  return summary;
}

}  // namespace mission
