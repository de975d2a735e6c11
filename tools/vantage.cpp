// vantage: the person's command line, without the robot.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <optional>

#include "mission/check_report.hpp"
#include "mission/config_schema.hpp"
#include "mission/json_text.hpp"
#include "tools/vantage_cover.hpp"
#include "tools/vantage_decode.hpp"
#include "tools/vantage_tour.hpp"

namespace {

constexpr int kFine = 0, kRefused = 2;
constexpr int kThreads = 2;

struct CheckOptions {
  std::filesystem::path mission;
  std::filesystem::path site;
  std::optional<std::uint64_t> seed;
  bool json = false;
  double exact_s = 60;
};

mission::MissionCheck checked(const CheckOptions& options) {
  return mission::check_mission(options.mission, {.site_folder = options.site,
                                                  .has_seed = options.seed.has_value(),
                                                  .seed = options.seed.value_or(0)});
}

int check(const CheckOptions& options) {
  const auto result = checked(options);
  if (options.json) fmt::print("{}", mission::json_pretty(mission::check_json(result)));
  for (const auto& error : result.errors)
    if (!options.json) fmt::print(stderr, "{}\n", error.text());
  if (!result.errors.empty()) return kRefused;
  if (!options.json) fmt::print("{}", mission::check_text(result));
  return kFine;
}

int cover(const CheckOptions& options) {
  const auto result = checked(options);
  for (const auto& error : result.errors) fmt::print(stderr, "{}\n", error.text());
  if (!result.errors.empty()) return kRefused;
  fmt::print("{}", tools::judgement_text(tools::judge_covers(result, options.exact_s, kThreads)));
  return kFine;
}

void add_mission_options(CLI::App& command, CheckOptions& options) {
  command.add_option("mission", options.mission, "Mission file (TOML)")->required();
  command.add_option("--site", options.site, "Use this site folder instead of the mission's");
  command.add_option("--seed", options.seed, "Use this seed instead of the mission's");
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Helps to write missions: checks them, explains their keys."};
  app.footer(
      "Examples:\n"
      "  vantage check configs/missions/fort.toml\n"
      "  vantage check configs/missions/any_site.toml --site path/to/folder --json\n"
      "  vantage tour pcb442.tsp --json\n"
      "  vantage cover configs/missions/fort.toml\n"
      "  vantage keys | less\n"
      "  vantage decode agilex drive.log\n"
      "Exit: 0 fine, 1 nothing found, 2 not fine (every reason is on stderr, one a line).");
  app.require_subcommand(1);

  CheckOptions options;
  auto* check_command = app.add_subcommand(
      "check",
      "Reads a mission, its robot and its site; reports every error, or what will be used");
  add_mission_options(*check_command, options);
  check_command->add_flag("--json", options.json, "Report as JSON on stdout, errors too");
  auto* cover_command = app.add_subcommand(
      "cover",
      "Plans Phase I and tells how few stations the same candidates would need, by an integer "
      "programme (CBC)");
  add_mission_options(*cover_command, options);
  cover_command->add_option("--exact-s", options.exact_s, "Seconds for each area at most");
  auto* keys_command =
      app.add_subcommand("keys", "Prints every key with its range, default and meaning (Markdown)");
  std::function<int()> run;
  vantage::add_tour_command(app, run);
  vantage::add_decode_command(app, run);

  try {
    app.parse(argc, argv);
    if (run) return run();
    if (*keys_command) {
      fmt::print("{}", mission::config_reference());
      return kFine;
    }
    return *cover_command ? cover(options) : check(options);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kFine : kRefused;
  } catch (const std::exception& error) {
    fmt::print(stderr, "vantage: {}\n", error.what());
    return kRefused;
  }
}
