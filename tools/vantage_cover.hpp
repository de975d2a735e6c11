// `vantage cover`: how few stations a mission could do with, judged by an integer programme.
#pragma once

#include <string>
#include <vector>

#include "mission/plan.hpp"
#include "tools/cover_cbc.hpp"

namespace tools {

struct CoverJudgement {
  std::string area;
  int greedy{}, refined{};
  int at_least{};        // The planner's own proof.
  int exact{};           // CBC's best cover that reaches the goal; it knows the refined one.
  int exact_at_least{};  // CBC's bound.
};

// How CBC would cover what the plan covers, with the same candidates and the same goal, without the
// rules for overlap and gain; at most time_s.
CbcCover exact_cover(const mission::AreaPlan& plan, const mission::ScannerConfig& scanner,
                     double time_s, int threads);

// The same for every area that is not skipped.
std::vector<CoverJudgement> judge_covers(const mission::MissionConfig& config,
                                         const nav::SiteMap& map, const mission::SiteTasks& tasks,
                                         double time_s, int threads);

std::string judgement_text(const std::vector<CoverJudgement>& judgements);

}  // namespace tools
