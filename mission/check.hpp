// Whether a mission fits its site, before anything starts.
#pragma once

#include <string>
#include <vector>

#include "mission/config.hpp"
#include "nav/free_space.hpp"
#include "nav/site_map.hpp"

namespace mission {

// Parts of a region smaller than this are no place to survey from.
inline constexpr double kFreeAreaMinM2 = 1.0;

// More voxels than this do not fit the memory that a mission may use.
inline constexpr double kVoxelsMax = 400e6;

// An error that reading or repairing a site put into words, "file:line:column: message"; without
// that beginning it is about the whole of `file`.
ConfigError site_error(const std::string& text, const std::string& file);

// What stands between this mission and this site: errors of the map, regions in the mission that
// the map lacks or where nobody can stand, a start outside the free space, too many voxels,
// stations of its plan file that stand where nobody can. `areas` is free_areas(site.map,
// config.robot.body.radius_m, kFreeAreaMinM2). Pure.
std::vector<ConfigError> check_site(const MissionConfig& config, const nav::RepairedSite& site,
                                    const std::vector<nav::FreeArea>& areas);

}  // namespace mission
