// Plan files: stations chosen before, so that a survey can visit the same places again.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "mission/config.hpp"
#include "mission/config_reader.hpp"
#include "nav/free_space.hpp"

namespace mission {

// Reads a plan file (TOML; keys in configs/README.md) into config.plan. A station without area, x_m
// or y_m is an error, as are more stations than kPlanStationsMax and two of one name.
inline constexpr std::size_t kPlanStationsMax = 10'000;
ConfigReading read_plan(std::string_view text, const std::string& file, MissionConfig& config);

// The same as text that reads back to the same stations, bit for bit.
std::string plan_text(const SavedPlan& plan);

// What is wrong with config.plan on this site: stations in no free area, in another than they say,
// or in a region that the mission skips. `areas` as for check_site.
std::vector<ConfigError> check_plan(const MissionConfig& config,
                                    const std::vector<nav::FreeArea>& areas);

// The plan's stations in this area, in their order.
std::vector<SavedStation> stations_in(const SavedPlan& plan, const std::string& area);

}  // namespace mission
