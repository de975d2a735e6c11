#include "mission/console_keys.hpp"

#include <charconv>

#include "mission/console.hpp"

namespace mission {
namespace {

constexpr std::string_view kBegins = "numbers after ", kEnds = "you no longer drive";
constexpr std::size_t kLineMax = 200;

}  // namespace

void ConsoleKeys::hear(std::string_view shown) {
  for (const char character : shown) {
    if (character != '\r' && character != '\n') {
      if (line_.size() < kLineMax) line_ += character;
      continue;
    }
    std::uint32_t number{};
    if (line_.starts_with(kEnds)) last_number_.reset();
    if (line_.starts_with(kBegins) &&
        std::from_chars(line_.data() + kBegins.size(), line_.data() + line_.size(), number).ec ==
            std::errc{})
      last_number_ = number;
    line_.clear();
  }
}

std::string ConsoleKeys::send(std::string_view typed) {
  std::string bytes;
  for (const char key : typed) {
    bytes += key;
    if (last_number_ && teleop_twist(key)) bytes += std::to_string(++*last_number_) + ".";
  }
  return bytes;
}

}  // namespace mission
