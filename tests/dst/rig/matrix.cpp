#include "tests/dst/rig/matrix.hpp"

#include <fmt/format.h>

namespace dst {
namespace {

using namespace std::chrono_literals;

constexpr hal::Duration kFrom = 12s, kDuring = 25s;

}  // namespace

// Frozen readings of battery and inputs look like a robot at which nothing happens; the e-stop
// itself is hard-wired. Slow replies of the power units are still in time.
const std::vector<Cell>& matrix() {
  static const std::vector<Cell> kCells{
      {"drive", "off", "F012-drive-silent", true},
      {"drive", "stuck", "drive: base's state is frozen", true},
      {"drive", "garbage", "drive: another program commands the base", true},
      {"drive", "wrong", "drive: odometry and speed disagree", false},
      {"drive", "slow", "drive: reports are missing", false},
      {"drive", "delayed", "drive: base answers late", true},
      {"drive", "intermittent", "F012-drive-silent", true},
      {"drive", "duplicated_reordered", "drive: reports doubled or out of order", false},
      {"scanner", "off", "scanner: no answer", true},
      {"scanner", "stuck", "scanner: same scan again and again", true},
      {"scanner", "garbage", "scanner: damaged telegrams", true},
      {"scanner", "wrong", "scanner: settings differ", true},
      {"scanner", "slow", "scanner: scans too slow", false},
      {"scanner", "delayed", "scanner: scans out of order", false},
      {"scanner", "intermittent", "scanner: no answer", true},
      {"scanner", "duplicated_reordered", "scanner: scans out of order", false},
      {"pan", "off", "pan: no answer", true},
      {"pan", "stuck", "pan: does not get there", false},
      {"pan", "garbage", "pan: no pan-tilt unit's answers", true},
      {"pan", "wrong", "pan: does not get there", false},
      {"pan", "slow", "pan: does not get there", false},
      {"pan", "delayed", "pan: answers late", false},
      {"pan", "intermittent", "pan: no answer", true},
      {"pan", "duplicated_reordered", "pan: no answer", true},
      {"imu", "off", "imu: silent", true},
      {"imu", "stuck", "imu: frozen", true},
      {"imu", "garbage", "imu: damaged bytes", true},
      {"imu", "wrong", "imu: values impossible", false},
      {"imu", "slow", "imu: slower than set", false},
      {"imu", "delayed", "imu: messages late", false},
      {"imu", "intermittent", "imu: silent", true},
      {"imu", "duplicated_reordered", "imu: messages repeated or out of order", false},
      {"gnss", "off", "gnss: silent", true},
      {"gnss", "stuck", "gnss: frozen", true},
      {"gnss", "garbage", "gnss: damaged bytes", true},
      {"gnss", "wrong", "gnss: fix far from the site", false},
      {"gnss", "slow", "gnss: slower than set", false},
      {"gnss", "delayed", "gnss: messages late", false},
      {"gnss", "intermittent", "gnss: silent", true},
      {"gnss", "duplicated_reordered", "gnss: messages repeated or out of order", false},
      {"obstacles", "off", "obstacles: no answer", true},
      {"obstacles", "stuck", "obstacles: same scan again and again", true},
      {"obstacles", "garbage", "obstacles: damaged scans", true},
      {"obstacles", "wrong", "obstacles: scans too slow", true},
      {"obstacles", "slow", "obstacles: scans out of order", true},
      {"obstacles", "delayed", "obstacles: scans come late", false},
      {"obstacles", "intermittent", "obstacles: no answer", true},
      {"obstacles", "duplicated_reordered", "obstacles: scans out of order", false},
      {"battery", "off", "power: no answer", true},
      {"battery", "stuck", "", false},
      {"battery", "garbage", "power: damaged replies", true},
      {"battery", "wrong", "power: battery values disagree", false},
      {"battery", "slow", "", false},
      {"battery", "delayed", "power: no answer", true},
      {"battery", "intermittent", "power: no answer", false},
      {"battery", "duplicated_reordered", "power: damaged replies", true},
      {"board", "off", "F001-estop-pressed", true},
      {"board", "stuck", "", false},
      {"board", "garbage", "F001-estop-pressed", true},
      {"board", "wrong", "power: e-stop contacts contradict each other", true},
      {"board", "slow", "", false},
      {"board", "delayed", "F001-estop-pressed", true},
      {"board", "intermittent", "F001-estop-pressed", true},
      {"board", "duplicated_reordered", "F001-estop-pressed", true},
      {"safety", "off", "F001-estop-pressed", true},
      {"safety", "stuck", "", false},
      {"safety", "garbage", "F001-estop-pressed", true},
      {"safety", "wrong", "power: safety controller fault", false},
      {"safety", "slow", "", false},
      {"safety", "delayed", "F001-estop-pressed", true},
      {"safety", "intermittent", "F001-estop-pressed", true},
      {"safety", "duplicated_reordered", "F001-estop-pressed", true},
  };
  return kCells;
}

Outcome run_cell(const Cell& cell) {
  Scenario scenario;
  scenario.releases_after = 5s;
  scenario.faults.push_back(
      {std::string(cell.role), sim::parse_unit_fault(cell.fault).setting, kFrom, kDuring});
  Options options;
  options.observe = true;
  options.observe_from = kFrom;
  return run_mission(make_quiet_yard(), scenario, options);
}

std::string objection(const Cell& cell, const Outcome& outcome) {
  if (outcome.violation) return report(0, *outcome.violation);
  if (outcome.held != cell.held) return cell.held ? "the robot was not held" : "the robot was held";
  if (!outcome.completed) return "not completed: " + outcome.end;
  if (cell.named.empty())
    return outcome.named.empty() ? "" : "something was named: " + *outcome.named.begin();
  return outcome.named.contains(std::string(cell.named)) ? "" : "not named";
}

std::string row(const Cell& cell, const Outcome& outcome) {
  std::string names;
  for (const std::string& name : outcome.named) names += (names.empty() ? "" : "; ") + name;
  return fmt::format("{:10}{:21}{:8}{:10}{} scans in {:4.0f} s  {}\n", cell.role, cell.fault,
                     outcome.held ? "held" : "goes on", outcome.completed ? "completed" : "ended",
                     outcome.scans, hal::seconds(outcome.virtual_time),
                     names.empty() ? "-" : names);
}

}  // namespace dst
