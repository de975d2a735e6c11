// Simulated Modbus units on a stream: for clients that speak the wire.
#pragma once

#include <functional>

#include "hal/clock.hpp"
#include "hal/links.hpp"
#include "sim/register_unit.hpp"

namespace sim {

enum class ModbusWire : std::uint8_t { tcp, rtu };

// Null: nobody has that number, and nobody answers.
using UnitOfNumber = std::function<RegisterUnit*(std::uint8_t)>;

// Answers one request after the other until cancelled, with what is wrong with each unit (see
// RegisterUnit::faults()). Damaged requests are passed over. The stream and all units must outlive
// it.
hal::Task<void> serve_modbus(hal::ByteStream& stream, ModbusWire wire, hal::Clock& clock,
                             UnitOfNumber unit_of);

}  // namespace sim
