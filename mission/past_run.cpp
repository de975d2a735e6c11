#include "mission/past_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/json.hpp>
#include <cmath>

#include "mission/octomap_io.hpp"

namespace mission {
namespace {

namespace fs = std::filesystem;
namespace json = boost::json;

AskedView asked_view(const json::value& entry) {
  const json::value& planned = entry.at("planned");
  return {std::string(entry.at("area").as_string()),
          {planned.at("x_m").to_number<double>(), planned.at("y_m").to_number<double>()}};
}

DensityGoal::PastScan past_scan(const json::value& seen_from, double scanner_height_m) {
  const auto number = [&](const char* key) { return seen_from.at(key).to_number<double>(); };
  hal::Pose2 pose;
  pose.position_m = {number("x_m"), number("y_m")};
  pose.heading_rad = number("heading_rad");
  return {.pattern = {.azimuth_first_rad = number("azimuth_first_rad"),
                      .azimuth_step_rad = number("azimuth_step_rad"),
                      .elevation_first_rad = number("elevation_first_rad"),
                      .elevation_step_rad = number("elevation_step_rad"),
                      .columns = seen_from.at("columns").to_number<std::uint32_t>(),
                      .rows = seen_from.at("rows").to_number<std::uint32_t>()},
          .T_W_S = scanner_pose(pose, number("ground_z_m"), scanner_height_m)};
}

std::vector<std::uint64_t> voxel_numbers(const json::value& array) {
  std::vector<std::uint64_t> voxels;
  for (const json::value& voxel : array.as_array())
    voxels.push_back(voxel.to_number<std::uint64_t>());
  return voxels;
}

// Throws boost::system::system_error for what is missing or of another kind.
PastSummary summary_of(const json::value& root) {
  const json::value& sensor = root.at("sensor");
  PastSummary summary{.site = std::string(root.at("site").as_string()),
                      .gain_min_voxels = root.at("gain_min_voxels").to_number<int>(),
                      .scanner_height_m = sensor.at("height_m").to_number<double>(),
                      .range_min_m = sensor.at("range_min_m").to_number<double>(),
                      .range_max_m = sensor.at("range_max_m").to_number<double>(),
                      .grazing_max_deg = sensor.at("grazing_max_deg").to_number<double>(),
                      .fov_deg = sensor.at("fov_deg").to_number<double>(),
                      .azimuth_step_deg = sensor.at("azimuth_step_deg").to_number<double>(),
                      .elevation_step_deg = sensor.at("elevation_step_deg").to_number<double>(),
                      .density_min_ppm2 = root.at("density_min_ppm2").to_number<double>(),
                      .foliage = root.at("foliage").as_bool(),
                      .foliage_share_min = root.at("foliage_share_min").to_number<double>(),
                      .radius_m = root.at("radius_m").to_number<double>(),
                      .margin_m = root.at("margin_m").to_number<double>(),
                      .asked = {},
                      .set_aside = voxel_numbers(root.at("voxels_set_aside")),
                      .thin_set_aside = voxel_numbers(root.at("voxels_thin_set_aside")),
                      .foliage_voxels = voxel_numbers(root.at("voxels_foliage")),
                      .scans = {}};
  for (const json::value& scan : root.at("scans").as_array()) {
    if (scan.at("kind").as_string() == "next_best_view") summary.asked.push_back(asked_view(scan));
    summary.scans.push_back(past_scan(scan.at("seen_from"), summary.scanner_height_m));
  }
  for (const json::value& dropped : root.at("dropped").as_array())
    if (dropped.at("name").as_string().starts_with("NBV "))
      summary.asked.push_back(asked_view(dropped));
  if (const json::value* left_out = root.as_object().if_contains("left_out"))
    for (const json::value& view : left_out->as_array()) summary.asked.push_back(asked_view(view));
  return summary;
}

FileResult<std::optional<PastSummary>> read_summary(const fs::path& file,
                                                    const planning::VoxelGrid& grid) {
  std::error_code ignored;
  if (!fs::exists(file, ignored)) return std::optional<PastSummary>();
  const auto text = read_file(file);
  if (!text) return text.error();
  const auto broken = [&](const std::string& why) {
    return FileError{
        file, "read", make_error_code(boost::system::errc::bad_message),
        "it is not a run's summary (" + why + "); restore it, or move map.ot away from it"};
  };
  try {
    PastSummary summary = summary_of(json::parse(*text));
    const auto outside = [&](std::uint64_t voxel) { return voxel >= grid.size(); };
    for (const auto* voxels :
         {&summary.set_aside, &summary.thin_set_aside, &summary.foliage_voxels})
      if (std::ranges::any_of(*voxels, outside))
        return broken("voxels set aside, or of foliage, lie outside the map");
    return std::optional(std::move(summary));
  } catch (const std::exception& error) {
    return broken(error.what());
  }
}

}  // namespace

FileResult<PastRun> read_run(const fs::path& path) {
  std::error_code ignored;
  const fs::path map_file = fs::is_directory(path, ignored) ? path / "map.ot" : path;
  auto read = read_octomap(map_file);
  if (!read) return read.error();
  auto summary = read_summary(map_file.parent_path() / "summary.json", read->map.grid());
  if (!summary) return summary.error();
  return PastRun{map_file, std::move(read->map), std::move(*summary)};
}

Overrides overrides_of(const PastRun& run, Overrides overrides) {
  if (!run.summary) return overrides;
  if (overrides.robot_file.empty()) overrides.radius_m = run.summary->radius_m;
  overrides.margin_m = run.summary->margin_m;
  return overrides;
}

void adopt(const PastRun& run, MissionConfig& config) {
  const planning::VoxelGrid& grid = run.map.grid();
  config.phase2.voxel_m = grid.voxel_m;
  config.phase2.height_m = std::max(1, grid.nz - 1) * grid.voxel_m;
  if (!run.summary) return;
  config.phase2.gain_min_voxels = run.summary->gain_min_voxels;
  ScannerConfig& scanner = config.robot.scanner;
  scanner.height_m = run.summary->scanner_height_m;
  scanner.range_min_m = run.summary->range_min_m;
  scanner.range_max_m = run.summary->range_max_m;
  scanner.grazing_max_deg = run.summary->grazing_max_deg;
  scanner.fov_deg = run.summary->fov_deg;
  scanner.azimuth_step_deg = run.summary->azimuth_step_deg;
  scanner.elevation_step_deg = run.summary->elevation_step_deg;
  config.phase2.density_min_ppm2 = run.summary->density_min_ppm2;
  config.phase2.foliage = run.summary->foliage;
  config.phase2.foliage_share_min = run.summary->foliage_share_min;
}

std::vector<std::string> differences(const PastRun& run, const MissionConfig& config) {
  if (!run.summary)
    return {
        "no summary.json beside the map: cells asked for before and voxels that stayed unseen "
        "count again, no surface has the points of a density goal and views look through no "
        "foliage; robot, scanner and margin are the mission's"};
  const PastSummary& past = *run.summary;
  const ScannerConfig& scanner = config.robot.scanner;
  const struct {
    std::string_view what;
    double past, now;
  } kValues[] = {{"radius_m", past.radius_m, config.robot.body.radius_m},
                 {"margin_m", past.margin_m, config.margin_m},
                 {"height_m of the scanner", past.scanner_height_m, scanner.height_m},
                 {"range_min_m", past.range_min_m, scanner.range_min_m},
                 {"range_max_m", past.range_max_m, scanner.range_max_m},
                 {"grazing_max_deg", past.grazing_max_deg, scanner.grazing_max_deg},
                 {"fov_deg", past.fov_deg, scanner.fov_deg},
                 {"density_min_ppm2", past.density_min_ppm2, config.phase2.density_min_ppm2}};
  std::vector<std::string> all;
  for (const auto& value : kValues)
    if (std::abs(value.past - value.now) > 1e-9 * std::abs(value.past))
      all.push_back(fmt::format("{} was {} in the run and is {} here: the answer is not the run's",
                                value.what, value.past, value.now));
  if (config.phase2.foliage && !past.foliage)
    all.push_back("the run did not tell foliage from walls: views here look through none");
  if (past.foliage && !config.phase2.foliage)
    all.push_back("the run's views looked through foliage and those here do not");
  if (config.phase2.foliage && past.foliage &&
      past.foliage_share_min != config.phase2.foliage_share_min)
    all.push_back(fmt::format("what is foliage is as the run had it, with foliage_share_min = {}",
                              past.foliage_share_min));
  return all;
}

SiteModel model_of(const PastRun& run, const MissionConfig& config, const nav::SiteMap& map,
                   const std::vector<AreaTask>& tasks, int threads) {
  SiteModel model(config, map, tasks, threads, run.map);
  if (!run.summary) {
    model.restore({}, {}, {});
    return model;
  }
  for (const AskedView& asked : run.summary->asked)
    for (const ViewCell& cell : model.cells()) {
      const auto& area = tasks[static_cast<std::size_t>(cell.task)].area;
      const double off_m = (model.cell_position_m(cell).head<2>() - asked.at_m).norm();
      if (area.name == asked.area && off_m < run.map.grid().voxel_m / 4) model.exclude(cell.voxel);
    }
  model.set_aside(run.summary->set_aside);
  model.restore(run.summary->foliage_voxels, run.summary->scans, run.summary->thin_set_aside);
  return model;
}

}  // namespace mission
