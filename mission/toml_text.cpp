#include "mission/toml_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <variant>

#include "mission/toml_scan.hpp"

namespace mission {
namespace {

constexpr std::size_t kTextMax = 256 * 1024;
constexpr std::size_t kErrorsMax = 20;
constexpr int kDotsMax = 64;

std::vector<std::string> split_lines(std::string_view text) {
  std::vector<std::string> lines;
  while (!text.empty()) {
    const auto end = text.find('\n');
    lines.emplace_back(text.substr(0, end));
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
  }
  return lines;
}

std::string join(const std::vector<std::string>& lines) {
  std::string text;
  for (const auto& line : lines) text += line + "\n";
  return text;
}

std::size_t indent(const std::string& line) {
  return std::min(line.find_first_not_of(" \t"), line.size());
}

bool is_header(const std::string& line) {
  const auto first = indent(line);
  return first < line.size() && line[first] == '[';
}

// The parser's words without its "Error while parsing ...: ", which adds nothing here.
std::string plain(std::string_view description) {
  constexpr std::string_view kStart = "Error while parsing ";
  std::string text{description};
  if (text.starts_with(kStart)) text.erase(0, kStart.size());
  const auto newline = text.find("'\n'");
  if (newline != std::string::npos) text.replace(newline, 3, "the end of the line");
  const auto escaped = text.find("'\\n'");
  if (escaped != std::string::npos) text.replace(escaped, 4, "the end of the line");
  return text;
}

bool has(const std::string& text, std::string_view part) {
  return text.find(part) != std::string::npos;
}

struct Remedy {
  std::string_view says;  // Part of the parser's words.
  std::string_view remedy;
};

constexpr Remedy kRemedies[]{
    {"cannot redefine", "it is set above already: remove one of the two"},
    {"control characters", "close the text with its quote on the same line"},
    {"end-of-file", "something is opened here and never closed"},
    {"expected value", "write a value after the '='"},
    {"boolean", "put text in quotes; flags are true or false, in lower case"},
    {"could not determine value type", "put text in quotes"},
    {"expected '='", "write key = value"},
    {"table header", "write [name] on a line of its own"},
    {"leading zeroes", "write the number without leading zeroes"},
    {"not representable", "the number is too large"},
    {"saw ','", "write decimals with a point, and no comma after the value"},
    {"expected a comment", "write one key = value on a line"},
    {"expected digit", "write a plain number: the unit is part of the key"},
    {"floating-point", "write digits on both sides of the point"},
};

// What the person can do about it.
std::string_view remedy(const std::string& text, const std::string& line) {
  const auto value = line.find('=');
  const bool bare = has(line, "/") && !has(line, "'") && !has(line, "\"");
  if (value != std::string::npos && bare) return "put text in quotes";
  for (const auto& known : kRemedies)
    if (has(text, known.says)) return known.remedy;
  return "correct or remove this line";
}

// The last line, up to `last`, that opens what the end of the file finds still open.
int opening_line(const std::vector<std::string>& lines, int last, bool array) {
  for (int i = std::min<int>(last, static_cast<int>(lines.size())); i >= 1; --i) {
    const auto& line = lines[static_cast<std::size_t>(i - 1)];
    const bool opens =
        array ? has(line, "[") && has(line, "=") : has(line, "\"\"\"") || has(line, "'''");
    if (opens) return i;
  }
  return last;
}

TomlError explain(const toml::parse_error& error, const std::vector<std::string>& lines) {
  const std::string text = plain(error.description());
  TomlError explained{static_cast<int>(error.source().begin.line),
                      static_cast<int>(error.source().begin.column), ""};
  if (has(text, "end-of-file")) {
    explained.line = opening_line(lines, explained.line, has(text, "array"));
    explained.column = 1;
  }
  const auto index = static_cast<std::size_t>(std::max(explained.line, 1)) - 1;
  const std::string line = index < lines.size() ? lines[index] : "";
  if (has(text, "cannot redefine") || has(text, "end-of-file"))
    explained.column = static_cast<int>(indent(line)) + 1;
  explained.message = fmt::format("not TOML: {}; {}", text, remedy(text, line));
  return explained;
}

// Leaves out the broken line, and all of its table when it is the header or runs to the end of the
// file; false when there is nothing left to leave out there.
bool leave_out(std::vector<std::string>& lines, const TomlError& error) {
  const auto first = static_cast<std::size_t>(std::max(error.line, 1)) - 1;
  if (first >= lines.size() || lines[first].empty()) return false;
  const bool table = is_header(lines[first]) || has(error.message, "end-of-file");
  lines[first].clear();
  for (auto i = first + 1; table && i < lines.size() && !is_header(lines[i]); ++i) lines[i].clear();
  return true;
}

// Deep nesting would overflow the stack of the parser's destructors.
int too_deep_line(const std::vector<std::string>& lines) {
  for (std::size_t i = 0; i < lines.size(); ++i)
    if (std::count(lines[i].begin(), lines[i].end(), '.') > kDotsMax)
      return static_cast<int>(i) + 1;
  return 0;
}

// One attempt: a table, or the first error.
std::variant<toml::table, TomlError> parse(const std::vector<std::string>& lines) {
  try {
    return toml::parse(std::string_view{join(lines)});
  } catch (const toml::parse_error& error) {
    return explain(error, lines);
  } catch (const TomlAssertion&) {
    return TomlError{};
  }
}

// Where the parser gave up without saying: the end of the shortest beginning that it cannot bear.
TomlError unexplained(const std::vector<std::string>& lines) {
  for (std::size_t n = 1; n <= lines.size(); ++n) {
    const std::vector<std::string> begin(lines.begin(), lines.begin() + static_cast<long>(n));
    const auto parsed = parse(begin);
    const auto* error = std::get_if<TomlError>(&parsed);
    if (error && error->line == 0)
      return {static_cast<int>(n), static_cast<int>(indent(lines[n - 1])) + 1,
              "not TOML: something in this line cannot be read; correct or remove it"};
  }
  return {1, 1, "not TOML: something cannot be read"};
}

}  // namespace

TomlText parse_toml(std::string_view text) {
  TomlText result;
  if (text.size() > kTextMax) {
    result.errors.push_back({1, 1, "the file is larger than 256 KiB: not a config file"});
    return result;
  }
  auto lines = split_lines(text);
  if (const int line = too_deep_line(lines)) {
    result.errors.push_back({line, 1, fmt::format("more than {} dots in one line", kDotsMax)});
    return result;
  }
  for (const auto& place : strange_characters(lines)) {
    auto& line = lines[static_cast<std::size_t>(place.line) - 1];
    line.clear();
    result.errors.push_back({place.line, place.column, place.message});
    if (result.errors.size() >= kErrorsMax) return result;
  }
  for (std::size_t tries = 0; tries < kErrorsMax; ++tries) {
    auto parsed = parse(lines);
    if (auto* table = std::get_if<toml::table>(&parsed)) {
      result.table = std::move(*table);
      return result;
    }
    auto error = std::get<TomlError>(parsed);
    if (error.line == 0) error = unexplained(lines);
    const bool go_on = leave_out(lines, error);
    if (go_on || result.errors.empty()) result.errors.push_back(error);
    if (!go_on) return result;
  }
  return result;
}

}  // namespace mission
