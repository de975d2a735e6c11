// What a survey does about a station that no road leads to any more: what it alone would have
// covered is to be seen from elsewhere.
#include <algorithm>

#include "mission/json_text.hpp"
#include "mission/survey.hpp"

namespace mission {
namespace {

namespace json = boost::json;

// Its own draw for each station that is replaced.
std::uint64_t seed_for(const MissionConfig& config, std::size_t task, int dropped) {
  return config.seed + task + 1'000'003 * (static_cast<std::uint64_t>(dropped) + 1);
}

// "inner 3 b" is the second station in place of "inner 3".
std::string name_instead(const std::string& dropped, std::size_t number) {
  return dropped + " " + static_cast<char>('a' + static_cast<int>(number));
}

}  // namespace

// The walls of the map that the area's scans in hand saw from where they were taken, and those that
// the stations still to come will see.
std::vector<std::vector<planning::WallPiece>> Survey::walls_kept(std::size_t t) const {
  const AreaPlan& plan = record_.plans[t];
  const planning::Visibility visibility(plan.walls, sensor_limits(config_.robot.scanner));
  std::vector<std::vector<planning::WallPiece>> kept;
  for (const ScanRecord& scan : record_.scans)
    if (scan.area == plan.area.name && scan.fit.verdict != ScanVerdict::refused)
      kept.push_back(
          visibility.from({nav::to_mm(scan.believed.position_m), scan.believed.heading_rad}));
  for (std::size_t at = dealt_with_[t]; at < plan.tour.size(); ++at)
    kept.push_back(plan.cover.stations[static_cast<std::size_t>(plan.tour[at])].sees);
  return kept;
}

planning::Replacements Survey::find_instead(std::size_t t, int dropped,
                                            const Eigen::Vector2d& here_m) const {
  const AreaPlan& plan = record_.plans[t];
  const planning::SensorLimits limits = sensor_limits(config_.robot.scanner);
  const auto can_be_reached = [&](const planning::Candidate& at) {
    return roads_[t].roadmap().route(here_m, nav::to_m(at.position)).has_value();
  };
  const planning::LostStation lost{
      .sees = plan.cover.stations[static_cast<std::size_t>(dropped)].sees,
      .kept = walls_kept(t),
      .candidates = planning::draw_candidates(roads_[t].area(), config_.phase1.candidates,
                                              limits.fov_deg, seed_for(config_, t, dropped)),
      .can_be_reached = can_be_reached,
      .overlap_min = config_.phase1.overlap_min};
  return planning::replace_station(lost, plan.walls, limits, threads_);
}

hal::Task<void> Survey::replace(std::size_t t, int dropped) {
  planning::Replacements found;
  const std::function<void()> look = [&, here_m = Eigen::Vector2d(pilot_.pose().position_m)] {
    found = find_instead(t, dropped, here_m);
  };
  co_await parts_.compute.run(look);
  StationReplaced replaced{.area = record_.plans[t].area.name,
                           .name = station_name(record_.plans[t], dropped),
                           .lost_m = found.lost_m,
                           .left_m = found.left_m,
                           .stations = {}};
  json::array stations;
  for (planning::Station& station : found.stations) {
    const std::string name = name_instead(replaced.name, replaced.stations.size());
    replaced.stations.push_back({name, pose_of(station.at), station.adds_m, station.overlaps_m});
    stations.push_back({{"name", name},
                        {"at", exact_json(pose_of(station.at))},
                        {"adds_m", station.adds_m},
                        {"overlaps_m", station.overlaps_m}});
    add_station(t, name, std::move(station));
  }
  decide({{"t_s", now_s()},
          {"decision", "replace"},
          {"name", replaced.name},
          {"lost_m", replaced.lost_m},
          {"left_m", replaced.left_m},
          {"stations", std::move(stations)}});
  tell(event_of(replaced));
  note_instead(replaced);
  if (!replaced.stations.empty()) co_await retour(t, dealt_with_[t]);
}

// As the last of its area's tour.
void Survey::add_station(std::size_t t, std::string name, planning::Station station) {
  AreaPlan& plan = record_.plans[t];
  replacements_.insert(name);
  plan.names.resize(plan.cover.stations.size());
  plan.names.push_back(std::move(name));
  plan.tour.push_back(static_cast<int>(plan.cover.stations.size()));
  plan.cover.stations.push_back(std::move(station));
  std::vector<std::vector<planning::Span>> views;
  for (const planning::Station& of : plan.cover.stations) views.push_back(spans_of(of.sees));
  plan.cover.overlap = planning::overlap_graph(views, config_.phase1.overlap_min);
  ++stations_planned_;
}

void Survey::note_instead(const StationReplaced& replaced) {
  for (DroppedStation& dropped : record_.dropped) {
    if (dropped.area != replaced.area || dropped.name != replaced.name) continue;
    dropped.instead = Instead{replaced.lost_m, replaced.left_m, {}};
    for (const StationReplaced::Station& station : replaced.stations)
      dropped.instead->stations.push_back(station.name);
  }
}

}  // namespace mission
