// What a device says is wrong, in words a person can act on: tables of bits or codes.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

namespace drivers {

// Static texts: a fault may be kept for as long as one likes.
struct Fault {
  std::uint32_t code{};    // The bits, or the code.
  std::string_view name;   // "battery too low: stopped"
  std::string_view cause;  // What most often is behind it.
  std::string_view remedy;

  bool operator==(const Fault&) const = default;
};

// The faults whose bits are set in `bits`, in the table's order.
inline std::vector<Fault> faults_in(std::span<const Fault> table, std::uint32_t bits) {
  std::vector<Fault> found;
  for (const Fault& fault : table)
    if ((bits & fault.code) != 0) found.push_back(fault);
  return found;
}

// What a codec returns for bytes that are no message of its device.
struct Unread {
  std::string_view why;  // The same words for the same reason.

  bool operator==(const Unread&) const = default;
};

}  // namespace drivers
