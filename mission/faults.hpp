// What can go wrong, in one table: every fault has an id that never changes, what is done about it,
// its cause, its effect and its remedy. The manual's page docs/faults.md is made from it. Pure.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace mission {

// What a fault makes the robot do; a later one outweighs all before it.
enum class Action : std::uint8_t {
  note,    // Says it and goes on.
  rescan,  // Takes the scan again, a bounded number of times.
  home,    // Ends the mission and drives home.
  hold,    // Stands until it is over.
  stop,    // Stands until it is over and a person has released the robot.
};
std::string_view name(Action action);

// In the order of the table.
enum class FaultCode : std::uint8_t {
  nothing_wrong,
  estop_pressed,
  bumper_pressed,
  estop_circuit,
  bumper_circuit,
  safety_controller,
  remote_control,
  release_refused,
  drive_no_timeout,
  drive_commanded_by_others,
  drive_silent,
  drive_bus_down,
  drive_fault,
  drive_supply,
  drive_lost_us,
  drive_other_device,
  drive_refuses_setting,
  drive_not_in_command,
  drive_hot,
  drive_loaded,
  drive_bus_disturbed,
  drive_undocumented,
  remote_control_lost,
  odometry_doubtful,
  way_blocked,
  drive_feedback_late,
  scanner_silent,
  scanner_stuck,
  scanner_other_device,
  scanner_refuses_setting,
  scanner_fault,
  scanner_line_disturbed,
  scanner_slow,
  scanner_dirty,
  scanner_unsynchronised,
  scanner_starting,
  scan_disturbed,
  pan_silent,
  pan_stuck,
  pan_other_device,
  pan_refuses_setting,
  pan_hot,
  pan_supply,
  pan_line_disturbed,
  imu_silent,
  imu_other_device,
  imu_refuses_setting,
  imu_fault,
  imu_disturbed,
  imu_line_disturbed,
  gnss_silent,
  gnss_other_device,
  gnss_refuses_setting,
  gnss_fault,
  gnss_no_fix,
  gnss_false_position,
  gnss_reception,
  gnss_no_corrections,
  gnss_line_disturbed,
  pose_uncertain,
  range_stale,
  power_silent,
  power_other_device,
  power_line_disturbed,
  reset_stuck,
  relay_stuck,
  battery_low,
  battery_fault,
  battery_doubtful,
  link_absent,
  link_forbidden,
  link_busy,
  link_unreachable,
  link_settings,
  link_bus_down,
  link_not_acknowledged,
  link_other_device,
  link_disturbed,
  link_failed,
  planner_late,
  no_route,
  no_view,
  planner_failed,
  disk_full,
  disk_failed,
  disk_read_only,
  journal_damaged,
  disk_given_up,
  program_fault,
  watchdog_restart,
  power_cut,
  clock_jumped,
  unknown_fault
};

struct FaultEntry {
  FaultCode code{};
  std::string_view id;  // "F012-drive-silent"
  Action action{};
  std::string_view cause, effect, remedy;
};

std::span<const FaultEntry> all_faults();
const FaultEntry& entry_of(FaultCode code);

// By the whole id, its number ("F012", "f12", "12") or its name ("drive-silent"), in any case; null
// when there is none.
const FaultEntry* find_fault(std::string_view id);

// The fault for what a driver or a link says of itself: `role` is the device's ("drive", "scanner",
// "pan", "imu", "gnss", "power") or "link", `name` is drivers::Fault's. FaultCode::unknown_fault
// when nobody foresaw it. Does not allocate.
FaultCode fault_of(std::string_view role, std::string_view name);

// A total order: by action, then the one that stands first in the table.
bool outweighs(FaultCode one, FaultCode other);
// The gravest of them; nothing of none.
std::optional<FaultCode> gravest(std::span<const FaultCode> faults);

// A page about all faults, in Markdown.
std::string faults_page();

}  // namespace mission
