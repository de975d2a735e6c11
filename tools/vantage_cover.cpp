#include "tools/vantage_cover.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "mission/plan.hpp"
#include "tools/cover_cbc.hpp"

namespace tools {
namespace {

constexpr int kCellsMax = 600;  // More make the programme slow and the bound hardly better.

CoverJudgement judge(const mission::MissionConfig& config, const nav::SiteMap& map,
                     const nav::FreeArea& area, std::uint64_t seed, double time_s, int threads) {
  const auto walls = planning::walls_of(map, area);
  const auto limits = mission::sensor_limits(config.robot.scanner);
  const auto rules = mission::cover_config(config.phase1);
  const auto plan = planning::plan_cover(area, walls, limits, rules, seed, threads);
  std::vector<int> known;
  for (const planning::Station& station : plan.stations)
    known.push_back(
        static_cast<int>(std::ranges::find(plan.candidates, station.at) - plan.candidates.begin()));
  const CbcCover exact = solve_cover(planning::cover_problem(plan, walls, limits, threads), known,
                                     {.time_s = time_s, .cells_max = kCellsMax});
  return {.area = area.name,
          .greedy = plan.stations_greedy,
          .refined = static_cast<int>(plan.stations.size()),
          .at_least = plan.stations_at_least,
          .exact = static_cast<int>(exact.sets.size()),
          .exact_at_least = exact.at_least};
}

}  // namespace

std::vector<CoverJudgement> judge_covers(const mission::MissionCheck& check, double time_s,
                                         int threads) {
  std::vector<CoverJudgement> all;
  const auto tasks = mission::assign_areas(check.config, check.site.map, check.areas).tasks;
  for (std::size_t t = 0; t < tasks.size(); ++t)
    if (tasks[t].mode != mission::AreaMode::skip)
      all.push_back(judge(check.config, check.site.map, tasks[t].area, check.config.seed + t,
                          time_s, threads));
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
