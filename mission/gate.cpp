#include "mission/gate.hpp"

#include <algorithm>
#include <cmath>

namespace mission {
namespace {

// News from the future is no news.
bool fresh(hal::Time at, hal::Time now, hal::Duration max) {
  return at != hal::Time{} && at <= now && now - at <= max;
}

bool finite(const hal::Twist& twist) {
  return std::isfinite(twist.forward_mps) && std::isfinite(twist.turn_radps);
}

// Why nothing may pass; GateReason::passes: it may.
GateReason doubt(const GateConfig& config, const GateState& state, const GateInputs& inputs,
                 hal::Time now) {
  const bool teleop = inputs.mode == Mode::teleop;
  if (now < state.given_at) return GateReason::clock;
  if (!moves(inputs.mode)) return GateReason::mode;
  if (!fresh(inputs.feedback_at, now, config.feedback_max)) return GateReason::feedback;
  if (config.has_range && !fresh(inputs.range_at, now, config.range_max)) return GateReason::range;
  if (teleop && !operator_alive(config, state, now)) return GateReason::teleop;
  if (!teleop && !fresh(inputs.planned_at, now, config.planner_max)) return GateReason::planner;
  if (!finite(teleop ? state.heard.twist : inputs.planned)) return GateReason::number;
  if (!(inputs.zone_speed_max_mps >= 0)) return GateReason::zone;
  return GateReason::passes;
}

// Slower as a whole, so that a curve stays that curve.
hal::Twist slowed(hal::Twist twist, double speed_max_mps, double turn_max_radps) {
  const double share = std::max({1.0, std::abs(twist.forward_mps) / speed_max_mps,
                                 std::abs(twist.turn_radps) / turn_max_radps});
  return {std::clamp(twist.forward_mps / share, -speed_max_mps, speed_max_mps),  // Rounded.
          std::clamp(twist.turn_radps / share, -turn_max_radps, turn_max_radps)};
}

// What is wanted as far as it may grow from what was, through zero where the sign changes.
double grown(double was, double wanted, double step_max) {
  const double from = was * wanted > 0 ? std::abs(was) : 0;
  return std::copysign(std::min(std::abs(wanted), from + step_max), wanted);
}

hal::Twist limited(const GateConfig& config, const GateState& state, const GateInputs& inputs,
                   double step_s) {
  const bool teleop = inputs.mode == Mode::teleop;
  const double zone_mps = inputs.zone_speed_max_mps;
  const double speed_mps =
      std::min(zone_mps, teleop ? config.teleop_speed_max_mps : config.speed_max_mps);
  if (speed_mps <= 0) return {};
  const hal::Twist wanted = slowed(teleop ? state.heard.twist : inputs.planned, speed_mps,
                                   teleop ? config.teleop_turn_max_radps : config.turn_max_radps);
  return {grown(state.given.forward_mps, wanted.forward_mps, config.accel_max_mps2 * step_s),
          grown(state.given.turn_radps, wanted.turn_radps, config.turn_accel_max_radps2 * step_s)};
}

}  // namespace

void hear(GateState& state, const OperatorPacket& packet, hal::Time now) {
  if (packet.sequence <= state.heard.sequence) return;
  state.heard = packet;
  state.heard_at = now;
}

bool operator_alive(const GateConfig& config, const GateState& state, hal::Time now) {
  return state.heard.dead_man && fresh(state.heard_at, now, config.teleop_max);
}

GateCommand gate(const GateConfig& config, GateState& state, const GateInputs& inputs,
                 hal::Time now) {
  GateCommand command{{}, doubt(config, state, inputs, now)};
  if (command.reason == GateReason::passes)
    command.twist =
        limited(config, state, inputs, hal::seconds(std::min(now - state.given_at, kGatePeriod)));
  state.given = command.twist;
  state.given_at = now;
  return command;
}

std::string_view name(GateReason reason) {
  static constexpr std::string_view kReasons[]{
      "passes",
      "time went backwards",
      "nobody may drive",
      "the drive does not report",
      "the range source does not report",
      "the dead-man is not held",
      "the mission says nothing",
      "the command is not a number",
      "nobody knows how fast one may be here",
  };
  return kReasons[static_cast<std::size_t>(reason)];
}

}  // namespace mission
