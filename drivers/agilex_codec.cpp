#include "drivers/agilex_codec.hpp"

#include <algorithm>
#include <cmath>

namespace drivers::agilex {
namespace {

using hal::CanFrame;

// Tenths on the wire. The quotient is the double nearest to the decimal: 256 -> 25.6.
template <class T>
double tenths(ByteView bytes, std::size_t at) {
  return big<T>(bytes, at) / 10.0;
}

std::int8_t signed_byte(ByteView data, std::size_t at) {
  return static_cast<std::int8_t>(data[at]);
}

// --- One small function per frame; the tables below say which.

template <class T>
Message motion(const CanFrame& frame) {
  const ByteView data = frame.data;
  return T{big<std::int16_t>(data, 0), big<std::int16_t>(data, 2), big<std::int16_t>(data, 4),
           big<std::int16_t>(data, 6)};
}

template <class T>
Message lights(const CanFrame& frame, std::size_t count_at) {
  const auto& data = frame.data;
  return T{data[0] != 0, {data[1], data[2]}, {data[3], data[4]}, data[count_at]};
}
template <class T>
Message v2_lights(const CanFrame& frame) {
  return lights<T>(frame, 7);
}
template <class T>
Message v1_lights(const CanFrame& frame) {
  return lights<T>(frame, 6);
}

Message brake(const CanFrame& frame) {
  return BrakeCommand{frame.data[0] != 0, frame.data[1]};
}

Message motion_mode(const CanFrame& frame) {
  return MotionModeCommand{frame.data[0]};
}

Message control_mode(const CanFrame& frame) {
  if (frame.data[0] > 2) return Unread{"no such control mode"};
  return ControlModeCommand{ControlMode{frame.data[0]}};
}

Message reset(const CanFrame& frame) {
  if (frame.data[0] > 4) return Unread{"no such motor"};
  return ResetCommand{frame.data[0]};
}

Message version_query(const CanFrame& frame) {
  if (frame.data[0] != 1) return Unread{"no such query"};
  return VersionQuery{};
}

Message system_state(const CanFrame& frame) {
  const auto& data = frame.data;
  if (data[0] > 2) return Unread{"no such vehicle state"};
  if (data[1] > 3) return Unread{"no such control mode"};
  return SystemState{VehicleState{data[0]}, ControlMode{data[1]}, tenths<std::uint16_t>(data, 2),
                     little<std::uint16_t>(data, 4), data[7]};
}

Message rc_state(const CanFrame& frame) {
  const auto& data = frame.data;
  RcState rc;
  for (std::size_t i = 0; i < rc.switches.size(); ++i)
    rc.switches[i] = Switch{static_cast<std::uint8_t>(data[0] >> (2 * i) & 3)};
  rc.right_horizontal = signed_byte(data, 1);
  rc.right_vertical = signed_byte(data, 2);
  rc.left_vertical = signed_byte(data, 3);
  rc.left_horizontal = signed_byte(data, 4);
  rc.knob = signed_byte(data, 5);
  rc.count = data[7];
  return rc;
}

Message motor_fast(const CanFrame& frame) {
  const ByteView data = frame.data;
  return MotorFast{static_cast<std::uint8_t>(frame.id & 0xF), big<std::int16_t>(data, 0),
                   tenths<std::int16_t>(data, 2), big<std::int32_t>(data, 4)};
}

Message motor_slow(const CanFrame& frame) {
  const auto& data = frame.data;
  return MotorSlow{static_cast<std::uint8_t>(frame.id & 0xF), tenths<std::uint16_t>(data, 0),
                   big<std::int16_t>(data, 2), signed_byte(data, 4), data[5]};
}

Message odometry(const CanFrame& frame) {
  return Odometry{big<std::int32_t>(frame.data, 0), big<std::int32_t>(frame.data, 4)};
}

Message battery_basic(const CanFrame& frame) {
  const auto& data = frame.data;
  return BatteryBasic{data[0], data[1], tenths<std::int16_t>(data, 2),
                      tenths<std::int16_t>(data, 4), tenths<std::int16_t>(data, 6)};
}

Message battery_extended(const CanFrame& frame) {
  const auto& data = frame.data;
  return BatteryExtended{{data[0], data[1]}, {data[2], data[3]}};
}

Message version(const CanFrame& frame) {
  const ByteView data = frame.data;
  return Version{big<std::uint16_t>(data, 0), big<std::uint16_t>(data, 2),
                 big<std::uint16_t>(data, 4), big<std::uint16_t>(data, 6)};
}

Message v1_command(const CanFrame& frame) {
  const auto& data = frame.data;
  if (data[0] > 2) return Unread{"no such control mode"};
  return V1Command{
      data[0], data[1], signed_byte(data, 2), signed_byte(data, 3), signed_byte(data, 4), data[6]};
}

Message v1_motion(const CanFrame& frame) {
  return V1Motion{big<std::int16_t>(frame.data, 0), big<std::int16_t>(frame.data, 2),
                  frame.data[6]};
}

Message v1_state(const CanFrame& frame) {
  const auto& data = frame.data;
  if (data[0] > 2) return Unread{"no such vehicle state"};
  return V1State{VehicleState{data[0]}, data[1], tenths<std::uint16_t>(data, 2),
                 big<std::uint16_t>(data, 4), data[6]};
}

Message v1_motor(const CanFrame& frame) {
  const auto& data = frame.data;
  return V1Motor{static_cast<std::uint8_t>((frame.id & 0xF) + 1), tenths<std::int16_t>(data, 0),
                 big<std::int16_t>(data, 2), signed_byte(data, 4), data[6]};
}

struct Kind {
  std::uint32_t first, last;  // Ids.
  std::uint8_t size_min;
  Message (*decode)(const CanFrame&);
};

constexpr Kind kV2[] = {
    {0x111, 0x111, 8, motion<MotionCommand>},
    {0x121, 0x121, 8, v2_lights<LightCommand>},
    {0x131, 0x131, 1, brake},
    {0x141, 0x141, 1, motion_mode},
    {0x211, 0x211, 8, system_state},
    {0x221, 0x221, 8, motion<MotionState>},
    {0x231, 0x231, 8, v2_lights<LightState>},
    {0x241, 0x241, 8, rc_state},
    {0x251, 0x254, 8, motor_fast},
    {0x261, 0x264, 6, motor_slow},
    {0x311, 0x311, 8, odometry},
    {0x361, 0x361, 8, battery_basic},
    {0x362, 0x362, 4, battery_extended},
    {0x411, 0x411, 1, version_query},
    {0x41A, 0x41A, 8, version},
    {0x421, 0x421, 1, control_mode},
    {0x441, 0x441, 1, reset},
    {0x4A1, 0x4A1, 8, version},
};
constexpr Kind kV1[] = {
    {0x130, 0x130, 8, v1_command},
    {0x131, 0x131, 8, v1_motion},
    {0x140, 0x140, 8, v1_lights<V1LightCommand>},
    {0x141, 0x141, 8, v1_lights<V1LightState>},
    {0x151, 0x151, 8, v1_state},
    {0x200, 0x203, 8, v1_motor},
};

bool is_v1_id(std::uint32_t id) {
  return std::any_of(std::begin(kV1), std::end(kV1),
                     [&](const Kind& kind) { return id >= kind.first && id <= kind.last; });
}

}  // namespace

Message decode(const CanFrame& frame, Dialect dialect) {
  if (frame.extended) return Unread{"extended id"};
  if (frame.remote) return Unread{"remote frame"};
  const std::span<const Kind> kinds =
      dialect == Dialect::v1 ? std::span<const Kind>(kV1) : std::span<const Kind>(kV2);
  for (const Kind& kind : kinds) {
    if (frame.id < kind.first || frame.id > kind.last) continue;
    if (frame.size < kind.size_min || frame.size > 8) return Unread{"length"};
    if (dialect == Dialect::v1 && frame.data[7] != v1_checksum(frame)) return Unread{"checksum"};
    return kind.decode(frame);
  }
  return Unread{"unknown id"};
}

bool from_base(const Message& message) {
  return std::visit(
      []<class T>(const T&) {
        return !(std::is_same_v<T, MotionCommand> || std::is_same_v<T, LightCommand> ||
                 std::is_same_v<T, BrakeCommand> || std::is_same_v<T, MotionModeCommand> ||
                 std::is_same_v<T, ControlModeCommand> || std::is_same_v<T, ResetCommand> ||
                 std::is_same_v<T, VersionQuery> || std::is_same_v<T, V1Command> ||
                 std::is_same_v<T, V1LightCommand>);
      },
      message);
}

std::optional<Dialect> dialect_of(const CanFrame& frame) {
  if (frame.extended || frame.remote) return std::nullopt;
  if (is_v1_id(frame.id)) {
    const bool v1 = frame.size == 8 && frame.data[7] == v1_checksum(frame);
    return v1 ? std::optional(Dialect::v1) : std::nullopt;
  }
  return std::holds_alternative<Unread>(decode(frame, Dialect::v2)) ? std::nullopt
                                                                    : std::optional(Dialect::v2);
}

std::uint8_t v1_checksum(const CanFrame& frame) {
  std::uint32_t sum = (frame.id & 0xFF) + (frame.id >> 8 & 0xFF) + frame.size;
  for (std::size_t i = 0; i < 7; ++i) sum += frame.data[i];
  return static_cast<std::uint8_t>(sum);
}

MotionCommand motion_command(hal::Twist twist, Limits limits) {
  if (!std::isfinite(twist.forward_mps) || !std::isfinite(twist.turn_radps)) return {};
  const double forward = twist.forward_mps * 1000, turn = twist.turn_radps * 1000;
  const double over =
      std::max({1.0, std::abs(forward) / limits.forward_mmps, std::abs(turn) / limits.turn_mradps});
  const auto within = [&](double value, std::int16_t limit) {
    return static_cast<std::int16_t>(std::clamp<double>(std::round(value / over), -limit, limit));
  };
  MotionCommand command;
  command.forward_mmps = within(forward, limits.forward_mmps);
  command.turn_mradps = within(turn, limits.turn_mradps);
  return command;
}

}  // namespace drivers::agilex
