// Whether bytes are still those that were written: XXH64, against torn and lost sectors, not
// against people. The same on every machine.
#pragma once

#include <cstdint>
#include <memory>
#include <string_view>

struct XXH64_state_s;

namespace mission {

class Checksum {
 public:
  Checksum();
  void add(std::string_view bytes);
  std::uint64_t value() const;  // Of all bytes so far, one after the other.

 private:
  struct Free {
    void operator()(XXH64_state_s* state) const;
  };
  std::unique_ptr<XXH64_state_s, Free> state_;
};

std::uint64_t checksum_of(std::string_view bytes);

}  // namespace mission
