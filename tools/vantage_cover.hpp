// `vantage cover`: how few stations a mission could do with, judged by an integer programme.
#pragma once

#include <string>

#include "mission/check_report.hpp"

namespace tools {

struct CoverJudgement {
  std::string area;
  int greedy{}, refined{};
  int at_least{};        // The planner's own proof.
  int exact{};           // CBC's best cover that reaches the goal; it knows the refined one.
  int exact_at_least{};  // CBC's bound.
};

// Plans every area that is not skipped, and gives CBC the same candidates and the same goal,
// without the rules for overlap and gain; at most time_s for each area.
std::vector<CoverJudgement> judge_covers(const mission::MissionCheck& check, double time_s,
                                         int threads);

std::string judgement_text(const std::vector<CoverJudgement>& judgements);

}  // namespace tools
