#include "drivers/waveshare_map.hpp"

#include <algorithm>
#include <cassert>
#include <iterator>

namespace drivers::waveshare {
namespace {

constexpr std::uint16_t kPulseOn = 0x0200, kPulseOff = 0x0400, kAll = 0x00FF;
constexpr std::uint32_t kBauds[]{4800, 9600, 19200, 38400, 57600, 115200, 128000, 256000};
constexpr char kParities[]{'N', 'E', 'O'};

modbus::WriteOne coil(int at, std::uint16_t value) {
  return {modbus::Function::write_coil, static_cast<std::uint16_t>(at), value};
}

[[maybe_unused]] bool is_channel(int channel) {
  return channel >= 0 && channel < kChannels;
}

}  // namespace

std::optional<Channels> channels_of(const std::vector<bool>& bits) {
  if (bits.size() != kChannels) return std::nullopt;
  Channels channels;
  for (std::size_t i = 0; i < kChannels; ++i) channels[i] = bits[i];
  return channels;
}

modbus::WriteOne set_relay(int channel, std::uint16_t on_off_toggle) {
  assert(is_channel(channel));
  return coil(channel, on_off_toggle);
}

modbus::WriteOne set_all(bool on) {
  return coil(kAll, on ? kOn : kOff);
}

modbus::WriteBits set_relays(Channels on) {
  modbus::WriteBits write{0, std::vector<bool>(kChannels)};
  for (std::size_t i = 0; i < kChannels; ++i) write.bits[i] = on[i];
  return write;
}

modbus::WriteOne pulse_on(int channel, std::uint16_t tenths) {
  assert(is_channel(channel) && tenths >= 1 && tenths <= 0x7FFF);
  return coil(kPulseOn + channel, tenths);
}

modbus::WriteOne pulse_off(int channel, std::uint16_t tenths) {
  assert(is_channel(channel) && tenths >= 1 && tenths <= 0x7FFF);
  return coil(kPulseOff + channel, tenths);
}

double version_of(std::uint16_t value) {
  return value / 100.0;
}

std::optional<ChannelMode> mode_of(std::uint16_t value) {
  if (value > 3) return std::nullopt;
  return ChannelMode{static_cast<std::uint8_t>(value)};
}

std::optional<std::uint16_t> serial_word(Serial serial) {
  const auto* baud = std::find(std::begin(kBauds), std::end(kBauds), serial.baud);
  const auto* parity = std::find(std::begin(kParities), std::end(kParities), serial.parity);
  if (baud == std::end(kBauds) || parity == std::end(kParities)) return std::nullopt;
  return static_cast<std::uint16_t>((parity - kParities) << 8 | (baud - kBauds));
}

std::optional<Serial> serial_of(std::uint16_t word) {
  const std::size_t parity = word >> 8, baud = word & 0xFF;
  if (parity >= std::size(kParities) || baud >= std::size(kBauds)) return std::nullopt;
  return Serial{kBauds[baud], kParities[parity]};
}

}  // namespace drivers::waveshare
