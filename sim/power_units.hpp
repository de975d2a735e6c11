// The Modbus units of a robot's supply and safety: battery monitor, relay board, safety controller.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <set>
#include <string>

#include "hal/clock.hpp"
#include "sim/battery.hpp"
#include "sim/register_unit.hpp"
#include "sim/unit_faults.hpp"

namespace sim {

// A battery service behind a Cerbo GX, and the gateway's own service in one: registers 800 and on,
// 256 and on. A read across a register that it does not have is refused as a whole. `wrong`
// falsifies the voltage, but not the power.
class VictronUnit final : public RegisterUnit {
 public:
  struct Config {
    std::string serial = "HQ2024SIM000";  // Twelve letters at most.
    bool has_bms = false;                 // A CAN battery has registers 320 to 329.
  };
  VictronUnit(const Config& config, Battery& battery, hal::Clock& clock, UnitFaults& faults)
      : config_(config), battery_(battery), clock_(clock), faults_(faults) {}

  hal::Result<std::vector<std::uint16_t>> read_input(hal::RegisterRange range) override;
  hal::Result<std::vector<std::uint16_t>> read_holding(hal::RegisterRange range) override;
  UnitFaults* faults() override { return &faults_; }

  void set_alarm(std::uint16_t at, std::uint16_t level) { alarms_[at] = level; }

 private:
  std::map<std::uint16_t, std::uint16_t> registers();

  const Config config_;
  Battery& battery_;
  hal::Clock& clock_;
  UnitFaults& faults_;
  std::map<std::uint16_t, std::uint16_t> alarms_;
};

// A Waveshare Modbus RTU Relay (D): eight relays, eight inputs. On its inputs hang a safety relay's
// two contacts (0 closed, 1 open while released), and the reset button (2). Loses its relays' state
// with its power. `wrong` turns input 1 round.
class RelayUnit final : public RegisterUnit {
 public:
  RelayUnit(hal::Clock& clock, UnitFaults& faults) : clock_(clock), faults_(faults) {}

  hal::Task<void> run();  // Watches its power; ends only by cancellation.

  hal::Result<std::vector<std::uint16_t>> read_holding(hal::RegisterRange range) override;
  hal::Result<std::vector<bool>> read_coils(hal::RegisterRange range) override;
  hal::Result<std::vector<bool>> read_discrete(hal::RegisterRange range) override;
  hal::Result<void> write_register(std::uint16_t at, std::uint16_t value) override;
  hal::Result<void> write_coil_raw(std::uint16_t at, std::uint16_t value) override;
  UnitFaults* faults() override { return &faults_; }

  void press_estop(bool pressed) { inputs_[0] = !pressed, inputs_[1] = pressed; }
  void press_reset(bool pressed) { inputs_[2] = pressed; }
  void set_input(std::size_t channel, bool closed) { inputs_.at(channel) = closed; }
  void set_mode(std::size_t channel, std::uint16_t mode) { modes_.at(channel) = mode; }
  bool relay(std::size_t channel);

 private:
  hal::Clock& clock_;
  UnitFaults& faults_;
  std::array<bool, 8> inputs_{true};
  struct Relay {
    bool on = false;
    hal::Time turns_at = hal::Time::max();  // The end of a pulse.
  };
  std::array<Relay, 8> relays_{};
  std::array<std::uint16_t, 8> modes_{};
};

// A Pilz PNOZmulti 2 whose outputs o0 to o2 are e-stop released, bumper free, drives enabled.
// `wrong` puts its fault lamp on.
class PilzUnit final : public RegisterUnit {
 public:
  explicit PilzUnit(UnitFaults& faults) : faults_(faults) {}

  hal::Result<std::vector<std::uint16_t>> read_input(hal::RegisterRange range) override;
  hal::Result<std::vector<bool>> read_discrete(hal::RegisterRange range) override;
  hal::Result<void> write_coil_raw(std::uint16_t at, std::uint16_t value) override;
  UnitFaults* faults() override { return &faults_; }

  void press_estop(bool pressed) { estop_ = pressed; }
  void press_bumper(bool pressed) { bumper_ = pressed; }
  void set_lamps(std::uint16_t lamps) { lamps_ = lamps; }

 private:
  UnitFaults& faults_;
  bool estop_ = false, bumper_ = false;
  std::uint16_t lamps_ = 0x1000;  // RUN.
};

}  // namespace sim
