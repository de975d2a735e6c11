#include "drivers/cia402.hpp"

#include <algorithm>
#include <cmath>

#include "drivers/cia402_layout.hpp"

namespace drivers::cia402 {
namespace {

struct Pattern {
  std::uint16_t mask, value;
  State state;
};
// CiA 402-2, statusword: bits 0-3, 5 and 6.
constexpr Pattern kPatterns[] = {
    {0x4F, 0x00, State::not_ready},
    {0x4F, 0x40, State::switch_on_disabled},
    {0x6F, 0x21, State::ready_to_switch_on},
    {0x6F, 0x23, State::switched_on},
    {0x6F, 0x27, State::operation_enabled},
    {0x6F, 0x07, State::quick_stop_active},
    {0x4F, 0x0F, State::fault_reaction_active},
    {0x4F, 0x08, State::fault},
};

bool bit(std::uint16_t word, unsigned at) {
  return (word >> at & 1) != 0;
}

std::optional<std::uint16_t> towards_enabled(State state) {
  switch (state) {
    case State::switch_on_disabled:
      return kShutdown;
    case State::ready_to_switch_on:
      return kSwitchOn;
    case State::switched_on:
    case State::operation_enabled:
      return kEnableOperation;
    case State::quick_stop_active:
      return kDisableVoltage;
    default:
      return std::nullopt;
  }
}

std::optional<std::uint16_t> towards_rest(State state, std::uint16_t when_enabled) {
  switch (state) {
    case State::operation_enabled:
      return when_enabled;
    case State::quick_stop_active:
      return kQuickStop;  // Holds the ramp; the drive ends it.
    case State::switch_on_disabled:
    case State::ready_to_switch_on:
    case State::switched_on:
      return kDisableVoltage;
    default:
      return std::nullopt;
  }
}

}  // namespace

std::optional<State> state_of(std::uint16_t statusword) {
  for (const Pattern& pattern : kPatterns)
    if ((statusword & pattern.mask) == pattern.value) return pattern.state;
  return std::nullopt;
}

std::string_view name(State state) {
  static constexpr std::string_view kNames[]{
      "not ready",         "switch-on disabled", "ready to switch on",    "switched on",
      "operation enabled", "quick stop active",  "fault reaction active", "fault"};
  return kNames[static_cast<std::size_t>(state)];
}

Status status_of(std::uint16_t statusword) {
  return {bit(statusword, 4),  bit(statusword, 7),  bit(statusword, 9),
          bit(statusword, 10), bit(statusword, 11), bit(statusword, 12)};
}

std::optional<std::uint16_t> next_controlword(State state, Goal goal) {
  switch (goal) {
    case Goal::enabled:
      return towards_enabled(state);
    case Goal::stopped:
      return towards_rest(state, kQuickStop);
    case Goal::off:
      return state == State::quick_stop_active ? kDisableVoltage
                                               : towards_rest(state, kDisableVoltage);
  }
  return std::nullopt;
}

bool reached(State state, Goal goal) {
  return state == (goal == Goal::enabled ? State::operation_enabled : State::switch_on_disabled);
}

VelocityObjects velocity_objects(Mode mode) {
  if (mode == Mode::velocity) return {{kVlTarget, 16, true}, {kVlActual, 16, true}};
  return {{kVelocityTarget, 32, true}, {kVelocityActual, 32, true}};
}

std::int32_t Scale::units(double speed_mps, std::int32_t limit) const {
  const double wanted = std::round(speed_mps * units_per_mps);
  if (std::isnan(wanted)) return 0;
  return static_cast<std::int32_t>(std::clamp<double>(wanted, -static_cast<double>(limit), limit));
}

std::vector<canopen::PdoSetup> velocity_pdos(const VelocityConfig& config,
                                             const PdoLayout& layout) {
  const auto setup = [&](const PdoLayout::Part& part, bool from_node) {
    return canopen::PdoSetup{part.number, from_node,    config.sync_every,
                             0,           part.mapping, layout.fixed};
  };
  std::vector<canopen::PdoSetup> pdos{setup(layout.target, false), setup(layout.status, true)};
  if (layout.position.number != layout.status.number) pdos.push_back(setup(layout.position, true));
  return pdos;
}

std::vector<canopen::PdoSetup> velocity_pdos(const VelocityConfig& config) {
  return velocity_pdos(config, own_layout(config.mode));
}

std::vector<canopen::Setting> velocity_settings(const VelocityConfig& config) {
  return velocity_settings(config, own_layout(config.mode));
}

std::vector<canopen::Setting> velocity_settings(const VelocityConfig& config,
                                                const PdoLayout& layout) {
  constexpr std::uint32_t kAll = 0xFFFFFFFF;
  const std::uint32_t watch = std::uint32_t{config.master} << 16 | config.master_heartbeat_max_ms;
  std::vector<canopen::Setting> settings{
      {{0x1017, 0}, 2, config.heartbeat_ms, kAll, "heartbeat every ms"},
      {{0x1016, 1}, 4, watch, kAll, "longest silence of the master"},
      {kAbortConnection, 2, 3, kAll, "quick stop when the master is silent"}};
  const auto ramp = [&](canopen::Address at, std::uint32_t value, std::string_view what) {
    if (value != 0) settings.push_back({at, 4, value, kAll, what});
  };
  ramp(kAcceleration, config.acceleration, "acceleration");
  ramp(kDeceleration, config.deceleration, "deceleration");
  ramp(kQuickStopDeceleration, config.quick_stop_deceleration, "quick-stop deceleration");
  for (const canopen::PdoSetup& pdo : velocity_pdos(config, layout)) {
    const auto writes = canopen::pdo_settings(config.node, pdo);
    settings.insert(settings.end(), writes.begin(), writes.end());
  }
  const auto mode = static_cast<std::uint32_t>(config.mode);
  settings.push_back({kModes, 1, mode, kAll, "mode of operation", false, kModesDisplay});
  return settings;
}

}  // namespace drivers::cia402
