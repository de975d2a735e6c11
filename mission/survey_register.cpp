// How a survey finds out where its scans really stood, and what it does about it.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "mission/json_text.hpp"
#include "mission/survey.hpp"

namespace mission {
namespace {

namespace json = boost::json;

// Poses that all pairs together would move by less stay as they are, and the map with them.
constexpr double kMovedM = 0.001, kMovedRad = 0.00005;

constexpr double in_degrees(double angle_rad) {
  return angle_rad * 180 / std::numbers::pi;
}

double turned_rad(const hal::Pose2& from, const hal::Pose2& to) {
  return std::abs(std::remainder(to.heading_rad - from.heading_rad, 2 * std::numbers::pi));
}

json::array axes_json(const std::array<nav::HeldAxis, 3>& axes, double unit) {
  json::array all;
  for (const nav::HeldAxis& axis : axes)
    all.push_back({{"direction", {axis.direction.x(), axis.direction.y(), axis.direction.z()}},
                   {"strength", axis.strength},
                   {"sigma", axis.sigma * unit},
                   {"free", axis.is_free}});
  return all;
}

json::object pair_json(const ScanPair& pair) {
  const nav::Registration& r = pair.figures;
  return {{"scan", pair.with},
          {"verdict", nav::name(r.verdict)},
          {"used", pair.used},
          {"reason", r.reason},
          {"rms_m", r.rms_m},
          {"cloud_to_cloud_m", r.cloud_to_cloud_m},
          {"overlap", r.overlap},
          {"fit", r.fit},
          {"conflict", r.conflict},
          {"conflict_as_believed", pair.conflict_at},
          {"pairs", r.pairs},
          {"moved_m", r.moved_m},
          {"moved_deg", in_degrees(r.moved_rad)},
          {"guess_tried", r.guess_tried},
          {"shift_m", axes_json(r.shift, 1)},
          {"turn_deg", axes_json(r.turn, 180 / std::numbers::pi)}};
}

}  // namespace

// Where it was taken by what is known without it. The localizer has used the time of the scan: this
// pose is better than the one on arrival. One placed by hand has been surveyed.
ScanBelief Survey::note_pose(ScanRecord& scan) const {
  if (!scan.by_hand) {
    scan.believed = pilot_.pose();
    scan.claim(pilot_.covariance());
  }
  ScanBelief belief{scan.believed, scan.covariance, scan.believed, scan.covariance,
                    scan.ground_z_m};
  if (!scan.by_hand) {
    belief.alone = pilot_.pose_alone();
    belief.alone_covariance = pilot_.covariance_alone();
  }
  return belief;
}

// What became of the sensors since the last stop.
void Survey::note_sensors() {
  for (const SensorEvent& event : pilot_.sensors().take(parts_.clock.now()))
    decide({{"t_s", hal::seconds(event.at - began_)},
            {"decision", "sensor"},
            {"sensor", event.sensor},
            {"what", name(event.what)},
            {"for_s", event.for_s},
            {"fixes", event.count}});
}

// The walls that the scan shows, over those of the map. Tells the localizer, which refuses what it
// is sure against.
hal::Task<Survey::MapSays> Survey::match_map(const hal::ScanCloud& cloud, const ScanRecord& scan) {
  if (!matcher_ || scan.by_hand) co_return MapSays::nothing;
  nav::ScanMatch match;
  const std::function<void()> lay = [&, guess = pilot_.pose()] {
    match = matcher_->match(scan_points(cloud, Eigen::Isometry3d::Identity()), guess);
  };
  co_await parts_.compute.run(lay);
  bool used = false;
  if (match.good)
    used = pilot_.correct_by_map(match.pose, match.covariance).gate != nav::Gate::rejected;
  ++(used ? record_.registration.map_matched : record_.registration.map_unmatched);
  decide({{"t_s", now_s()},
          {"decision", "map_match"},
          {"number", scan.number},
          {"used", used},
          {"good", match.good},
          {"reason", match.reason},
          {"fit", match.fit},
          {"score", match.score},
          {"rms_m", match.rms_m},
          {"free", match.free},
          {"pose", exact_json(match.pose)},
          {"sigma_x_m", std::sqrt(match.covariance(0, 0))},
          {"sigma_y_m", std::sqrt(match.covariance(1, 1))},
          {"sigma_heading_deg", in_degrees(std::sqrt(match.covariance(2, 2)))}});
  if (!match.good) co_return MapSays::nothing;
  co_return used ? MapSays::here : MapSays::elsewhere;
}

// By the localizer's guess, and if that fails once by others.
void Survey::register_scan(const hal::ScanCloud& cloud, const ScanBelief& belief, ScanRecord& scan,
                           MapSays map, bool last) {
  if (!config_.registration.scans) return;
  const bool contradicted = scan.fit.verdict == ScanVerdict::refused;  // The take before this.
  registrar_.take(scan_points(cloud, Eigen::Isometry3d::Identity()));
  try_to_register(belief, scan, false);
  if (scan.fit.references == 0 && !attempt_.pairs.empty()) try_to_register(belief, scan, true);
  // A scan may lie, and so may the map: where they differ it is taken again, and then the map is no
  // reason to refuse it.
  if (map == MapSays::elsewhere && !last) {
    scan.fit.verdict = ScanVerdict::refused;
    scan.fit.reason = "its walls lie beside those of the map";
  }
  // From the same place: what contradicted the others a moment ago has to fit them now, or the map.
  if (contradicted && map != MapSays::here && scan.fit.verdict == ScanVerdict::alone) {
    scan.fit.verdict = attempt_.fit.verdict = ScanVerdict::refused;
    scan.fit.reason = "the take before was contradicted, and nothing speaks for this one";
  }
  if (scan.fit.verdict == ScanVerdict::refused && !last) return;
  registrar_.keep(scan.number, belief, attempt_);
}

void Survey::try_to_register(const ScanBelief& belief, ScanRecord& scan, bool other_guesses) {
  const int tries = scan.fit.tries + 1;
  attempt_ = registrar_.attempt(belief, other_guesses);
  scan.fit = attempt_.fit;
  scan.fit.tries = tries;
  scan.believed = attempt_.pose;
  scan.claim(attempt_.covariance);
  json::array against;
  for (const ScanPair& pair : attempt_.pairs) against.push_back(pair_json(pair));
  decide({{"t_s", now_s()},
          {"decision", "registration"},
          {"number", scan.number},
          {"name", scan.name},
          {"try", tries},
          {"other_guesses", other_guesses},
          {"verdict", name(scan.fit.verdict)},
          {"reason", scan.fit.reason},
          {"localizer", exact_json(belief.pose)},
          {"registered", exact_json(attempt_.pose)},
          {"moved_m", scan.fit.moved_m},
          {"moved_deg", in_degrees(scan.fit.moved_rad)},
          {"chi2", scan.fit.chi2},
          {"sigma_position_m", scan.sigma_position_m},
          {"sigma_heading_deg", in_degrees(scan.sigma_heading_rad)},
          {"against", std::move(against)}});
}

// The robot stands where the scan says that it stands.
void Survey::tell_localizer(const ScanRecord& scan) {
  if (scan.by_hand) return;
  last_by_robot_ = static_cast<int>(record_.scans.size());
  last_by_robot_at_m_ = pilot_.travelled_m();
  const bool fits =
      scan.fit.verdict == ScanVerdict::accepted || scan.fit.verdict == ScanVerdict::held_in_part;
  if (!fits) return;
  const nav::Correction done = pilot_.correct(attempt_.measured, attempt_.measured_covariance);
  if (done.gate == nav::Gate::rejected) ++record_.registration.unheard;
}

// What the scans show by now is what the robot holds on to on its next way.
hal::Task<void> Survey::know_walls() {
  if (!walls_) co_return;
  std::shared_ptr<const nav::WallMap> walls;
  const std::function<void()> build = [&] {
    walls = std::make_shared<const nav::WallMap>(walls_->map());
  };
  co_await parts_.compute.run(build);
  pilot_.know_walls(parts_.compute, std::move(walls));
}

std::string Survey::refused_note(const ScanRecord& scan) {
  return fmt::format("scan {} ({}) contradicts the scans that it overlaps and was not merged: {}",
                     scan.number, scan.name, scan.fit.reason);
}

void Survey::note_verdict(const ScanRecord& scan, bool again) {
  RegistrationCounts& counts = record_.registration;
  if (again) {
    ++counts.retaken;
    decide({{"t_s", now_s()},
            {"decision", "retake"},
            {"number", scan.number},
            {"name", scan.name},
            {"reason", scan.fit.reason}});
    return;
  }
  counts.accepted += scan.fit.verdict == ScanVerdict::accepted;
  counts.held_in_part += scan.fit.verdict == ScanVerdict::held_in_part;
  counts.alone += scan.fit.verdict == ScanVerdict::alone;
  counts.refused += scan.fit.verdict == ScanVerdict::refused;
  if (scan.fit.verdict == ScanVerdict::refused) record_.notes.push_back(refused_note(scan));
}

// All pairs that overlap together; where that moves any pose, the map is filled anew.
hal::Task<void> Survey::close_tour() {
  const int scans = static_cast<int>(record_.scans.size());
  const bool nothing_new = std::exchange(scans_closed_, scans) == scans;
  if (!config_.registration.scans || !config_.registration.tour_end || nothing_new) co_return;
  bool moved = false;
  const std::function<void()> close = [&] { moved = fit_tour(); };
  co_await parts_.compute.run(close);
  const std::function<void()> fill = [this] { fill_anew(true); };
  if (moved) co_await until_written(fill);
  co_await keep_closing(moved);
  if (moved) co_await know_walls();
  // Where the robot still stands at the last scan that it took, that moves it too.
  if (!moved || last_by_robot_ < 0 || pilot_.travelled_m() != last_by_robot_at_m_) co_return;
  const ScanRecord& scan = record_.scans[static_cast<std::size_t>(last_by_robot_)];
  if (scan.fit.verdict != ScanVerdict::refused)
    (void)pilot_.correct(scan.believed, scan.covariance);
}

// Takes over the poses that fit all pairs best. False: they are the ones that are there.
bool Survey::fit_tour() {
  const TourFit tour = registrar_.close();
  RegistrationCounts& counts = record_.registration;
  double moved_max_m = 0, moved_max_rad = 0;
  json::array scans;
  for (const TourFit::Scan& fit : tour.scans) {
    const ScanRecord& scan = record_.scans[static_cast<std::size_t>(fit.number - 1)];
    const double moved_m = (fit.pose.position_m - scan.believed.position_m).norm();
    const double moved_rad = turned_rad(scan.believed, fit.pose);
    moved_max_m = std::max(moved_max_m, moved_m);
    moved_max_rad = std::max(moved_max_rad, moved_rad);
    scans.push_back({{"number", fit.number},
                     {"from", exact_json(scan.believed)},
                     {"to", exact_json(fit.pose)},
                     {"moved_m", moved_m},
                     {"moved_deg", in_degrees(moved_rad)}});
  }
  const bool moves = tour.settled && (moved_max_m > kMovedM || moved_max_rad > kMovedRad);
  ++counts.tours_closed;
  counts.pairs = tour.pairs;
  counts.pairs_odd += tour.pairs_odd;
  counts.moved_max_m = std::max(counts.moved_max_m, moves ? moved_max_m : 0);
  counts.moved_max_rad = std::max(counts.moved_max_rad, moves ? moved_max_rad : 0);
  decide({{"t_s", now_s()},
          {"decision", "tour_closed"},
          {"pairs", tour.pairs},
          {"pairs_new", tour.pairs_new},
          {"pairs_at_odds", tour.pairs_odd},
          {"chi2", tour.chi2},
          {"settled", tour.settled},
          {"map_filled_anew", moves},
          {"moved_max_m", moved_max_m},
          {"moved_max_deg", in_degrees(moved_max_rad)},
          {"scans", std::move(scans)}});
  if (!moves) return false;
  for (const TourFit::Scan& fit : tour.scans) {
    ScanRecord& scan = record_.scans[static_cast<std::size_t>(fit.number - 1)];
    scan.believed = fit.pose;
    scan.claim(fit.covariance);
  }
  return true;
}

// The files of the scans, the cloud, the map and the roads, as if every scan had come with its pose
// of now.
// What views were tried for and given up stays so.
void Survey::fill_anew(bool save) {
  auto anew = std::make_unique<SiteModel>(config_, map_, tasks_.tasks, threads_);
  anew->take_up(*model_);
  if (walls_) walls_->clear();
  CloudMerger cloud;
  std::map<int, std::vector<Eigen::Vector2d>> shown_m;  // What the map lacks, by scan.
  for (ScanRecord& scan : record_.scans) {
    const bool refused = scan.fit.verdict == ScanVerdict::refused;
    if (!refused) {
      const hal::ScanCloud measured =
          parts_.store
              .beams(scan.number, beams_checksums_[static_cast<std::size_t>(scan.number - 1)])
              .value();
      const Eigen::Isometry3d T_W_S =
          scanner_pose(scan.believed, scan.ground_z_m, config_.robot.scanner.height_m);
      const std::vector<Eigen::Vector3f> W_points_m = scan_points(measured, T_W_S);
      if (save) save_points(scan, W_points_m, T_W_S);
      cloud.add(W_points_m);
      const ScanEffect effect = anew->add(measured, W_points_m, T_W_S, scan.ground_z_m);
      scan.points_outside_box = effect.points_outside_box;
      shown_m[scan.number] = effect.closed_m();
      if (walls_)
        walls_->add(scan.number, W_points_m, T_W_S.translation().head<2>(), scan.ground_z_m);
    }
    scan.after = anew->counts();
  }
  model_ = std::move(anew);
  cloud_ = std::move(cloud);
  record_.grid = model_->map().grid();
  if (tasks_.start_area >= 0)
    roads_[static_cast<std::size_t>(tasks_.start_area)].close_anew(shown_m,
                                                                   SiteModel::kObstacleCellM);
}

void Survey::note_registration() {
  const RegistrationCounts& counts = record_.registration;
  if (counts.unheard > 0)
    record_.notes.push_back(fmt::format(
        "the localizer did not follow {} scans that fit their neighbours", counts.unheard));
  if (counts.pairs_odd > 0)
    record_.notes.push_back(fmt::format(
        "{} pairs of scans were at odds with all others and left out when a tour closed",
        counts.pairs_odd));
}

}  // namespace mission
