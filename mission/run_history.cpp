#include "mission/run_history.hpp"

#include <fmt/format.h>

#include <functional>
#include <map>

#include "mission/json_fields.hpp"
#include "mission/json_text.hpp"

namespace mission {

// Found by their arguments: see json_fields.hpp.
template <class Fields>
void describe(Fields& fields, RunInput& of) {
  fields("what", of.what);
  fields("checksum", of.checksum);
}

template <class Fields>
void describe(Fields& fields, RunBegun& of) {
  fields("mission", of.mission);
  fields("backend", of.backend);
  fields("inputs", of.inputs);
}

template <class Fields>
void describe(Fields& fields, RunPlanned& of) {
  fields("stations", of.stations);
  fields("checksum", of.checksum);
}

template <class Fields>
void describe(Fields& fields, Whereabouts& of) {
  fields("believed", of.believed);
  fields("covariance", of.covariance);
  fields("truth", of.truth);
  fields("ground_z_m", of.ground_z_m);
}

template <class Fields>
void describe(Fields& fields, EnergyTimes& of) {
  fields("drive_s", of.drive_s);
  fields("scan_s", of.scan_s);
  fields("idle_s", of.idle_s);
}

template <class Fields>
void describe(Fields& fields, MovingFacts& of) {
  fields("legs", of.legs);
  fields("obstacles_met", of.obstacles_met);
  fields("waited_s", of.waited_s);
  fields("short_max_m", of.short_max_m);
}

template <class Fields>
void describe(Fields& fields, RegistrationCounts& of) {
  fields("accepted", of.accepted);
  fields("held_in_part", of.held_in_part);
  fields("alone", of.alone);
  fields("refused", of.refused);
  fields("retaken", of.retaken);
  fields("unheard", of.unheard);
  fields("map_matched", of.map_matched);
  fields("map_unmatched", of.map_unmatched);
  fields("tours_closed", of.tours_closed);
  fields("pairs", of.pairs);
  fields("pairs_odd", of.pairs_odd);
  fields("moved_max_m", of.moved_max_m);
  fields("moved_max_rad", of.moved_max_rad);
}

template <class Fields>
void describe(Fields& fields, SoFar& of) {
  fields("mission_s", of.mission_s);
  fields("spent", of.spent);
  fields("energy_scans", of.energy_scans);
  fields("driven_m", of.driven_m);
  fields("moving", of.moving);
  fields("registration", of.registration);
}

template <class Fields>
void describe(Fields& fields, LegDone& of) {
  fields("to", of.to);
  fields("arrived", of.arrived);
  fields("track_m", of.track_m);
  fields("touched_m", of.touched_m);
  fields("so_far", of.so_far);
  fields("where", of.where);
}

template <class Fields>
void describe(Fields& fields, VoxelCounts& of) {
  fields("seen_empty", of.seen_empty);
  fields("seen_occupied", of.seen_occupied);
  fields("unseen", of.unseen);
  fields("boundary_unseen", of.boundary_unseen);
}

template <class Fields>
void describe(Fields& fields, ScanFit& of) {
  fields("verdict", of.verdict);
  fields("reason", of.reason);
  fields("tries", of.tries);
  fields("references", of.references);
  fields("rms_m", of.rms_m);
  fields("cloud_to_cloud_m", of.cloud_to_cloud_m);
  fields("overlap", of.overlap);
  fields("strength_shift", of.strength_shift);
  fields("strength_turn", of.strength_turn);
  fields("moved_m", of.moved_m);
  fields("moved_rad", of.moved_rad);
  fields("chi2", of.chi2);
  fields("before", of.before);
}

template <class Fields>
void describe(Fields& fields, ScanRecord& of) {
  fields("number", of.number);
  fields("next_best_view", of.next_best_view);
  fields("name", of.name);
  fields("area", of.area);
  fields("by_hand", of.by_hand);
  fields("planned", of.planned);
  fields("believed", of.believed);
  fields("covariance", of.covariance);
  fields("sigma_position_m", of.sigma_position_m);
  fields("sigma_heading_rad", of.sigma_heading_rad);
  fields("arrived", of.arrived);
  fields("arrived_sigma_m", of.arrived_sigma_m);
  fields("arrived_sigma_rad", of.arrived_sigma_rad);
  fields("fit", of.fit);
  fields("stamp_ns", of.stamp);
  fields("truth", of.truth);
  fields("ground_z_m", of.ground_z_m);
  fields("start_s", of.start_s);
  fields("end_s", of.end_s);
  fields("driven_m", of.driven_m);
  fields("beams", of.beams);
  fields("points", of.points);
  fields("points_outside_box", of.points_outside_box);
  fields("adds_m", of.adds_m);
  fields("overlaps_m", of.overlaps_m);
  fields("predicted_voxels", of.predicted_voxels);
  fields("resolved_voxels", of.resolved_voxels);
  fields("after", of.after);
}

template <class Fields>
void describe(Fields& fields, NextView& of) {
  fields("x", of.cell.voxel.x);
  fields("y", of.cell.voxel.y);
  fields("z", of.cell.voxel.z);
  fields("task", of.cell.task);
  fields("pose", of.pose);
  fields("ground_z_m", of.ground_z_m);
  fields("voxels", of.voxels);
}

template <class Fields>
void describe(Fields& fields, RegistrarScan& of) {
  fields("number", of.number);
  fields("T_W_S", of.T_W_S);
  fields("in_hand", of.in_hand);
  fields("prior_T_W_S", of.prior_T_W_S);
  fields("prior_covariance", of.prior_covariance);
}

template <class Fields>
void describe(Fields& fields, RegistrarLink& of) {
  fields("from", of.from);
  fields("to", of.to);
  fields("T_from_to", of.T_from_to);
  fields("covariance", of.covariance);
}

template <class Fields>
void describe(Fields& fields, RegistrarChange& of) {
  fields("scan", of.scan);
  fields("links", of.links);
  fields("tried", of.tried);
}

template <class Fields>
void describe(Fields& fields, RegistrarState& of) {
  fields("scans", of.scans);
  fields("links", of.links);
  fields("tried", of.tried);
}

template <class Fields>
void describe(Fields& fields, ScanDone& of) {
  fields("scan", of.scan);
  fields("beams_checksum", of.beams_checksum);
  fields("view", of.view);
  fields("visible_before", of.visible_before);
  fields("registered", of.registered);
  fields("so_far", of.so_far);
  fields("where", of.where);
}

template <class Fields>
void describe(Fields& fields, TourClosed::Scan& of) {
  fields("number", of.number);
  fields("believed", of.believed);
  fields("covariance", of.covariance);
}

template <class Fields>
void describe(Fields& fields, TourClosed& of) {
  fields("scans", of.scans);
  fields("moved", of.moved);
  fields("poses", of.poses);
  fields("registrar", of.registrar);
  fields("so_far", of.so_far);
}

template <class Fields>
void describe(Fields& fields, DroppedStation& of) {
  fields("name", of.name);
  fields("area", of.area);
  fields("planned", of.planned);
  fields("reason", of.reason);
}

template <class Fields>
void describe(Fields& fields, StationDropped& of) {
  fields("station", of.station);
  fields("view", of.view);
}

template <class Fields>
void describe(Fields& fields, ViewsLeftOut& of) {
  fields("views", of.views);
  fields("closed_for_now", of.closed_for_now);
}

template <class Fields>
void describe(Fields& fields, StationReplaced::Station& of) {
  fields("name", of.name);
  fields("at", of.at);
  fields("adds_m", of.adds_m);
  fields("overlaps_m", of.overlaps_m);
}

template <class Fields>
void describe(Fields& fields, StationReplaced& of) {
  fields("area", of.area);
  fields("name", of.name);
  fields("lost_m", of.lost_m);
  fields("left_m", of.left_m);
  fields("stations", of.stations);
}

template <class Fields>
void describe(Fields& fields, RunEnded& of) {
  fields("completed", of.completed);
  fields("reason", of.reason);
}

template <class Fields>
void describe(Fields& fields, RunResumed& of) {
  fields("after", of.after);
  fields("scan_lost", of.scan_lost);
}

namespace {

namespace json = boost::json;

template <class T>
EventText text_of(std::string kind, const T& event) {
  return {std::move(kind), json_line(JsonOut::of(event))};
}

template <class T>
T read_as(const json::value& value) {
  T read;
  JsonIn::read(value, read);
  return read;
}

// What each kind of event does to the history.
using Take = std::function<void(RunHistory&, const json::value&)>;

void take_place(RunHistory& history, const Whereabouts& where) {
  history.where = where;
  history.left = false;
}

void take_leg(RunHistory& history, const json::value& value) {
  auto leg = read_as<LegDone>(value);
  history.so_far = leg.so_far;
  take_place(history, leg.where);
  history.steps.emplace_back(std::move(leg));
}

void take_scan(RunHistory& history, const json::value& value) {
  auto scan = read_as<ScanDone>(value);
  if (scan.scan.number != static_cast<int>(history.scans().size()) + 1)
    throw std::runtime_error("scans do not follow each other");
  history.so_far = scan.so_far;
  take_place(history, scan.where);
  history.steps.emplace_back(std::move(scan));
}

void take_closing(RunHistory& history, const json::value& value) {
  auto closed = read_as<TourClosed>(value);
  if (closed.scans != static_cast<int>(history.scans().size()))
    throw std::runtime_error("a tour closes over other scans");
  history.so_far = closed.so_far;
  history.steps.emplace_back(std::move(closed));
}

void take_replacement(RunHistory& history, const json::value& value) {
  auto replaced = read_as<StationReplaced>(value);
  if (history.planned)
    for (const StationReplaced::Station& station : replaced.stations)
      history.planned->stations.emplace_back(replaced.area, station.name);
  history.steps.emplace_back(std::move(replaced));
}

void take_resumed(RunHistory& history, const json::value& value) {
  const auto resumed = read_as<RunResumed>(value);
  if (resumed.scan_lost) {
    if (*resumed.scan_lost != static_cast<int>(history.scans().size()))
      throw std::runtime_error("a scan was lost that was not the last");
    history.lose_last_scan();
  }
  ++history.resumed;
  history.ended.reset();
  history.products = false;
  history.last_stop.clear();
}

const std::map<std::string, Take>& takes() {
  static const std::map<std::string, Take> all{
      {"begun", [](auto& h, const auto& v) { h.begun = read_as<RunBegun>(v); }},
      {"planned", [](auto& h, const auto& v) { h.planned = read_as<RunPlanned>(v); }},
      {"leaves", [](auto& h, const auto&) { h.left = true; }},
      {"place",
       [](auto& h, const auto& v) {
         h.where = read_as<Whereabouts>(v);
         h.left = true;
       }},
      {"leg", take_leg},
      {"scan", take_scan},
      {"tour_closed", take_closing},
      {"dropped", [](auto& h, const auto& v) { h.steps.emplace_back(read_as<StationDropped>(v)); }},
      {"left_out", [](auto& h, const auto& v) { h.steps.emplace_back(read_as<ViewsLeftOut>(v)); }},
      {"replaced", take_replacement},
      {"stopped",
       [](auto& h, const auto& v) { h.last_stop = std::string(v.at("what").as_string()); }},
      {"ended", [](auto& h, const auto& v) { h.ended = read_as<RunEnded>(v); }},
      {"products", [](auto& h, const auto&) { h.products = true; }},
      {"at_start", [](auto& h, const auto&) { h.stands_at_start(); }},
      {"resumed", take_resumed}};
  return all;
}

}  // namespace

std::vector<const ScanDone*> RunHistory::scans() const {
  std::vector<const ScanDone*> all;
  for (const RunStep& step : steps)
    if (const auto* scan = std::get_if<ScanDone>(&step)) all.push_back(scan);
  return all;
}

void RunHistory::stands_at_start() {
  where.reset();
  left = false;
}

// Tours that closed over it have to close again; legs and drops stay as they were.
void RunHistory::lose_last_scan() {
  const int last = static_cast<int>(scans().size());
  std::erase_if(steps, [last](const RunStep& step) {
    const auto* scan = std::get_if<ScanDone>(&step);
    const auto* closed = std::get_if<TourClosed>(&step);
    return (scan != nullptr && scan->scan.number == last) ||
           (closed != nullptr && closed->scans == last);
  });
}

std::string RunHistory::why_ended() const {
  if (ended) return ended->reason;
  std::string why = "the program was cut off";
  if (!last_stop.empty()) why += "; before that: " + last_stop;
  return why;
}

EventText event_of(const RunBegun& event) {
  return text_of("begun", event);
}
EventText event_of(const RunPlanned& event) {
  return text_of("planned", event);
}
EventText event_of(const LegDone& event) {
  return text_of("leg", event);
}
EventText event_of(const ScanDone& event) {
  return text_of("scan", event);
}
EventText event_of(const TourClosed& event) {
  return text_of("tour_closed", event);
}
EventText event_of(const StationDropped& event) {
  return text_of("dropped", event);
}
EventText event_of(const StationReplaced& event) {
  return text_of("replaced", event);
}
EventText event_of(const ViewsLeftOut& event) {
  return text_of("left_out", event);
}
EventText event_of(const RunEnded& event) {
  return text_of("ended", event);
}
EventText event_of(const RunResumed& event) {
  return text_of("resumed", event);
}
EventText event_of(const Whereabouts& event) {
  return text_of("place", event);
}
EventText leaves_event(const std::string& to) {
  return {"leaves", json_line(json::object{{"to", to}})};
}
EventText stopped_event(const std::string& what) {
  return {"stopped", json_line(json::object{{"what", what}})};
}
EventText at_start_event() {
  return {"at_start", "{}"};
}
EventText products_event() {
  return {"products", "{}"};
}

FileResult<RunHistory> read_history(const std::vector<JournalEvent>& events,
                                    const std::filesystem::path& path) {
  RunHistory history;
  for (const JournalEvent& event : events) {
    try {
      const auto take = takes().find(event.kind);
      if (take == takes().end()) throw std::runtime_error("no run writes such an event");
      take->second(history, json::parse(event.text));
    } catch (const std::exception& error) {
      return FileError{
          path, "use", make_error_code(boost::system::errc::bad_message),
          fmt::format("its event {} ({}) is damaged: {}", event.number, event.kind, error.what())};
    }
  }
  return history;
}

}  // namespace mission
