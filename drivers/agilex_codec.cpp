#include "drivers/agilex_codec.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace drivers::agilex {
namespace {

using hal::CanFrame;

// Tenths on the wire. The quotient is the double nearest to the decimal: 256 -> 25.6.
template <class T>
double tenths(ByteView bytes, std::size_t at) {
  return big<T>(bytes, at) / 10.0;
}

template <class T>
void put_tenths(CanFrame& frame, std::size_t at, double value) {
  const double raw = std::isnan(value) ? 0 : std::round(value * 10);
  put_big<T>(frame.data, at,
             static_cast<T>(std::clamp<double>(raw, std::numeric_limits<T>::min(),
                                               std::numeric_limits<T>::max())));
}

std::int8_t signed_byte(ByteView data, std::size_t at) {
  return static_cast<std::int8_t>(data[at]);
}

CanFrame frame_of(std::uint32_t id, std::uint8_t size) {
  CanFrame frame;
  frame.id = id;
  frame.size = size;
  return frame;
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

// --- And back.

struct Encoder {
  CanFrame operator()(const Unread&) const {
    assert(!"nothing to encode");
    return {};
  }
  CanFrame operator()(const MotionCommand& m) const { return motion(0x111, m); }
  CanFrame operator()(const LightCommand& m) const { return lights(0x121, 7, m.enable, m); }
  CanFrame operator()(const BrakeCommand& m) const {
    CanFrame frame = frame_of(0x131, 2);
    frame.data[0] = m.brake;
    frame.data[1] = m.count;
    return frame;
  }
  CanFrame operator()(const MotionModeCommand& m) const { return byte(0x141, 8, m.mode); }
  CanFrame operator()(const ControlModeCommand& m) const {
    return byte(0x421, 1, static_cast<std::uint8_t>(m.mode));
  }
  CanFrame operator()(const ResetCommand& m) const { return byte(0x441, 1, m.motor); }
  CanFrame operator()(const VersionQuery&) const { return byte(0x411, 1, 1); }
  CanFrame operator()(const SystemState& m) const {
    CanFrame frame = frame_of(0x211, 8);
    frame.data[0] = static_cast<std::uint8_t>(m.vehicle);
    frame.data[1] = static_cast<std::uint8_t>(m.mode);
    put_tenths<std::uint16_t>(frame, 2, m.battery_v);
    put_little<std::uint16_t>(frame.data, 4, m.fault_bits);
    frame.data[7] = m.count;
    return frame;
  }
  CanFrame operator()(const MotionState& m) const { return motion(0x221, m); }
  CanFrame operator()(const LightState& m) const { return lights(0x231, 7, m.enabled, m); }
  CanFrame operator()(const RcState& m) const {
    CanFrame frame = frame_of(0x241, 8);
    for (std::size_t i = 0; i < m.switches.size(); ++i)
      frame.data[0] = static_cast<std::uint8_t>(frame.data[0] | static_cast<unsigned>(m.switches[i])
                                                                    << (2 * i));
    frame.data[1] = static_cast<std::uint8_t>(m.right_horizontal);
    frame.data[2] = static_cast<std::uint8_t>(m.right_vertical);
    frame.data[3] = static_cast<std::uint8_t>(m.left_vertical);
    frame.data[4] = static_cast<std::uint8_t>(m.left_horizontal);
    frame.data[5] = static_cast<std::uint8_t>(m.knob);
    frame.data[7] = m.count;
    return frame;
  }
  CanFrame operator()(const MotorFast& m) const {
    CanFrame frame = frame_of(0x250U + m.motor, 8);
    put_big<std::int16_t>(frame.data, 0, m.speed_rpm);
    put_tenths<std::int16_t>(frame, 2, m.current_a);
    put_big<std::int32_t>(frame.data, 4, m.position_pulses);
    return frame;
  }
  CanFrame operator()(const MotorSlow& m) const {
    CanFrame frame = frame_of(0x260U + m.motor, 8);
    put_tenths<std::uint16_t>(frame, 0, m.driver_v);
    put_big<std::int16_t>(frame.data, 2, m.driver_c);
    frame.data[4] = static_cast<std::uint8_t>(m.motor_c);
    frame.data[5] = m.fault_bits;
    return frame;
  }
  CanFrame operator()(const Odometry& m) const {
    CanFrame frame = frame_of(0x311, 8);
    put_big<std::int32_t>(frame.data, 0, m.left_mm);
    put_big<std::int32_t>(frame.data, 4, m.right_mm);
    return frame;
  }
  CanFrame operator()(const BatteryBasic& m) const {
    CanFrame frame = frame_of(0x361, 8);
    frame.data[0] = m.charge_percent;
    frame.data[1] = m.health_percent;
    put_tenths<std::int16_t>(frame, 2, m.voltage_v);
    put_tenths<std::int16_t>(frame, 4, m.current_a);
    put_tenths<std::int16_t>(frame, 6, m.temperature_c);
    return frame;
  }
  CanFrame operator()(const BatteryExtended& m) const {
    CanFrame frame = frame_of(0x362, 4);
    std::copy(m.alarms.begin(), m.alarms.end(), frame.data.begin());
    std::copy(m.warnings.begin(), m.warnings.end(), frame.data.begin() + 2);
    return frame;
  }
  CanFrame operator()(const Version& m) const {
    CanFrame frame = frame_of(0x41A, 8);
    put_big<std::uint16_t>(frame.data, 0, m.board_hardware);
    put_big<std::uint16_t>(frame.data, 2, m.driver_hardware);
    put_big<std::uint16_t>(frame.data, 4, m.board_software);
    put_big<std::uint16_t>(frame.data, 6, m.driver_software);
    return frame;
  }
  CanFrame operator()(const V1Command& m) const {
    CanFrame frame = frame_of(0x130, 8);
    frame.data[0] = m.mode;
    frame.data[1] = m.fault_clear;
    frame.data[2] = static_cast<std::uint8_t>(m.forward_percent);
    frame.data[3] = static_cast<std::uint8_t>(m.turn_percent);
    frame.data[4] = static_cast<std::uint8_t>(m.lateral_percent);
    return signed_off(frame, m.count);
  }
  CanFrame operator()(const V1Motion& m) const {
    CanFrame frame = frame_of(0x131, 8);
    put_big<std::int16_t>(frame.data, 0, m.forward_mmps);
    put_big<std::int16_t>(frame.data, 2, m.turn_mradps);
    return signed_off(frame, m.count);
  }
  CanFrame operator()(const V1LightCommand& m) const {
    return signed_off(lights(0x140, 6, m.enable, m), m.count);
  }
  CanFrame operator()(const V1LightState& m) const {
    return signed_off(lights(0x141, 6, m.enabled, m), m.count);
  }
  CanFrame operator()(const V1State& m) const {
    CanFrame frame = frame_of(0x151, 8);
    frame.data[0] = static_cast<std::uint8_t>(m.vehicle);
    frame.data[1] = m.mode;
    put_tenths<std::uint16_t>(frame, 2, m.battery_v);
    put_big<std::uint16_t>(frame.data, 4, m.fault_bits);
    return signed_off(frame, m.count);
  }
  CanFrame operator()(const V1Motor& m) const {
    CanFrame frame = frame_of(0x200U + m.motor - 1, 8);
    put_tenths<std::int16_t>(frame, 0, m.current_a);
    put_big<std::int16_t>(frame.data, 2, m.speed_rpm);
    frame.data[4] = static_cast<std::uint8_t>(m.motor_c);
    return signed_off(frame, m.count);
  }

 private:
  static CanFrame byte(std::uint32_t id, std::uint8_t size, std::uint8_t value) {
    CanFrame frame = frame_of(id, size);
    frame.data[0] = value;
    return frame;
  }
  template <class T>
  static CanFrame motion(std::uint32_t id, const T& m) {
    CanFrame frame = frame_of(id, 8);
    put_big<std::int16_t>(frame.data, 0, m.forward_mmps);
    put_big<std::int16_t>(frame.data, 2, m.turn_mradps);
    put_big<std::int16_t>(frame.data, 4, m.lateral_mmps);
    put_big<std::int16_t>(frame.data, 6, m.steering_mrad);
    return frame;
  }
  template <class T>
  static CanFrame lights(std::uint32_t id, std::size_t count_at, bool on, const T& m) {
    CanFrame frame = frame_of(id, 8);
    frame.data = {
        on,    m.front.mode, m.front.custom_percent, m.rear.mode, m.rear.custom_percent, 0x00U,
        0x00U, 0x00U};
    frame.data[count_at] = m.count;
    return frame;
  }
  static CanFrame signed_off(CanFrame frame, std::uint8_t count) {
    frame.data[6] = count;
    frame.data[7] = v1_checksum(frame);
    return frame;
  }
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

CanFrame encode(const Message& message) {
  return std::visit(Encoder{}, message);
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

namespace uart {
namespace {

// Length, type, id, count; the length counts these and the data.
constexpr std::size_t kFixed = 4;

std::uint8_t sum(ByteView bytes) {
  std::uint8_t total = 0;
  for (const auto byte : bytes) total = static_cast<std::uint8_t>(total + byte);
  return total;
}

}  // namespace

Look look(ByteView front) {
  if (front[0] != 0x5A) return Look::none("no start of frame");
  if (front.size() < 2) return Look::more();
  if (front[1] != 0xA5) return Look::none("no start of frame");
  if (front.size() < 4) return Look::more();
  if (front[2] < kFixed) return Look::none("length");
  if (front[3] != 0xAA && front[3] != 0x55) return Look::none("type");
  const std::size_t size = 3U + front[2];
  if (front.size() < size) return Look::more();
  return sum(front.first(size - 1)) == front[size - 1] ? Look::frame(size) : Look::none("checksum");
}

Frame decode(ByteView frame) {
  return {frame[3] == 0xAA, frame[4], frame.subspan(5, frame[2] - kFixed), frame[frame.size() - 2]};
}

Bytes encode(const Frame& frame) {
  assert(frame.data.size() + kFixed <= 255);
  Bytes bytes{0x5A, 0xA5, static_cast<std::uint8_t>(frame.data.size() + kFixed),
              static_cast<std::uint8_t>(frame.from_base ? 0xAA : 0x55), frame.id};
  bytes.insert(bytes.end(), frame.data.begin(), frame.data.end());
  bytes.push_back(frame.count);
  bytes.push_back(sum(bytes));
  return bytes;
}

}  // namespace uart

}  // namespace drivers::agilex
