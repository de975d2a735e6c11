#include "mission/config.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <optional>
#include <sstream>
#include <tuple>

#include "mission/config_reader.hpp"
#include "mission/config_schema.hpp"
#include "mission/plan_file.hpp"
#include "mission/suggest.hpp"

namespace mission {
namespace {

namespace fs = std::filesystem;

constexpr double kBeamsMax = 20e6;

// Everything known about one mission while it is read.
struct Draft {
  LoadedMission loaded;
  ConfigReading mission, robot, plan;
  std::string robot_name;  // For messages; "" while no robot file is read.
  std::string plan_name;   // The same for the plan file.

  MissionConfig& config() { return loaded.config; }
  bool good(const std::string& path) const {
    const auto& reading = path.starts_with("robot.") ? robot : mission;
    return !reading.syntax_broken && !reading.bad.contains(path);
  }
  void fail(const ConfigPlace& place, std::string message) {
    loaded.errors.push_back({place.file, place.line, place.column, std::move(message)});
  }
};

// Where to point for a rule about several keys: the last one that was written, else the mission.
ConfigPlace last_written(const MissionConfig& config, const std::vector<std::string>& paths) {
  ConfigPlace last{config.file, 1, 1};
  bool any = false;
  for (const auto& path : paths) {
    const auto found = config.written.find(path);
    if (found == config.written.end()) continue;
    const auto& place = found->second;
    const bool later = place.file != last.file ||
                       std::tie(place.line, place.column) > std::tie(last.line, last.column);
    if (!any || later) last = place;
    any = true;
  }
  return last;
}

// A rule about several keys, checked only when each of them was read well.
void require(Draft& draft, bool holds, const std::vector<std::string>& paths, std::string message) {
  const bool readable =
      std::all_of(paths.begin(), paths.end(), [&](const auto& path) { return draft.good(path); });
  if (!holds && readable) draft.fail(last_written(draft.config(), paths), std::move(message));
}

double beams_of(const ScannerConfig& s) {
  const double columns = std::max(1.0, std::round(s.fov_deg / s.azimuth_step_deg));
  const double rows =
      std::floor((s.elevation_max_deg - s.elevation_min_deg) / s.elevation_step_deg) + 1;
  return columns * std::max(rows, 1.0);
}

void check_scanner(Draft& draft) {
  const auto& s = draft.config().robot.scanner;
  const std::string in = "robot.scanner.";
  require(draft, s.range_min_m < s.range_max_m, {in + "range_min_m", in + "range_max_m"},
          fmt::format("'range_min_m' ({} m) must be less than 'range_max_m' ({} m)", s.range_min_m,
                      s.range_max_m));
  const bool rising = s.elevation_min_deg < s.elevation_max_deg;
  require(draft, rising, {in + "elevation_min_deg", in + "elevation_max_deg"},
          fmt::format("'elevation_min_deg' ({} deg) must be less than 'elevation_max_deg' ({} deg)",
                      s.elevation_min_deg, s.elevation_max_deg));
  const double beams = beams_of(s);
  require(draft, !rising || beams <= kBeamsMax,
          {in + "fov_deg", in + "azimuth_step_deg", in + "elevation_min_deg",
           in + "elevation_max_deg", in + "elevation_step_deg"},
          fmt::format("{:.1f} million beams a scan, more than {:.0f} million; "
                      "make 'azimuth_step_deg' or 'elevation_step_deg' larger",
                      beams / 1e6, kBeamsMax / 1e6));
}

void check_voxels(Draft& draft) {
  const auto& config = draft.config();
  const double height_m = config.phase2.height_m;
  require(draft, config.phase2.voxel_m <= height_m, {"phase2.voxel_m", "phase2.height_m"},
          fmt::format("'voxel_m' ({} m) must not be more than 'height_m' ({} m)",
                      config.phase2.voxel_m, height_m));
  require(draft, config.robot.scanner.height_m < height_m,
          {"phase2.height_m", "robot.scanner.height_m"},
          fmt::format("the scanner ('height_m' {} m in [scanner]) must be below the top of the "
                      "voxel box ('height_m' {} m in [phase2])",
                      config.robot.scanner.height_m, height_m));
}

// Mission file first, then the robot file, the plan file and the rest; by line and column within.
void sort_errors(Draft& draft) {
  const auto rank = [&](const ConfigError& error) {
    if (error.file == draft.config().file) return 0;
    return error.file == draft.robot_name ? 1 : error.file == draft.plan_name ? 2 : 3;
  };
  std::stable_sort(draft.loaded.errors.begin(), draft.loaded.errors.end(),
                   [&](const ConfigError& a, const ConfigError& b) {
                     return std::tuple(rank(a), a.line, a.column) <
                            std::tuple(rank(b), b.line, b.column);
                   });
}

void read_mission_text(Draft& draft, std::string_view text, const std::string& file) {
  auto& config = draft.config();
  config.file = file;
  draft.mission = read_config(ConfigFile::mission, text, file, config);
  if (config.name.empty() && !file.starts_with("(")) config.name = fs::path(file).stem().string();
  if (config.name.empty()) config.name = "mission";
}

void read_robot_text(Draft& draft, std::string_view text, const std::string& file) {
  draft.robot_name = file;
  draft.robot = read_config(ConfigFile::robot, text, file, draft.config());
}

LoadedMission finish(Draft& draft) {
  auto& errors = draft.loaded.errors;
  errors.insert(errors.end(), draft.mission.errors.begin(), draft.mission.errors.end());
  errors.insert(errors.end(), draft.robot.errors.begin(), draft.robot.errors.end());
  errors.insert(errors.end(), draft.plan.errors.begin(), draft.plan.errors.end());
  check_scanner(draft);
  check_voxels(draft);
  sort_errors(draft);
  return std::move(draft.loaded);
}

std::optional<std::string> text_in_file(const fs::path& file) {
  std::error_code ignored;
  if (fs::is_directory(file, ignored)) return std::nullopt;
  std::ifstream stream(file, std::ios::binary);
  if (!stream) return std::nullopt;
  std::ostringstream text;
  text << stream.rdbuf();
  return std::move(text).str();
}

// " ; did you mean 'x'?" from the names that stand where the missing one was looked for.
std::string guess_sibling(const fs::path& missing) {
  std::vector<std::string> names;
  std::error_code error;
  const auto folder = missing.has_parent_path() ? missing.parent_path() : fs::path(".");
  for (const auto& entry : fs::directory_iterator(folder, error))
    names.push_back(entry.path().filename().string());
  std::sort(names.begin(), names.end());
  return did_you_mean(closest(missing.filename().string(), names));
}

fs::path relative_to(const fs::path& file, const fs::path& path) {
  return (file.parent_path() / path).lexically_normal();
}

ConfigPlace place_of(const Draft& draft, const std::string& path) {
  const auto found = draft.loaded.config.written.find(path);
  if (found != draft.loaded.config.written.end()) return found->second;
  return {draft.loaded.config.file, 1, 1};
}

// The text of a file that the mission names by `key`, whose path becomes relative to the working
// folder; empty, with an error, when it cannot be read.
std::optional<std::string> named_file(Draft& draft, const fs::path& mission_file,
                                      const std::string& key, fs::path& path) {
  path = relative_to(mission_file, path);
  auto text = text_in_file(path);
  if (!text)
    draft.fail(place_of(draft, key),
               fmt::format("{} file '{}' cannot be read (the path is relative to the mission "
                           "file){}",
                           key, path.generic_string(), guess_sibling(path)));
  return text;
}

void load_robot(Draft& draft, const fs::path& mission_file, const fs::path& replacement) {
  auto& path = draft.config().robot_file;
  if (!replacement.empty()) {
    path = replacement;
    draft.config().written["robot"] = {"--robot", 0, 0};
    if (const auto text = text_in_file(path))
      return read_robot_text(draft, *text, path.generic_string());
    return draft.fail({"--robot", 0, 0}, fmt::format("robot file '{}' cannot be read{}",
                                                     path.generic_string(), guess_sibling(path)));
  }
  if (path.empty()) return;  // The defaults are a working robot.
  if (const auto text = named_file(draft, mission_file, "robot", path))
    read_robot_text(draft, *text, path.generic_string());
}

void load_robot_paths(MissionConfig& config) {
  for (auto* path : {&config.robot.scanner.metadata, &config.robot.corrections.account})
    if (!path->empty()) *path = relative_to(config.robot_file, *path);
}

void load_plan(Draft& draft, const fs::path& mission_file) {
  auto& path = draft.config().plan_file;
  if (path.empty()) return;
  const auto text = named_file(draft, mission_file, "plan", path);
  if (!text) return;
  draft.plan_name = path.generic_string();
  draft.plan = read_plan(*text, draft.plan_name, draft.config());
}

// Only that it is there (a folder, or a map file); what it holds is read with the site.
void check_site_folder(Draft& draft, const fs::path& mission_file, const Overrides& overrides) {
  auto& folder = draft.config().site_folder;
  std::error_code ignored;
  if (!overrides.site_folder.empty()) {
    folder = overrides.site_folder;
    draft.config().written["site"] = {"--site", 0, 0};
    if (!fs::exists(folder, ignored))
      draft.fail({"--site", 0, 0}, fmt::format("site folder '{}' does not exist{}",
                                               folder.generic_string(), guess_sibling(folder)));
    return;
  }
  if (folder.empty()) {
    if (draft.good("site"))
      draft.fail({draft.config().file, 1, 1},
                 "no site: add site = \"FOLDER\" above the first [table], or give --site FOLDER");
    return;
  }
  folder = relative_to(mission_file, folder);
  if (!fs::exists(folder, ignored))
    draft.fail(place_of(draft, "site"),
               fmt::format("site folder '{}' does not exist (the path is relative to the mission "
                           "file){}",
                           folder.generic_string(), guess_sibling(folder)));
}

}  // namespace

std::string ConfigError::text() const {
  if (line <= 0) return fmt::format("{}: {}", file, message);
  return fmt::format("{}:{}:{}: {}", file, line, column, message);
}

LoadedMission load_mission(const fs::path& file, const Overrides& overrides) {
  Draft draft;
  draft.config().file = file.generic_string();
  const auto text = file.empty() ? std::string() : text_in_file(file);
  if (!text) {
    draft.fail({file.generic_string(), 0, 0}, "mission file cannot be read" + guess_sibling(file));
    return std::move(draft.loaded);
  }
  read_mission_text(draft, *text, file.empty() ? "(no mission file)" : file.generic_string());
  if (overrides.has_seed) {
    draft.config().seed = overrides.seed;
    draft.config().written["seed"] = {"--seed", 0, 0};
  }
  check_site_folder(draft, file, overrides);
  load_robot(draft, file, overrides.robot_file);
  load_robot_paths(draft.config());
  if (overrides.radius_m) draft.config().robot.body.radius_m = *overrides.radius_m;
  if (overrides.margin_m) draft.config().margin_m = *overrides.margin_m;
  load_plan(draft, file);
  return finish(draft);
}

LoadedMission parse_mission(std::string_view mission_text, const std::string& mission_name,
                            std::string_view robot_text, const std::string& robot_name) {
  Draft draft;
  read_mission_text(draft, mission_text, mission_name);
  if (!robot_text.empty()) read_robot_text(draft, robot_text, robot_name);
  return finish(draft);
}

}  // namespace mission
