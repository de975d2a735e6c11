// What goes wrong in one mission, drawn from a seed: nothing else decides it.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "hal/values.hpp"
#include "sim/link_faults.hpp"
#include "sim/unit_faults.hpp"

namespace dst {

inline constexpr hal::Duration kForEver = std::chrono::hours(24);

// The devices of the robot, as mission::RobotUnits calls them.
inline constexpr std::string_view kRoles[]{"drive",     "scanner", "pan",   "imu",   "gnss",
                                           "obstacles", "battery", "board", "safety"};

struct DeviceFault {
  std::string role;
  sim::FaultSetting setting;
  hal::Duration from{}, during{};
};

// The link of a role, cut after so many more bytes, frames or requests.
struct LinkCut {
  std::string role;
  std::uint64_t after{};
  hal::Duration from{}, during{};
};

// What a person presses, and for how long.
enum class Press : std::uint8_t { base_estop, board_estop, safety_estop, bumper, transmitter };
std::string_view name(Press press);
struct Pressed {
  Press what{};
  hal::Duration from{}, during{};
};

// Satellites, too, say what day it is: the receiver's date jumps by so many days.
struct DateJump {
  hal::Duration from{};
  int days{};
};

// People and time servers set the computer's own clock.
struct ClockJump {
  hal::Duration from{};
  std::chrono::seconds by{};
};

enum class DiskFault : std::uint8_t { full, io_error, short_writes, slow_flushes };
std::string_view name(DiskFault fault);
struct DiskTrouble {
  DiskFault fault{};
  hal::Duration from{}, during{};
  bool sends_home = false;  // [disk] then = "home"
};

// The computer loses its power, so many steps of the simulation after that time; it comes back, and
// a person goes on with the run.
struct PowerCut {
  hal::Duration from{};
  int steps{};
};

// At the serial console: what their keys send, and what the line does to it.
struct Operator {
  struct Typed {
    hal::Duration at{};
    std::string bytes;
  };
  bool knows_password{};
  std::vector<Typed> typed;  // In the order of time.
  sim::LinkFaults disturbed;
  hal::Duration disturbed_from{}, disturbed_during{};
  std::optional<hal::Duration> cut_from;
  hal::Duration cut_during{};
};

struct Scenario {
  std::uint64_t seed{};
  std::vector<DeviceFault> faults;
  std::vector<LinkCut> cuts;
  std::vector<Pressed> presses;
  std::vector<DateJump> jumps;
  std::vector<ClockJump> clock_jumps;
  std::optional<DiskTrouble> disk;
  std::optional<PowerCut> power_cut, cut_again;  // Again: from when the run was gone on with.
  std::optional<Operator> at_console;
  hal::Duration releases_after{};  // A person releases a robot that has been stopped for so long,
  bool by_button{};                // by the board's button, or as the console does.
};

Scenario draw_scenario(std::uint64_t seed);
// One line for each thing that goes wrong, in the order of time.
std::string text(const Scenario& scenario);

}  // namespace dst
