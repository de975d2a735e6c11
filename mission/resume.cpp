#include "mission/resume.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "mission/beams_file.hpp"
#include "mission/checksum.hpp"
#include "mission/progress.hpp"
#include "mission/store.hpp"

namespace mission {
namespace {

namespace fs = std::filesystem;
namespace json = boost::json;

fs::path beams_of(const fs::path& folder, int number) {
  return folder / "scans" / fmt::format("{:04}.beams", number);
}

FileResult<void> verify(const fs::path& folder, const ScanDone& done) {
  return verify_beams(beams_of(folder, done.scan.number), done.beams_checksum);
}

// Stations that were scanned or dropped, of those that were planned.
std::size_t stations_dealt_with(const RunHistory& history) {
  std::set<std::pair<std::string, std::string>> done;
  for (const RunStep& step : history.steps) {
    if (const auto* scan = std::get_if<ScanDone>(&step); scan != nullptr && !scan->view)
      done.emplace(scan->scan.area, scan->scan.name);
    if (const auto* drop = std::get_if<StationDropped>(&step); drop != nullptr && !drop->view)
      done.emplace(drop->station.area, drop->station.name);
  }
  return done.size();
}

std::size_t views_taken(const RunHistory& history) {
  return static_cast<std::size_t>(std::ranges::count_if(
      history.scans(), [](const ScanDone* scan) { return scan->view.has_value(); }));
}

std::size_t stations_planned(const RunHistory& history) {
  return history.planned ? history.planned->stations.size() : 0;
}

FileResult<RunInput> input_of(const std::string& what, const fs::path& file) {
  const auto text = read_file(file);
  if (!text) return text.error();
  return RunInput{what + " " + file.filename().string(), checksum_of(*text)};
}

}  // namespace

FileResult<std::optional<LeftRun>> find_left_run(const fs::path& folder) {
  const fs::path path = folder / RunStore::kJournalName;
  std::error_code ignored;
  if (!fs::exists(path, ignored)) return std::optional<LeftRun>();
  const auto file = JournalFile::open(path);
  if (!file) return file.error();
  const auto events = file->read();
  if (!events) return events.error();
  auto history = read_history(*events, path);
  if (!history) return history.error();
  const auto scans = history->scans();
  if (history->finished() || scans.empty()) return std::optional<LeftRun>();
  LeftRun left;
  if (const auto whole = verify(folder, *scans.back()); !whole)
    left.last_scan_damage = whole.error().text();
  left.history = std::move(*history);
  return std::optional(std::move(left));
}

std::string offer_text(const LeftRun& run, const fs::path& folder) {
  const RunHistory& history = run.history;
  const ScanRecord& last = history.scans().back()->scan;
  std::string text =
      fmt::format("an unfinished run of {} lies in {}:\n",
                  history.begun ? history.begun->mission : "a mission", folder.string());
  text += fmt::format("  {} of {} stations are done", stations_dealt_with(history),
                      stations_planned(history));
  if (const std::size_t views = views_taken(history); views > 0)
    text += fmt::format(", and {} next best view{}", views, views == 1 ? "" : "s");
  text += fmt::format("; {} scans, {} of mission time\n", history.scans().size(),
                      duration_text(history.so_far.mission_s));
  text += fmt::format(
      "  last scan: {} ({}), {}\n", last.number, last.name,
      run.last_scan_damage.empty() ? "whole" : "to be taken again: " + run.last_scan_damage);
  text += fmt::format("  it ended because: {}\n", history.why_ended());
  text +=
      "go on with it with --resume (and --skip STATION), or remove it and begin anew with "
      "--restart\n";
  return text;
}

json::object offer_json(const LeftRun& run, const fs::path& folder) {
  const RunHistory& history = run.history;
  const ScanRecord& last = history.scans().back()->scan;
  return {{"folder", folder.string()},
          {"mission", history.begun ? history.begun->mission : ""},
          {"stations_done", stations_dealt_with(history)},
          {"stations", stations_planned(history)},
          {"next_best_views", views_taken(history)},
          {"scans", history.scans().size()},
          {"last_scan",
           {{"number", last.number},
            {"name", last.name},
            {"whole", run.last_scan_damage.empty()},
            {"damage", run.last_scan_damage}}},
          {"mission_s", history.so_far.mission_s},
          {"resumed", history.resumed},
          {"ended_because", history.why_ended()}};
}

FileResult<std::vector<RunInput>> run_inputs(const fs::path& mission_file,
                                             const MissionConfig& config) {
  std::vector<RunInput> inputs;
  const std::pair<const char*, fs::path> files[] = {{"mission file", mission_file},
                                                    {"robot file", config.robot_file},
                                                    {"plan file", config.plan_file}};
  for (const auto& [what, file] : files) {
    if (file.empty()) continue;
    auto input = input_of(what, file);
    if (!input) return input.error();
    inputs.push_back(std::move(*input));
  }
  std::vector<fs::path> site;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(config.site_folder, error)) {
    const std::string ending = entry.path().extension().string();
    if (ending == ".geojson" || ending == ".json" || ending == ".obj") site.push_back(entry.path());
  }
  if (error) return FileError{config.site_folder, "read", error};
  std::ranges::sort(site);
  for (const fs::path& file : site) {
    auto input = input_of("site file", file);
    if (!input) return input.error();
    inputs.push_back(std::move(*input));
  }
  inputs.push_back({"seed", config.seed});
  return inputs;
}

std::vector<std::string> changed_inputs(const RunBegun& begun, const std::vector<RunInput>& now) {
  std::vector<std::string> changed;
  const auto same_name = [](const std::vector<RunInput>& all, const std::string& what) {
    return std::ranges::find(all, what, &RunInput::what);
  };
  for (const RunInput& then : begun.inputs) {
    const auto found = same_name(now, then.what);
    if (found == now.end())
      changed.push_back(fmt::format("the run began with {}, which is not there now", then.what));
    else if (found->checksum != then.checksum)
      changed.push_back(fmt::format("the {} is not the one that the run began with", then.what));
  }
  for (const RunInput& input : now)
    if (same_name(begun.inputs, input.what) == begun.inputs.end())
      changed.push_back(fmt::format("the run began without {}", input.what));
  return changed;
}

std::vector<std::string> unknown_stations(const RunHistory& history,
                                          const std::vector<std::string>& names) {
  std::vector<std::string> unknown;
  for (const std::string& name : names) {
    const bool known =
        history.planned && std::ranges::any_of(history.planned->stations, [&](const auto& station) {
          return station.second == name;
        });
    if (!known) unknown.push_back(fmt::format("the run's plan has no station '{}'", name));
  }
  return unknown;
}

FileResult<std::optional<int>> verify_scans(RunHistory& history, const fs::path& folder) {
  const auto scans = history.scans();
  for (const ScanDone* done : scans) {
    const auto whole = verify(folder, *done);
    if (whole) continue;
    if (done != scans.back()) return whole.error();
    const int lost = done->scan.number;
    history.lose_last_scan();
    return std::optional(lost);
  }
  return std::optional<int>();
}

}  // namespace mission
