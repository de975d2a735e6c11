// What links carry, without the waiting: for pure code.
#pragma once

#include <array>
#include <cstdint>

namespace hal {

// One classical CAN data or remote frame.
struct CanFrame {
  std::uint32_t id{};  // 11 bits, or 29 where extended.
  std::uint8_t size{};
  std::array<std::uint8_t, 8> data{};
  bool extended{};
  bool remote{};  // Asks for the frame of this id; has no data.

  bool operator==(const CanFrame&) const = default;
};

// Registers or coils of a Modbus unit.
struct RegisterRange {
  std::uint16_t first{};
  std::uint16_t count{};
};

}  // namespace hal
