#include "drivers/agilex_codec.hpp"
#include "drivers/can_offline.hpp"
#include "drivers/offline_can.hpp"

namespace drivers {
namespace {

using namespace agilex;

std::string_view name(VehicleState state) {
  static constexpr std::string_view kNames[]{"normal", "e-stop pressed", "exception"};
  return kNames[static_cast<std::size_t>(state)];
}
std::string_view name(ControlMode mode) {
  static constexpr std::string_view kNames[]{"standby", "CAN", "UART", "remote control"};
  return kNames[static_cast<std::size_t>(mode)];
}
std::string_view name(Switch position) {
  static constexpr std::string_view kNames[]{"unknown", "middle", "up", "down"};
  return kNames[static_cast<std::size_t>(position)];
}

// Fills a message with the values of one struct. Returns its name.
struct Describe {
  Fields& fields;

  std::string_view operator()(const Unread&) const { return {}; }
  std::string_view operator()(const MotionCommand& m) const { return motion(m, "motion command"); }
  std::string_view operator()(const MotionState& m) const { return motion(m, "motion state"); }
  std::string_view operator()(const LightCommand& m) const {
    return lights(m.enable, m, "light command");
  }
  std::string_view operator()(const LightState& m) const {
    return lights(m.enabled, m, "light state");
  }
  std::string_view operator()(const V1LightCommand& m) const {
    return lights(m.enable, m, "light command, version 1");
  }
  std::string_view operator()(const V1LightState& m) const {
    return lights(m.enabled, m, "light state, version 1");
  }
  std::string_view operator()(const BrakeCommand& m) const {
    fields.add("brake", m.brake).add("count", m.count);
    return "brake command";
  }
  std::string_view operator()(const MotionModeCommand& m) const {
    fields.add("mode", m.mode);
    return "motion mode command";
  }
  std::string_view operator()(const ControlModeCommand& m) const {
    fields.add("mode", name(m.mode));
    return "control mode command";
  }
  std::string_view operator()(const ResetCommand& m) const {
    fields.add("motor", m.motor);
    return "fault reset";
  }
  std::string_view operator()(const VersionQuery&) const { return "version query"; }
  std::string_view operator()(const SystemState& m) const {
    fields.add("vehicle", name(m.vehicle)).add("mode", name(m.mode));
    fields.add("battery_v", m.battery_v).add("fault_bits", m.fault_bits).add("count", m.count);
    fields.faults(faults_set(system_faults(), m.fault_bits));
    return "system state";
  }
  std::string_view operator()(const RcState& m) const {
    static constexpr const char* kSwitches[]{"switch_a", "switch_b", "switch_c", "switch_d"};
    for (std::size_t i = 0; i < 4; ++i) fields.add(kSwitches[i], name(m.switches[i]));
    fields.add("right_horizontal_percent", m.right_horizontal);
    fields.add("right_vertical_percent", m.right_vertical);
    fields.add("left_vertical_percent", m.left_vertical);
    fields.add("left_horizontal_percent", m.left_horizontal);
    fields.add("knob_percent", m.knob).add("count", m.count);
    return "remote control";
  }
  std::string_view operator()(const MotorFast& m) const {
    fields.add("motor", m.motor).add("speed_rpm", m.speed_rpm).add("current_a", m.current_a);
    fields.add("position_pulses", m.position_pulses);
    return "motor, fast";
  }
  std::string_view operator()(const MotorSlow& m) const {
    fields.add("motor", m.motor).add("driver_v", m.driver_v).add("driver_c", m.driver_c);
    fields.add("motor_c", m.motor_c).add("fault_bits", m.fault_bits);
    fields.faults(faults_set(motor_faults(), m.fault_bits));
    return "motor, slow";
  }
  std::string_view operator()(const Odometry& m) const {
    fields.add("left_mm", m.left_mm).add("right_mm", m.right_mm);
    return "odometry";
  }
  std::string_view operator()(const BatteryBasic& m) const {
    fields.add("charge_percent", m.charge_percent).add("health_percent", m.health_percent);
    fields.add("voltage_v", m.voltage_v).add("current_a", m.current_a);
    fields.add("temperature_c", m.temperature_c);
    return "battery";
  }
  std::string_view operator()(const BatteryExtended& m) const {
    fields.add("alarms", m.alarms).add("warnings", m.warnings);
    return "battery alarms";
  }
  std::string_view operator()(const Version& m) const {
    const auto dotted = [](std::uint16_t word) {
      return std::to_string(word >> 8) + "." + std::to_string(word & 0xFF);
    };
    fields.add("board_hardware", dotted(m.board_hardware));
    fields.add("driver_hardware", dotted(m.driver_hardware));
    fields.add("board_software", dotted(m.board_software));
    fields.add("driver_software", dotted(m.driver_software));
    return "version";
  }
  std::string_view operator()(const V1Command& m) const {
    fields.add("mode", m.mode).add("fault_clear", m.fault_clear);
    fields.add("forward_percent", m.forward_percent).add("turn_percent", m.turn_percent);
    fields.add("lateral_percent", m.lateral_percent).add("count", m.count);
    return "command, version 1";
  }
  std::string_view operator()(const V1Motion& m) const {
    fields.add("forward_mmps", m.forward_mmps).add("turn_mradps", m.turn_mradps);
    fields.add("count", m.count);
    return "motion state, version 1";
  }
  std::string_view operator()(const V1State& m) const {
    fields.add("vehicle", name(m.vehicle)).add("mode", m.mode).add("battery_v", m.battery_v);
    fields.add("fault_bits", m.fault_bits).add("count", m.count);
    fields.faults(faults_set(v1_faults(), m.fault_bits));
    return "system state, version 1";
  }
  std::string_view operator()(const V1Motor& m) const {
    fields.add("motor", m.motor).add("current_a", m.current_a).add("speed_rpm", m.speed_rpm);
    fields.add("motor_c", m.motor_c).add("count", m.count);
    return "motor, version 1";
  }

