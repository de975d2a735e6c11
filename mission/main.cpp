// vantaged: surveys one site, from its floor plan to the last next best view.
#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <iostream>

#include "mission/main_command_line.hpp"
#include "mission/main_hardware.hpp"
#include "mission/main_realtime.hpp"
#include "mission/main_service.hpp"
#include "mission/resume.hpp"

namespace {

// Exit codes: what the operator's scripts may rely on.
constexpr int kDone = 0, kFailed = 1, kRefused = 2, kStopped = 3, kUnfinished = 4, kStartAgain = 5;

struct Options {
  std::filesystem::path mission;
  std::filesystem::path out;
  std::filesystem::path site;
  std::filesystem::path judge_cells;
  std::optional<std::uint64_t> seed;
  int threads = 0;
  bool quiet = false;
  bool service = false;
  bool resume = false, restart = false, from_start = false;
  std::vector<std::string> skip;
};

int refuse(const std::vector<mission::ConfigError>& errors) {
  for (const auto& error : errors) fmt::print(stderr, "{}\n", error.text());
  fmt::print(stderr, "vantaged: refused to start: {} error{}; nothing was written\n", errors.size(),
             errors.size() == 1 ? "" : "s");
  return kRefused;
}

void print_outcome(const mission::RunRecord& record, const std::filesystem::path& report,
                   double wall_s) {
  double covered_m = 0, coverable_m = 0;
  for (const mission::AreaPlan& plan : record.plans) {
    covered_m += plan.cover.covered_m;
    coverable_m += plan.cover.coverable_m;
  }
  const auto views =
      std::ranges::count_if(record.scans, [](const auto& scan) { return scan.next_best_view; });
  fmt::print("{}: {}\n", record.completed ? "done" : "NOT completed", record.end);
  fmt::print("  {} scans ({} stations, {} next best views), {} dropped\n", record.scans.size(),
             static_cast<std::ptrdiff_t>(record.scans.size()) - views, views,
             record.dropped.size());
  if (coverable_m > 0)
    fmt::print(
        "  Phase I plan covers {:.1f} % of the {:.0f} m of wall that any station could see\n",
        100 * covered_m / coverable_m, coverable_m);
  fmt::print("  driven {:.0f} m in {} of mission time\n", record.driven_total_m,
             mission::duration_text(record.mission_s));
  if (record.truth && record.truth->surface_visible > 0)
    fmt::print(
        "  truth: {:.2f} % of the {} visible surface voxels are seen; worst pose error {:.3f} m\n",
        100.0 * static_cast<double>(record.truth->surface_seen) /
            static_cast<double>(record.truth->surface_visible),
        record.truth->surface_visible, record.truth->position_error_max_m);
  fmt::print("  report: {}\n", report.string());
  fmt::print(stderr, "{:.1f} s of wall time\n", wall_s);  // Apart: stdout repeats exactly.
}

mission::Prepared prepare(const Options& options) {
  return mission::prepare(options.mission,
                          {.site_folder = options.site,
                           .robot_file = {},
                           .has_seed = options.seed.has_value(),
                           .seed = options.seed.value_or(0)},
                          mission::WorldUse::backend);
}

// Why this mission is nothing for a service; empty: it is.
std::vector<mission::ConfigError> service_problems(const mission::Prepared& prepared) {
  std::vector<mission::ConfigError> errors;
  if (prepared.config.robot.backend != "hardware")
    errors.push_back({prepared.config.robot_file.generic_string(), 0, 0,
                      "a service runs real devices; write backend = \"hardware\""});
  if (std::getenv("STATE_DIRECTORY") == nullptr)
    errors.push_back({"--service", 0, 0,
                      "needs a folder that outlasts it in $STATE_DIRECTORY; write "
                      "StateDirectory=vantage in its unit"});
  return errors;
}

// Before anything else is read: within a second or two.
std::optional<int> offer(const Options& options) {
  if (options.resume || options.restart) return std::nullopt;
  const auto left = mission::find_left_run(options.out);
  if (!left) {
    fmt::print(stderr, "vantaged: {}; begin anew with --restart\n", left.error().text());
    return kRefused;
  }
  if (!left->has_value()) return std::nullopt;
  fmt::print("{}", mission::offer_text(**left, options.out));
  return kUnfinished;
}

struct RunPlace {
  std::filesystem::path folder;
  bool resume{}, from_start{};
};

// A service goes on with the run that it left, once a person has released the robot; where that
// cannot be, it says why and begins another one: nothing of the old one is touched.
RunPlace service_run(const std::filesystem::path& runs, const mission::Prepared& prepared,
                     mission::Service& service) {
  const std::filesystem::path last = mission::last_run_folder(runs);
  const mission::NextStart ordered = service.this_start();
  if (ordered == mission::NextStart::anew)
    service.log("begins a new run, as an operator ordered at the console");
  if (!last.empty() && ordered != mission::NextStart::anew) {
    const auto left = mission::find_left_run(last);
    if (!left) {
      service.log(fmt::format("begins a new run: {}", left.error().text()));
    } else if (left->has_value()) {
      const auto now = mission::run_inputs(prepared.mission_file, prepared.config).value();
      const auto& begun = (*left)->history.begun;
      std::vector<std::string> obstacles =
          begun ? mission::changed_inputs(*begun, now)
                : std::vector<std::string>{"its journal lacks the beginning"};
      service.log(mission::offer_text(**left, last));
      mission::RunHistory history = (*left)->history;
      if (const auto whole = mission::verify_scans(history, last); !whole)
        obstacles.push_back(whole.error().text());
      const bool from_start = ordered == mission::NextStart::from_start;
      if (from_start && obstacles.empty())
        service.log("goes on from the start, as an operator ordered at the console");
      if (obstacles.empty()) return {last, true, from_start};
      service.log("begins a new run instead: " + obstacles.front());
    }
  }
  return {mission::next_run_folder(runs), false};
}

int run(const Options& options) {
  const auto began = std::chrono::steady_clock::now();
  if (!options.service)
    if (const auto offered = offer(options)) return *offered;
  mission::Prepared prepared = prepare(options);
  if (prepared.errors.empty() && options.service) prepared.errors = service_problems(prepared);
  if (!prepared.errors.empty()) return refuse(prepared.errors);
  std::optional<mission::Service> service;
  if (options.service) service.emplace(std::getenv("STATE_DIRECTORY"));
  for (const nav::Repair& repair : prepared.site.repairs)
    fmt::print(stderr, "repaired: {}: {}\n", repair.where, repair.what);
  for (const auto* notes : {&prepared.notes, &prepared.tasks.notes})
    for (const std::string& note : *notes) fmt::print(stderr, "note: {}\n", note);
  const RunPlace place = service ? service_run(options.out, prepared, *service)
                                 : RunPlace{options.out, options.resume, options.from_start};
  const mission::RunOptions run_options{.out = place.folder,
                                        .resume = place.resume,
                                        .skip = options.skip,
                                        .from_start = place.from_start,
                                        .judge_cells = options.judge_cells,
                                        .threads = mission::threads_or_all(options.threads),
                                        .progress = options.quiet ? nullptr : &std::cerr,
                                        .terminal = isatty(STDERR_FILENO) != 0,
                                        .service = service ? &*service : nullptr,
                                        .prepare_again = [&] { return prepare(options); }};
  const bool hardware = prepared.config.robot.backend == "hardware";
  const mission::RunOutcome outcome = hardware ? mission::run_on_hardware(prepared, run_options)
                                               : mission::run_in_simulation(prepared, run_options);
  print_outcome(outcome.record, outcome.report,
                std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count());
  if (service) service->ended(outcome.held);
  if (service && service->next_start() != mission::NextStart::as_usual) return kStartAgain;
  if (outcome.failure.empty()) return kDone;
  fmt::print(stderr, "vantaged: {}\n", outcome.failure);
  return outcome.stopped ? kStopped : kFailed;
}

void add_options(mission::CommandLine& line, Options& options) {
  line.add("mission", &options.mission, "Mission file (TOML)", {.required = true});
  line.add("--out", &options.out, "Folder for the run's products", {.required = true});
  line.add("--site", &options.site, "Use this site folder instead of the mission's");
  line.add("--seed", &options.seed, "Use this seed instead of the mission's");
  line.add("--threads", &options.threads, "Threads for planning and ray casting (0: all cores)",
           {.within = {{0, 256}}});
  line.add("--judge-cells", &options.judge_cells,
           "Simulation: write the scanner positions that coverage was judged from (CSV)");
  line.add("--resume", &options.resume,
           "Go on with the unfinished run in --out: no station is scanned again");
  line.add("--restart", &options.restart, "Remove an unfinished run in --out and begin anew",
           {.excludes = "--resume"});
  line.add("--skip", &options.skip,
           "With --resume: leave out this station, by its name; may be given again",
           {.needs = "--resume"});
  line.add("--from-start", &options.from_start,
           "With --resume: the robot stands at its start now, wherever the run last knew it to be, "
           "as when it drove home for a disk that never worked again",
           {.needs = "--resume"});
  line.add("--quiet", &options.quiet, "No progress on the terminal");
  line.add("--service", &options.service,
           "As a service of systemd (see vantage.service): tells it how far it is, and waits "
           "for a person's release unless the mission says start = \"on-boot\" and the last "
           "run ended in order and did not leave the robot stopped; --out holds a numbered folder "
           "for each run");
}

}  // namespace

int main(int argc, char** argv) {
  mission::keep_memory();
  Options options;
  mission::CommandLine line(
      "Surveys a site: plans stations, tours them, takes next best views.",
      "Examples:\n"
      "  vantaged configs/missions/fort.toml --out runs/fort\n"
      "  vantaged configs/missions/any_site.toml --site path/to/folder --out runs/mine\n"
      "Exit: 0 done, 1 the mission failed (the report says how far it came), 2 refused to start,\n"
      "3 stopped by SIGINT or SIGTERM: the robot stands, and the report says how far it came,\n"
      "4 an unfinished run is in the folder: nothing was done; --resume or --restart decides,\n"
      "5 a service that is to be started again, as was ordered at its console.");
  add_options(line, options);
  if (!line.parse(argc, argv)) return line.asked_for_help() ? kDone : kRefused;
  try {
    return run(options);
  } catch (const std::exception& error) {
    fmt::print(stderr, "vantaged: {}\n", error.what());
    return kRefused;
  }
}
