// PDO mappings, and objects to be written in order with what must read back (CiA 301).
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "drivers/bytes.hpp"
#include "drivers/canopen_sdo.hpp"

namespace drivers::canopen {

// One object in a PDO.
struct Mapped {
  Address at;
  std::uint8_t bits{};  // 1..64
  bool is_signed{};     // Not in the mapping itself; the object's data type says it.
  bool operator==(const Mapped&) const = default;
};

// The mapping object's value: index, sub-index and bits. The sign is not in it.
constexpr std::uint32_t mapping_word(const Mapped& mapped) {
  return std::uint32_t{mapped.at.index} << 16 | std::uint32_t{mapped.at.sub} << 8 | mapped.bits;
}
constexpr Mapped mapped(std::uint32_t word) {
  return {{static_cast<std::uint16_t>(word >> 16), static_cast<std::uint8_t>(word >> 8)},
          static_cast<std::uint8_t>(word),
          false};
}

// At most 64 bits in all, each entry 1..64 bits: else a mapping is not valid.
bool is_valid(std::span<const Mapped> mapping);

// One value per entry, first entry in the lowest bits of the first byte. Values are cut to their
// bits. The mapping must be valid and have as many entries as there are values. Allocates nothing.
void pack(std::span<const Mapped> mapping, std::span<const std::int64_t> values, Pdo& pdo);

// Values of signed entries are negative where they should be; unsigned ones of 64 bits wrap. False
// when the PDO is shorter than the mapping says: `values` is then not changed. Longer is allowed.
bool unpack(std::span<const Mapped> mapping, const Pdo& pdo, std::span<std::int64_t> values);

// An object that has to hold a value before the robot drives.
struct Setting {
  Address at;
  std::uint8_t size{};  // Bytes: 1, 2 or 4.
  std::uint32_t value{};
  // Read back and compared under this mask; 0: not read back (commands, not settings).
  std::uint32_t compare_mask{};
  std::string_view what{};           // "heartbeat every ms"
  bool optional{};                   // The drive may refuse it: not every drive has it.
  std::optional<Address> read_at{};  // Where it reads back, if not where it was written.
  bool operator==(const Setting&) const = default;
};

Bytes bytes_of(const Setting& setting);
// Whether what was read back is what was wanted; short or long replies are not.
bool reads_back(const Setting& setting, ByteView read);

struct PdoSetup {
  std::uint8_t number{};           // 1..4
  bool from_node{};                // TPDO
  std::uint8_t transmission{};     // 0 acyclic, 1..240 every n-th SYNC, 254 and 255 on change.
  std::uint16_t event_timer_ms{};  // TPDO only; 0: none.
  std::vector<Mapped> mapping;
  bool fixed{};  // The node's own mapping: it is not written.
};

// The writes that map one PDO of a node, in the order that drives insist on (pre-operational only).
std::vector<Setting> pdo_settings(std::uint8_t node, const PdoSetup& setup);

}  // namespace drivers::canopen
