// The other side of numbered keys: what `vantage console` sends. Pure.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace mission {

class ConsoleKeys {
 public:
  // What the robot shows: it says where numbers begin, and when the keys no longer drive.
  void hear(std::string_view shown);
  // What to send for these keys: in between, each dead-man key with a number of its own.
  std::string send(std::string_view typed);

 private:
  std::string line_;  // Of what is shown, as far as it came; bounded.
  std::optional<std::uint32_t> last_number_;
};

}  // namespace mission
