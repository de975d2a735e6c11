#include "mission/check_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/json/array.hpp>
#include <boost/json/object.hpp>

#include "mission/config_schema.hpp"
#include "mission/json_text.hpp"
#include "mission/site_io.hpp"
#include "nav/polygons.hpp"

namespace mission {
namespace {

constexpr std::size_t kColumns = 100;
constexpr std::size_t kRemarksShown = 10;

void check_its_site(MissionCheck& check) {
  LoadedSite loaded = load_site(check.config.site_folder);
  check.notes = loaded.notes;
  for (const auto& error : loaded.errors)
    check.errors.push_back(site_error(error, check.config.site_folder.generic_string()));
  if (!loaded.errors.empty()) return;
  check.origin = loaded.origin;
  check.model_file = loaded.model_file;
  check.ground_mapped = std::ranges::any_of(
      loaded.raw.features, [](const auto& feature) { return feature.ground_z_m.has_value(); });
  check.site = nav::repair_site(loaded.raw, check.config.margin_m);
  if (check.site.errors.empty())
    check.areas = nav::free_areas(check.site.map, check.config.robot.body.radius_m, kFreeAreaMinM2);
  const auto errors = check_site(check.config, check.site, check.areas);
  check.errors.insert(check.errors.end(), errors.begin(), errors.end());
}

// Items one after the other, in lines that start with `head` or as much space.
std::string flow(const std::string& head, const std::vector<std::string>& items) {
  std::string text, line = head;
  bool first = true;
  for (const auto& item : items) {
    if (!first && line.size() + 2 + item.size() > kColumns) {
      text += line + "\n";
      line = std::string(head.size(), ' ');
      first = true;
    }
    line += (first ? "" : ", ") + item;
    first = false;
  }
  return text + line + "\n";
}

// "phase2.voxel_m" -> "phase2"; keys above the first table -> "mission" or "robot".
std::string group_of(const std::string& path) {
  const auto cut = path.rfind('.');
  if (path.starts_with("regions.")) return "regions";
  if (cut == std::string::npos) return "mission";
  const auto group = path.substr(0, cut);
  return group.starts_with("robot.") ? group.substr(6) : group;
}

std::string values_text(const MissionConfig& config) {
  std::string text, group;
  std::vector<std::string> items;
  const auto close = [&] {
    if (!items.empty()) text += flow(fmt::format("  {:<9}", group), items);
    items.clear();
  };
  for (const auto& value : effective_values(config)) {
    const auto next = group_of(value.path);
    if (next != group) close();
    group = next;
    const auto key = value.path.starts_with("regions.")
                         ? value.path.substr(8)
                         : value.path.substr(value.path.rfind('.') + 1);
    const bool written = value.origin != "default";
    const std::string shown = value.value.empty() ? "(none)" : value.value;
    items.push_back(fmt::format("{} {}{}", key, shown, written ? "*" : ""));
  }
  close();
  return text;
}

std::string mode_of(const MissionConfig& config, const std::string& region) {
  const auto found = config.regions.find(region);
  return found == config.regions.end() ? "" : " (" + found->second + ")";
}

std::string site_text(const MissionCheck& check) {
  const auto& map = check.site.map;
  std::string text =
      fmt::format("  site {}: {} obstacle{}, {} region{}, boundary {:.0f} m2\n", map.name,
                  map.obstacles.size(), map.obstacles.size() == 1 ? "" : "s", map.regions.size(),
                  map.regions.size() == 1 ? "" : "s", nav::area_m2(map.boundary));
  std::vector<std::string> areas;
  for (const auto& area : check.areas)
    areas.push_back(fmt::format("{}{} {:.0f} m2", area.name, mode_of(check.config, area.region),
                                nav::area_m2(area.standable)));
  text += flow("  room to stand: ", areas);
  std::vector<std::string> remarks;
  for (const auto& note : check.notes) remarks.push_back("note: " + note);
  for (const auto& repair : check.site.repairs)
    remarks.push_back(fmt::format("repaired: {}: {}", repair.where, repair.what));
  for (std::size_t i = 0; i < std::min(remarks.size(), kRemarksShown); ++i)
    text += "  " + remarks[i] + "\n";
  if (remarks.size() > kRemarksShown)
    text += fmt::format("  and {} more; --json lists them all\n", remarks.size() - kRemarksShown);
  return text;
}

boost::json::array values_json(const MissionConfig& config) {
  boost::json::array values;
  for (const auto& value : effective_values(config))
    values.push_back(boost::json::object{{"key", value.path},
                                         {"value", value.value},
                                         {"unit", value.unit},
                                         {"origin", value.origin}});
  return values;
}

}  // namespace

MissionCheck check_mission(const std::filesystem::path& file, const Overrides& overrides) {
  LoadedMission loaded = load_mission(file, overrides);
  MissionCheck check;
  check.config = std::move(loaded.config);
  check.errors = std::move(loaded.errors);
  std::error_code ignored;
  const auto& folder = check.config.site_folder;
  if (!folder.empty() && std::filesystem::exists(folder, ignored)) check_its_site(check);
  return check;
}

std::string check_text(const MissionCheck& check) {
  return fmt::format("{}: fine (* = written in a file or given, else the default)\n",
                     check.config.file) +
         values_text(check.config) + site_text(check);
}

boost::json::array errors_json(const std::vector<ConfigError>& errors) {
  boost::json::array list;
  for (const auto& error : errors)
    list.push_back(boost::json::object{{"file", error.file},
                                       {"line", error.line},
                                       {"column", error.column},
                                       {"message", error.message}});
  return list;
}

boost::json::value check_json(const MissionCheck& check) {
  boost::json::array repairs, notes, areas;
  for (const auto& repair : check.site.repairs)
    repairs.push_back(boost::json::object{{"where", repair.where}, {"what", repair.what}});
  for (const auto& note : check.notes) notes.emplace_back(note);
  for (const auto& area : check.areas)
    areas.push_back(boost::json::object{{"name", area.name},
                                        {"region", area.region},
                                        {"area_m2", rounded(nav::area_m2(area.standable), 2)}});
  return boost::json::object{
      {"ok", check.errors.empty()},          {"errors", errors_json(check.errors)},
      {"repairs", std::move(repairs)},       {"notes", std::move(notes)},
      {"values", values_json(check.config)}, {"areas", std::move(areas)}};
}

}  // namespace mission
