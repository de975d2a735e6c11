// An AgileX base on a CAN bus: reports at a Scout 2.0's rates, obeys as its manual says.
#pragma once

#include <cstdint>

#include "drivers/agilex_codec.hpp"
#include "hal/clock.hpp"
#include "hal/links.hpp"
#include "sim/battery.hpp"
#include "sim/unit_faults.hpp"
#include "sim/world.hpp"

namespace sim {

// Switched off (UnitFault::off) it forgets its odometry and who commanded it. Against something its
// wheels stall: they stand, the currents rise, and after 300 ms the motor drivers say so. `wrong`
// falsifies its odometry but not its speed.
class AgilexUnit {
 public:
  struct Config {
    drivers::agilex::Dialect dialect = drivers::agilex::Dialect::v2;
    drivers::agilex::Limits limits = drivers::agilex::kScout2;
    drivers::agilex::Version version{0x0100, 0x0100, 0x0203, 0x0105};
    std::uint8_t motors = 4;
    hal::Duration motor_slow_period = std::chrono::milliseconds(20);  // A Tracer's: 100 ms.
    double wheel_radius_m = 0.165;
    std::int32_t odometry_mm = 0;  // Both counters at the start.
    bool stops_by_itself = true;   // 500 ms after the last command; false: a defective base.
  };

  // The battery may be null: then 26.4 V for ever.
  AgilexUnit(const Config& config, World& world, Battery* battery, hal::Clock& clock,
             hal::CanBus& bus, UnitFaults& faults);

  hal::Task<void> run();  // Ends only by cancellation.

  // What a person or fate does to it.
  void press_estop(bool pressed);
  void switch_transmitter(bool commands);
  void set_exception(bool exception) { exception_ = exception; }
  void set_stops_by_itself(bool stops) { stops_by_itself_ = stops; }
  void set_fault_bits(std::uint16_t system, std::uint8_t motor) {
    fault_bits_ = system;
    motor_bits_ = motor;
  }

 private:
  hal::Task<void> listen();
  hal::Task<void> report();
  void hear(const hal::CanFrame& frame);
  void obey(const drivers::agilex::MotionCommand& command);
  void stop();
  void restart();
  void roll(hal::Time now);
  hal::Task<void> report_fast();
  hal::Task<void> report_slow(std::int64_t cycle);
  hal::Task<void> report_v1();
  hal::Task<hal::Result<void>> send(const drivers::agilex::Message& message);
  drivers::agilex::VehicleState vehicle() const;
  bool stalled() const;  // For long enough to be told.
  double battery_v() const;
  double motor_current_a(double side_mps) const;

  const Config config_;
  World& world_;
  Battery* battery_;
  hal::Clock& clock_;
  UnitFaults& faults_;
  FaultyCan bus_;

  drivers::agilex::ControlMode mode_ = drivers::agilex::ControlMode::standby;
  bool estop_ = false, exception_ = false;
  std::uint16_t fault_bits_ = 0;
  std::uint8_t motor_bits_ = 0, count_ = 0;
  bool was_off_ = false, stops_by_itself_;
  double left_mm_, right_mm_;
  hal::Twist obeyed_;
  hal::Time commanded_at_{}, stalled_at_ = hal::Time::max();
};

}  // namespace sim
