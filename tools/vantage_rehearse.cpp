// vantage rehearse: the whole mission in a rough model, before anybody goes to the site. The
// stations and the next best views it took become one set of stations for the real mission.
#include <fmt/format.h>
#include <unistd.h>

#include <iostream>
#include <memory>

#include "mission/main_realtime.hpp"
#include "mission/plan_preview.hpp"
#include "mission/progress.hpp"
#include "tools/vantage_command.hpp"

namespace vantage {
namespace {

struct RehearseOptions {
  SiteOptions site;
  std::filesystem::path model, out, save;
  bool json = false;
};

struct Counts {
  std::size_t stations{}, views{};
};

Counts counts_of(const mission::RunRecord& record) {
  Counts counts;
  for (const mission::ScanRecord& scan : record.scans)
    ++(scan.next_best_view ? counts.views : counts.stations);
  return counts;
}

boost::json::object outcome_json(const mission::RunOutcome& outcome, const mission::SavedPlan& plan,
                                 const std::filesystem::path& saved) {
  const mission::RunRecord& record = outcome.record;
  const Counts counts = counts_of(record);
  boost::json::array stations, dropped;
  for (const mission::SavedStation& station : plan.stations)
    stations.push_back(boost::json::object{{"area", station.area},
                                           {"name", station.name},
                                           {"x_m", station.x_m},
                                           {"y_m", station.y_m},
                                           {"heading_deg", station.heading_deg}});
  for (const mission::DroppedStation& station : record.dropped)
    dropped.push_back(boost::json::object{{"name", station.name}, {"reason", station.reason}});
  return {{"ok", outcome.failure.empty()},
          {"completed", record.completed},
          {"end", outcome.failure.empty() ? record.end : outcome.failure},
          {"stations", counts.stations},
          {"next_best_views", counts.views},
          {"minutes", record.mission_s / 60},
          {"driven_m", record.driven_total_m},
          {"plan", std::move(stations)},
          {"dropped", std::move(dropped)},
          {"plan_file", saved.generic_string()},
          {"report", outcome.report.generic_string()}};
}

void print_outcome(const mission::RunOutcome& outcome, const mission::SavedPlan& plan,
                   const std::filesystem::path& saved) {
  const mission::RunRecord& record = outcome.record;
  const Counts counts = counts_of(record);
  fmt::print("rehearsed {}: {} stations and {} next best views in {}, {:.0f} m driven\n",
             record.site, counts.stations, counts.views, mission::duration_text(record.mission_s),
             record.driven_total_m);
  fmt::print("  ended: {}\n", record.end);
  for (const mission::DroppedStation& station : record.dropped)
    fmt::print("  dropped {}: {}\n", station.name, station.reason);
  fmt::print("  plan of {} stations: {}\n", plan.stations.size(), saved.string());
  fmt::print("    to use it, write into the mission: plan = \"{}\" (or its path from there)\n",
             saved.filename().string());
  fmt::print("  report: {}\n", outcome.report.string());
}

// runs/fort-rehearsal for a mission of fort.toml.
std::filesystem::path folder_of(const RehearseOptions& options) {
  if (!options.out.empty()) return options.out;
  return std::filesystem::path("runs") / (options.site.mission.stem().string() + "-rehearsal");
}

int rehearse(const RehearseOptions& options) {
  mission::keep_memory();
  const std::filesystem::path out = folder_of(options);
  mission::Prepared site = prepared(options.site, mission::WorldUse::world, options.model);
  if (!options.model.empty())
    site.notes.push_back(fmt::format(
        "rehearsed in {} instead of the site's own model: coverage and truth are of that model",
        options.model.generic_string()));
  if (!options.json) tell_remarks(site);
  const mission::RunOutcome outcome = mission::run_in_simulation(
      site, {.out = out,
             .judge_cells = {},
             .threads = mission::threads_or_all(options.site.threads),
             .progress = isatty(STDERR_FILENO) != 0 ? &std::cerr : nullptr,
             .terminal = true});
  const mission::SavedPlan plan = mission::plan_of(outcome.record);
  const auto saved = options.save.empty() ? out / "plan.toml" : options.save;
  if (!plan.stations.empty()) write_product(saved, mission::plan_text(plan));
  if (options.json) {
    boost::json::object answer = outcome_json(outcome, plan, saved);
    add_remarks(answer, site);
    print_json(answer);
  } else {
    print_outcome(outcome, plan, saved);
  }
  if (outcome.failure.empty()) return kFine;
  fmt::print(stderr, "vantage: {}\n", outcome.failure);
  return kFailed;
}

}  // namespace

void add_rehearse_command(CLI::App& app, Run& run) {
  const auto options = std::make_shared<RehearseOptions>();
  auto* command = app.add_subcommand(
      "rehearse", "Runs a mission in a model of the site and saves where it scanned as a plan");
  command->footer(
      "Examples:\n"
      "  vantage rehearse configs/missions/church.toml\n"
      "  vantage rehearse my.toml --model rough.obj --out runs/rehearsal --save plan.toml\n"
      "The plan holds the stations and the next best views; a mission with plan = \"plan.toml\"\n"
      "tours them and plans no others.\n"
      "Exit: 0 fine, 1 the mission failed (the plan holds what it did), 2 refused.");
  add_mission_options(*command, options->site);
  command->add_option("--model", options->model, "Rough 3-D model (OBJ) instead of the site's own");
  command->add_option("--out", options->out,
                      "Folder for the rehearsal's products; default: runs/MISSION-rehearsal");
  command->add_option("--save", options->save, "Plan file to write; default: plan.toml in --out");
  add_json_flag(*command, options->json);
  command->callback([options, &run] {
    run = [options] { return answer(options->json, [&] { return rehearse(*options); }); };
  });
}

}  // namespace vantage
