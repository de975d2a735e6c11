// A VN-100 that rides on the simulated robot.
#pragma once

#include <map>
#include <string>

#include "drivers/vn100_codec.hpp"
#include "hal/clock.hpp"
#include "sim/uart.hpp"
#include "sim/unit_faults.hpp"
#include "sim/world.hpp"

namespace sim {

struct Vn100UnitConfig {
  std::string model = "VN-100T-CR";
  std::string serial = "0100013270";
  std::string firmware = "2.1.0.0";
  int baud = 115200;
  double clock_skew = 0;                 // Its seconds per ours, less one.
  hal::Duration running_since_before{};  // Its clock at our time 0.
  std::uint16_t vpe_status = 0;
};

// Answers requests one after the other, and measures at whole multiples of its period of our time,
// so that a 50 Hz one draws of the world's noise what a mission's only IMU would. The world's only
// reader of sample_imu(). What is written to it is forgotten by restart(), as nothing is saved.
class Vn100Unit {
 public:
  // `end` is its own end of the line; all must outlive it.
  Vn100Unit(const Vn100UnitConfig& config, World& world, hal::Clock& clock, hal::ByteStream& end,
            UnitFaults& faults);

  hal::Task<void> run();
  void restart();  // As after a loss of power.

  Uart& uart() { return uart_; }
  void set_vpe_status(std::uint16_t status) { config_.vpe_status = status; }
  // The next requests that write a register are answered with this VNERR code.
  void refuse_settings(int code) { refuse_code_ = code; }

 private:
  hal::Task<void> answer_requests();
  hal::Task<void> stream();
  hal::Task<hal::Result<void>> answer(const drivers::Vn100Line& request);
  std::string reply_to(const drivers::Vn100Line& request);
  std::string write_register(const drivers::Vn100Line& request, int reg);
  drivers::Bytes measure();
  void read_registers();
  hal::Duration period() const;
  int value_of(int reg, std::size_t field, int base = 10) const;

  Vn100UnitConfig config_;
  World& world_;
  hal::Clock& clock_;
  UnitFaults& faults_;
  Uart uart_;
  FaultyStream out_;
  NoiseStream noise_;                     // Of what the world does not tell.
  std::map<int, std::string> registers_;  // As they are read: "800" or "1,16,01,0029".
  // What they say of the output.
  struct {
    bool binary{}, lines{};
    int divisor{}, lines_hz{};
    std::uint16_t common{};
  } output_;
  bool paused_ = false;
  hal::Time started_at_{};
  int refuse_code_ = 0;
};

}  // namespace sim
