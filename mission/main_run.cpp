#include "mission/main_run.hpp"

#include <fmt/format.h>

#include <boost/asio/co_spawn.hpp>
#include <ostream>
#include <thread>

#include "mission/disk_fault.hpp"
#include "mission/main_links.hpp"
#include "mission/report.hpp"
#include "mission/resume.hpp"

namespace mission {
namespace {

// The ground's height from the model, where the map is silent.
void take_ground(Prepared& prepared, std::vector<nav::FreeArea>& areas) {
  nav::SiteMap& map = prepared.site.map;
  assume_ground(prepared.sim, map);
  for (nav::FreeArea& area : areas) area.ground_z_m = map.ground_z_m;
}

void load_world(Prepared& prepared, const MissionCheck& check, WorldUse use,
                const std::filesystem::path& replacement, std::vector<nav::FreeArea>& areas) {
  const auto model = replacement.empty() ? check.model_file : std::optional(replacement);
  const std::string folder = check.config.site_folder.generic_string();
  if (!model && use == WorldUse::world)
    prepared.errors.push_back({folder, 0, 0,
                               "no model.obj, which simulation needs as the world; add one, or run "
                               "`vantage rehearse --model FILE.obj`"});
  if (!model || (use == WorldUse::ground && check.ground_mapped)) return;
  prepared.sim = load_sim_site(*model);
  for (const std::string& error : prepared.sim.errors)
    prepared.errors.push_back(site_error(error, model->generic_string()));
  if (prepared.errors.empty() && !check.ground_mapped) take_ground(prepared, areas);
}

constexpr hal::Duration kStartPatience = std::chrono::seconds(60);

hal::Task<void> start_and_survey(RobotDrivers& drivers, GatedDrive& gate, Survey& survey) {
  const hal::Result<void> started = co_await drivers.started(kStartPatience);
  if (started.has_error())
    throw std::runtime_error("not every device started: " + drivers.not_running());
  co_await arm(gate);
  co_await survey.run();
}

// Runs the survey to its end; returns what went wrong, or "".
std::string run_survey(SimBackend& backend, Survey& survey,
                       const std::function<void(SimBackend&)>& watch) {
  bool ended = false;
  std::string failure;
  const auto on_end = [&](std::exception_ptr error) {
    ended = true;
    try {
      if (error) std::rethrow_exception(error);
    } catch (const std::exception& e) {
      failure = e.what();
    }
  };
  boost::asio::co_spawn(backend.executor(),
                        start_and_survey(backend.drivers(), backend.gate(), survey), on_end);
  const auto done = [&] {
    if (watch) watch(backend);
    return ended;
  };
  if (!backend.run(done))
    return backend.failure().empty() ? "the mission waits for something that cannot come"
                                     : backend.failure();
  return failure;
}

void write_event(JournalFile& journal, EventText event) {
  std::vector<JournalEvent> one{{0, {}, std::move(event.kind), std::move(event.text)}};
  journal.append(one).value();
}

// Why not, in one text; empty: nothing.
std::string objections(const RunHistory& history, const std::vector<RunInput>& inputs,
                       const RunOptions& options) {
  if (history.finished()) return "the run in " + options.out.string() + " is finished";
  if (!history.begun) return "no run began in " + options.out.string();
  std::string all;
  for (const auto& some :
       {changed_inputs(*history.begun, inputs), unknown_stations(history, options.skip)})
    for (const std::string& one : some) all += (all.empty() ? "" : "; ") + one;
  return all;
}

OpenedRun go_on(const std::vector<RunInput>& inputs, const RunOptions& options) {
  std::error_code ignored;
  if (!std::filesystem::exists(options.out / RunStore::kJournalName, ignored))
    throw CannotResume("there is no run in " + options.out.string());
  const std::filesystem::path path = options.out / RunStore::kJournalName;
  JournalFile journal = JournalFile::open(path).value();
  RunHistory history = read_history(journal.read().value(), path).value();
  if (std::string why = objections(history, inputs, options); !why.empty()) throw CannotResume(why);
  const std::optional<int> lost = verify_scans(history, options.out).value();
  RunStore store = RunStore::go_on(options.out).value();
  if (options.from_start) {
    write_event(journal,
                at_start_event());  // So that another cut does not bring back the old place.
    history.stands_at_start();
  }
  write_event(journal, event_of(RunResumed{history.why_ended(), lost}));
  ++history.resumed;
  return {std::move(store), std::move(journal), std::move(history)};
}

// What only real devices need.
std::vector<ConfigError> hardware_problems(const MissionCheck& check) {
  std::vector<ConfigError> errors = link_problems(check.config);
  if (!check.origin)
    errors.push_back(
        {check.config.site_folder.generic_string(), 0, 0,
         "the map does not say where it lies on the earth, which satellite fixes need; write "
         "\"origin\": {\"lon\": ..., \"lat\": ..., \"h\": ...} beside \"features\": of (0, 0), in "
         "degrees and metres above the ellipsoid"});
  return errors;
}

// The products that are made once at the end; those of each scan are on disk already.
void write_products(RunStore& store, const Survey& survey, Journal& journal) {
  const SiteModel& model = survey.model();
  ProductFacts facts;
  facts.map_ot_offset_m =
      store.save_map(model.map().grid(), [&](planning::Voxel v) { return model.map().at(v); })
          .value()
          .offset_m;
  store.save_cloud(survey.cloud()).value();
  facts.cloud_points = survey.cloud().points().size();
  facts.cloud_grid_m = survey.cloud().grid_m();
  facts.cloud_doublings = survey.cloud().doublings();
  store.save_summary(summarise(survey.record(), facts)).value();
  store.save_report(report_html(survey.record(), facts)).value();
  store.finish().value();
  EventText event = products_event();
  journal.append_now(std::move(event.kind), std::move(event.text)).value();
  if (survey.record().completed) store.remove_beams();
}

}  // namespace

std::string save_products(RunStore& store, const Survey& survey, Journal& journal) {
  try {
    write_products(store, survey, journal);
    return "";
  } catch (const FileFailure& error) {
    return fault_text(error.error());
  }
}

OpenedRun open_run(const Prepared& prepared, const RunOptions& options) {
  const auto inputs = run_inputs(prepared.mission_file, prepared.config).value();
  if (options.resume) return go_on(inputs, options);
  RunStore store = RunStore::open(options.out).value();
  JournalFile journal = JournalFile::open(store.journal_path()).value();
  write_event(journal,
              event_of(RunBegun{prepared.config.name, prepared.config.robot.backend, inputs}));
  return {std::move(store), std::move(journal), std::nullopt};
}

Prepared prepare(const std::filesystem::path& mission_file, const Overrides& overrides,
                 WorldUse use, const std::filesystem::path& model_file) {
  MissionCheck check = check_mission(mission_file, overrides);
  Prepared prepared;
  prepared.mission_file = mission_file;
  prepared.config = check.config;
  prepared.site = std::move(check.site);
  prepared.origin = check.origin;
  prepared.notes = check.notes;
  prepared.errors = check.errors;
  if (!prepared.errors.empty()) return prepared;
  const bool hardware = use == WorldUse::backend && prepared.config.robot.backend == "hardware";
  if (use == WorldUse::backend) use = hardware ? WorldUse::ground : WorldUse::world;
  if (use == WorldUse::world || hardware) prepared.errors = robot_problems(prepared.config);
  if (hardware)
    for (ConfigError& error : hardware_problems(check)) prepared.errors.push_back(std::move(error));
  if (!prepared.errors.empty()) return prepared;
  if (use != WorldUse::none) load_world(prepared, check, use, model_file, check.areas);
  if (!prepared.errors.empty()) return prepared;
  prepared.tasks = assign_areas(prepared.config, prepared.site.map, check.areas);
  if (use == WorldUse::world)
    complete_ground(prepared.sim, prepared.site.map, prepared.tasks.tasks);
  prepared.notes.insert(prepared.notes.end(), prepared.sim.notes.begin(), prepared.sim.notes.end());
  return prepared;
}

RunOutcome run_in_simulation(Prepared& prepared, const RunOptions& options) {
  SimBackend backend(prepared.config, prepared.tasks, std::move(prepared.sim), options.threads);
  OpenedRun run = open_run(prepared, options);
  RunStore& store = run.store;
  const RunHistory* past = run.past ? &*run.past : nullptr;
  if (past != nullptr && past->where && past->where->truth)
    backend.put_robot(*past->where->truth, past->where->ground_z_m);
  std::ostream none(nullptr);
  ProgressPrinter progress(options.progress ? *options.progress : none,
                           options.progress && options.terminal);
  hal::ComputeHere compute;
  Journal journal(std::move(run.journal), backend.clock(), compute);
  backend.on_event([&journal](const std::string& what) {
    EventText event = stopped_event(what);
    journal.tell(std::move(event.kind), std::move(event.text));
  });
  Survey survey(prepared.config, prepared.site.map, prepared.tasks, options.threads,
                {backend.clock(), backend.devices(), store, progress, compute, &journal, past,
                 options.skip, [&backend] { return backend.truths(); }});
  backend.gate().watch_surroundings([&survey] { return survey.surroundings(); });
  RunRecord& record = survey.record();
  record.repairs = prepared.site.repairs;
  record.notes.insert(record.notes.begin(), prepared.notes.begin(), prepared.notes.end());
  std::string failure = run_survey(backend, survey, options.watch);
  progress.finish();
  record.notes.insert(record.notes.end(), backend.events().begin(), backend.events().end());
  record.truth = backend.judge(record, survey.model(), prepared.tasks.tasks, options.judge_cells);
  if (std::string unsaved = save_products(store, survey, journal); !unsaved.empty())
    failure += (failure.empty() ? "" : "; ") + unsaved;
  return {std::move(record), store.report_path(), std::move(failure), false};
}

int threads_or_all(int threads) {
  return threads > 0 ? threads : std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

}  // namespace mission
