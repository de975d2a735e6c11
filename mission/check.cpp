#include "mission/check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <regex>

#include "mission/plan_file.hpp"
#include "mission/suggest.hpp"

namespace mission {
namespace {

class SiteCheck {
 public:
  SiteCheck(const MissionConfig& config, const nav::SiteMap& map,
            const std::vector<nav::FreeArea>& areas)
      : config_(config), map_(map), areas_(areas) {}

  std::vector<ConfigError> run() {
    for (const auto& [region, mode] : config_.regions) check_region(region, mode);
    check_outage();
    check_room();
    check_start();
    check_voxel_count();
    return std::move(errors_);
  }

 private:
  void fail(const std::string& key, std::string message) {
    const auto found = config_.written.find(key);
    const ConfigPlace place =
        found == config_.written.end() ? ConfigPlace{config_.file, 1, 1} : found->second;
    errors_.push_back({place.file, place.line, place.column, std::move(message)});
  }

  void check_outage() {
    const std::string& region = config_.robot.sim.gnss_outage;
    const bool known = std::ranges::any_of(
        map_.regions, [&](const nav::Region& on_map) { return on_map.name == region; });
    if (!region.empty() && !known)
      fail("robot.sim.gnss_outage", fmt::format("the map has no region '{}'", region));
  }

  void check_region(const std::string& region, const std::string& mode) {
    std::vector<std::string> known;
    for (const auto& on_map : map_.regions) known.push_back(on_map.name);
    const std::string key = "regions." + region;
    if (std::find(known.begin(), known.end(), region) == known.end()) {
      const auto guess = did_you_mean(closest(region, known));
      return fail(key, fmt::format("the map has no region '{}'{}", region,
                                   guess.empty() ? "; it has: " + listed(known) : guess));
    }
    const bool stands = std::any_of(areas_.begin(), areas_.end(),
                                    [&](const auto& area) { return area.region == region; });
    if (!stands && mode != "skip")
      fail(key, fmt::format("region '{0}' has no room to stand for a robot of radius {1} m; write "
                            "{0} = \"skip\", or make 'radius_m' smaller",
                            region, config_.robot.body.radius_m));
  }

  void check_room() {
    if (areas_.empty())
      fail("site", fmt::format("the site has no room to stand for a robot of radius {} m; correct "
                               "the boundary or the obstacles of the map",
                               config_.robot.body.radius_m));
  }

  void check_start() {
    if (!map_.start || areas_.empty()) return;
    if (nav::area_at(areas_, nav::to_mm(map_.start->position_m)) >= 0) return;
    fail("site", fmt::format("the map's start ({:.2f}, {:.2f}) m is not in the free space of a "
                             "robot of radius {} m; move it away from obstacles and keep-outs",
                             map_.start->position_m.x(), map_.start->position_m.y(),
                             config_.robot.body.radius_m));
  }

  // The box of the voxel map: the boundary and the free areas, and one voxel around.
  void check_voxel_count() {
    Eigen::Vector2d low = Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity());
    Eigen::Vector2d high = -low;
    const auto add = [&](const nav::Polygons& polygons) {
      for (const auto& polygon : polygons)
        for (const auto vertex : polygon.outer) {
          low = low.cwiseMin(nav::to_m(vertex));
          high = high.cwiseMax(nav::to_m(vertex));
        }
    };
    add(map_.boundary);
    for (const auto& area : areas_) add(area.drivable);
    if (!(low.array() <= high.array()).all()) return;
    const Eigen::Vector3d size_m(high.x() - low.x(), high.y() - low.y(), config_.phase2.height_m);
    const double voxels = count(size_m, config_.phase2.voxel_m);
    if (voxels <= kVoxelsMax) return;
    double enough_m = config_.phase2.voxel_m;
    while (count(size_m, enough_m) > kVoxelsMax) enough_m *= 1.02;
    fail("phase2.voxel_m",
         fmt::format("the site's box of {:.0f} x {:.0f} x {:.0f} m has {:.0f} million voxels of {} "
                     "m, more than {:.0f} million; write voxel_m = {:.2f} or more, or make "
                     "'height_m' smaller",
                     size_m.x(), size_m.y(), size_m.z(), voxels / 1e6, config_.phase2.voxel_m,
                     kVoxelsMax / 1e6, std::ceil(enough_m * 100) / 100));
  }

  static double count(const Eigen::Vector3d& size_m, double voxel_m) {
    return ((size_m / voxel_m).array().ceil() + Eigen::Array3d(2, 2, 1)).prod();
  }

  const MissionConfig& config_;
  const nav::SiteMap& map_;
  const std::vector<nav::FreeArea>& areas_;
  std::vector<ConfigError> errors_;
};

}  // namespace

ConfigError site_error(const std::string& text, const std::string& file) {
  static const std::regex pattern(R"(^([^:\n]+):([0-9]{1,9}):([0-9]{1,9}):? ([^]*)$)");
  std::smatch match;
  if (!std::regex_match(text, match, pattern)) return {file, 0, 0, text};
  return {match[1], std::stoi(match[2]), std::stoi(match[3]), match[4]};
}

std::vector<ConfigError> check_site(const MissionConfig& config, const nav::RepairedSite& site,
                                    const std::vector<nav::FreeArea>& areas) {
  std::vector<ConfigError> errors;
  for (const auto& error : site.errors)
    errors.push_back(site_error(error, config.site_folder.generic_string()));
  if (!errors.empty()) return errors;  // A broken map says nothing more.
  errors = SiteCheck{config, site.map, areas}.run();
  const auto of_plan = check_plan(config, areas);
  errors.insert(errors.end(), of_plan.begin(), of_plan.end());
  return errors;
}

}  // namespace mission
