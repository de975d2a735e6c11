#include "drivers/victron_map.hpp"

#include <algorithm>

namespace drivers::victron {
namespace {

using Range = hal::RegisterRange;

constexpr Range kSystemRanges[] = {{840, 7}};
constexpr Range kBatteryRanges[] = {{256, 11}, {267, 13}, {303, 2}, {320, 10}};

constexpr Register kSystem[] = {
    {"voltage_v", 840, Type::u16, 10},      {"current_a", 841, Type::s16, 10},
    {"power_w", 842, Type::s16, 1},         {"charge_percent", 843, Type::u16, 1},
    {"state", 844, Type::u16, 1},           {"consumed_ah", 845, Type::u16, -10},
    {"time_to_go_s", 846, Type::u16, 0.01},
};

constexpr Register kBattery[] = {
    {"power_w", 256, Type::s32, 1},
    {"voltage_v", 259, Type::u16, 100},
    {"starter_voltage_v", 260, Type::u16, 100},
    {"current_a", 261, Type::s16, 10},
    {"temperature_c", 262, Type::s16, 10},
    {"mid_voltage_v", 263, Type::u16, 100},
    {"mid_deviation_percent", 264, Type::u16, 100},
    {"consumed_ah", 265, Type::u16, -10},
    {"charge_percent", 266, Type::u16, 10},
    {"time_to_go_s", 303, Type::u16, 0.01},
    {"health_percent", 304, Type::u16, 10},
};

constexpr Fault kAlarms[] = {
    {267, "battery alarm", "one of the others", "see the others"},
    {268, "battery voltage low", "discharged or a bad cell", "end the survey; charge"},
    {269, "battery voltage high", "wrong charger", "unplug the charger; check its voltage"},
    {272, "battery charge low", "discharged", "end the survey; charge"},
    {273, "battery too cold", "frost", "warm it before charging"},
    {274, "battery too hot", "overload or sun", "stop; let it cool"},
    {275, "battery halves differ", "a weak cell", "have the battery checked"},
    {278, "battery fuse blown", "short circuit or overload", "find the cause; replace the fuse"},
    {279, "battery monitor too hot", "overload", "stop; let it cool"},
    {320, "charge current high", "wrong charger", "check the charger"},
    {321, "discharge current high", "overload or a blocked wheel", "stop; find the load"},
    {322, "cells out of balance", "a weak cell", "charge fully; have it checked"},
    {323, "battery internal failure", "the battery's own electronics", "do not drive; service"},
    {324, "too hot to charge", "charging after a hard drive", "let it cool before charging"},
    {325, "too cold to charge", "frost", "warm it before charging"},
    {326, "cell voltage low", "discharged or a bad cell", "end the survey; charge"},
    {327, "battery CAN cable", "loose or broken", "check the cable to the battery"},
    {328, "battery contactor", "stuck or driven open", "do not drive; service"},
};

std::optional<std::uint16_t> word_at(std::span<const std::uint16_t> image, std::uint16_t first,
                                     std::uint16_t at) {
  if (at < first || std::size_t{at} - first >= image.size()) return std::nullopt;
  return image[std::size_t{at} - first];
}

std::optional<double> named(std::span<const Register> registers, std::string_view name,
                            std::span<const std::uint16_t> image, std::uint16_t first) {
  const auto found = std::find_if(registers.begin(), registers.end(),
                                  [&](const Register& reg) { return reg.name == name; });
  return value_of(*found, image, first);
}

}  // namespace

std::optional<double> value_of(const Register& reg, std::span<const std::uint16_t> image,
                               std::uint16_t image_first) {
  const auto high = word_at(image, image_first, reg.at);
  if (!high) return std::nullopt;
  double raw = *high;
  if (reg.type == Type::u16 && *high == 0xFFFF) return std::nullopt;
  if (reg.type == Type::s16) {
    if (*high == 0x7FFF) return std::nullopt;
    raw = static_cast<std::int16_t>(*high);
  }
  if (reg.type == Type::s32) {
    const auto low = word_at(image, image_first, static_cast<std::uint16_t>(reg.at + 1));
    if (!low) return std::nullopt;
    const auto whole = std::uint32_t{*high} << 16 | *low;
    if (whole == 0x7FFFFFFF) return std::nullopt;
    raw = static_cast<std::int32_t>(whole);
  }
  return raw == 0 ? 0 : raw / reg.scale;
}

std::span<const Range> system_ranges() {
  return kSystemRanges;
}
std::span<const Range> battery_ranges() {
  return kBatteryRanges;
}
std::span<const Register> system_registers() {
  return kSystem;
}
std::span<const Register> battery_registers() {
  return kBattery;
}

System system_of(std::span<const std::uint16_t> image, std::uint16_t image_first) {
  const auto value = [&](std::string_view name) {
    return named(kSystem, name, image, image_first);
  };
  System system{value("voltage_v"),      value("current_a"), value("power_w"),
                value("charge_percent"), std::nullopt,       value("consumed_ah"),
                value("time_to_go_s")};
  const auto state = value("state");
  if (state && *state <= 2) system.state = ChargeState{static_cast<std::uint8_t>(*state)};
  return system;
}

void take(Battery& battery, std::span<const std::uint16_t> image, std::uint16_t image_first) {
  const auto value = [&](std::optional<double>& to, std::string_view name) {
    const auto found = std::find_if(std::begin(kBattery), std::end(kBattery),
                                    [&](const Register& reg) { return reg.name == name; });
    if (word_at(image, image_first, found->at)) to = value_of(*found, image, image_first);
  };
  value(battery.voltage_v, "voltage_v");
  value(battery.current_a, "current_a");
  value(battery.power_w, "power_w");
  value(battery.charge_percent, "charge_percent");
  value(battery.temperature_c, "temperature_c");
  value(battery.consumed_ah, "consumed_ah");
  value(battery.time_to_go_s, "time_to_go_s");
}

std::vector<Alarm> alarms_in(std::span<const std::uint16_t> image, std::uint16_t image_first) {
  std::vector<Alarm> alarms;
  for (const Fault& fault : kAlarms) {
    const auto word = word_at(image, image_first, static_cast<std::uint16_t>(fault.value));
    if (word == 1 || word == 2) alarms.push_back({&fault, word == 2});
  }
  return alarms;
}

}  // namespace drivers::victron
