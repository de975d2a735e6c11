// How a survey goes on with a run that was cut off or ended early: everything as it was, then the
// stations that are left.
#include <fmt/format.h>

#include <set>

#include "mission/json_text.hpp"
#include "mission/survey.hpp"
#include "planning/spans.hpp"

namespace mission {

// Stations are planned again from the same inputs, which gives the same ones; what the scans showed
// is filled in again as it came.
hal::Task<void> Survey::take_up() {
  const RunHistory& past = *parts_.past;
  if (past.planned && past.planned->checksum != planned().checksum)
    throw CannotGoOn(
        "the plan is not the one that this run has: it was made by another version of the program; "
        "go on with that one, or begin anew with --restart");
  const std::function<void()> work = [this] { redo(); };
  co_await parts_.compute.run(work);
  if (!past.planned) co_await keep_plan();
  if (config_.disk.home() && !past.ended && past.where)
    say_disk(
        "the run's end was not written: the robot is taken to stand where the run last knew it to "
        "be; if it went home for its disk, `resume from-start` at a service's console, or --resume "
        "--from-start, tells that it stands at its start");
  tour_the_rest();
  decide({{"t_s", now_s()},
          {"decision", "resumed"},
          {"after", past.why_ended()},
          {"scans", record_.scans.size()},
          {"dropped", record_.dropped.size()},
          {"at", exact_json(pilot_.pose())}});
}

void Survey::redo() {
  const RunHistory& past = *parts_.past;
  RegistrarState registrar;
  for (const RunStep& step : past.steps) {
    std::visit([this](const auto& done) { redo(done); }, step);
    if (const auto* scan = std::get_if<ScanDone>(&step); scan != nullptr && scan->registered)
      scan->registered->apply(registrar);
    if (const auto* closed = std::get_if<TourClosed>(&step); closed != nullptr && closed->registrar)
      registrar = *closed->registrar;
  }
  registrar_.take_up(registrar, [this](int number) {
    const std::uint64_t checksum = beams_checksums_[static_cast<std::size_t>(number - 1)];
    return scan_points(parts_.store.beams(number, checksum).value(), Eigen::Isometry3d::Identity());
  });
  mend_scans();
  energy_.take_up(past.so_far.spent, past.so_far.energy_scans);
  before_s_ = past.so_far.mission_s - hal::seconds(parts_.clock.now() - began_);
  record_.driven_total_m = past.so_far.driven_m;
  record_.moving = past.so_far.moving;
  record_.registration = past.so_far.registration;
  record_.grid = model_->map().grid();
  record_.resumed = past.resumed;
  record_.notes.push_back(
      fmt::format("this run went on, for the {}. time, with {} scans that it had: {}",
                  record_.resumed, record_.scans.size(), past.why_ended()));
}

void Survey::redo(const LegDone& leg) {
  record_.driven_m.push_back(leg.track_m);
  if (!leg.touched_m.empty() && tasks_.start_area >= 0)
    roads_[static_cast<std::size_t>(tasks_.start_area)].close(leg.touched_m, Pilot::kTouchedSideM);
}

void Survey::redo(const ScanDone& done) {
  ScanRecord scan = done.scan;
  const bool refused = scan.fit.verdict == ScanVerdict::refused;
  if (!record_.scans.empty()) record_.scans.back().visible_to_next = done.visible_before;
  const hal::ScanCloud cloud = parts_.store.beams(scan.number, done.beams_checksum).value();
  beams_checksums_.push_back(done.beams_checksum);
  scan.pattern = cloud.pattern;
  if (done.view) {
    model_->exclude(done.view->cell.voxel);
    ++views_taken_;
  }
  if (!refused) {
    const Eigen::Isometry3d T_W_S =
        scanner_pose(scan.believed, scan.ground_z_m, config_.robot.scanner.height_m);
    const Stop stop{.name = scan.name,
                    .task = done.view ? done.view->cell.task : 0,
                    .pose = scan.planned,
                    .station = nullptr,
                    .view = done.view ? &*done.view : nullptr};
    insert(cloud, scan_points(cloud, T_W_S), T_W_S, stop, scan);
  } else {
    record_.notes.push_back(refused_note(scan));
  }
  const VoxelCounts now = model_->counts();
  if (now.seen_occupied != scan.after.seen_occupied || now.unseen != scan.after.unseen)
    record_.notes.push_back(fmt::format(
        "scan {} ({}) filled the map otherwise than it did before: another version of the program "
        "took it",
        scan.number, scan.name));
  record_.scans.push_back(std::move(scan));
}

void Survey::redo(const TourClosed& closed) {
  scans_closed_ = closed.scans;
  if (!closed.moved) return;
  for (const TourClosed::Scan& pose : closed.poses) {
    ScanRecord& scan = record_.scans.at(static_cast<std::size_t>(pose.number - 1));
    scan.believed = pose.believed;
    scan.claim(pose.covariance);
  }
  fill_anew(false);
  (void)count_again();
}

void Survey::redo(const StationDropped& dropped) {
  record_.dropped.push_back(dropped.station);
  if (dropped.view) model_->exclude(dropped.view->cell.voxel);
}

// Roads that were closed for now are open again, and what lies behind them counts again.
void Survey::redo(const ViewsLeftOut& left_out) {
  (void)count_again();
  if (left_out.closed_for_now) return;
  for (const NextView& view : left_out.views) {
    model_->exclude(view.cell.voxel);
    left_out_.push_back(view);
  }
  left_out_at_ = roads_[static_cast<std::size_t>(tasks_.start_area)].openings();
}

void Survey::redo(const StationReplaced& replaced) {
  const auto area = [](const AreaPlan& plan) -> const std::string& { return plan.area.name; };
  const auto plan = std::ranges::find(record_.plans, replaced.area, area);
  if (plan == record_.plans.end()) return;
  const auto t = static_cast<std::size_t>(plan - record_.plans.begin());
  for (const StationReplaced::Station& station : replaced.stations) {
    const planning::Candidate at{nav::to_mm(station.at.position_m), station.at.heading_rad};
    auto sees = planning::visible_walls(at, plan->walls, sensor_limits(config_.robot.scanner));
    const double sees_m = planning::nm_to_m(planning::length_nm(planning::spans_of(sees)));
    add_station(t, station.name, {at, std::move(sees), sees_m, station.adds_m, station.overlaps_m});
  }
  note_instead(replaced);
}

// Points in W are written from what was measured wherever they are not whole, or as from an earlier
// pose: the run was cut off while they were corrected.
void Survey::mend_scans() {
  for (const ScanRecord& scan : record_.scans) {
    const Eigen::Isometry3d T_W_S =
        scanner_pose(scan.believed, scan.ground_z_m, config_.robot.scanner.height_m);
    const auto there = read_ply(parts_.store.scan_path(scan.number));
    if (there && there->T_W_S && there->T_W_S->matrix() == T_W_S.matrix() &&
        there->W_points_m.size() == scan.points)
      continue;
    const std::uint64_t checksum = beams_checksums_[static_cast<std::size_t>(scan.number - 1)];
    save_points(scan, scan_points(parts_.store.beams(scan.number, checksum).value(), T_W_S), T_W_S);
    record_.notes.push_back(fmt::format("{} was written again from what was measured: {}",
                                        parts_.store.scan_path(scan.number).filename().string(),
                                        there ? "its pose is another" : there.error().text()));
  }
}

// What has been scanned or dropped comes first in each tour, the rest behind it: in the best order
// from where the robot stands.
void Survey::tour_the_rest() {
  std::set<std::pair<std::string, std::string>> done;
  for (const ScanRecord& scan : record_.scans)
    if (!scan.next_best_view) done.emplace(scan.area, scan.name);
  const auto scanned = done;
  for (const DroppedStation& station : record_.dropped) done.emplace(station.area, station.name);
  for (std::size_t t = 0; t < record_.plans.size(); ++t) {
    AreaPlan& plan = record_.plans[t];
    const auto rest = std::ranges::stable_partition(plan.tour, [&](int s) {
      return done.contains({plan.area.name, station_name(plan, s)});
    });
    dealt_with_[t] = static_cast<std::size_t>(rest.begin() - plan.tour.begin());
    for (auto s = plan.tour.begin(); s != rest.begin(); ++s)
      if (scanned.contains({plan.area.name, station_name(plan, *s)}))
        covered_m_ += plan.cover.stations[static_cast<std::size_t>(*s)].adds_m;
    stations_done_ += dealt_with_[t];
    if (static_cast<int>(t) != tasks_.start_area || dealt_with_[t] == 0) continue;
    tours_next_ = dealt_with_[t];
    plan.way_m.clear();  // Of a tour that is no more.
    const std::vector<int> left(rest.begin(), rest.end());
    const std::optional<Eigen::Vector2d> home_m =
        config_.return_home ? std::optional(tasks_.start.position_m) : std::nullopt;
    std::ranges::copy(tour_from(pilot_.pose().position_m, plan, left, roads_[t].roadmap(), home_m),
                      rest.begin());
  }
}

}  // namespace mission
