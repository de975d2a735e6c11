// A FLIR PTU that answers in its ASCII language and turns in the simulated world.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "drivers/ptu_codec.hpp"
#include "hal/clock.hpp"
#include "hal/links.hpp"
#include "sim/pan_motion.hpp"
#include "sim/pan_truth.hpp"
#include "sim/unit_faults.hpp"

namespace sim {

struct FlirPtuUnitConfig {
  double arcsec_per_step = 46.2857;                   // Of an E46-70 in half steps.
  bool counter_clockwise{};                           // Whether positive positions turn that way.
  double angle_max_rad = 159 * 0.017453292519943295;  // To both sides.
  double speed_max_radps = 60 * 0.017453292519943295;
  double acceleration_radps2 = 25 * 0.017453292519943295;       // At power-up.
  hal::Duration latency = std::chrono::milliseconds(2);         // From a request to its answer,
  hal::Duration latency_jitter = std::chrono::milliseconds(8);  // and how much later sometimes.
  hal::Duration position_age{};                                 // Of what it tells of a motion.
  hal::Duration reset_time = std::chrono::seconds(12);          // At power-up, without answers.
  std::string version = "Pan-Tilt Controller v3.02.2 (E46-70), (C)2014 FLIR";
  std::uint64_t seed = 1;
};

// Factory settings (echo, verbose) at the start and when power comes back after `off`, and then a
// reset. `wrong` tells positions that are off by that factor; `slow` also turns more slowly.
class FlirPtuUnit final : public PanTruth {
 public:
  FlirPtuUnit(FlirPtuUnitConfig config, hal::Clock& clock, hal::ByteStream& link,
              UnitFaults& faults);
  ~FlirPtuUnit() override;

  hal::Task<void> run();

  double angle_rad(hal::Time time) const override;
  std::uint64_t changes() const override { return changes_; }

  // Something holds the head: the motor goes on counting steps and the head stays behind by so
  // many. A reset finds the zero again.
  void lose_steps(std::int64_t steps);
  void set_temperature_f(int temperature_f) { temperature_f_ = temperature_f; }

 private:
  struct Request {
    std::string name;  // In capitals.
    std::optional<std::int64_t> value;
  };
  struct Answered {
    std::string text;  // With "*" or "!".
    hal::Duration after{};
  };
  using Handler = Answered (FlirPtuUnit::*)(const Request&);
  struct Known;
  static const Known kKnown[];

  hal::Task<void> answer(const std::string& text);
  Answered reply(const Request& request);
  Answered number(std::int64_t value, std::string_view words) const;
  std::optional<Request> parse(std::string_view text) const;
  void restart();
  void look_at_power();

  Answered position(const Request& request);
  Answered offset(const Request& request);
  Answered speed(const Request& request);
  Answered current_speed(const Request& request);
  Answered acceleration(const Request& request);
  Answered limit(const Request& request);
  Answered resolution(const Request& request);
  Answered tilt(const Request& request);
  Answered talk(const Request& request);
  Answered halt(const Request& request);
  Answered await(const Request& request);
  Answered reset(const Request& request);
  Answered tell_health(const Request& request);
  Answered tell_version(const Request& request);

  Answered go(std::int64_t steps);
  void plan(std::int64_t target);
  std::int64_t steps_max() const;
  double step_rad() const;

  const FlirPtuUnitConfig config_;
  hal::Clock& clock_;
  UnitFaults& faults_;
  FaultyStream link_;
  Dice dice_;

  PanMotion motion_;  // In steps, of the motor.
  std::int64_t head_offset_{};
  std::uint64_t changes_{};
  std::int64_t speed_{}, acceleration_{}, target_{};
  bool echo_ = true, verbose_ = true, off_{};
  std::string half_;  // Of a request.
  hal::Time ready_{};
  int temperature_f_ = 95;
};

}  // namespace sim
