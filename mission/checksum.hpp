// Whether bytes are still those that were written.
#pragma once

#include <cstdint>
#include <string_view>

namespace mission {

// Eight bytes at a time, some GB/s. A change within any one group of eight is always found, others
// but for one in 2^64: against torn and lost sectors, not against people. The same on every
// machine.
class Checksum {
 public:
  void add(std::string_view bytes);  // Two additions are not one of both together.
  std::uint64_t value() const { return value_; }

 private:
  std::uint64_t value_ = 0x9E3779B97F4A7C15;
};

std::uint64_t checksum_of(std::string_view bytes);

}  // namespace mission
