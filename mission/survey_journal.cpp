// What a survey tells its journal: what going on after a cut needs.
#include <fmt/format.h>

#include <cmath>

#include "hal/angles.hpp"
#include "mission/checksum.hpp"
#include "mission/json_fields.hpp"
#include "mission/survey.hpp"

namespace mission {
namespace {

// On the way a robot tells where it is once in so many metres, and when it has turned by so much:
// it is cut off near one of these places.
constexpr double kPlaceEveryM = 1, kPlaceEveryRad = 0.2;
constexpr hal::Duration kPlacePause = std::chrono::milliseconds(200);

}  // namespace

// Durable when it returns. A survey that nobody could go on with goes on no farther either: see
// watch_disk().
hal::Task<void> Survey::keep(EventText event) {
  if (parts_.journal == nullptr) co_return;
  (void)co_await parts_.journal->append(std::move(event.kind), std::move(event.text));
}

void Survey::tell(EventText event) {
  if (parts_.journal != nullptr) parts_.journal->tell(std::move(event.kind), std::move(event.text));
}

RunPlanned Survey::planned() const {
  RunPlanned planned;
  std::string places;
  for (const AreaPlan& plan : record_.plans)
    for (const int s : plan.tour) {
      planned.stations.emplace_back(plan.area.name, station_name(plan, s));
      places +=
          JsonOut::of(pose_of(plan.cover.stations[static_cast<std::size_t>(s)].at)).as_string();
    }
  planned.checksum = checksum_of(places);
  return planned;
}

SoFar Survey::so_far() const {
  return {.mission_s = now_s(),
          .spent = energy_.spent(),
          .energy_scans = energy_.scans(),
          .driven_m = record_.driven_total_m,
          .moving = record_.moving,
          .registration = record_.registration};
}

Whereabouts Survey::whereabouts() const {
  Whereabouts where{pilot_.pose(), pilot_.covariance(), std::nullopt, 0};
  if (!parts_.truths) return where;
  const Truths truths = parts_.truths();
  where.truth = truths.robot;
  where.ground_z_m = truths.ground_z_m;
  return where;
}

hal::Task<void> Survey::keep_plan() {
  co_await keep(event_of(planned()));
}

hal::Task<void> Survey::keep_scan(const Stop& stop) {
  if (parts_.journal == nullptr) co_return;
  ScanDone done;
  done.scan = record_.scans.back();
  done.beams_checksum = beams_checksums_.back();
  if (parts_.truths) done.scan.truth = parts_.truths().scan;
  if (stop.view != nullptr) done.view = *stop.view;
  if (record_.scans.size() > 1)
    done.visible_before = record_.scans[record_.scans.size() - 2].visible_to_next;
  if (config_.registration.scans) done.registered = registrar_.last_kept();
  done.so_far = so_far();
  done.where = whereabouts();
  told_scan_ = true;
  co_await keep(event_of(done));
}

hal::Task<void> Survey::keep_closing(bool moved) {
  if (parts_.journal == nullptr) co_return;
  TourClosed closed;
  closed.scans = static_cast<int>(record_.scans.size());
  closed.moved = moved;
  if (moved)
    for (const ScanRecord& scan : record_.scans)
      closed.poses.push_back({scan.number, scan.believed, scan.covariance});
  closed.registrar = registrar_.state();
  closed.so_far = so_far();
  co_await keep(event_of(closed));
}

void Survey::tell_leg(const Stop& stop, const LegEnd& leg) {
  if (parts_.journal == nullptr) return;
  tell(event_of(LegDone{.to = stop.name,
                        .arrived = leg.arrived,
                        .track_m = leg.track_m,
                        .touched_m = leg.touched_m,
                        .so_far = so_far(),
                        .where = whereabouts()}));
}

void Survey::tell_drop(const Stop& stop) {
  if (parts_.journal == nullptr) return;
  StationDropped dropped{record_.dropped.back(), std::nullopt};
  if (stop.view != nullptr) dropped.view = *stop.view;
  tell(event_of(dropped));
}

hal::Task<void> Survey::follow(const Stop& stop, LegEnd& leg) {
  leg = co_await pilot_.drive_to(roads_[static_cast<std::size_t>(stop.task)], stop.pose);
}

// Ends only by cancellation.
hal::Task<void> Survey::tell_places() {
  double told_m = pilot_.travelled_m(), told_rad = pilot_.pose().heading_rad;
  for (;;) {
    co_await parts_.clock.sleep_for(kPlacePause);
    const double turned_rad = std::abs(hal::wrapped(pilot_.pose().heading_rad - told_rad));
    if (pilot_.travelled_m() - told_m < kPlaceEveryM && turned_rad < kPlaceEveryRad) continue;
    told_m = pilot_.travelled_m();
    told_rad = pilot_.pose().heading_rad;
    tell(event_of(whereabouts()));
  }
}

// Nothing runs beside it any more. False: the journal lacks something.
bool Survey::keep_end() {
  if (parts_.journal == nullptr) return true;
  EventText event = event_of(RunEnded{record_.completed, record_.end});
  const auto kept = parts_.journal->append_now(std::move(event.kind), std::move(event.text));
  if (!kept) record_.notes.push_back("its end is not in the journal: " + kept.error().text());
  return static_cast<bool>(kept);
}

bool Survey::keeps_beams() const {
  return parts_.journal != nullptr || (config_.registration.scans && config_.registration.tour_end);
}

}  // namespace mission
