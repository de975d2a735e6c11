// One mission: the guarded executive and the shipped drivers in virtual time, and what a scenario
// does to them.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "tests/dst/rig/judge.hpp"
#include "tests/dst/rig/scenario.hpp"

namespace dst {

struct Outcome {
  std::optional<Violation> violation;
  bool completed{};
  std::string end;                            // The mission's own reason.
  std::vector<std::string> notes, decisions;  // Of these the last ones.
  std::size_t scans{};
  hal::Duration virtual_time{};
  double cpu_s{};  // Of one core.
  double driven_m{};
  double from_start_m{};  // Where the robot really stands at the end, from where it began.
  std::uint64_t decisions_hash{}, frames_hash{}, journal_hash{}, console_hash{};  // The trace.
  int resumed{};  // How often a person went on with the run: after a power cut, a failed disk.
  int stops{};
  hal::Duration slowest_stop{};
  // What the operator could read while it ran, where Options::observe: "imu: silent", "F001-...".
  std::set<std::string> named;
  bool held{};          // The robot was stopped, or stood for a missing device.
  bool password_set{};  // Somebody gave the console another password.

  // Equal for equal traces.
  bool same_trace(const Outcome& other) const {
    return decisions_hash == other.decisions_hash && frames_hash == other.frames_hash &&
           journal_hash == other.journal_hash && console_hash == other.console_hash &&
           virtual_time == other.virtual_time && end == other.end;
  }
};

struct Options {
  bool observe = false;
  hal::Duration observe_from{};
  hal::Duration ends_within = std::chrono::hours(3);  // Of virtual time.
  std::function<void()> each_minute = {};             // Of virtual time. May be empty.
};

// With its end, where power was cut or the disk failed: then a person goes on with the run, if it
// has a scan, or begins anew. What the program was told is safe must be there then, whole.
Outcome run_mission(const support::RandomYard& yard, const Scenario& scenario,
                    const Options& options = {});

// The yard and the scenario of the seed.
Outcome run_seed(std::uint64_t seed, const Options& options = {});

// For people: what was violated, and how to see it again.
std::string report(std::uint64_t seed, const Violation& violation);

}  // namespace dst
