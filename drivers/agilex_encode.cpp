#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "drivers/agilex_codec.hpp"

namespace drivers::agilex {
namespace {

using hal::CanFrame;

template <class T>
void put_tenths(CanFrame& frame, std::size_t at, double value) {
  const double raw = std::isnan(value) ? 0 : std::round(value * 10);
  put_big<T>(frame.data, at,
             static_cast<T>(std::clamp<double>(raw, std::numeric_limits<T>::min(),
                                               std::numeric_limits<T>::max())));
}

CanFrame frame_of(std::uint32_t id, std::uint8_t size) {
  CanFrame frame;
  frame.id = id;
  frame.size = size;
  return frame;
}

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

}  // namespace

CanFrame encode(const Message& message) {
  return std::visit(Encoder{}, message);
}

}  // namespace drivers::agilex
