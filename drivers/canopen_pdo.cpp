#include "drivers/canopen_pdo.hpp"

#include <cassert>

namespace drivers::canopen {
namespace {

constexpr std::uint32_t kOff = 1U << 31;  // Of a PDO's COB-ID.
constexpr std::uint32_t kAll = 0xFFFFFFFF;
constexpr std::uint32_t kCobIdMask = kOff | 0x7FF;  // Drives set bits 29 and 30 as they like.

std::uint64_t mask_of(unsigned bits) {
  return bits >= 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << bits) - 1;
}

unsigned bits_of(std::span<const Mapped> mapping) {
  unsigned bits = 0;
  for (const Mapped& entry : mapping) bits += entry.bits;
  return bits;
}

}  // namespace

bool is_valid(std::span<const Mapped> mapping) {
  for (const Mapped& entry : mapping)
    if (entry.bits < 1 || entry.bits > 64) return false;
  return bits_of(mapping) <= 64;
}

void pack(std::span<const Mapped> mapping, std::span<const std::int64_t> values, Pdo& pdo) {
  assert(is_valid(mapping) && mapping.size() == values.size());
  std::uint64_t all = 0;
  unsigned at = 0;
  for (std::size_t i = 0; i < mapping.size(); ++i) {
    all |= (static_cast<std::uint64_t>(values[i]) & mask_of(mapping[i].bits)) << at;
    at += mapping[i].bits;
  }
  pdo.size = static_cast<std::uint8_t>((at + 7) / 8);
  put_little<std::uint64_t>(pdo.data, 0, all);
}

bool unpack(std::span<const Mapped> mapping, const Pdo& pdo, std::span<std::int64_t> values) {
  assert(is_valid(mapping) && mapping.size() == values.size());
  if (pdo.size * 8U < bits_of(mapping)) return false;
  const auto all = little<std::uint64_t>(pdo.data, 0);
  unsigned at = 0;
  for (std::size_t i = 0; i < mapping.size(); ++i) {
    const unsigned bits = mapping[i].bits;
    std::uint64_t value = all >> at & mask_of(bits);
    const bool negative = mapping[i].is_signed && (value >> (bits - 1) & 1) != 0;
    if (negative) value |= ~mask_of(bits);
    values[i] = static_cast<std::int64_t>(value);
    at += bits;
  }
  return true;
}

Bytes bytes_of(const Setting& setting) {
  Bytes bytes;
  for (unsigned i = 0; i < setting.size; ++i)
    bytes.push_back(static_cast<std::uint8_t>(setting.value >> (8 * i)));
  return bytes;
}

bool reads_back(const Setting& setting, ByteView read) {
  if (read.size() != setting.size) return false;
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < read.size(); ++i)
    value |= static_cast<std::uint32_t>(read[i]) << (8 * i);
  return ((value ^ setting.value) & setting.compare_mask) == 0;
}

std::vector<Setting> pdo_settings(std::uint8_t node, const PdoSetup& setup) {
  assert(setup.number >= 1 && setup.number <= 4 && is_valid(setup.mapping));
  const auto step = static_cast<std::uint16_t>(setup.number - 1);
  const auto parameters = static_cast<std::uint16_t>((setup.from_node ? 0x1800 : 0x1400) + step);
  const auto map = static_cast<std::uint16_t>((setup.from_node ? 0x1A00 : 0x1600) + step);
  const std::uint32_t cob_id = (setup.from_node ? 0x180U : 0x200U) + 0x100U * step + node;
  std::vector<Setting> settings{
      {{parameters, 1}, 4, cob_id | kOff, kCobIdMask, "PDO off while it is mapped"},
      {{parameters, 2}, 1, setup.transmission, kAll, "when the PDO is sent"}};
  if (setup.from_node)
    settings.push_back({{parameters, 5},
                        2,
                        setup.event_timer_ms,
                        kAll,
                        "PDO at least every ms",
                        setup.event_timer_ms == 0});
  settings.push_back({{parameters, 1}, 4, cob_id, kCobIdMask, "PDO on"});
  if (setup.fixed) return settings;
  std::vector<Setting> maps{{{map, 0}, 1, 0, kAll, "mapping emptied"}};
  for (std::size_t i = 0; i < setup.mapping.size(); ++i)
    maps.push_back({{map, static_cast<std::uint8_t>(i + 1)},
                    4,
                    mapping_word(setup.mapping[i]),
                    kAll,
                    "mapped object"});
  maps.push_back({{map, 0},
                  1,
                  static_cast<std::uint32_t>(setup.mapping.size()),
                  kAll,
                  "number of mapped objects"});
  settings.insert(settings.end() - 1, maps.begin(), maps.end());
  return settings;
}

}  // namespace drivers::canopen