 private:
  template <class T>
  std::string_view motion(const T& m, std::string_view named) const {
    fields.add("forward_mmps", m.forward_mmps).add("turn_mradps", m.turn_mradps);
    fields.add("lateral_mmps", m.lateral_mmps).add("steering_mrad", m.steering_mrad);
    return named;
  }
  template <class T>
  std::string_view lights(bool on, const T& m, std::string_view named) const {
    fields.add("enabled", on).add("front_mode", m.front.mode);
    fields.add("front_percent", m.front.custom_percent).add("rear_mode", m.rear.mode);
    fields.add("rear_percent", m.rear.custom_percent).add("count", m.count);
    return named;
  }
};

class Offline : public OfflineDecoder {
 public:
  void feed(const Captured& captured, const std::function<void(drivers::Message)>& out) override {
    const auto frame = can_frame(captured);
    if (!frame) return skip(skipped_, "length", captured.bytes.size());
    // Two ids are in both dialects: there, what was seen before decides.
    const bool shared = frame->id == 0x131 || frame->id == 0x141;
    if (const auto seen = dialect_of(*frame); seen && !(shared && dialect_)) dialect_ = seen;
    const agilex::Message read = decode(*frame, dialect_.value_or(Dialect::v2));
    if (const auto* unread = std::get_if<Unread>(&read))
      return skip(skipped_, unread->why, captured.bytes.size());
    drivers::Message message{"", captured.t_s, from_base(read), {}};
    Fields fields(message);
    message.name = std::visit(Describe{fields}, read);
    out(std::move(message));
  }
  SkippedBy skipped() const override { return skipped_; }

 private:
  std::optional<Dialect> dialect_;
  SkippedBy skipped_;
};

}  // namespace

std::unique_ptr<OfflineDecoder> agilex_offline() {
  return std::make_unique<Offline>();
}

}  // namespace drivers
