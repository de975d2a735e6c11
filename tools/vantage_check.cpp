// vantage check, vantage keys: is this mission right, and what may a mission say?
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <memory>

#include "mission/config_schema.hpp"
#include "mission/main_robot.hpp"
#include "tools/vantage_command.hpp"

namespace vantage {
namespace {

struct CheckOptions {
  std::filesystem::path mission;
  std::filesystem::path site;
  std::optional<std::uint64_t> seed;
  bool json = false;
};

// What only the drivers can tell of a robot file that could be read.
void check_robot(mission::MissionCheck& result) {
  const std::string file = result.config.robot_file.generic_string();
  const bool read = std::ranges::none_of(
      result.errors, [&](const mission::ConfigError& error) { return error.file == file; });
  if (!read) return;
  const auto problems = mission::robot_problems(result.config);
  result.errors.insert(result.errors.end(), problems.begin(), problems.end());
}

int check(const CheckOptions& options) {
  auto result = mission::check_mission(options.mission, {.site_folder = options.site,
                                                         .robot_file = {},
                                                         .has_seed = options.seed.has_value(),
                                                         .seed = options.seed.value_or(0)});
  check_robot(result);
  if (options.json) print_json(mission::check_json(result));
  for (const auto& error : result.errors)
    if (!options.json) fmt::print(stderr, "{}\n", error.text());
  if (!result.errors.empty()) return kRefused;
  if (!options.json) fmt::print("{}", mission::check_text(result));
  return kFine;
}

// The table as JSON: one object per key.
boost::json::array keys_json() {
  boost::json::array keys;
  for (const auto& section : mission::config_schema())
    for (const auto& spec : section.keys)
      keys.push_back(boost::json::object{{"file", mission::name(section.file)},
                                         {"section", section.name},
                                         {"key", spec.key},
                                         {"unit", spec.unit},
                                         {"min", spec.min},
                                         {"max", spec.max},
                                         {"meaning", spec.help}});
  return keys;
}

}  // namespace

void add_check_command(CLI::App& app, Run& run) {
  const auto options = std::make_shared<CheckOptions>();
  auto* command = app.add_subcommand(
      "check",
      "Reads a mission, its robot and its site; reports every error, or what will be used");
  command->footer(
      "Examples:\n"
      "  vantage check configs/missions/fort.toml\n"
      "  vantage check configs/missions/any_site.toml --site path/to/folder --json");
  command->add_option("mission", options->mission, "Mission file (TOML)")->required();
  command->add_option("--site", options->site, "Use this site folder instead of the mission's");
  command->add_option("--seed", options->seed, "Use this seed instead of the mission's");
  add_json_flag(*command, options->json);
  command->callback([options, &run] {
    run = [options] { return answer(options->json, [&] { return check(*options); }); };
  });
}

void add_keys_command(CLI::App& app, Run& run) {
  const auto json = std::make_shared<bool>(false);
  auto* command =
      app.add_subcommand("keys", "Prints every key with its range, default and meaning (Markdown)");
  command->footer("Examples:\n  vantage keys | less\n  vantage keys --json");
  add_json_flag(*command, *json);
  command->callback([json, &run] {
    run = [json] {
      if (*json)
        print_json(keys_json());
      else
        fmt::print("{}", mission::config_reference());
      return kFine;
    };
  });
}

}  // namespace vantage
