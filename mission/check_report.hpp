// A mission checked against its files and its site, and the result in words: `vantage check`.
#pragma once

#include <boost/json/array.hpp>
#include <boost/json/value.hpp>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "mission/check.hpp"
#include "mission/config.hpp"
#include "mission/geojson_crs.hpp"
#include "nav/free_space.hpp"
#include "nav/site_map.hpp"

namespace mission {

struct MissionCheck {
  MissionConfig config;
  bool ground_mapped{};                             // The map says how high its ground lies.
  std::optional<GeoOrigin> origin;                  // Where the site lies on the earth.
  std::optional<std::filesystem::path> model_file;  // The site's 3-D model.
  nav::RepairedSite site;                           // As far as it could be read.
  std::vector<nav::FreeArea> areas;                 // Empty when the site has errors.
  std::vector<std::string> notes;                   // What reading the site found worth saying.
  std::vector<ConfigError> errors;                  // Mission file, robot file, command line, site.
};

// Reads the mission, its robot and its site, and checks everything in one run: errors of the config
// do not hide errors of the site.
MissionCheck check_mission(const std::filesystem::path& file, const Overrides& overrides);

// The effective values with their origin and what the site holds, on one screen of 100 columns.
std::string check_text(const MissionCheck& check);

// [{"file", "line", "column", "message"}]
boost::json::array errors_json(const std::vector<ConfigError>& errors);

// {"ok", "errors": [{"file", "line", "column", "message"}], "repairs": [{"where", "what"}],
//  "notes", "values": [{"key", "value", "unit", "origin"}], "areas": [{"name", "region",
//  "area_m2"}]}
boost::json::value check_json(const MissionCheck& check);

}  // namespace mission
