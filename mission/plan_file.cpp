#include "mission/plan_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "mission/suggest.hpp"

namespace mission {
namespace {

ConfigError error_at(const ConfigPlace& place, std::string message) {
  return {place.file, place.line, place.column, std::move(message)};
}

// "station 'inner 3'", or the place in the file where it has no name.
std::string called(const SavedStation& station) {
  return station.name.empty() ? "the station" : fmt::format("station '{}'", station.name);
}

std::string missing_key(const SavedStation& station) {
  if (station.area.empty()) return "area";
  if (std::isnan(station.x_m)) return "x_m";
  return std::isnan(station.y_m) ? "y_m" : "";
}

void check_stations(const SavedPlan& plan, const std::string& file, ConfigReading& reading) {
  if (plan.stations.size() > kPlanStationsMax)
    reading.errors.push_back({file, 1, 1,
                              fmt::format("{} stations, more than {}; split the survey",
                                          plan.stations.size(), kPlanStationsMax)});
  std::set<std::string> names;
  for (const SavedStation& station : plan.stations) {
    if (const std::string key = missing_key(station); !key.empty())
      reading.errors.push_back(error_at(
          station.place,
          fmt::format("{} has no '{}'; add it below this [[station]]", called(station), key)));
    if (!station.name.empty() && !names.insert(station.name).second)
      reading.errors.push_back(error_at(
          station.place,
          fmt::format("two stations are named '{}'; give them different names", station.name)));
  }
}

// A TOML basic string.
std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    const auto code = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\')
      out += std::string("\\") + c;
    else if (code < 0x20 || code == 0x7F)
      out += fmt::format("\\u{:04X}", code);
    else
      out += c;
  }
  return out + '"';
}

// Why the station cannot be where it is, or "".
std::string misplaced(const MissionConfig& config, const SavedStation& station,
                      const std::vector<nav::FreeArea>& areas) {
  const int at = nav::area_at(areas, nav::to_mm(Eigen::Vector2d(station.x_m, station.y_m)));
  const std::string where =
      fmt::format("{} at ({:.3f}, {:.3f}) m", called(station), station.x_m, station.y_m);
  if (at < 0)
    return fmt::format(
        "{} does not stand in the free space of a robot of radius {} m; move it away "
        "from obstacles and keep-outs, or make a new plan for this site",
        where, config.robot.body.radius_m);
  const nav::FreeArea& area = areas[static_cast<std::size_t>(at)];
  if (area.name != station.area)
    return fmt::format("{} stands in area '{}', not in '{}'; write area = \"{}\" or move it", where,
                       area.name, station.area, area.name);
  const auto mode = config.regions.find(area.region);
  if (mode != config.regions.end() && mode->second == "skip")
    return fmt::format(
        "{} stands in region '{}', which the mission skips; remove it from the plan, "
        "or the region from [regions]",
        where, area.region);
  return "";
}

}  // namespace

ConfigReading read_plan(std::string_view text, const std::string& file, MissionConfig& config) {
  config.plan = {};
  ConfigReading reading = read_config(ConfigFile::plan, text, file, config);
  if (reading.errors.empty()) check_stations(config.plan, file, reading);
  if (reading.errors.empty() && config.plan.stations.empty())
    reading.errors.push_back(
        {file, 1, 1,
         "the plan has no [[station]]; leave 'plan' out of the mission to have one made"});
  return reading;
}

std::string plan_text(const SavedPlan& plan) {
  std::string text =
      "# Stations for a mission's `plan = \"FILE\"`: they are toured, and no others planned.\n";
  if (!plan.site.empty()) text += fmt::format("site = {}\n", quoted(plan.site));
  if (!plan.made_by.empty()) text += fmt::format("made_by = {}\n", quoted(plan.made_by));
  text += fmt::format("seed = {}\n", plan.seed);
  for (const SavedStation& station : plan.stations) {
    text += fmt::format("\n[[station]]\narea = {}\n", quoted(station.area));
    if (!station.name.empty()) text += fmt::format("name = {}\n", quoted(station.name));
    text += fmt::format("x_m = {}\ny_m = {}\nheading_deg = {}\n", station.x_m, station.y_m,
                        station.heading_deg);
  }
  return text;
}

std::vector<ConfigError> check_plan(const MissionConfig& config,
                                    const std::vector<nav::FreeArea>& areas) {
  std::vector<ConfigError> errors;
  for (const SavedStation& station : config.plan.stations)
    if (std::string why = misplaced(config, station, areas); !why.empty())
      errors.push_back(error_at(station.place, std::move(why)));
  return errors;
}

std::vector<SavedStation> stations_in(const SavedPlan& plan, const std::string& area) {
  std::vector<SavedStation> stations;
  std::ranges::copy_if(plan.stations, std::back_inserter(stations),
                       [&](const SavedStation& station) { return station.area == area; });
  return stations;
}

}  // namespace mission
