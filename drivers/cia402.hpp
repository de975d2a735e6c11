// Drives by CiA 402: states, the next controlword, velocity modes, settings. Pure.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "drivers/canopen_pdo.hpp"

namespace drivers::cia402 {

enum class State : std::uint8_t {
  not_ready,
  switch_on_disabled,
  ready_to_switch_on,
  switched_on,
  operation_enabled,
  quick_stop_active,
  fault_reaction_active,
  fault,
};

// Nothing for bits that no state has. Bits that a state leaves open (voltage, warning, remote,
// limits) do not matter.
std::optional<State> state_of(std::uint16_t statusword);
std::string_view name(State state);

// The statusword's other bits.
struct Status {
  bool voltage_enabled{};
  bool warning{};
  bool remote{};  // The controlword is obeyed.
  bool target_reached{};
  bool internal_limit{};
  bool standing{};  // Profile velocity only: speed is 0.
  bool operator==(const Status&) const = default;
};
Status status_of(std::uint16_t statusword);

constexpr std::uint16_t kDisableVoltage = 0x0000, kQuickStop = 0x0002, kShutdown = 0x0006,
                        kSwitchOn = 0x0007, kEnableOperation = 0x000F, kHalt = 0x010F,
                        kFaultReset = 0x0080;

enum class Goal : std::uint8_t {
  off,      // Switch-on disabled: no torque.
  enabled,  // Operation enabled.
  stopped,  // As fast as the drive's quick-stop ramp; then off.
};

// The controlword that brings a drive one state closer to the goal; the one that holds it there
// once it is reached. Nothing where the drive has to move on by itself (not ready, fault reaction)
// or needs its fault reset first.
std::optional<std::uint16_t> next_controlword(State state, Goal goal);
bool reached(State state, Goal goal);

// A fault reset is an edge of bit 7: 0x0000, then 0x0080, once each.
inline constexpr std::uint16_t kFaultResetSequence[]{kDisableVoltage, kFaultReset};

enum class Mode : std::int8_t { velocity = 2, profile_velocity = 3, cyclic_velocity = 9 };
// Bit of object 0x6502, supported modes.
constexpr std::uint32_t mode_bit(Mode mode) {
  return 1U << (static_cast<int>(mode) - 1);
}

// Objects by name.
inline constexpr canopen::Address kErrorCode{0x603F, 0}, kControlword{0x6040, 0},
    kStatusword{0x6041, 0}, kVlTarget{0x6042, 0}, kVlDemand{0x6043, 0}, kVlActual{0x6044, 0},
    kAbortConnection{0x6007, 0}, kQuickStopOption{0x605A, 0}, kModes{0x6060, 0},
    kModesDisplay{0x6061, 0}, kPosition{0x6064, 0}, kVelocityActual{0x606C, 0},
    kTorqueActual{0x6077, 0}, kDcLinkMv{0x6079, 0}, kMotorSpeedMax{0x6080, 0},
    kAcceleration{0x6083, 0}, kDeceleration{0x6084, 0}, kQuickStopDeceleration{0x6085, 0},
    kVelocityTarget{0x60FF, 0}, kSupportedModes{0x6502, 0};

// Where a mode takes its target and shows its speed: 16 bits in velocity mode, else 32.
struct VelocityObjects {
  canopen::Mapped target, actual;
};
VelocityObjects velocity_objects(Mode mode);

// Drive units per wheel speed differ from drive to drive (rpm, 0.1 rpm, counts per second): found
// at commissioning. Sign: of a wheel that turns forward.
struct Scale {
  double units_per_mps{};

  // Rounded, clamped to `limit` units either way; what is not a number is 0.
  std::int32_t units(double speed_mps, std::int32_t limit) const;
  double mps(std::int64_t units) const { return static_cast<double>(units) / units_per_mps; }
};

struct VelocityConfig {
  std::uint8_t node{};
  std::uint8_t master{127};
  Mode mode = Mode::profile_velocity;
  std::uint16_t heartbeat_ms = 100;
  std::uint16_t master_heartbeat_max_ms = 300;  // The drive stops by itself after that.
  std::uint32_t acceleration{}, deceleration{},
      quick_stop_deceleration{};  // Drive units; 0: as is.
  std::uint8_t sync_every = 1;    // PDOs with every n-th SYNC.
};

struct PdoLayout;  // cia402_layout.hpp

// RPDO1: controlword and target. TPDO1: statusword and speed. TPDO2: position and torque.
std::vector<canopen::PdoSetup> velocity_pdos(const VelocityConfig& config);
// The same where a drive has its own mapping.
std::vector<canopen::PdoSetup> velocity_pdos(const VelocityConfig& config, const PdoLayout& layout);

// All that a drive must hold before it may drive, in order, to be written in pre-operational.
std::vector<canopen::Setting> velocity_settings(const VelocityConfig& config);
std::vector<canopen::Setting> velocity_settings(const VelocityConfig& config,
                                                const PdoLayout& layout);

}  // namespace drivers::cia402
