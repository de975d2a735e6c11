// What another config would change. Pure.
#pragma once

#include <string>
#include <vector>

#include "mission/config.hpp"

namespace mission {

// "phase1.candidates: 500 instead of 1000", in the schema's order; empty: every key has the same
// value.
std::vector<std::string> config_changes(const MissionConfig& now, const MissionConfig& next);

}  // namespace mission
