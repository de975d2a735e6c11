// vantaged: surveys one site, from its floor plan to the last next best view.
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <boost/asio/co_spawn.hpp>
#include <chrono>
#include <cstdio>
#include <iostream>
#include <thread>

#include "mission/check.hpp"
#include "mission/main_sim.hpp"
#include "mission/report.hpp"
#include "mission/site_io.hpp"
#include "mission/summary.hpp"
#include "mission/survey.hpp"

namespace {

// Exit codes: what the operator's scripts may rely on.
constexpr int kDone = 0, kFailed = 1, kRefused = 2;

struct Options {
  std::filesystem::path mission;
  std::filesystem::path out;
  std::filesystem::path site;
  std::filesystem::path judge_cells;
  std::optional<std::uint64_t> seed;
  int threads = 0;
  bool quiet = false;
};

// Everything that must be right before anything starts or is written.
struct Prepared {
  mission::MissionConfig config;
  nav::RepairedSite site;
  mission::SiteTasks tasks;
  mission::SimSite sim;
  std::vector<std::string> notes;
  std::vector<std::string> errors;
};

int refuse(const std::vector<std::string>& errors) {
  for (const std::string& error : errors) fmt::print(stderr, "{}\n", error);
  fmt::print(stderr, "vantaged: refused to start: {} error{}; nothing was written\n", errors.size(),
             errors.size() == 1 ? "" : "s");
  return kRefused;
}

bool any_ground(const nav::RawSite& raw) {
  return std::ranges::any_of(raw.features, [](const auto& f) { return f.ground_z_m.has_value(); });
}

void prepare_site(Prepared& prepared) {
  mission::LoadedSite loaded = mission::load_site(prepared.config.site_folder);
  prepared.errors = loaded.errors;
  if (prepared.errors.empty() && !loaded.model_file)
    prepared.errors.push_back(fmt::format("{}: no model.obj, which simulation needs as the world",
                                          prepared.config.site_folder.string()));
  if (!prepared.errors.empty()) return;
  prepared.notes = loaded.notes;
  prepared.site = nav::repair_site(loaded.raw, prepared.config.margin_m);
  prepared.errors = prepared.site.errors;
  if (!prepared.errors.empty()) return;
  prepared.sim = mission::load_sim_site(*loaded.model_file);
  prepared.errors = prepared.sim.errors;
  if (!prepared.errors.empty()) return;
  if (!any_ground(loaded.raw)) mission::assume_ground(prepared.sim, prepared.site.map);
}

Prepared prepare(const Options& options) {
  Prepared prepared;
  const mission::LoadedMission loaded =
      mission::load_mission(options.mission, {.site_folder = options.site,
                                              .has_seed = options.seed.has_value(),
                                              .seed = options.seed.value_or(0)});
  for (const mission::ConfigError& error : loaded.errors) prepared.errors.push_back(error.text());
  if (!prepared.errors.empty()) return prepared;
  prepared.config = loaded.config;
  prepare_site(prepared);
  if (!prepared.errors.empty()) return prepared;

  const auto areas = nav::free_areas(prepared.site.map, prepared.config.robot.body.radius_m,
                                     mission::kFreeAreaMinM2);
  for (const mission::ConfigError& error :
       mission::check_site(prepared.config, prepared.site, areas))
    prepared.errors.push_back(error.text());
  if (!prepared.errors.empty()) return prepared;
  prepared.tasks = mission::assign_areas(prepared.config, prepared.site.map, areas);
  mission::complete_ground(prepared.sim, prepared.site.map, prepared.tasks.tasks);
  return prepared;
}

void print_outcome(const mission::RunRecord& record, const mission::RunStore& store,
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
  fmt::print("  report: {}\n", store.report_path().string());
  fmt::print(stderr, "{:.1f} s of wall time\n", wall_s);  // Apart: stdout repeats exactly.
}

// The products that are made once at the end; those of each scan are on disk already.
void save_products(mission::RunStore& store, const mission::Survey& survey) {
  const mission::SiteModel& model = survey.model();
  mission::ProductFacts facts;
  facts.map_ot_offset_m =
      store.save_map(model.map().grid(), [&](planning::Voxel v) { return model.map().at(v); })
          .value()
          .offset_m;
  store.save_cloud(survey.cloud()).value();
  facts.cloud_points = survey.cloud().points().size();
  facts.cloud_grid_m = survey.cloud().grid_m();
  facts.cloud_doublings = survey.cloud().doublings();
  store.save_summary(mission::summarise(survey.record(), facts)).value();
  store.save_report(mission::report_html(survey.record(), facts)).value();
  store.finish().value();
}

int survey_site(Prepared& prepared, const Options& options, int threads) {
  const auto began = std::chrono::steady_clock::now();
  mission::SimBackend backend(prepared.config, prepared.tasks, std::move(prepared.sim), threads);
  mission::RunStore store = mission::RunStore::open(options.out).value();
  std::ostream none(nullptr);
  mission::ProgressPrinter progress(options.quiet ? none : std::cerr,
                                    !options.quiet && isatty(STDERR_FILENO) != 0);
  mission::Survey survey(prepared.config, prepared.site.map, prepared.tasks, threads,
                         {backend.clock(), backend.devices(), store, progress});
  mission::RunRecord& record = survey.record();
  record.repairs = prepared.site.repairs;
  record.notes.insert(record.notes.begin(), prepared.notes.begin(), prepared.notes.end());

  bool ended = false;
  std::string failure;
  boost::asio::co_spawn(backend.io(), survey.run(), [&](std::exception_ptr error) {
    ended = true;
    try {
      if (error) std::rethrow_exception(error);
    } catch (const std::exception& e) {
      failure = e.what();
    }
  });
  if (!backend.run([&] { return ended; }))
    failure = "the mission waits for something that cannot come";
  progress.finish();
  record.truth = backend.judge(record, survey.model(), prepared.tasks.tasks, options.judge_cells);
  save_products(store, survey);
  print_outcome(record, store,
                std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count());
  if (failure.empty()) return kDone;
  fmt::print(stderr, "vantaged: {}\n", failure);
  return kFailed;
}

int run(const Options& options) {
  Prepared prepared = prepare(options);
  if (!prepared.errors.empty()) return refuse(prepared.errors);
  for (const nav::Repair& repair : prepared.site.repairs)
    fmt::print(stderr, "repaired: {}: {}\n", repair.where, repair.what);
  prepared.notes.insert(prepared.notes.end(), prepared.sim.notes.begin(), prepared.sim.notes.end());
  for (const auto* notes : {&prepared.notes, &prepared.tasks.notes})
    for (const std::string& note : *notes) fmt::print(stderr, "note: {}\n", note);
  const int cores = static_cast<int>(std::thread::hardware_concurrency());
  return survey_site(prepared, options, options.threads > 0 ? options.threads : std::max(1, cores));
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  CLI::App app{"Surveys a site: plans stations, tours them, takes next best views."};
  app.footer(
      "Examples:\n"
      "  vantaged configs/missions/fort.toml --out runs/fort\n"
      "  vantaged configs/missions/any_site.toml --site path/to/folder --out runs/mine\n"
      "Exit: 0 done, 1 the mission failed (the report says how far it came), 2 refused to start.");
  app.add_option("mission", options.mission, "Mission file (TOML)")->required();
  app.add_option("--out", options.out, "Folder for the run's products")->required();
  app.add_option("--site", options.site, "Use this site folder instead of the mission's");
  app.add_option("--seed", options.seed, "Use this seed instead of the mission's");
  app.add_option("--threads", options.threads,
                 "Threads for planning and ray casting (0: all cores)")
      ->check(CLI::Range(0, 256));
  app.add_option("--judge-cells", options.judge_cells,
                 "Simulation: write the scanner positions that coverage was judged from (CSV)");
  app.add_flag("--quiet", options.quiet, "No progress on the terminal");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kDone : kRefused;
  }
  try {
    return run(options);
  } catch (const std::exception& error) {
    fmt::print(stderr, "vantaged: {}\n", error.what());
    return kRefused;
  }
}
