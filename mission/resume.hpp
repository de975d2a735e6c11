// A run that was cut off or ended early: what lies in its folder, and what whoever starts the
// program again is offered.
#pragma once

#include <boost/json/object.hpp>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "mission/config.hpp"
#include "mission/files.hpp"
#include "mission/run_history.hpp"

namespace mission {

struct LeftRun {
  RunHistory history;
  std::string last_scan_damage;  // Empty: the last scan is whole, or there is none.
};

// Nothing where nothing would be lost: no run, a finished one, or one without a scan. Fails when
// the journal is damaged or in use. Reads the journal and the last scan, no more.
FileResult<std::optional<LeftRun>> find_left_run(const std::filesystem::path& folder);

// For people, and for programs: station k of n, the last scan and whether it is whole, why it
// ended, and what can be done.
std::string offer_text(const LeftRun& run, const std::filesystem::path& folder);
boost::json::object offer_json(const LeftRun& run, const std::filesystem::path& folder);

// Files and settings that decide what a run does, with their checksums: mission, robot and plan
// file, the site's maps and models, the seed.
FileResult<std::vector<RunInput>> run_inputs(const std::filesystem::path& mission_file,
                                             const MissionConfig& config);

// What is not as it was when the run began; one sentence each.
std::vector<std::string> changed_inputs(const RunBegun& begun, const std::vector<RunInput>& now);

// Names that no station of the run has; one sentence each.
std::vector<std::string> unknown_stations(const RunHistory& history,
                                          const std::vector<std::string>& names);

// Whether every scan of the run is whole. Empties the run of its last one when that is damaged, and
// returns its number; any other is an error.
FileResult<std::optional<int>> verify_scans(RunHistory& history,
                                            const std::filesystem::path& folder);

}  // namespace mission
