#include "tools/vantage_cover.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <memory>

#include "tools/vantage_command.hpp"

namespace tools {
namespace {

constexpr int kCellsMax = 600;  // More make the programme slow and the bound hardly better.

CoverJudgement judge(const mission::AreaPlan& plan, const CbcCover& exact) {
  return {.area = plan.area.name,
          .greedy = plan.cover.stations_greedy,
          .refined = static_cast<int>(plan.cover.stations.size()),
          .at_least = plan.cover.stations_at_least,
          .exact = static_cast<int>(exact.sets.size()),
          .exact_at_least = exact.at_least};
}

}  // namespace

CbcCover exact_cover(const mission::AreaPlan& plan, const mission::ScannerConfig& scanner,
                     double time_s, int threads) {
  std::vector<int> known;
  for (const planning::Station& station : plan.cover.stations)
    known.push_back(static_cast<int>(std::ranges::find(plan.cover.candidates, station.at) -
                                     plan.cover.candidates.begin()));
  return solve_cover(
      planning::cover_problem(plan.cover, plan.walls, mission::sensor_limits(scanner), threads),
      known, {.time_s = time_s, .cells_max = kCellsMax});
}

std::vector<CoverJudgement> judge_covers(const mission::MissionConfig& config,
                                         const nav::SiteMap& map, const mission::SiteTasks& tasks,
                                         double time_s, int threads) {
  std::vector<CoverJudgement> all;
  for (const mission::PlannedArea& area : mission::plan_areas(config, map, tasks, threads))
    all.push_back(judge(area.plan, exact_cover(area.plan, config.robot.scanner, time_s, threads)));
  return all;
}

std::string judgement_text(const std::vector<CoverJudgement>& judgements) {
  std::string text = fmt::format("{:<16}{:>8}{:>9}{:>18}{:>12}{:>18}\n", "area", "greedy",
                                 "refined", "proven at least", "CBC found", "CBC at least");
  for (const auto& j : judgements)
    text += fmt::format("{:<16}{:>8}{:>9}{:>18}{:>12}{:>18}\n", j.area, j.greedy, j.refined,
                        j.at_least, j.exact, j.exact_at_least);
  return text;
}

}  // namespace tools

namespace vantage {
namespace {

struct CoverOptions {
  SiteOptions site;
  double exact_s = 60;
  bool json = false;
};

boost::json::array judgements_json(const std::vector<tools::CoverJudgement>& judgements) {
  boost::json::array areas;
  for (const auto& j : judgements)
    areas.push_back(boost::json::object{{"name", j.area},
                                        {"stations_greedy", j.greedy},
                                        {"stations", j.refined},
                                        {"stations_at_least", j.at_least},
                                        {"cbc_stations", j.exact},
                                        {"cbc_at_least", j.exact_at_least}});
  return areas;
}

int cover(const CoverOptions& options) {
  const mission::Prepared site = prepared(options.site, mission::WorldUse::none);
  const auto judgements =
      tools::judge_covers(site.config, site.site.map, site.tasks, options.exact_s,
                          mission::threads_or_all(options.site.threads));
  if (options.json)
    print_json(boost::json::object{{"ok", true}, {"areas", judgements_json(judgements)}});
  else
    fmt::print("{}", tools::judgement_text(judgements));
  return kFine;
}

}  // namespace

void add_cover_command(CLI::App& app, Run& run) {
  const auto options = std::make_shared<CoverOptions>();
  auto* command = app.add_subcommand(
      "cover",
      "Plans Phase I and tells how few stations the same candidates would need, by an integer "
      "programme (CBC)");
  command->footer("Examples:\n  vantage cover configs/missions/fort.toml --exact-s 30");
  add_mission_options(*command, options->site);
  command->add_option("--exact-s", options->exact_s, "Seconds for each area at most");
  add_json_flag(*command, options->json);
  command->callback([options, &run] {
    run = [options] { return answer(options->json, [&] { return cover(*options); }); };
  });
}

}  // namespace vantage
