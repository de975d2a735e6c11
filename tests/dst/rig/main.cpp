// vantage-dst: missions of the shipped executive and drivers on simulated devices that fail, on a
// computer whose clock is set, whose disk fails and whose power is cut, and with somebody at its
// console, one for each seed, in virtual time. Ends with 1 at the first seed that violates what
// must always hold, and says how to see it again.
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <string>
#include <thread>

#include "mission/main_command_line.hpp"
#include "mission/main_realtime.hpp"
#include "tests/dst/rig/matrix.hpp"
#include "tests/dst/rig/missions.hpp"
#include "tests/dst/rig/soak.hpp"

namespace {

struct Asked {
  std::uint64_t seed = 1;
  std::optional<std::uint64_t> replay;
  int missions = 200;
  int jobs = std::clamp(static_cast<int>(std::thread::hardware_concurrency()), 1, 256);
  bool matrix = false, verbose = false;
  std::string cell;
  double soak_hours = 0;
};

void tell(const dst::Outcome& outcome) {
  for (const std::string& note : outcome.notes) fmt::print("  said: {}\n", note);
  for (const std::string& named : outcome.named) fmt::print("  named: {}\n", named);
  for (const std::string& line : outcome.decisions) fmt::print("  decided: {}\n", line);
  fmt::print("  {} scans, {:.1f} m, {:.1f} s of virtual time in {:.2f} s of a core; end: {}\n",
             outcome.scans, outcome.driven_m, hal::seconds(outcome.virtual_time), outcome.cpu_s,
             outcome.end);
  fmt::print(
      "  trace: decisions {:016x}, frames {:016x}, journal {:016x}, console {:016x}; gone on with "
      "{} "
      "times\n",
      outcome.decisions_hash, outcome.frames_hash, outcome.journal_hash, outcome.console_hash,
      outcome.resumed);
}

int replay(std::uint64_t seed) {
  std::fputs(dst::text(dst::draw_scenario(seed)).c_str(), stdout);
  dst::Options options;
  options.observe = true;
  const dst::Outcome outcome = dst::run_seed(seed, options);
  tell(outcome);
  if (!outcome.violation) return 0;
  std::fputs(dst::report(seed, *outcome.violation).c_str(), stdout);
  return 1;
}

int run(const Asked& asked) {
  const dst::Sums sums = dst::run_seeds(
      asked.seed, asked.missions, asked.jobs, [&](std::uint64_t seed, const dst::Outcome& outcome) {
        if (asked.verbose)
          fmt::print(
              "seed {}: {:.0f} s in {:.2f} s, {} scans, decisions {:016x}, frames {:016x}, journal "
              "{:016x}: {}\n",
              seed, hal::seconds(outcome.virtual_time), outcome.cpu_s, outcome.scans,
              outcome.decisions_hash, outcome.frames_hash, outcome.journal_hash, outcome.end);
        if (outcome.violation) std::fputs(dst::report(seed, *outcome.violation).c_str(), stdout);
        std::fflush(stdout);
      });
  std::fputs(sums.text().c_str(), stdout);
  return sums.violated > 0 ? 1 : 0;
}

int matrix(const std::string& only, bool verbose) {
  int odd = 0;
  for (const dst::Cell& cell : dst::matrix()) {
    if (!only.empty() && only != std::string(cell.role) + ":" + std::string(cell.fault)) continue;
    const dst::Outcome outcome = dst::run_cell(cell);
    const std::string objection = dst::objection(cell, outcome);
    std::fputs(dst::row(cell, outcome).c_str(), stdout);
    if (!objection.empty()) fmt::print("  not as expected: {}\n", objection);
    if (!objection.empty() || verbose) tell(outcome);
    odd += !objection.empty();
  }
  fmt::print("{} cells, {} not as expected\n", dst::matrix().size(), odd);
  return odd > 0 ? 1 : 0;
}

int soak(std::uint64_t seed, double hours) {
  const dst::SoakResult result = dst::soak(seed, hal::from_seconds(hours * 3600));
  std::fputs(result.text().c_str(), stdout);
  if (!result.outcome.violation) return result.flat() ? 0 : 1;
  std::fputs(dst::report(seed, *result.outcome.violation).c_str(), stdout);
  return 1;
}

}  // namespace

int main(int argc, char** argv) {
  mission::keep_memory();
  mission::CommandLine line(
      "Missions on devices that fail, and on a computer whose clock is set, whose disk fails and "
      "whose power is cut, in virtual time. A run that is cut is gone on with from what its disk "
      "still has.");
  Asked asked;
  line.add("--seed", &asked.seed, "of the first mission", {.shows_default = true});
  line.add("--missions", &asked.missions, "how many, with seeds one after the other",
           {.within = {{1, 100'000'000}}, .shows_default = true});
  line.add("--jobs", &asked.jobs, "at once; as many as there are processors",
           {.within = {{1, 256}}, .shows_default = true});
  line.add("--verbose", &asked.verbose, "a line for each mission; of a cell of the matrix all");
  line.add("--matrix", &asked.matrix, "every fault of every device once, with its reaction");
  line.add("--cell", &asked.cell, "of the matrix only this one: \"imu:slow\"");
  line.add("--soak-hours", &asked.soak_hours,
           "one mission of so many virtual hours in which devices come and go");
  line.add("--replay", &asked.replay, "run this one seed, and tell all");
  if (!line.parse(argc, argv)) return line.exit_code();
  if (asked.replay) return replay(*asked.replay);
  if (asked.matrix) return matrix(asked.cell, asked.verbose);
  return asked.soak_hours > 0 ? soak(asked.seed, asked.soak_hours) : run(asked);
}
