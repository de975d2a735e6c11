// What a robot file says of its corrections, in the terms of the drivers. Like main.cpp it may know
// everything.
#pragma once

#include <string>

#include "drivers/ntrip_codec.hpp"
#include "mission/account.hpp"
#include "mission/config.hpp"

namespace mission {

inline bool has_corrections(const RobotConfig& robot) {
  return robot.corrections.device != "none";
}

// The link must be one that corrections_problem() has nothing against.
drivers::NtripRequest ntrip_request_of(const CorrectionsConfig& config, const Account& account);

// What is wrong with them, and the key that says so; empty: nothing.
struct CorrectionsProblem {
  std::string key, text;
};
CorrectionsProblem corrections_problem(const RobotConfig& robot);

}  // namespace mission
