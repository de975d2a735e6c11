// The only way to the motors: what a mission or an operator wants, made safe, 100 times a second.
// Zero when in doubt. Pure; does not allocate.
#pragma once

#include <cstdint>
#include <limits>
#include <string_view>

#include "hal/values.hpp"
#include "mission/supervisor.hpp"

namespace mission {

inline constexpr hal::Duration kGatePeriod = std::chrono::milliseconds(10);

// All limits are positive and finite.
struct GateConfig {
  double speed_max_mps = 1.0, turn_max_radps = 0.785;
  double teleop_speed_max_mps = 0.3, teleop_turn_max_radps = 0.4;
  // How fast a speed may grow in size. Slower is always allowed at once.
  double accel_max_mps2 = 1.0, turn_accel_max_radps2 = 4.0;
  bool has_range = false;  // A range source is configured.
  // How long an input counts.
  hal::Duration teleop_max = std::chrono::milliseconds(200);
  hal::Duration range_max = std::chrono::milliseconds(250);
  hal::Duration feedback_max = std::chrono::milliseconds(100);
  hal::Duration planner_max = std::chrono::milliseconds(500);
};

// What an operator's console sends over and over while its dead-man is held.
struct OperatorPacket {
  std::uint32_t sequence{};  // From 1; a packet that is not newer than all before moves nothing.
  bool dead_man{};           // Held.
  hal::Twist twist;
};

// Times are of the latest news; time 0: never.
struct GateInputs {
  Mode mode = Mode::stopped;
  hal::Twist planned;
  hal::Time planned_at{};
  hal::Time feedback_at{};  // Of the drive.
  hal::Time range_at{};
  // How fast one may be where the robot stands; not a number: nobody knows.
  double zone_speed_max_mps = std::numeric_limits<double>::infinity();
};

struct GateState {
  hal::Twist given;
  hal::Time given_at{};
  OperatorPacket heard;  // The newest.
  hal::Time heard_at{};
};

enum class GateReason : std::uint8_t {
  passes,
  clock,     // Time went backwards.
  mode,      // Nobody may drive.
  feedback,  // The drive does not report.
  range,     // The range source does not report.
  teleop,    // The dead-man is not held, or the console is silent.
  planner,   // The mission does not say anything.
  number,    // Not finite.
  zone,      // Nobody knows how fast one may be here.
};
std::string_view name(GateReason reason);

struct GateCommand {
  hal::Twist twist;
  GateReason reason = GateReason::mode;  // Why it is zero; or passes, limited or not.
};

// A packet has arrived. Repeated and older ones are not heard.
void hear(GateState& state, const OperatorPacket& packet, hal::Time now);
// The dead-man is held, as far as is known.
bool operator_alive(const GateConfig& config, const GateState& state, hal::Time now);

// One cycle: what to send to the drive. |forward| and |turn| are within the limits of the mode and
// the zone, and grow by no more than the acceleration allows in one period, however long ago the
// last cycle was.
GateCommand gate(const GateConfig& config, GateState& state, const GateInputs& inputs,
                 hal::Time now);

}  // namespace mission
