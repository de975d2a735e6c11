// Which PDOs of a drive carry what a velocity drive needs, and where in them: as we map them, or as
// a drive with a fixed mapping insists on. Pure.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "drivers/canopen_pdo.hpp"
#include "drivers/cia402.hpp"

namespace drivers::cia402 {

struct PdoLayout {
  struct Part {
    std::uint8_t number{};  // Of the PDO, 1..4.
    std::vector<canopen::Mapped> mapping;
  };
  Part target;    // RPDO with the controlword and the target.
  Part status;    // TPDO with the statusword and the speed.
  Part position;  // TPDO with the position; may be the same.
  bool fixed{};   // The drive's own mapping, which cannot be written.
};

// As velocity_pdos() maps them.
PdoLayout own_layout(Mode mode);

// The mappings that a drive has, by PDO number less 1. Empty: it has no such PDO, or one of more
// than 8 objects.
struct FixedPdos {
  std::array<std::vector<canopen::Mapped>, 4> to_node, from_node;
};
// Empty, or what the mappings lack. An RPDO may carry the mode of operation besides, and padding:
// whatever else it carries would be overwritten, and so it does not count.
std::string find_layout(const FixedPdos& has, Mode mode, PdoLayout& into);

// Whether an object is part of a mapping.
bool is_mapping(canopen::Address at);

// The value of an object in a PDO; nothing where the mapping has it not, or the PDO is too short.
std::optional<std::int64_t> value_in(std::span<const canopen::Mapped> mapping,
                                     const canopen::Pdo& pdo, canopen::Address at);

}  // namespace drivers::cia402
