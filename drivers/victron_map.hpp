// Victron battery monitors behind a Cerbo GX (Modbus TCP): registers -> values. Pure.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "drivers/fault.hpp"
#include "hal/frames.hpp"

namespace drivers::victron {

// Units of the gateway.
constexpr std::uint8_t kSystemUnit = 100, kCanBatteryUnit = 225;

enum class Type : std::uint8_t { u16, s16, s32 };

// One value in the registers: raw / scale. A negative scale turns the sign, as Victron lists it.
struct Register {
  std::string_view name;  // With its unit: "voltage_v".
  std::uint16_t at{};
  Type type{};
  double scale = 1;
};

// What the device says it does not know (0xFFFF, 0x7FFF, 0x7FFFFFFF) is nothing, as is a register
// that is not in the image.
std::optional<double> value_of(const Register& reg, std::span<const std::uint16_t> image,
                               std::uint16_t image_first);

// Ranges to read: a read across a register that the service does not have is refused as a whole.
std::span<const hal::RegisterRange> system_ranges();
std::span<const hal::RegisterRange> battery_ranges();
// The registers in them.
std::span<const Register> system_registers();
std::span<const Register> battery_registers();

enum class ChargeState : std::uint8_t { idle = 0, charging = 1, discharging = 2 };

struct System {                                                         // Unit 100.
  std::optional<double> voltage_v, current_a, power_w, charge_percent;  // Current: + is charging.
  std::optional<ChargeState> state;
  std::optional<double> consumed_ah;  // 0 when full, negative below.
  std::optional<double> time_to_go_s;
  bool operator==(const System&) const = default;
};
System system_of(std::span<const std::uint16_t> image, std::uint16_t image_first);

struct Battery {  // A battery service.
  std::optional<double> voltage_v, current_a, power_w, charge_percent, temperature_c, consumed_ah,
      time_to_go_s;
  bool operator==(const Battery&) const = default;
};
// Takes what the image holds of the battery's values into `battery`, leaves the others.
void take(Battery& battery, std::span<const std::uint16_t> image, std::uint16_t image_first);

struct Alarm {
  const Fault* fault{};  // Its value is the register.
  bool severe{};         // Else a warning.
};
// The alarms that are set in the image.
std::vector<Alarm> alarms_in(std::span<const std::uint16_t> image, std::uint16_t image_first);

}  // namespace drivers::victron
