#include "tools/vantage_command.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <cstdio>

#include "mission/files.hpp"
#include "mission/json_text.hpp"

namespace vantage {
namespace {

std::string joined(const std::vector<mission::ConfigError>& errors) {
  std::string text;
  for (const auto& error : errors) text += (text.empty() ? "" : "\n") + error.text();
  return text;
}

void tell(bool json, const std::vector<mission::ConfigError>& errors) {
  if (json)
    print_json(boost::json::object{{"ok", false}, {"errors", mission::errors_json(errors)}});
  fmt::print(stderr, "{}\n", joined(errors));
}

// What replaces the mission's own.
void add_replacements(CLI::App& command, SiteOptions& options) {
  command.add_option("--site", options.site, "Site folder; replaces the mission's");
  command.add_option("--robot", options.robot, "Robot file (TOML); replaces the mission's");
  command.add_option("--seed", options.seed, "Seed of every random choice; replaces the mission's");
  command
      .add_option("--threads", options.threads,
                  "Threads (0: all cores); results do not depend on it")
      ->check(CLI::Range(0, 256));
}

mission::Prepared prepared_with(const SiteOptions& options, const mission::Overrides& overrides,
                                mission::WorldUse use, const std::filesystem::path& model_file) {
  if (options.mission.empty() && options.site.empty())
    throw Refusal("no site; give --site FOLDER, or --mission FILE that names one");
  mission::Prepared result = mission::prepare(options.mission, overrides, use, model_file);
  if (!result.errors.empty()) throw Refusal(result.errors);
  return result;
}

}  // namespace

Refusal::Refusal(std::vector<mission::ConfigError> all)
    : std::runtime_error(joined(all)), errors(std::move(all)) {}

mission::Overrides SiteOptions::overrides() const {
  return {.site_folder = site,
          .robot_file = robot,
          .has_seed = seed.has_value(),
          .seed = seed.value_or(0)};
}

void add_site_options(CLI::App& command, SiteOptions& options) {
  command.add_option("--mission", options.mission,
                     "Mission file (TOML); without one every key has its default");
  add_replacements(command, options);
}

void add_mission_options(CLI::App& command, SiteOptions& options) {
  command.add_option("mission", options.mission, "Mission file (TOML)")->required();
  add_replacements(command, options);
}

void add_json_flag(CLI::App& command, bool& json) {
  command.add_flag("--json", json, "Answer as JSON on stdout, errors too");
}

mission::Prepared prepared(const SiteOptions& options, mission::WorldUse use,
                           const std::filesystem::path& model_file) {
  return prepared_with(options, options.overrides(), use, model_file);
}

mission::PastRun past_run(const std::filesystem::path& path) {
  auto read = mission::read_run(path);
  if (!read) throw Refusal(read.error().text());
  return std::move(*read);
}

PastSite past_site(const SiteOptions& options, const std::filesystem::path& map) {
  const mission::PastRun past = past_run(map);
  const bool adopts = options.mission.empty();
  const mission::Overrides overrides =
      adopts ? mission::overrides_of(past, options.overrides()) : options.overrides();
  mission::Prepared site = prepared_with(options, overrides, mission::WorldUse::ground, {});
  const mission::RobotConfig robot = site.config.robot;
  if (adopts) mission::adopt(past, site.config);
  if (!options.robot.empty()) site.config.robot = robot;
  for (const std::string& note : mission::differences(past, site.config))
    site.notes.push_back(note);
  mission::SiteModel model = mission::model_of(past, site.config, site.site.map, site.tasks.tasks,
                                               mission::threads_or_all(options.threads));
  return {past.map_file, std::move(site), std::move(model)};
}

void tell_remarks(const mission::Prepared& prepared) {
  for (const nav::Repair& repair : prepared.site.repairs)
    fmt::print(stderr, "repaired: {}: {}\n", repair.where, repair.what);
  for (const auto* notes : {&prepared.notes, &prepared.tasks.notes})
    for (const std::string& note : *notes) fmt::print(stderr, "note: {}\n", note);
}

void add_remarks(boost::json::object& to, const mission::Prepared& prepared) {
  boost::json::array repairs, all_notes;
  for (const nav::Repair& repair : prepared.site.repairs)
    repairs.push_back(boost::json::object{{"where", repair.where}, {"what", repair.what}});
  for (const auto* notes : {&prepared.notes, &prepared.tasks.notes})
    for (const std::string& note : *notes) all_notes.emplace_back(note);
  to["repairs"] = std::move(repairs);
  to["notes"] = std::move(all_notes);
}

void print_json(const boost::json::value& value) {
  fmt::print("{}", mission::json_pretty(value));
}

void write_product(const std::filesystem::path& file, const std::string& text) {
  const auto written = mission::write_file(file, {text});
  if (!written) throw Refusal(written.error().text());
}

int answer(bool json, const std::function<int()>& command) {
  try {
    return command();
  } catch (const Refusal& refusal) {
    tell(json, refusal.errors);
  } catch (const std::exception& error) {
    tell(json, {{"vantage", 0, 0, error.what()}});
  }
  return kRefused;
}

std::vector<double> parse_numbers(const std::string& text, std::size_t count,
                                  const std::string& option) {
  std::vector<double> numbers;
  const char* at = text.data();
  const char* const end = at + text.size();
  for (bool more = true; more;) {
    double number{};
    const auto read = std::from_chars(at, end, number);
    if (read.ec != std::errc{} || !std::isfinite(number)) break;
    numbers.push_back(number);
    at = read.ptr;
    more = at != end && *at == ',';
    if (more) ++at;
  }
  if (at == end && numbers.size() == count && !text.ends_with(',')) return numbers;
  throw Refusal(fmt::format("{} must be {} in metres, found '{}'; for example {}", option,
                            count == 2 ? "X,Y" : "X,Y,Z", text,
                            count == 2 ? "12.5,-3" : "12.5,-3,1"));
}

Eigen::Vector2d parse_xy(const std::string& text, const std::string& option) {
  const std::vector<double> xy = parse_numbers(text, 2, option);
  return {xy[0], xy[1]};
}

}  // namespace vantage
