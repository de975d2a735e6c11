// libmodbus as one function that blocks: for the thread of a ModbusBus.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "drivers/modbus_client.hpp"
#include "drivers/modbus_frames.hpp"

struct _modbus;

namespace drivers {

struct ModbusRequest {
  std::uint8_t unit{};
  modbus::Function function{};
  std::uint16_t at{};
  std::uint16_t count_or_value{};
};

struct ModbusOutcome {
  boost::system::error_code error;
  std::vector<std::uint16_t> words;  // Of the functions that read registers.
  std::vector<bool> bits;            // Of those that read bits.
  std::optional<Trouble> trouble;    // Present where there is an error.
};

class ModbusLine {
 public:
  ModbusLine(ModbusBus::Address address, const hal::Clock& clock, ModbusBus::Config config);
  ~ModbusLine();

  // Blocks up to the reply time-out, twice that when it has to connect.
  ModbusOutcome perform(const ModbusRequest& request);

 private:
  struct Close {
    void operator()(_modbus* context);
    bool locked;  // Its serial port, for us alone. At first not: it is value-initialised.
  };

  // errno, or 0.
  int connect();
  int make_context();
  int prepare_port();
  int exchange(const ModbusRequest& request, ModbusOutcome& outcome);
  int write_any_coil(const ModbusRequest& request);
  ModbusOutcome failed(int error, const ModbusRequest& request);

  ModbusBus::Address address_;
  const hal::Clock& clock_;
  ModbusBus::Config config_;
  std::unique_ptr<_modbus, Close> context_;  // Null while not connected.
  hal::Time connect_again_{};
  hal::Duration pause_{};
  int connect_error_{};
};

}  // namespace drivers
