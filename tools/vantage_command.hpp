// What the commands of `vantage` have in common: options, exit codes, how errors are told.
#pragma once

#include <CLI/CLI.hpp>
#include <boost/json/object.hpp>
#include <filesystem>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "mission/main_run.hpp"
#include "mission/past_run.hpp"

namespace vantage {

// Exit codes: what scripts may rely on.
constexpr int kFine = 0, kFailed = 1, kRefused = 2;

// Runs the command that the user named; each command sets it when it is parsed.
using Run = std::function<int()>;

// The commands, one file each. Each adds itself to the app and, when named, sets `run`.
void add_check_command(CLI::App& app, Run& run);
void add_keys_command(CLI::App& app, Run& run);
void add_plan_command(CLI::App& app, Run& run);
void add_rehearse_command(CLI::App& app, Run& run);
void add_nbv_command(CLI::App& app, Run& run);
void add_why_command(CLI::App& app, Run& run);
void add_slice_command(CLI::App& app, Run& run);
void add_cover_command(CLI::App& app, Run& run);
void add_tour_command(CLI::App& app, Run& run);
void add_decode_command(CLI::App& app, Run& run);
void add_doctor_command(CLI::App& app, Run& run);
void add_register_command(CLI::App& app, Run& run);
void add_localize_command(CLI::App& app, Run& run);
void add_explain_command(CLI::App& app, Run& run);
void add_route_command(CLI::App& app, Run& run);
void add_resume_command(CLI::App& app, Run& run);
void add_console_command(CLI::App& app, Run& run);

// Bad input: what() is for the user, "FILE:LINE:COLUMN: ..." where there is a place. Exit 2.
struct Refusal : std::runtime_error {
  explicit Refusal(const std::string& message) : Refusal({{"vantage", 0, 0, message}}) {}
  explicit Refusal(std::vector<mission::ConfigError> all);

  std::vector<mission::ConfigError> errors;
};

// Which mission, on which site.
struct SiteOptions {
  std::filesystem::path mission, site, robot;
  std::optional<std::uint64_t> seed;
  int threads = 0;

  mission::Overrides overrides() const;
};

// --site, --mission, --robot, --seed, --threads.
void add_site_options(CLI::App& command, SiteOptions& options);
// The same with the mission as the command's required argument.
void add_mission_options(CLI::App& command, SiteOptions& options);

// --json, the same on every command.
void add_json_flag(CLI::App& command, bool& json);

// Reads and checks everything; throws Refusal with every error.
mission::Prepared prepared(const SiteOptions& options, mission::WorldUse use,
                           const std::filesystem::path& model_file = {});

// Reads what a run left behind, or throws Refusal.
mission::PastRun past_run(const std::filesystem::path& path);

// What a run left behind, on its site.
struct PastSite {
  std::filesystem::path map_file;
  mission::Prepared site;  // Notes say where it differs from what the run had.
  mission::SiteModel model;
};

// `map` is map.ot or the run's folder. Without a mission file, voxels and margin are the run's; and
// radius and scanner too, unless a robot file is given.
PastSite past_site(const SiteOptions& options, const std::filesystem::path& map);

// Repairs and notes on stderr, so that nothing is changed in silence.
void tell_remarks(const mission::Prepared& prepared);
// The same as members "repairs" and "notes".
void add_remarks(boost::json::object& to, const mission::Prepared& prepared);

void print_json(const boost::json::value& value);

// Writes the file whole, or throws Refusal.
void write_product(const std::filesystem::path& file, const std::string& text);

// Calls the command and turns its errors into messages and an exit code; with `json` they are also
// on stdout as {"ok": false, "errors": [...]}.
int answer(bool json, const std::function<int()>& command);

// "1,-2.5,3" -> that many numbers; throws Refusal that names the option.
std::vector<double> parse_numbers(const std::string& text, std::size_t count,
                                  const std::string& option);
Eigen::Vector2d parse_xy(const std::string& text, const std::string& option);

}  // namespace vantage
