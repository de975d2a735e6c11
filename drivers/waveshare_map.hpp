// Waveshare Modbus RTU Relay (D): 8 relays, 8 inputs. Requests and register images <-> values.
// Pure.
#pragma once

#include <bitset>
#include <cstdint>
#include <optional>
#include <vector>

#include "drivers/modbus_frames.hpp"
#include "hal/frames.hpp"

namespace drivers::waveshare {

constexpr int kChannels = 8;
constexpr hal::RegisterRange kRelays{0, kChannels};  // Coils.
constexpr hal::RegisterRange kInputs{0, kChannels};  // Discrete inputs.
constexpr std::uint16_t kVersion = 0x8000;           // Holding register: 200 is 2.00.
constexpr std::uint16_t kModes = 0x1000;             // Holding registers, one per channel.
constexpr std::uint16_t kOn = 0xFF00, kOff = 0x0000, kToggle = 0x5500;  // Of a coil.

enum class ChannelMode : std::uint8_t { normal = 0, linked = 1, toggles = 2, edge = 3 };

using Channels = std::bitset<kChannels>;

// Nothing for a reply that has not exactly the eight channels.
std::optional<Channels> channels_of(const std::vector<bool>& bits);

modbus::WriteOne set_relay(int channel, std::uint16_t on_off_toggle);
modbus::WriteOne set_all(bool on);
modbus::WriteBits set_relays(Channels on);
// On for tenths * 0.1 s, then off by itself: repeated, it is a dead man's switch, because relays
// hold their state when the bus dies. tenths: 1 to 0x7FFF.
modbus::WriteOne pulse_on(int channel, std::uint16_t tenths);
modbus::WriteOne pulse_off(int channel, std::uint16_t tenths);

double version_of(std::uint16_t value);
std::optional<ChannelMode> mode_of(std::uint16_t value);

// Register 0x2000 at unit 0.
struct Serial {
  std::uint32_t baud{};
  char parity = 'N';  // 'N', 'E' or 'O'.
  bool operator==(const Serial&) const = default;
};
std::optional<std::uint16_t> serial_word(Serial serial);  // Nothing for rates it does not have.
std::optional<Serial> serial_of(std::uint16_t word);

}  // namespace drivers::waveshare
