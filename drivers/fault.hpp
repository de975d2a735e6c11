// Faults by name: what a bit or a code of a device means, why it comes and what to do about it.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

namespace drivers {

struct Fault {
  std::uint32_t value{};  // One bit (or several) of a status word, or a whole code: the table says.
  std::string_view name;
  std::string_view cause;
  std::string_view remedy;
};

// For tables of bits: those that are set in `word`.
inline std::vector<const Fault*> faults_set(std::span<const Fault> table, std::uint32_t word) {
  std::vector<const Fault*> set;
  for (const Fault& fault : table)
    if ((word & fault.value) == fault.value) set.push_back(&fault);
  return set;
}

// For tables of codes: the entry of `code`, or null.
inline const Fault* fault_of(std::span<const Fault> table, std::uint32_t code) {
  for (const Fault& fault : table)
    if (fault.value == code) return &fault;
  return nullptr;
}

}  // namespace drivers
