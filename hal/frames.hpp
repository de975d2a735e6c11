// What links carry, without the waiting: for pure code.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>

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

// Which frames are wanted.
struct CanFilter {
  std::uint32_t id{}, mask{};  // Passes where (id ^ its id) & mask is 0.
  bool extended{};

  constexpr bool passes(const CanFrame& frame) const {
    return extended == frame.extended && ((frame.id ^ id) & mask) == 0;
  }
};

// What passes any of the filters; all when there is none.
constexpr bool passes(std::span<const CanFilter> filters, const CanFrame& frame) {
  return filters.empty() || std::any_of(filters.begin(), filters.end(),
                                        [&](const CanFilter& one) { return one.passes(frame); });
}

// Registers or coils of a Modbus unit.
struct RegisterRange {
  std::uint16_t first{};
  std::uint16_t count{};
};

}  // namespace hal
