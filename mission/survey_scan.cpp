// What a survey does at a stop: it takes a scan, keeps it, and fills the map from it.
#include <fmt/format.h>

#include "mission/disk_fault.hpp"
#include "mission/json_text.hpp"
#include "mission/survey.hpp"

namespace mission {
namespace {

namespace json = boost::json;
namespace errc = boost::system::errc;

constexpr std::uint64_t kScansOfRoom = 2;  // Must be free on the disk before one is taken.
constexpr int kScanTries = 3;              // At a stop,
constexpr hal::Duration kScanPause = std::chrono::seconds(5);
constexpr int kStopsWithoutScan = 2;  // and so many stops in a row: then no scanner is left.

// Trying again cannot help: the robot file asks for what the devices do not do.
bool is_hopeless(boost::system::error_code error) {
  return error == errc::invalid_argument || error == errc::argument_out_of_domain;
}

// Of what is kept of one at most: what was measured (less where its beams are a fan), and its
// points in W.
std::uint64_t scan_bytes(const ScannerConfig& scanner) {
  constexpr double kBeamBytes = 28, kPointBytes = 12;
  const double columns = scanner.fov_deg / scanner.azimuth_step_deg + 1;
  const double rows =
      (scanner.elevation_max_deg - scanner.elevation_min_deg) / scanner.elevation_step_deg + 1;
  return static_cast<std::uint64_t>(columns * rows * (kBeamBytes + kPointBytes));
}

}  // namespace

// Takes the scan and lays it over the others; one that contradicts them is taken once more.
hal::Task<bool> Survey::acquire(const Stop& stop, ScanRecord scan) {
  scan.number = static_cast<int>(record_.scans.size()) + 1;
  scan.start_s = now_s();
  co_await until_decided();
  const std::function<void()> look = [this] { look_for_room(); };
  co_await until_written(look);
  const int takes = config_.registration.scans && config_.registration.retake ? 2 : 1;
  for (int take = 1;; ++take) {
    const double began_s = now_s();
    const std::optional<hal::ScanCloud> cloud = co_await take_scan(stop);
    if (!cloud) {
      energy_.stood(now_s() - began_s);
      co_return false;
    }
    scan.end_s = now_s();
    energy_.scanned(scan.end_s - began_s);
    scan.stamp = cloud->stamp;
    note_sensors();
    const MapSays map = co_await match_map(*cloud, scan);
    const ScanBelief belief = note_pose(scan);
    const std::function<void()> fit = [&] {
      register_scan(*cloud, belief, scan, map, take == takes);
    };
    co_await parts_.compute.run(fit);
    const bool again = scan.fit.verdict == ScanVerdict::refused && take < takes;
    note_verdict(scan, again);
    if (again) continue;
    tell_localizer(scan);
    Saved saved;
    co_await save(*cloud, scan, saved);
    const std::function<void()> work = [&] { merge(*cloud, saved, stop, scan); };
    co_await parts_.compute.run(work);
    co_await keep_scan(stop);
    keeps_scan_ = false;
    co_await know_walls();
    co_return true;
  }
}

// For the next scan. Throws FileFailure: there is none.
void Survey::look_for_room() {
  parts_.store.has_room(kScansOfRoom * scan_bytes(config_.robot.scanner)).value();
}

// A few tries. Nothing: the stop is dropped, with the reason. Throws when it must be expected that
// no stop will have a scan any more.
hal::Task<std::optional<hal::ScanCloud>> Survey::take_scan(const Stop& stop) {
  std::string reason;
  bool hopeless = false;
  for (int tries = 1; tries <= kScanTries && !hopeless; ++tries) {
    auto cloud = co_await parts_.devices.scanner.scan();
    if (cloud) {
      stops_without_scan_ = 0;
      co_return std::move(*cloud);
    }
    hopeless = is_hopeless(cloud.error());
    const std::string troubles = parts_.devices.troubles ? parts_.devices.troubles() : "";
    reason = fmt::format("no scan, tried {} times: {}{}", tries, cloud.error().message(),
                         troubles.empty() ? "" : " (" + troubles + ")");
    decide({{"t_s", now_s()}, {"decision", "no_scan"}, {"name", stop.name}, {"reason", reason}});
    if (tries < kScanTries && !hopeless) co_await parts_.clock.sleep_for(kScanPause);
  }
  drop(stop, reason);
  if (hopeless || ++stops_without_scan_ >= kStopsWithoutScan)
    throw CannotGoOn(fmt::format("at {}: {}", stop.name, reason));
  co_return std::nullopt;
}

// Durable before it counts: what was measured, and its points.
hal::Task<void> Survey::save(const hal::ScanCloud& cloud, const ScanRecord& scan, Saved& saved) {
  const std::function<void()> work = [&] {
    const Eigen::Isometry3d T_W_S =
        scanner_pose(scan.believed, scan.ground_z_m, config_.robot.scanner.height_m);
    saved.W_points_m = scan_points(cloud, T_W_S);
    if (keeps_beams()) saved.beams_checksum = parts_.store.save_beams(scan.number, cloud).value();
    save_points(scan, saved.W_points_m, T_W_S);
  };
  co_await until_written(work);
}

// A scan that contradicts the others is kept, and not merged: what it alone saw stays unseen.
void Survey::merge(const hal::ScanCloud& cloud, const Saved& saved, const Stop& stop,
                   ScanRecord& scan) {
  const Eigen::Isometry3d T_W_S =
      scanner_pose(scan.believed, scan.ground_z_m, config_.robot.scanner.height_m);
  const std::vector<Eigen::Vector3f>& W_points_m = saved.W_points_m;
  if (keeps_beams()) beams_checksums_.push_back(saved.beams_checksum);
  ScanEffect effect;
  if (scan.fit.verdict != ScanVerdict::refused)
    effect = insert(cloud, W_points_m, T_W_S, stop, scan);
  scan.beams = cloud.pattern.beams();
  scan.pattern = cloud.pattern;
  scan.points = W_points_m.size();
  scan.points_outside_box = effect.points_outside_box;
  scan.after = model_->counts();
  record_.grid = model_->map().grid();  // May have grown.
  decide({{"t_s", now_s()},
          {"decision", "scan"},
          {"number", scan.number},
          {"name", scan.name},
          {"merged", scan.fit.verdict != ScanVerdict::refused},
          {"believed", exact_json(scan.believed)},
          {"sigma_position_m", scan.sigma_position_m},
          {"points", scan.points},
          {"seen_occupied", scan.after.seen_occupied},
          {"seen_empty", scan.after.seen_empty},
          {"unseen", scan.after.unseen},
          {"boundary_unseen", scan.after.boundary_unseen},
          {"predicted_voxels", scan.predicted_voxels},
          {"resolved_voxels", scan.resolved_voxels},
          {"new_obstacle_cells", effect.new_obstacles_m.size()},
          {"rough_ground_cells", effect.rough_ground_m.size()},
          {"box_layers_added", effect.layers_added}});
  record_.scans.push_back(std::move(scan));
  keeps_scan_ = parts_.journal != nullptr;
  told_scan_ = false;
}

void Survey::save_points(const ScanRecord& scan, const std::vector<Eigen::Vector3f>& W_points_m,
                         const Eigen::Isometry3d& T_W_S) {
  parts_.store
      .save_scan(
          W_points_m, T_W_S,
          {.number = scan.number, .station = scan.name, .time_s = scan.end_s, .seed = config_.seed})
      .value();
}

ScanEffect Survey::insert(const hal::ScanCloud& cloud,
                          const std::vector<Eigen::Vector3f>& W_points_m,
                          const Eigen::Isometry3d& T_W_S, const Stop& stop, ScanRecord& scan) {
  cloud_.add(W_points_m);
  if (stop.view) {
    model_->expect(*stop.view);
    scan.predicted_voxels = stop.view->voxels;
  }
  ScanEffect effect = model_->add(cloud, W_points_m, T_W_S, scan.ground_z_m);
  if (stop.view) scan.resolved_voxels = model_->settle();
  if (walls_) walls_->add(scan.number, W_points_m, T_W_S.translation().head<2>(), scan.ground_z_m);
  close_roads(scan.number, effect);
  return effect;
}

void Survey::close_roads(int scan, const ScanEffect& effect) {
  if (tasks_.start_area < 0) return;
  roads_[static_cast<std::size_t>(tasks_.start_area)].close(effect.closed_m(),
                                                            SiteModel::kObstacleCellM, scan);
}

}  // namespace mission
