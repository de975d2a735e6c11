#include "mission/survey.hpp"

#include <fmt/format.h>

#include <boost/system/system_error.hpp>

#include "hal/together.hpp"
#include "mission/disk_fault.hpp"
#include "mission/json_text.hpp"
#include "mission/look.hpp"

namespace mission {
namespace {

namespace json = boost::json;

// How far a robot may be from where it was last known to be on its way, and turned (1-sigma): its
// places are told every metre and 0.2 rad, and its drive goes on for up to half a second. No surer
// than that, and it would stand for a pose that is too uncertain (survey_surroundings.cpp).
constexpr double kCutOffM = 0.8, kCutOffRad = 0.22;

// Where it stands when it begins.
hal::Pose2 start_pose(const SiteTasks& tasks, const RunHistory* past) {
  return past != nullptr && past->where ? past->where->believed : tasks.start;
}

// A robot that was cut off on its way rolled on a little, and stands somewhere ahead. Only driving
// tells a heading: however often it was cut off, it may drive.
Eigen::Matrix3d start_covariance(const RunHistory* past) {
  Eigen::Matrix3d covariance = Pilot::start_covariance();
  if (past == nullptr || !past->where) return covariance;
  covariance += past->where->covariance;
  const Eigen::Vector3d cut_off{kCutOffM, kCutOffM, kCutOffRad};
  if (past->left) covariance += Eigen::Matrix3d(cut_off.cwiseAbs2().asDiagonal());
  const double over = std::sqrt(covariance(2, 2)) / (0.95 * Survey::kHeadingSigmaMaxRad);
  if (over > 1) {
    covariance.row(2) /= over;
    covariance.col(2) /= over;
  }
  return covariance;
}

json::object plan_json(const AreaPlan& plan) {
  json::array stations;
  for (const int s : plan.tour) {
    const planning::Station& station = plan.cover.stations[static_cast<std::size_t>(s)];
    json::object entry{{"name", station_name(plan, s)}};
    for (const auto& [key, value] : exact_json(pose_of(station.at))) entry[key] = value;
    entry["sees_m"] = station.sees_m;
    entry["adds_m"] = station.adds_m;
    entry["overlaps_m"] = station.overlaps_m;
    stations.push_back(std::move(entry));
  }
  return {{"area", plan.area.name},
          {"mode", plan.mode},
          {"candidates", plan.cover.candidates.size()},
          {"target_m", plan.cover.target_m},
          {"coverable_m", plan.cover.coverable_m},
          {"covered_m", plan.cover.covered_m},
          {"tour_m", plan.tour_m},
          {"stations", std::move(stations)},
          {"end", plan.cover.end}};
}

}  // namespace

Survey::Survey(const MissionConfig& config, const nav::SiteMap& map, SiteTasks tasks, int threads,
               Parts parts)
    : config_(config),
      map_(map),
      tasks_(std::move(tasks)),
      threads_(threads),
      parts_(parts),
      began_(parts.clock.now()),
      orders_(parts.clock),
      disk_(hal::from_seconds(config.disk.patience_s),
            config.disk.home() && tasks_.start_area >= 0),
      pilot_(config.robot, parts.clock, parts.devices, start_pose(tasks_, parts.past),
             start_covariance(parts.past)),
      model_(std::make_unique<SiteModel>(config, map, tasks_.tasks, threads)),
      matcher_(config.localize.match_map ? std::make_unique<MapMatcher>(map, config.robot.scanner)
                                         : nullptr),
      walls_(parts.devices.obstacles == nullptr
                 ? std::nullopt
                 : std::optional<WallsSoFar>(std::in_place, map, config.localize.match_map,
                                             look_height_m(config.robot))),
      registrar_(config.registration, config.robot.scanner, threads),
      energy_(config.robot.battery, config.robot.scanner.scan_s) {
  record_.mission = config.name;
  record_.site = map.name;
  record_.robot = config.robot.name;
  record_.seed = config.seed;
  record_.map = map;
  record_.notes = tasks_.notes;
  record_.scanner = config.robot.scanner;
  record_.radius_m = config.robot.body.radius_m;
  record_.margin_m = config.margin_m;
  record_.grid = model_->map().grid();
  layers_at_first_ = record_.grid.nz;
  record_.voxel_m = config.phase2.voxel_m;
  record_.gain_min_voxels = config.phase2.gain_min_voxels;
  record_.density_min_ppm2 = config.phase2.density_min_ppm2;
  record_.looks_through_foliage = config.phase2.foliage;
  record_.foliage_share_min = config.phase2.foliage_share_min;
}

hal::Task<void> Survey::run() {
  std::exception_ptr failure;
  orders_.begin(tasks_.start_area >= 0);
  try {
    // The survey decides when it is over; the pilot only keeps it company.
    co_await hal::first_of(survey(), beside());
  } catch (const CannotGoOn& why) {
    record_.end = why.what();
    failure = std::current_exception();
  } catch (const FileFailure& error) {
    record_.end = stop_reason_.empty() ? fault_text(error.error()) : stop_reason_;
    failure = std::make_exception_ptr(CannotGoOn(record_.end));
  } catch (const boost::system::system_error& error) {
    record_.end =
        stop_reason_.empty() ? fmt::format("a device failed: {}", error.what()) : stop_reason_;
    failure = std::current_exception();
  }
  orders_.end();
  note_given();
  record_.mission_s = now_s();
  note_sensors();
  note_gnss();
  note_registration();
  note_moving();
  note_left_out();
  note_ground();
  note_energy();
  record_.set_aside = model_->voxels_set_aside();
  record_.thin_set_aside = model_->thin_set_aside();
  record_.foliage = model_->foliage();
  note_end();
  if (failure) std::rethrow_exception(failure);
}

// On a disk that is full or gone the record alone says it.
void Survey::note_end() {
  const auto decided = parts_.store.decide({{"t_s", now_s()},
                                            {"decision", "end"},
                                            {"completed", record_.completed},
                                            {"reason", record_.end}});
  if (!decided) record_.notes.push_back("its end is no decision: " + decided.error().text());
  uncount_last_scan(keep_end());
}

// What lives with the survey: the pilot keeps the pose, the journal is written, and the disk is
// looked after.
hal::Task<void> Survey::beside() {
  std::vector<hal::Task<void>> all;
  all.push_back(pilot_.track());
  if (parts_.journal != nullptr) all.push_back(parts_.journal->run());
  co_await hal::first_of(watch_disk(), hal::together(std::move(all)));
}

hal::Task<void> Survey::survey() {
  co_await plan_stations();
  if (!config_.disk.home()) {
    co_await survey_site();
    co_return;
  }
  const int first = co_await hal::first_of(survey_site(), until_sent_home());
  if (first != 0) co_await home_without_disk();
}

hal::Task<void> Survey::survey_site() {
  if (parts_.past != nullptr)
    co_await take_up();
  else
    co_await keep_plan();
  co_await know_walls();
  bool ordered_home = false;
  try {
    co_await look_around();
  } catch (const OrderedHome& why) {
    record_.end = why.what();
    ordered_home = true;
  }
  if (ordered_home) co_await leave_for_home();
  (void)co_await go_home(ordered_home);
  note_box();
  record_.completed = !ordered_home;
}

hal::Task<void> Survey::look_around() {
  for (std::size_t t = 0; t < record_.plans.size(); ++t) co_await tour(t);
  if (record_.scans.empty()) throw CannotGoOn(why_no_scan());
  co_await close_tour();
  co_await refine();
}

// Nothing seen is nothing to go on from: no next best view could follow.
std::string Survey::why_no_scan() const {
  if (record_.dropped.empty())
    return "not one scan was taken: the plan has no stations, for no wall of the map can be "
           "scanned from where the robot can stand";
  const DroppedStation& last = record_.dropped.back();
  return fmt::format("not one scan was taken; the last of {} dropped stations, {}: {}",
                     record_.dropped.size(), last.name, last.reason);
}

// A box that is too low hides what the scans saw above it: the operator has to know.
void Survey::note_box() {
  const planning::VoxelGrid& grid = model_->map().grid();
  if (grid.nz > layers_at_first_)
    record_.notes.push_back(
        fmt::format("scans saw higher than the voxel box: it grew from {} to {} layers of {} m",
                    layers_at_first_, grid.nz, grid.voxel_m));
  if (const std::uint64_t above = model_->points_above_box(); above > 0)
    record_.notes.push_back(fmt::format(
        "{} points above the voxel box were left out: it grows for {} points in a layer or above, "
        "up to [phase2] height_max_m = {} m",
        above, SiteModel::kReturnsToGrow, config_.phase2.height_max_m));
  std::uint64_t points = 0;
  for (const ScanRecord& scan : record_.scans) points += scan.points;
  const std::uint64_t outside = model_->points_outside_box();
  if (outside * 1000 > points)
    record_.notes.push_back(fmt::format(
        "{} of {} points lie outside the voxel box: raise [phase2] height_max_m or margin_m",
        outside, points));
}

void Survey::note_ground() {
  if (const double rough_m2 = model_->rough_ground_m2(); rough_m2 > 0)
    record_.notes.push_back(
        fmt::format("scans show {:.1f} m2 of ground that is steeper than slope_max_deg = {} or a "
                    "step of more than step_max_m = {} m: the robot keeps off it",
                    rough_m2, config_.robot.body.slope_max_deg, config_.robot.body.step_max_m));
}

void Survey::note_moving() {
  const MovingFacts& moving = record_.moving;
  if (moving.obstacles_met > 0 || moving.waited_s >= 1)
    record_.notes.push_back(
        fmt::format("something that the map lacks was in the way on {} of {} ways; the robot "
                    "waited {:.0f} s before it in all",
                    moving.obstacles_met, moving.legs, moving.waited_s));
}

// Fixes that the localizer would not follow, and the times when it had to.
void Survey::note_gnss() {
  record_.gnss = pilot_.gnss();
  record_.profiles = pilot_.profiles();
  const auto& [fixes, refused, resets] = record_.gnss;
  if (refused * 100 > fixes)
    record_.notes.push_back(fmt::format(
        "{} of {} satellite fixes disagreed with the localizer and were refused: expect multipath "
        "near walls, or check the receiver's claimed accuracy",
        refused, fixes));
  if (resets > 0)
    record_.notes.push_back(fmt::format(
        "the localizer was lost {} times and started again from satellite fixes: check the scans "
        "taken before against their neighbours",
        resets));
  const hal::Time now = parts_.clock.now();
  for (const auto& [sensor, word, meanwhile] :
       {std::tuple(SensorLog::Sensor::gnss, "satellites were not seen",
                   "wheels, IMU and scans told the way"),
        std::tuple(SensorLog::Sensor::imu, "the IMU was silent", "the wheels told the turns")})
    if (const int losses = pilot_.sensors().losses(sensor); losses > 0)
      record_.notes.push_back(fmt::format("{} {} times, for {:.0f} s in all; {} meanwhile", word,
                                          losses, pilot_.sensors().silent_s(sensor, now),
                                          meanwhile));
}

hal::Task<void> Survey::plan_stations() {
  std::vector<PlannedArea> planned;
  const std::function<void()> plan = [&] { planned = plan_areas(config_, map_, tasks_, threads_); };
  co_await parts_.compute.run(plan);
  take_plans(std::move(planned));
}

void Survey::take_plans(std::vector<PlannedArea> all) {
  for (PlannedArea& planned : all) {
    json::object decision{{"t_s", now_s()}, {"decision", "stations"}};
    for (auto& [key, value] : plan_json(planned.plan)) decision[key] = value;
    decide(std::move(decision));
    for (const DroppedStation& station : planned.unreachable) record_.dropped.push_back(station);
    stations_planned_ += planned.plan.tour.size();
    target_m_ += planned.plan.cover.coverable_m;
    record_.plans.push_back(std::move(planned.plan));
    roads_.push_back(std::move(planned.roads));
  }
  dealt_with_.resize(record_.plans.size());
}

hal::Task<void> Survey::tour(std::size_t t) {
  const AreaPlan& plan = record_.plans[t];
  for (std::size_t& at = dealt_with_[t]; at < plan.tour.size();) {
    const int s = plan.tour[at];
    const planning::Station& station = plan.cover.stations[static_cast<std::size_t>(s)];
    const Stop stop{.name = station_name(plan, s),
                    .task = static_cast<int>(t),
                    .pose = pose_of(station.at),
                    .station = &station,
                    .view = nullptr};
    bool scanned = false;
    if (std::ranges::count(parts_.skip, stop.name) > 0)
      drop(stop, "skipped, as the operator asked");
    else
      scanned = co_await visit(stop);
    if (std::exchange(put_off_, false)) {
      co_await retour(t, at);
      continue;
    }
    ++at;
    ++stations_done_;
    if (scanned) covered_m_ += station.adds_m;
    // Once only: what cannot be reached in its place either is left to next best views.
    if (std::exchange(no_way_, false) && !replacements_.contains(stop.name)) co_await replace(t, s);
  }
  if (static_cast<int>(t) == tasks_.start_area) note_forecasts();
}

hal::Task<void> Survey::refine() {
  while (views_taken_ < config_.phase2.views_max) {
    bring_back();
    left_out_now_ = false;
    std::vector<NextView> views;
    const std::function<void()> look = [&] { views = choose_views(); };
    co_await parts_.compute.run(look);
    if (views.empty() && open_roads()) continue;
    if (views.empty() && scans_closed_ < static_cast<int>(record_.scans.size())) {
      co_await close_tour();
      continue;  // The map may show something worth seeing now.
    }
    if (views.empty()) {
      co_await leave(why_no_view(), true);
      co_return;
    }
    const bool done = co_await take_best_of(views);
    views_taken_ += done;
    const bool some_not_faced = config_.phase2.choose == "gain" && !views.empty() && !battery_low_;
    // Those that were left out are gone by the next look.
    if (!done && !battery_low_ && (left_out_now_ || open_roads())) continue;
    if (!done && !some_not_faced) {
      co_await close_tour();
      std::string reason =
          battery_low_ ? "the battery has to take the robot home: " + record_.dropped.back().reason
                       : "none of the views that would add enough can be reached";
      co_await leave(std::move(reason), false);
      co_return;
    }
  }
  co_await close_tour();
  std::string reason = fmt::format("took views_max = {} next best views", config_.phase2.views_max);
  co_await leave(std::move(reason), false);
}

// The best that can be reached; those tried stay excluded, and leave the views, as do those that no
// road leads to. False: none can.
hal::Task<bool> Survey::take_best_of(std::vector<NextView>& views) {
  battery_low_ = false;
  for (;;) {
    std::optional<std::size_t> chosen;
    ViewsLeftOut left_out;
    const std::function<void()> choose = [&, from_m = Eigen::Vector2d(pilot_.pose().position_m)] {
      chosen = choose_view(views, from_m, left_out);
    };
    co_await parts_.compute.run(choose);
    if (!left_out.views.empty()) tell(event_of(left_out));
    if (!chosen) co_return false;
    const NextView view = views[*chosen];
    views.erase(views.begin() + static_cast<std::ptrdiff_t>(*chosen));
    model_->exclude(view.cell.voxel);
    const Stop stop{.name = fmt::format("NBV {}", views_taken_ + 1),
                    .task = view.cell.task,
                    .pose = view.pose,
                    .station = nullptr,
                    .view = &view};
    const bool done = co_await visit(stop);
    if (done || battery_low_) co_return done;
  }
}

hal::Task<void> Survey::leave(std::string reason, bool stopped_for_gain) {
  record_.end = std::move(reason);
  const std::function<void()> note = [this, stopped_for_gain] { note_leftover(stopped_for_gain); };
  co_await parts_.compute.run(note);
}

// Goes to the stop by robot or by hand and scans. False: dropped, with the reason on record.
hal::Task<bool> Survey::visit_now(const Stop& stop) {
  show(stop);
  ScanRecord scan;
  scan.name = stop.name;
  scan.area = task(stop.task).area.name;
  scan.next_best_view = stop.view != nullptr;
  scan.planned = stop.pose;
  scan.ground_z_m = task(stop.task).area.ground_z_m;
  scan.by_hand = task(stop.task).mode == AreaMode::manual;
  if (stop.station) {
    scan.adds_m = stop.station->adds_m;
    scan.overlaps_m = stop.station->overlaps_m;
  }
  if (!scan.by_hand && !affords(stop)) co_return false;
  const bool there = scan.by_hand ? co_await carry(stop, scan) : co_await drive(stop, scan);
  if (!there) co_return false;
  orders_.scanning(true);
  const bool scanned = co_await acquire(stop, std::move(scan));
  co_return scanned;
}

hal::Task<bool> Survey::drive(const Stop& stop, ScanRecord& scan) {
  if (stop.task != tasks_.start_area) {
    drop(stop, fmt::format("the robot is in area '{}' and no road leads to '{}'",
                           task(tasks_.start_area).area.name, task(stop.task).area.name));
    co_return false;
  }
  const double began_s = now_s();
  LegEnd leg;
  tell(leaves_event(stop.name));
  co_await hal::first_of(follow(stop, leg), tell_places());
  energy_.drove(now_s() - began_s);
  scan.driven_m = leg.driven_m;
  record_.driven_total_m += leg.driven_m;
  record_.driven_m.push_back(leg.track_m);
  note_leg(leg);
  decide({{"t_s", now_s()},
          {"decision", "leg"},
          {"to", stop.name},
          {"arrived", leg.arrived},
          {"driven_m", leg.driven_m},
          {"short_of_goal_m", leg.short_of_goal_m},
          {"obstacles_met", leg.obstacles_met},
          {"waited_s", leg.waited_s},
          {"reason", leg.reason}});
  tell_leg(stop, leg);
  if (leg.drive_lost) throw CannotGoOn(fmt::format("on the way to {}: {}", stop.name, leg.reason));
  if (!leg.arrived) drop(stop, leg.reason);
  no_way_ = !leg.arrived && stop.station != nullptr;
  scan.arrive(pilot_.pose(), pilot_.covariance());
  co_return leg.arrived;
}

void Survey::note_leg(const LegEnd& leg) {
  MovingFacts& moving = record_.moving;
  ++moving.legs;
  moving.obstacles_met += leg.obstacles_met;
  moving.waited_s += leg.waited_s;
  if (leg.arrived) moving.short_max_m = std::max(moving.short_max_m, leg.short_of_goal_m);
}

hal::Task<bool> Survey::carry(const Stop& stop, ScanRecord& scan) {
  const double began_s = now_s();
  const auto placed = co_await parts_.devices.placement.place(task(stop.task).area.name, stop.pose);
  energy_.stood(now_s() - began_s);
  if (!placed) {
    drop(stop, fmt::format("nobody can set up the scanner there: {}", placed.error().message()));
    co_return false;
  }
  scan.believed = placed->pose;
  const Eigen::Vector3d sigmas{placed->position_sigma_m, placed->position_sigma_m,
                               placed->heading_sigma_rad};
  scan.claim(sigmas.cwiseAbs2().asDiagonal());
  co_return true;
}

void Survey::drop(const Stop& stop, const std::string& reason) {
  record_.dropped.push_back({stop.name, task(stop.task).area.name, stop.pose, reason});
  decide({{"t_s", now_s()},
          {"decision", "drop"},
          {"name", stop.name},
          {"at", exact_json(stop.pose)},
          {"reason", reason}});
  tell_drop(stop);
}

// What the disk does not take now is written before the next step: see until_decided().
void Survey::decide(const json::object& decision) {
  (void)parts_.store.decide(decision);
}

void Survey::show(const Stop& stop) {
  const double scanned = static_cast<double>(record_.scans.size());
  const double left = static_cast<double>(stations_planned_ - stations_done_);
  Progress progress;
  progress.phase = stop.view ? "Phase II" : "Phase I";
  progress.station = static_cast<int>(stop.view ? views_taken_ + 1 : stations_done_ + 1);
  progress.stations = stop.view ? 0 : static_cast<int>(stations_planned_);
  progress.area = task(stop.task).area.name;
  if (target_m_ > 0) progress.coverage = covered_m_ / target_m_;
  if (!record_.scans.empty()) progress.seen_occupied = record_.scans.back().after.seen_occupied;
  progress.mission_s = now_s();
  // What a station has taken so far, road and set-up included, is the best guess of the next one.
  if (!stop.view && scanned > 0) progress.eta_s = now_s() / scanned * left;
  shown_ = progress;
  parts_.progress.show(progress);
}

// Ordered or not: on the way a person may still take over. False: it is not there.
hal::Task<bool> Survey::go_home(bool ordered) {
  if ((!config_.return_home && !ordered) || tasks_.start_area < 0) co_return false;
  if (!ordered) orders_.goes_home("on its way home at the mission's end");
  const Stop home{.name = "home",
                  .task = tasks_.start_area,
                  .pose = tasks_.start,
                  .station = nullptr,
                  .view = nullptr};
  const bool there = co_await visit(home);
  co_return there;
}

}  // namespace mission
