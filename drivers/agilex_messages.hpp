// What AgileX bases say on CAN and what they are told: Scout, Bunker, Tracer, Hunter, Ranger.
//
// Forward is positive, turning left (counter-clockwise from above) is positive. Integers are as on
// the wire; tenths (volts, amperes, degrees) are doubles that print as the tenths they are.
#pragma once

#include <array>
#include <cstdint>
#include <variant>

#include "drivers/fault.hpp"
#include "drivers/unread.hpp"

namespace drivers::agilex {

enum class Dialect { v1, v2 };

enum class VehicleState : std::uint8_t { normal = 0, estop_pressed = 1, exception = 2 };
// Who commands the base. The transmitter (rc) wins over all others.
enum class ControlMode : std::uint8_t { standby = 0, can = 1, uart = 2, rc = 3 };

struct Light {
  std::uint8_t mode{};  // 0 off, 1 on, 2 breathing, 3 custom.
  std::uint8_t custom_percent{};
  bool operator==(const Light&) const = default;
};

// --- Version 2, host to base.

struct MotionCommand {  // 0x111. The base stops when none came for 500 ms.
  std::int16_t forward_mmps{};
  std::int16_t turn_mradps{};
  std::int16_t lateral_mmps{};  // 0 on skid-steer bases, as the next.
  std::int16_t steering_mrad{};
  bool operator==(const MotionCommand&) const = default;
};
struct LightCommand {  // 0x121
  bool enable{};
  Light front, rear;
  std::uint8_t count{};
  bool operator==(const LightCommand&) const = default;
};
struct BrakeCommand {  // 0x131
  bool brake{};
  std::uint8_t count{};
  bool operator==(const BrakeCommand&) const = default;
};
struct MotionModeCommand {  // 0x141. Ranger and omni bases only.
  std::uint8_t mode{};
  bool operator==(const MotionModeCommand&) const = default;
};
struct ControlModeCommand {  // 0x421. In standby all other commands are ignored.
  ControlMode mode{};
  bool operator==(const ControlModeCommand&) const = default;
};
struct ResetCommand {    // 0x441
  std::uint8_t motor{};  // 0 clears all faults, 1..4 that motor's.
  bool operator==(const ResetCommand&) const = default;
};
struct VersionQuery {  // 0x411
  bool operator==(const VersionQuery&) const = default;
};

// --- Version 2, base to host.

struct SystemState {  // 0x211
  VehicleState vehicle{};
  ControlMode mode{};
  double battery_v{};
  std::uint16_t fault_bits{};  // Byte 4 in bits 0-7, byte 5 in bits 8-15; see system_faults().
  std::uint8_t count{};        // Stands still when the base does no longer renew the message.
  bool operator==(const SystemState&) const = default;
};
struct MotionState {  // 0x221
  std::int16_t forward_mmps{};
  std::int16_t turn_mradps{};
  std::int16_t lateral_mmps{};
  std::int16_t steering_mrad{};
  bool operator==(const MotionState&) const = default;
};
struct LightState {  // 0x231
  bool enabled{};
  Light front, rear;
  std::uint8_t count{};
  bool operator==(const LightState&) const = default;
};
enum class Switch : std::uint8_t { unknown = 0, middle = 1, up = 2, down = 3 };
struct RcState {                     // 0x241
  std::array<Switch, 4> switches{};  // SWA, SWB, SWC, SWD.
  std::int8_t right_horizontal{}, right_vertical{}, left_vertical{}, left_horizontal{};  // +-100
  std::int8_t knob{};
  std::uint8_t count{};
  bool operator==(const RcState&) const = default;
};
struct MotorFast {       // 0x251..0x254
  std::uint8_t motor{};  // 1 front right, 2 front left, 3 rear left, 4 rear right on a Scout.
  std::int16_t speed_rpm{};
  double current_a{};
  std::int32_t position_pulses{};  // A Hunter SE counts in the lower 24 bits only.
  bool operator==(const MotorFast&) const = default;
};
struct MotorSlow {  // 0x261..0x264
  std::uint8_t motor{};
  double driver_v{};
  std::int16_t driver_c{};
  std::int8_t motor_c{};      // -40: no sensor.
  std::uint8_t fault_bits{};  // See motor_faults().
  bool operator==(const MotorSlow&) const = default;
};
struct Odometry {  // 0x311. Since power-up; wraps, see travelled_mm().
  std::int32_t left_mm{};
  std::int32_t right_mm{};
  bool operator==(const Odometry&) const = default;
};
struct BatteryBasic {  // 0x361
  std::uint8_t charge_percent{};
  std::uint8_t health_percent{};
  double voltage_v{};
  double current_a{};
  double temperature_c{};
  bool operator==(const BatteryBasic&) const = default;
};
struct BatteryExtended {  // 0x362. The bits are the battery maker's.
  std::array<std::uint8_t, 2> alarms{};
  std::array<std::uint8_t, 2> warnings{};
  bool operator==(const BatteryExtended&) const = default;
};
struct Version {  // 0x41A, or 0x4A1 from some bases. High byte major.
  std::uint16_t board_hardware{}, driver_hardware{}, board_software{}, driver_software{};
  bool operator==(const Version&) const = default;
};

// --- Version 1. Every frame has a count and a checksum.

struct V1Command {      // 0x130
  std::uint8_t mode{};  // 0 remote control, 1 CAN, 2 UART.
  std::uint8_t fault_clear{};
  std::int8_t forward_percent{}, turn_percent{}, lateral_percent{};
  std::uint8_t count{};
  bool operator==(const V1Command&) const = default;
};
struct V1Motion {  // 0x131
  std::int16_t forward_mmps{};
  std::int16_t turn_mradps{};
  std::uint8_t count{};
  bool operator==(const V1Motion&) const = default;
};
struct V1LightCommand {  // 0x140
  bool enable{};
  Light front, rear;
  std::uint8_t count{};
  bool operator==(const V1LightCommand&) const = default;
};
struct V1LightState {  // 0x141
  bool enabled{};
  Light front, rear;
  std::uint8_t count{};
  bool operator==(const V1LightState&) const = default;
};
struct V1State {  // 0x151
  VehicleState vehicle{};
  std::uint8_t mode{};  // As in V1Command.
  double battery_v{};
  std::uint16_t fault_bits{};  // See v1_faults().
  std::uint8_t count{};
  bool operator==(const V1State&) const = default;
};
struct V1Motor {         // 0x200..0x203
  std::uint8_t motor{};  // 1..4
  double current_a{};
  std::int16_t speed_rpm{};
  std::int8_t motor_c{};
  std::uint8_t count{};
  bool operator==(const V1Motor&) const = default;
};

using Message =
    std::variant<Unread, MotionCommand, LightCommand, BrakeCommand, MotionModeCommand,
                 ControlModeCommand, ResetCommand, VersionQuery, SystemState, MotionState,
                 LightState, RcState, MotorFast, MotorSlow, Odometry, BatteryBasic, BatteryExtended,
                 Version, V1Command, V1Motion, V1LightCommand, V1LightState, V1State, V1Motor>;

}  // namespace drivers::agilex
