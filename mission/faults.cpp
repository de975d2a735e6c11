#include "mission/faults.hpp"

#include <algorithm>

namespace mission {
namespace {

// Ids never change their meaning, and the number of one that is dropped is not used again.
constexpr FaultEntry kFaultTable[] = {
    {FaultCode::nothing_wrong, "F000-nothing-wrong", Action::note,
     "a state that the device tells, or that its trouble is over", "none", "nothing to do"},
    {FaultCode::estop_pressed, "F001-estop-pressed", Action::stop,
     "somebody pressed an e-stop, or its circuit is open", "the robot stands; the mission waits",
     "make sure that it is safe, release the e-stop, then release the robot"},
    {FaultCode::bumper_pressed, "F002-bumper-pressed", Action::stop, "something touches the bumper",
     "the robot stands; the mission waits", "free the bumper, then release the robot"},
    {FaultCode::estop_circuit, "F003-estop-circuit", Action::stop,
     "the e-stop cannot be read: contacts that contradict each other, a broken wire, or none "
     "configured",
     "counts as pressed: the robot stands",
     "check both contacts and their wires, press and release the e-stop, then release the robot"},
    {FaultCode::bumper_circuit, "F004-bumper-circuit", Action::stop,
     "the bumper cannot be read: contacts that contradict each other or a broken wire",
     "counts as pressed: the robot stands",
     "check both contacts and their wires, press and free the bumper, then release the robot"},
    {FaultCode::safety_controller, "F005-safety-controller", Action::stop,
     "the safety controller reports a fault or does not run", "what it guards counts as pressed",
     "read its diagnosis; start it; then release the robot"},
    {FaultCode::remote_control, "F006-remote-control", Action::stop,
     "the transmitter of the base is switched to manual driving",
     "the person drives; the mission waits",
     "switch the transmitter to command mode or off, then release the robot"},
    {FaultCode::release_refused, "F007-release-refused", Action::hold,
     "a release came while something still holds the robot, or the arming checks failed",
     "the robot stays where it is", "remove what it names, then release again"},
    {FaultCode::drive_no_timeout, "F010-drive-no-timeout", Action::stop,
     "the drive was not seen to stop by itself when no command came", "it is not armed",
     "set the drive's time-out (500 ms at most), or have it repaired; start again"},
    {FaultCode::drive_commanded_by_others, "F011-drive-commanded-by-others", Action::stop,
     "another program or device sends commands to the drive", "the robot stands; the mission waits",
     "end the other program, take the device off the bus, then release the robot"},
    {FaultCode::drive_silent, "F012-drive-silent", Action::stop,
     "no power, a loose cable, or the drive hangs", "the robot stands; the mission waits",
     "check the drive's supply and its CAN cable, then release the robot"},
    {FaultCode::drive_bus_down, "F013-drive-bus-down", Action::stop,
     "the CAN bus is off, nobody acknowledges, or the adapter is gone",
     "the drive stops by itself; the mission waits",
     "check bit rate, CAN-H and CAN-L, terminations and the adapter, then release the robot"},
    {FaultCode::drive_fault, "F014-drive-fault", Action::stop,
     "a motor, its driver or its sensor failed or is overloaded",
     "the drive stops; the mission waits",
     "clear the cause; switch the drive off and on; then release the robot"},
    {FaultCode::drive_supply, "F015-drive-supply", Action::stop,
     "the drive's supply is too low or too high", "the drive stops; the mission waits",
     "charge the battery; check the supply and its cable; then release the robot"},
    {FaultCode::drive_lost_us, "F016-drive-lost-us", Action::stop,
     "the drive did not hear from the program for too long",
     "the drive stops by itself; the mission waits",
     "check the CAN cable and the load of the computer, then release the robot"},
    {FaultCode::drive_other_device, "F017-drive-other-device", Action::hold,
     "another device or model, or another protocol, is where the drive should be",
     "it is not driven", "compare the bus, node ids and model with the robot file"},
    {FaultCode::drive_refuses_setting, "F018-drive-refuses-setting", Action::hold,
     "the drive refuses a setting, or reads back another", "it is not driven",
     "compare the setting with the drive's manual"},
    {FaultCode::drive_not_in_command, "F019-drive-not-in-command", Action::hold,
     "the drive does not give command to the program", "the robot stands; the mission waits",
     "switch the transmitter off; switch the drive off and on"},
    {FaultCode::drive_hot, "F020-drive-hot", Action::hold,
     "a long climb, overload, or a dragging brake", "the drive slows down or stops",
     "let it cool; lighten the load"},
    {FaultCode::drive_loaded, "F021-drive-loaded", Action::note, "a steep way or a heavy load",
     "none yet", "watch it; slow down where it comes often"},
    {FaultCode::drive_bus_disturbed, "F022-drive-bus-disturbed", Action::note,
     "a disturbed or overloaded bus, or a bridge on it", "reports are late or missing",
     "check cable and terminations, and what else sends on the bus"},
    {FaultCode::drive_undocumented, "F023-drive-undocumented", Action::note,
     "the maker does not say what this bit means", "none known",
     "note it with the firmware version and ask the maker"},
    {FaultCode::remote_control_lost, "F024-remote-control-lost", Action::note,
     "the transmitter is off, far away or empty", "nobody can take over by hand",
     "switch it on, or bring it closer"},
    {FaultCode::odometry_doubtful, "F025-odometry-doubtful", Action::note,
     "a wheel sensor, a wrong scale, or a drive that restarted",
     "the pose is corrected by the other sensors only", "drive a measured metre; check the sensor"},
    {FaultCode::way_blocked, "F026-way-blocked", Action::note,
     "the wheels stand though they are told to turn", "the robot backs off and takes another way",
     "free the robot if it does not get away by itself"},
    {FaultCode::drive_feedback_late, "F027-drive-feedback-late", Action::hold,
     "the drive did not report for more than 100 ms", "the robot stands until it reports again",
     "check the bus and the load of the computer"},
    {FaultCode::scanner_silent, "F100-scanner-silent", Action::rescan,
     "no power, a loose cable, or a wrong address", "no scan until it is back",
     "check supply, cable and address in the robot file"},
    {FaultCode::scanner_stuck, "F101-scanner-stuck", Action::rescan,
     "the scanner or its connection hangs", "no scan until it runs again", "switch it off and on"},
    {FaultCode::scanner_other_device, "F102-scanner-other-device", Action::rescan,
     "another device or model answers, or in another protocol", "no scan",
     "compare with the robot file"},
    {FaultCode::scanner_refuses_setting, "F103-scanner-refuses-setting", Action::rescan,
     "the scanner does not take a setting or a request", "no scan",
     "compare the settings with its manual"},
    {FaultCode::scanner_fault, "F104-scanner-fault", Action::rescan, "laser, motor or temperature",
     "no scan until it recovers", "let it cool; restart it; then service"},
    {FaultCode::scanner_line_disturbed, "F105-scanner-line-disturbed", Action::rescan,
     "bytes change or go missing on the way", "scans with lost beams are taken again",
     "check the cable and what else is on the network"},
    {FaultCode::scanner_slow, "F106-scanner-slow", Action::rescan,
     "scans are late, lost or out of order", "scans with lost beams are taken again",
     "check the network and the load of the computer"},
    {FaultCode::scanner_dirty, "F107-scanner-dirty", Action::note, "dirt on the window",
     "ranges are shorter or missing", "clean the window"},
    {FaultCode::scanner_unsynchronised, "F108-scanner-unsynchronised", Action::note,
     "no pulse per second comes", "times are the computer's",
     "none needed; connect PPS for better times"},
    {FaultCode::scanner_starting, "F109-scanner-starting", Action::note,
     "it has just been switched on or set", "scanning starts a little later", "wait"},
    {FaultCode::scan_disturbed, "F110-scan-disturbed", Action::rescan,
     "the robot moved while it scanned, or too many beams were lost",
     "the scan is taken again, at most twice",
     "keep people and traffic off the robot; check the ground"},
    {FaultCode::pan_silent, "F200-pan-silent", Action::rescan,
     "no power, a loose cable, or a wrong address", "no scan until it is back",
     "check supply, cable and address in the robot file"},
    {FaultCode::pan_stuck, "F201-pan-stuck", Action::rescan,
     "the pan axis does not get where it should", "no scan", "free the axis; check its limits"},
    {FaultCode::pan_other_device, "F202-pan-other-device", Action::rescan,
     "another device or model answers, or at another bit rate", "no scan",
     "compare with the robot file"},
    {FaultCode::pan_refuses_setting, "F203-pan-refuses-setting", Action::rescan,
     "the unit does not take a setting", "no scan", "compare the settings with its manual"},
    {FaultCode::pan_hot, "F204-pan-hot", Action::rescan, "motor or head above 60 deg C",
     "no scan until it has cooled", "let it rest; give it shade"},
    {FaultCode::pan_supply, "F205-pan-supply", Action::rescan, "its supply is below 11 V",
     "it may lose steps", "check the supply and its cable"},
    {FaultCode::pan_line_disturbed, "F206-pan-line-disturbed", Action::rescan,
     "answers are late or out of step", "scans are less exact or taken again",
     "connect it directly; check the cable"},
    {FaultCode::imu_silent, "F300-imu-silent", Action::note,
     "no power, a loose cable, or a wrong port",
     "turns are told by the wheels alone; on a robot the mission waits",
     "check supply, cable and port"},
    {FaultCode::imu_other_device, "F301-imu-other-device", Action::note,
     "another device or bit rate", "as without it", "compare with the robot file"},
    {FaultCode::imu_refuses_setting, "F302-imu-refuses-setting", Action::note,
     "the sensor does not take a setting", "as without it", "compare the settings with its manual"},
    {FaultCode::imu_fault, "F303-imu-fault", Action::note,
     "the sensor fails or its values stand still", "as without it",
     "switch it off and on; then service"},
    {FaultCode::imu_disturbed, "F304-imu-disturbed", Action::note,
     "shaking, magnetic fields or saturation", "turns are less certain",
     "keep it from iron, currents and vibration"},
    {FaultCode::imu_line_disturbed, "F305-imu-line-disturbed", Action::note,
     "bytes change, or messages are late or missing", "turns are less certain",
     "check cable, port and bit rate"},
    {FaultCode::gnss_silent, "F310-gnss-silent", Action::note,
     "no power, a loose cable, or a wrong port",
     "the pose is told by wheels and turns; on a robot the mission waits",
     "check supply, cable and port"},
    {FaultCode::gnss_other_device, "F311-gnss-other-device", Action::note,
     "another device, protocol or bit rate", "as without it", "compare with the robot file"},
    {FaultCode::gnss_refuses_setting, "F312-gnss-refuses-setting", Action::note,
     "the receiver does not take a setting", "as without it",
     "compare the settings with its manual"},
    {FaultCode::gnss_fault, "F313-gnss-fault", Action::note,
     "its values stand still or are impossible", "as without it",
     "switch it off and on; then service"},
    {FaultCode::gnss_no_fix, "F314-gnss-no-fix", Action::note,
     "too few satellites, or they are not trusted", "the pose is told by wheels and turns",
     "give the antenna a clear sky; wait a minute"},
    {FaultCode::gnss_false_position, "F315-gnss-false-position", Action::note,
     "false signals, or a wrong origin of the site", "fixes are refused",
     "compare the site's origin; do not trust satellites here"},
    {FaultCode::gnss_reception, "F316-gnss-reception", Action::note,
     "a jammer, interference, or the antenna and its cable", "fewer fixes",
     "check antenna and cable; move away from transmitters"},
    {FaultCode::gnss_no_corrections, "F317-gnss-no-corrections", Action::note,
     "their source, or the way from it, is gone or damaged", "fixes are less exact",
     "check the source of corrections"},
    {FaultCode::gnss_line_disturbed, "F318-gnss-line-disturbed", Action::note,
     "bytes change, or messages are late or missing", "fewer fixes",
     "check cable, port and bit rate"},
    {FaultCode::pose_uncertain, "F320-pose-uncertain", Action::hold,
     "the robot no longer knows well enough where it is", "the robot stands until it does",
     "look at its IMU and satellites; carry it to a known place"},
    {FaultCode::range_stale, "F321-range-stale", Action::hold,
     "the range source did not report for more than 250 ms",
     "the robot stands until it reports again", "check its supply and cable"},
    {FaultCode::power_silent, "F400-power-silent", Action::stop,
     "the Modbus unit is off, its cable is loose, or its address is wrong",
     "what it reads counts as pressed", "check supply, cable and address, then release the robot"},
    {FaultCode::power_other_device, "F401-power-other-device", Action::hold,
     "another device or firmware has this address", "what it reads counts as pressed",
     "compare addresses and settings with the robot file"},
    {FaultCode::power_line_disturbed, "F402-power-line-disturbed", Action::note,
     "wrong baud rate, a bad line, or a slow gateway",
     "inputs are late; when they are too late they count as pressed",
     "check baud rate, termination and other clients"},
    {FaultCode::reset_stuck, "F403-reset-stuck", Action::hold,
     "the reset button has been pressed for more than 3 s", "it releases nothing",
     "let it go; check the button and its wire"},
    {FaultCode::relay_stuck, "F404-relay-stuck", Action::note,
     "the relay board restarted, or something else switches it",
     "a relay does not stand as it was set", "check who else writes to the board"},
    {FaultCode::battery_low, "F410-battery-low", Action::home, "the battery is nearly empty",
     "drive home and charge", "charge it before the next mission"},
    {FaultCode::battery_fault, "F411-battery-fault", Action::home,
     "the battery is outside what it may do", "drive home before it switches off",
     "read the battery monitor; let it cool or warm up; service"},
    {FaultCode::battery_doubtful, "F412-battery-doubtful", Action::note,
     "the battery monitor contradicts itself", "its charge is not certain",
     "check the shunt and the monitor's settings"},
    {FaultCode::link_absent, "F500-link-absent", Action::hold,
     "unplugged, not powered, or the address is wrong", "its device is lost",
     "plug it in; compare the address in the robot file"},
    {FaultCode::link_forbidden, "F501-link-forbidden", Action::hold, "the user may not open it",
     "its device is lost", "add the user to the group that it names"},
    {FaultCode::link_busy, "F502-link-busy", Action::hold, "another program holds it",
     "its device is lost", "end the other program"},
    {FaultCode::link_unreachable, "F503-link-unreachable", Action::hold,
     "nobody answers at that address", "its device is lost", "check network, cable and address"},
    {FaultCode::link_settings, "F504-link-settings", Action::hold,
     "the port or the kernel cannot do what is asked", "its device is lost",
     "choose what it can; load the driver"},
    {FaultCode::link_bus_down, "F505-link-bus-down", Action::hold,
     "the CAN interface is down or bus off", "its device is lost",
     "bring the interface up; check the bus"},
    {FaultCode::link_not_acknowledged, "F506-link-not-acknowledged", Action::hold,
     "no other device is on the bus", "its device is lost",
     "switch the device on; check cable, terminations and bit rate"},
    {FaultCode::link_other_device, "F507-link-other-device", Action::hold,
     "not the device that the address promises", "its device is lost",
     "compare the address with the robot file"},
    {FaultCode::link_disturbed, "F508-link-disturbed", Action::note, "errors on the line",
     "some of what it carries is late or lost", "check cable, terminations and bit rate"},
    {FaultCode::link_failed, "F509-link-failed", Action::hold, "the system says why",
     "its device is lost", "see the detail"},
    {FaultCode::planner_late, "F600-planner-late", Action::hold,
     "no command of the mission for more than 500 ms", "the robot stands until commands come again",
     "none, unless it comes often: lower the resolution of the plan"},
    {FaultCode::no_route, "F601-no-route", Action::note, "no way leads to the next station",
     "the station is dropped, with its reason", "compare the map with the site; open the way"},
    {FaultCode::no_view, "F602-no-view", Action::note, "no place is left that would see enough",
     "the survey of this area ends", "none; see the report for what stays unseen"},
    {FaultCode::planner_failed, "F603-planner-failed", Action::hold,
     "the planner found no plan within its bounds, or failed",
     "the robot stands and the mission ends, with its reason", "see the reason; simplify the map"},
    {FaultCode::disk_full, "F700-disk-full", Action::hold,
     "too little space for the next scan, or for what is to be kept of this one",
     "nothing counts before it is saved; the robot stands until there is space, for "
     "`[disk] patience_s` at most",
     "free space; if the mission has ended meanwhile, go on with it by `resume`"},
    {FaultCode::disk_failed, "F701-disk-failed", Action::hold, "the disk does not read or write",
     "nothing counts before it is saved; the robot stands until the disk works, for "
     "`[disk] patience_s` at most",
     "check the disk; if the mission has ended meanwhile, go on with it by `resume`"},
    {FaultCode::disk_read_only, "F702-disk-read-only", Action::hold, "the folder cannot be written",
     "no mission is started; one that runs stands until it can be, for `[disk] patience_s` at most",
     "make it writable, or choose another folder"},
    {FaultCode::journal_damaged, "F703-journal-damaged", Action::hold,
     "the journal does not hold together", "no resume is offered",
     "start the mission anew; keep the journal for the maker"},
    {FaultCode::disk_given_up, "F704-disk-given-up", Action::home,
     "the disk failed for longer than `[disk] patience_s`, and `then = \"home\"`",
     "the robot drives home without its disk, also when that works again; the mission ends there",
     "check the disk, free space; go on with the mission by `resume`"},
    {FaultCode::program_fault, "F800-program-fault", Action::stop,
     "a mistake in this program: a promise of its code was broken",
     "the motors stop; it comes up again and waits", "report what it said; then release the robot"},
    {FaultCode::watchdog_restart, "F801-watchdog-restart", Action::stop,
     "a part of the program hung and was ended", "it comes up again and waits",
     "see the log; then release the robot"},
    {FaultCode::power_cut, "F802-power-cut", Action::stop,
     "power failed, or the program was killed", "it comes up and waits",
     "look at the robot; then release it"},
    {FaultCode::clock_jumped, "F803-clock-jumped", Action::note, "the computer's clock was set",
     "only labels change: all deadlines run on another clock", "none"},
    {FaultCode::unknown_fault, "F899-unknown-fault", Action::hold,
     "a device named a trouble that this table does not know", "the robot stands until it is over",
     "see what the device says; report it"},
};

constexpr std::size_t kNumberAt = 1, kNumberLength = 3, kNameAt = 5;  // In "F012-drive-silent".

char lower_case(char letter) {
  return letter >= 'A' && letter <= 'Z' ? static_cast<char>(letter - 'A' + 'a') : letter;
}

bool same_letters(std::string_view typed, std::string_view known) {
  return std::ranges::equal(typed, known, {}, lower_case, lower_case);
}

// "012" for "F012" and "12".
std::string three_digits(std::string_view typed) {
  if (typed.starts_with('F') || typed.starts_with('f')) typed.remove_prefix(1);
  const std::string digits(typed);
  const auto is_digit = [](char letter) { return letter >= '0' && letter <= '9'; };
  if (digits.empty() || digits.size() > kNumberLength || !std::ranges::all_of(digits, is_digit))
    return {};
  return std::string(kNumberLength - digits.size(), '0') + digits;
}

}  // namespace

std::string_view name(Action action) {
  static constexpr std::string_view kNames[]{"note", "rescan", "home", "hold", "stop"};
  return kNames[static_cast<std::size_t>(action)];
}

std::span<const FaultEntry> all_faults() {
  return kFaultTable;
}

const FaultEntry& entry_of(FaultCode code) {
  return kFaultTable[static_cast<std::size_t>(code)];
}

const FaultEntry* find_fault(std::string_view id) {
  const std::string number = three_digits(id);
  const auto is_it = [&](const FaultEntry& entry) {
    return same_letters(id, entry.id) || same_letters(id, entry.id.substr(kNameAt)) ||
           number == entry.id.substr(kNumberAt, kNumberLength);
  };
  const auto* const found = std::ranges::find_if(kFaultTable, is_it);
  return found == std::end(kFaultTable) ? nullptr : found;
}

bool outweighs(FaultCode one, FaultCode other) {
  const Action a = entry_of(one).action, b = entry_of(other).action;
  return a == b ? one < other : a > b;
}

std::optional<FaultCode> gravest(std::span<const FaultCode> faults) {
  if (faults.empty()) return std::nullopt;
  return *std::ranges::min_element(faults, outweighs);
}

}  // namespace mission
