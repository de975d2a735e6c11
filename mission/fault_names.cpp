// Which fault it is, by what drivers and links call their troubles.
#include <algorithm>

#include "mission/faults.hpp"

namespace mission {
namespace {

struct FaultNames {
  std::string_view role;
  FaultCode code{};
  std::string_view names;  // With '|' between them.
};

constexpr FaultNames kFaultNames[] = {
    {"drive", FaultCode::nothing_wrong, "no error"},
    {"drive", FaultCode::estop_pressed, "e-stop pressed|vendor bit 15"},
    {"drive", FaultCode::remote_control, "remote control has command"},
    {"drive", FaultCode::drive_commanded_by_others,
     "another device or master on the bus|another program commands the base"},
    {"drive", FaultCode::drive_silent,
     "no reports from the base|base's state is frozen|drive silent|"
     "drive stopped reporting"},
    {"drive", FaultCode::drive_bus_down,
     "nobody acknowledges on the bus|CAN bus down|recovered from bus off"},
    {"drive", FaultCode::drive_fault,
     "base reports an exception|no contact to motor 1|no contact to motor 2|"
     "no contact to motor 3|no contact to motor 4|motor current too high|"
     "motor driver lost CAN|motor current too high: the base stops|hardware fault|"
     "current too high|short circuit|internal software error|motor blocked|"
     "incremental sensor 1 fault|incremental sensor 2 fault|following error|"
     "generic error|current error|hardware error|software error|module error|"
     "monitoring error|external error|device-specific error|unknown error|generic|"
     "current|device profile|manufacturer|drive does not enable its power stage|"
     "drive's fault persists"},
    {"drive", FaultCode::drive_supply,
     "battery too low: the base stops|motor driver supply low|"
     "battery voltage too high|supply voltage too high|supply voltage too low|"
     "DC link voltage too high|DC link voltage too low|voltage error|voltage"},
    {"drive", FaultCode::drive_lost_us, "heartbeat lost"},
    {"drive", FaultCode::drive_other_device,
     "base speaks protocol version 1|another device on the bus|not a CiA 402 drive|"
     "another drive than expected|drive does not have this velocity mode|"
     "EDS does not fit"},
    {"drive", FaultCode::drive_refuses_setting,
     "toggle bit not alternated|SDO timed out|unknown SDO command|out of memory|"
     "access not supported|object can only be written|object can only be read|"
     "no such object|object cannot be mapped|PDO too long|"
     "parameters do not fit together|node-internal incompatibility|wrong length|"
     "value too long|value too short|no such sub-index|value out of range|"
     "value too high|value too low|general error|cannot be stored|"
     "refused: local control|refused because of the device state|no object dictionary|"
     "parameter error|PDO too short|unknown abort code|drive refuses a setting|"
     "drive does not keep a setting|drive's fixed PDO mapping does not do"},
    {"drive", FaultCode::drive_not_in_command,
     "base does not give command|drive does not start|drive does not answer questions"},
    {"drive", FaultCode::drive_hot,
     "motor too hot|motor driver too hot|motor driver too hot: the base stops|"
     "motor driver hot|device too hot|drive too hot|temperature error|temperature"},
    {"drive", FaultCode::drive_loaded, "motor current high|drive warns"},
    {"drive", FaultCode::drive_bus_disturbed,
     "reports are missing|reports doubled or out of order|unreadable reports|"
     "base answers late|command with a wrong checksum|CAN overrun|CAN error passive|"
     "communication|unreadable messages|drive answers late"},
    {"drive", FaultCode::drive_undocumented,
     "reserved fault bit 7|vendor bit 8|vendor bit 9|vendor bit 10|vendor bit 11|"
     "vendor bit 12|vendor bit 13|vendor bit 14|reserved motor bit 5|"
     "reserved motor bit 6|reserved motor bit 7|reserved bit 13|reserved bit 14|"
     "reserved bit 15|reserved"},
    {"drive", FaultCode::remote_control_lost, "remote control lost"},
    {"drive", FaultCode::odometry_doubtful,
     "odometry jumped|odometry and speed disagree|position jumped|"
     "position and speed disagree"},
    {"drive", FaultCode::way_blocked, "way blocked"},
    {"drive", FaultCode::battery_low, "battery low"},
    {"scanner", FaultCode::nothing_wrong,
     "resumed|out of range|low confidence|not measured|strong reflection|rotating|"
     "ready|measuring|sAN|PPS locked"},
    {"scanner", FaultCode::scanner_silent,
     "no answer message|no answer|no connection|no packets|cannot receive"},
    {"scanner", FaultCode::scanner_stuck, "scans stopped|same scan again and again"},
    {"scanner", FaultCode::scanner_other_device,
     "unknown method|unknown variable|unknown error|unknown type|"
     "unknown command for the name server|unknown command|unknown event|"
     "hub address corrupted|hub address decoding|hub address too long|"
     "hub address expected|not SCIP|wrong model|undefined command|not supported|"
     "unknown status|not CoLa|other packets|not an Ouster|firmware too old|"
     "another sensor than the metadata's"},
    {"scanner", FaultCode::scanner_refuses_setting,
     "access denied|local condition failed|invalid data|buffer overflow|"
     "buffer underflow|write access denied|method busy|flexible array out of bounds|"
     "value overflow in CoLa A|invalid character in CoLa A|no message|"
     "asynchronous methods suppressed|complex arrays unsupported|request refused|"
     "impossible sector|parameter error|buffer too small|other|impossible settings|"
     "setting refused|settings differ|not allowed|frequency|resolution|"
     "frequency and resolution|scan area|packet format not supported|"
     "sends to another port|sends to another computer|sensor in standby"},
    {"scanner", FaultCode::scanner_fault,
     "internal error|thermal shutdown|shot limiting imminent|shot limiting|alert|"
     "laser off|laser malfunction|processing stopped|hardware fault|device error|error|"
     "sensor complains"},
    {"scanner", FaultCode::scanner_line_disturbed,
     "damaged scans|cut request|too few characters|damaged telegrams|"
     "settings not answered"},
    {"scanner", FaultCode::scanner_slow,
     "scans too slow|scans get lost|scans come late|scans out of order"},
    {"scanner", FaultCode::scanner_dirty, "pollution warning|pollution error"},
    {"scanner", FaultCode::scanner_unsynchronised, "no PPS|PPS synchronising|PPS error"},
    {"scanner", FaultCode::scanner_starting,
     "just started|undefined|initialising|configuration|idle|in preparation|busy|"
     "standby"},
    {"pan", FaultCode::pan_silent, "no connection|no answer"},
    {"pan", FaultCode::pan_stuck, "does not get there|limit hit"},
    {"pan", FaultCode::pan_other_device,
     "no pan-tilt unit's answers|not understood|wrong model|illegal command"},
    {"pan", FaultCode::pan_refuses_setting,
     "setting refused|settings differ|refused|beyond a limit"},
    {"pan", FaultCode::pan_hot, "too hot"},
    {"pan", FaultCode::pan_supply, "supply too low"},
    {"pan", FaultCode::pan_line_disturbed, "answers late|answers out of step"},
    {"imu", FaultCode::imu_silent, "link lost|silent"},
    {"imu", FaultCode::imu_other_device, "not understood|another device"},
    {"imu", FaultCode::imu_refuses_setting,
     "setting refused|setting not kept|invalid checksum|invalid command|"
     "not enough parameters|too many parameters|invalid parameter|invalid register|"
     "unauthorised access"},
    {"imu", FaultCode::imu_fault, "frozen|values impossible|hard fault|watchdog reset"},
    {"imu", FaultCode::imu_disturbed,
     "attitude bad|attitude lost|gyroscope saturated|gyroscope recovering|"
     "magnetometer saturated|accelerometer saturated|known magnetic disturbance|"
     "known acceleration disturbance|magnetic disturbance|acceleration disturbance"},
    {"imu", FaultCode::imu_line_disturbed,
     "damaged bytes|messages repeated or out of order|messages late|slower than set|"
     "serial buffer overflow|output buffer overflow|insufficient baud rate|"
     "error buffer overflow"},
    {"gnss", FaultCode::gnss_silent, "no position sentences|link lost|silent"},
    {"gnss", FaultCode::gnss_other_device,
     "gpsd of another protocol|gpsd has no receiver|gpsd refuses|not understood|"
     "another device|protocol too old"},
    {"gnss", FaultCode::gnss_refuses_setting, "setting refused|setting not kept"},
    {"gnss", FaultCode::gnss_fault, "frozen|values impossible"},
    {"gnss", FaultCode::gnss_no_fix,
     "no fix|accuracy unknown|fix beyond its limits|position invalid|time not resolved"},
    {"gnss", FaultCode::gnss_false_position,
     "fix far from the site|spoofing indicated|spoofing on several signals"},
    {"gnss", FaultCode::gnss_reception, "interference|jammed|antenna short|antenna open"},
    {"gnss", FaultCode::gnss_no_corrections,
     "no corrections|damaged correction|correction not used|no corrections yet|"
     "caster not reached|caster lost|caster does not answer|not a caster|"
     "caster refuses user or password|no such mountpoint|caster refuses|"
     "caster's answer damaged|caster sends nothing|no RTCM 3 in what the caster sends|"
     "no position for the caster|corrections damaged|"
     "corrections repeated or out of order|corrections frozen|corrections slow|"
     "corrections old|base far away"},
    {"gnss", FaultCode::gnss_line_disturbed,
     "damaged bytes|messages repeated or out of order|messages late|slower than set"},
    {"power", FaultCode::estop_circuit, "e-stop contacts contradict each other|no e-stop input"},
    {"power", FaultCode::bumper_circuit, "bumper contacts contradict each other"},
    {"power", FaultCode::safety_controller,
     "safety output fault|safety input fault|safety controller fault|safety diagnosis|"
     "safety controller does not run"},
    {"power", FaultCode::power_silent, "no answer|not connected"},
    {"power", FaultCode::power_other_device,
     "gateway does not know this unit|refuses a request|not a board with eight inputs|"
     "channel does not stay in normal mode"},
    {"power", FaultCode::power_line_disturbed, "damaged replies|answers late"},
    {"power", FaultCode::reset_stuck, "reset button stuck"},
    {"power", FaultCode::relay_stuck, "relay does not follow"},
    {"power", FaultCode::battery_low, "battery voltage low|battery charge low|cell voltage low"},
    {"power", FaultCode::battery_fault,
     "battery alarm|battery voltage high|battery too cold|battery too hot|"
     "battery fuse blown|charge current high|discharge current high|"
     "cells out of balance|battery internal failure|too hot to charge|"
     "too cold to charge|battery contactor"},
    {"power", FaultCode::battery_doubtful,
     "battery values disagree|battery halves differ|battery monitor too hot|"
     "battery CAN cable"},
    {"link", FaultCode::nothing_wrong, "restarted|active again|acknowledged"},
    {"link", FaultCode::link_absent, "not there|lost|device failure"},
    {"link", FaultCode::link_forbidden, "not permitted"},
    {"link", FaultCode::link_busy, "in use|port in use|device busy"},
    {"link", FaultCode::link_unreachable,
     "connection refused|unreachable|no answer|unknown host name|"
     "gateway path unavailable|gateway target silent"},
    {"link", FaultCode::link_settings, "settings not taken|not supported here"},
    {"link", FaultCode::link_bus_down, "bus off|interface down"},
    {"link", FaultCode::link_not_acknowledged, "nobody acknowledges"},
    {"link", FaultCode::link_other_device,
     "another device|refused by the unit|illegal function|illegal address|"
     "illegal value"},
    {"link", FaultCode::link_disturbed,
     "transmit time-out|arbitration lost|controller trouble|protocol violation|"
     "transceiver trouble|bus error|error counters|receive overflow|transmit overflow|"
     "receive warning|transmit warning|receive passive|transmit passive|"
     "many bus errors|damaged data|memory parity error|unknown exception"},
    {"link", FaultCode::link_failed, "failed"},
};

bool lists(std::string_view names, std::string_view name) {
  while (!names.empty()) {
    const std::size_t end = std::min(names.find('|'), names.size());
    if (names.substr(0, end) == name) return true;
    names.remove_prefix(std::min(end + 1, names.size()));
  }
  return false;
}

}  // namespace

FaultCode fault_of(std::string_view role, std::string_view name) {
  for (const FaultNames& known : kFaultNames)
    if (known.role == role && lists(known.names, name)) return known.code;
  return FaultCode::unknown_fault;
}

}  // namespace mission
