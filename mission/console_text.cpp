#include "mission/console_text.hpp"

#include <algorithm>

namespace mission {
namespace {

constexpr std::size_t kConsoleColumns = 79;
constexpr std::string_view kIndent = "  ";

// Where a line that is too long is broken: after the last space that fits, else where it is full.
std::size_t break_at(std::string_view line, std::size_t room) {
  const std::size_t space = line.substr(0, room + 1).find_last_of(' ');
  const bool only_indent = line.find_first_not_of(' ') > space;
  return space == std::string_view::npos || only_indent ? room : space;
}

void put_line(std::string_view line, std::string& out) {
  std::string_view indent;
  while (line.size() + indent.size() > kConsoleColumns) {
    const std::size_t end = break_at(line, kConsoleColumns - indent.size());
    out.append(indent).append(line.substr(0, end)).append("\r\n");
    line.remove_prefix(end);
    line.remove_prefix(std::min(line.find_first_not_of(' '), line.size()));
    indent = kIndent;
  }
  out.append(indent).append(line).append("\r\n");
}

}  // namespace

std::string console_text(std::string_view text) {
  if (text.empty()) return {};
  std::string clean(text);
  for (char& c : clean)
    if (c != '\n' && (c < ' ' || c > '~')) c = '?';
  std::string out;
  std::string_view rest = clean;
  while (!rest.empty()) {
    const std::size_t end = std::min(rest.find('\n'), rest.size());
    put_line(rest.substr(0, end), out);
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  return out;
}

}  // namespace mission
