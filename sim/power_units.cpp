#include "sim/power_units.hpp"

#include <algorithm>
#include <boost/system/errc.hpp>
#include <cmath>

#include "drivers/safety_map.hpp"
#include "drivers/victron_map.hpp"
#include "drivers/waveshare_map.hpp"

namespace sim {
namespace {

using Words = std::vector<std::uint16_t>;
using Bits = std::vector<bool>;
using boost::system::errc::make_error_code;
namespace errc = boost::system::errc;
namespace waveshare = drivers::waveshare;

constexpr hal::Duration kPowerLook = std::chrono::milliseconds(100);
constexpr std::uint16_t kUnknown = 0xFFFF;

boost::system::error_code no_such_address() {
  return make_error_code(errc::bad_address);
}

std::uint16_t word(double value, double scale) {  // As on the wire: raw = value * scale.
  const double raw = std::clamp(std::round(value * scale), -32768.0, 65534.0);
  return static_cast<std::uint16_t>(static_cast<std::int32_t>(raw));
}

bool within(hal::RegisterRange range, std::uint32_t first, std::uint32_t count) {
  return range.count > 0 && range.first >= first && range.first + range.count <= first + count;
}

}  // namespace

// --- Victron.

hal::Result<Words> VictronUnit::read_input(hal::RegisterRange range) {
  return read_holding(range);
}

hal::Result<Words> VictronUnit::read_holding(hal::RegisterRange range) {
  const auto all = registers();
  Words words;
  for (std::uint32_t at = range.first; at < std::uint32_t{range.first} + range.count; ++at) {
    const auto found = all.find(static_cast<std::uint16_t>(at));
    if (found == all.end()) return no_such_address();
    words.push_back(found->second);
  }
  return words;
}

std::map<std::uint16_t, std::uint16_t> VictronUnit::registers() {
  battery_.update(clock_.now());
  const double v = battery_.voltage_v(), a = -battery_.current_a();
  const auto w = static_cast<std::uint32_t>(static_cast<std::int32_t>(std::lround(v * a)));
  std::map<std::uint16_t, std::uint16_t> all{{256, static_cast<std::uint16_t>(w >> 16)},
                                             {257, static_cast<std::uint16_t>(w)},
                                             {258, word(v * a, 1)},
                                             {259, word(v * faults_.wrong_factor(), 100)},
                                             {260, kUnknown},
                                             {261, word(a, 10)},
                                             {262, word(battery_.temperature_c(), 10)},
                                             {263, kUnknown},
                                             {264, kUnknown},
                                             {265, word(-battery_.consumed_ah(), -10)},
                                             {266, word(battery_.charge_percent(), 10)},
                                             {303, word(battery_.time_to_go_s(), 0.01)},
                                             {304, word(100, 10)}};
  for (std::uint16_t at = 267; at <= 279; ++at) all[at] = 0;
  if (config_.has_bms)
    for (std::uint16_t at = 320; at <= 329; ++at) all[at] = 0;
  for (std::size_t i = 0; i < 6; ++i) {
    const auto letter = [&](std::size_t at) {
      return static_cast<unsigned>(at < config_.serial.size() ? config_.serial[at] : '\0');
    };
    all[static_cast<std::uint16_t>(800 + i)] =
        static_cast<std::uint16_t>(letter(2 * i) << 8 | letter(2 * i + 1));
  }
  for (const auto& [at, level] : alarms_)
    if (all.contains(at)) all[at] = level;
  return all;
}

// --- Waveshare.

hal::Task<void> RelayUnit::run() {
  for (;;) {
    if (faults_.is(UnitFault::off)) relays_ = {};
    co_await clock_.sleep_for(kPowerLook);
  }
}

bool RelayUnit::relay(std::size_t channel) {
  Relay& relay = relays_.at(channel);
  if (clock_.now() >= relay.turns_at) relay = {!relay.on, hal::Time::max()};
  return relay.on;
}

hal::Result<Words> RelayUnit::read_holding(hal::RegisterRange range) {
  if (within(range, waveshare::kVersion, 1)) return Words{200};
  if (!within(range, waveshare::kModes, 8)) return no_such_address();
  const auto first = modes_.begin() + (range.first - waveshare::kModes);
  return Words(first, first + range.count);
}

hal::Result<void> RelayUnit::write_register(std::uint16_t at, std::uint16_t value) {
  if (!within({at, 1}, waveshare::kModes, 8)) return no_such_address();
  if (value > 3) return make_error_code(errc::invalid_argument);
  modes_[at - waveshare::kModes] = value;
  return {};
}

hal::Result<Bits> RelayUnit::read_coils(hal::RegisterRange range) {
  if (!within(range, 0, 8)) return no_such_address();
  Bits bits;
  for (std::size_t i = range.first; i < std::size_t{range.first} + range.count; ++i)
    bits.push_back(relay(i));
  return bits;
}

hal::Result<Bits> RelayUnit::read_discrete(hal::RegisterRange range) {
  if (!within(range, 0, 8)) return no_such_address();
  Bits bits(inputs_.begin(), inputs_.end());
  if (faults_.is(UnitFault::wrong)) bits[1] = !bits[1];
  return Bits(bits.begin() + range.first, bits.begin() + range.first + range.count);
}

hal::Result<void> RelayUnit::write_coil_raw(std::uint16_t at, std::uint16_t value) {
  const hal::Time now = clock_.now();
  const auto tenths = value * std::chrono::milliseconds(100);
  if (at == 0x00FF) {
    if (value != waveshare::kOn && value != waveshare::kOff)
      return make_error_code(errc::invalid_argument);
    relays_.fill({value == waveshare::kOn, hal::Time::max()});
    return {};
  }
  const std::size_t channel = at & 0xFF;
  if (channel >= relays_.size()) return no_such_address();
  Relay& one = relays_[channel];
  if (at >> 8 == 0x02) {
    one = {true, now + tenths};
  } else if (at >> 8 == 0x04) {
    one = {false, now + tenths};
  } else if (at >> 8 != 0) {
    return no_such_address();
  } else if (value == waveshare::kToggle) {
    one = {!relay(channel), hal::Time::max()};
  } else if (value == waveshare::kOn || value == waveshare::kOff) {
    one = {value == waveshare::kOn, hal::Time::max()};
  } else {
    return make_error_code(errc::invalid_argument);
  }
  return {};
}

// --- Pilz.

hal::Result<Words> PilzUnit::read_input(hal::RegisterRange range) {
  if (within(range, drivers::safety::kPilzLeds.first, 1))
    return Words{static_cast<std::uint16_t>(lamps_ | (faults_.is(UnitFault::wrong) ? 0x0400 : 0))};
  if (!within(range, 512, 8)) return no_such_address();
  Words words(range.count, 0);  // The same outputs, sixteen a register.
  const bool free = !estop_ && !bumper_;
  if (range.first == 512)
    words[0] = static_cast<std::uint16_t>((estop_ ? 0 : 1) | (bumper_ ? 0 : 2) | (free ? 4 : 0));
  return words;
}

hal::Result<Bits> PilzUnit::read_discrete(hal::RegisterRange range) {
  if (!within(range, drivers::safety::kPilzStatus.first, 128)) return no_such_address();
  Bits bits(128, false);
  bits[0] = !estop_;
  bits[1] = !bumper_;
  bits[2] = !estop_ && !bumper_;
  const auto first = bits.begin() + (range.first - drivers::safety::kPilzStatus.first);
  return Bits(first, first + range.count);
}

hal::Result<void> PilzUnit::write_coil_raw(std::uint16_t at, std::uint16_t value) {
  if (at > 127) return no_such_address();
  if (value != 0xFF00 && value != 0) return make_error_code(errc::invalid_argument);
  return {};
}

}  // namespace sim
