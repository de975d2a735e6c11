// What a run left behind, read back: its voxel map, and what Phase II would not ask for again.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "mission/config.hpp"
#include "mission/files.hpp"
#include "mission/site_model.hpp"
#include "planning/voxel_map.hpp"

namespace mission {

// A place where the run took a next best view, gave one up, or left one out.
struct AskedView {
  std::string area;
  Eigen::Vector2d at_m{0, 0};
};

// From summary.json beside the map.
struct PastSummary {
  std::string site;
  int gain_min_voxels{};
  double scanner_height_m{}, range_min_m{}, range_max_m{}, grazing_max_deg{};
  double fov_deg{}, azimuth_step_deg{}, elevation_step_deg{};  // Of the scanner.
  double density_min_ppm2{};
  bool foliage{};
  double foliage_share_min{};
  double radius_m{};  // Of the robot.
  double margin_m{};  // MissionConfig::margin_m
  std::vector<AskedView> asked;
  std::vector<std::uint64_t> set_aside;       // As SiteModel::voxels_set_aside,
  std::vector<std::uint64_t> thin_set_aside;  // thin_set_aside
  std::vector<std::uint64_t> foliage_voxels;  // and foliage.
  std::vector<DensityGoal::PastScan> scans;
};

struct PastRun {
  std::filesystem::path map_file;
  planning::VoxelMap map;
  std::optional<PastSummary> summary;  // Empty: no summary.json beside the map.
};

// `path` is a run's folder or a map.ot. Fails with the file's name on anything that cannot be read,
// also on a summary.json that is there and broken.
FileResult<PastRun> read_run(const std::filesystem::path& path);

// What the run says of robot and site; for a mission that no file describes. overrides_of: what
// decides where the robot can stand, before the site is read; a robot file given goes before the
// run's radius. adopt: voxels and scanner.
Overrides overrides_of(const PastRun& run, Overrides overrides);
void adopt(const PastRun& run, MissionConfig& config);

// Where the run's robot, scanner or site differs from the config's, so that answers are not the
// run's; one sentence each.
std::vector<std::string> differences(const PastRun& run, const MissionConfig& config);

// The model as the run left it: cells asked for and voxels set aside are so again, foliage is
// looked through if the config asks for it, and surfaces have the points that the run's scans put
// on them, for whatever goal the config has. Throws std::invalid_argument when the map is not of
// this site and mission (SiteModel).
SiteModel model_of(const PastRun& run, const MissionConfig& config, const nav::SiteMap& map,
                   const std::vector<AreaTask>& tasks, int threads);

}  // namespace mission
