// A simulated Modbus unit from the inside: what it answers.
#pragma once

#include <cstdint>
#include <vector>

#include "hal/frames.hpp"
#include "hal/values.hpp"

namespace sim {

class UnitFaults;

// Whatever is not overridden is refused as an unknown function. An error of
// drivers/modbus_errors.hpp is answered as that exception.
class RegisterUnit {
 public:
  virtual ~RegisterUnit() = default;

  virtual hal::Result<std::vector<std::uint16_t>> read_input(hal::RegisterRange range);
  virtual hal::Result<std::vector<std::uint16_t>> read_holding(hal::RegisterRange range);
  virtual hal::Result<std::vector<bool>> read_coils(hal::RegisterRange range);
  virtual hal::Result<std::vector<bool>> read_discrete(hal::RegisterRange range);
  virtual hal::Result<void> write_register(std::uint16_t at, std::uint16_t value);
  virtual hal::Result<void> write_coil_raw(std::uint16_t at, std::uint16_t value);

  // Whoever carries the answers brings about what is wrong with the unit, but for wrong values:
  // these are the unit's own affair. Null: it is always well.
  virtual UnitFaults* faults() { return nullptr; }
};

}  // namespace sim
