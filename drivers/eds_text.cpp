#include "drivers/eds_text.hpp"

#include <algorithm>
#include <charconv>

namespace drivers::eds {
namespace {

constexpr std::size_t kErrorsMax = 50;

char lower_char(char c) {
  return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
}

bool blank(char c) {
  return c == ' ' || c == '\t' || c == '\r' || c == '\f' || c == '\v';
}

std::optional<std::int64_t> parse_plain(std::string_view text) {
  const bool negative = text.starts_with('-');
  if (negative) text.remove_prefix(1);
  int base = 10;
  if (text.starts_with("0x") || text.starts_with("0X")) {
    base = 16;
    text.remove_prefix(2);
  } else if (text.size() > 1 && text[0] == '0') {
    base = 8;
  }
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, base);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  if (negative) return static_cast<std::int64_t>(0 - value);
  return static_cast<std::int64_t>(value);
}

}  // namespace

std::string lower(std::string_view text) {
  std::string result(text);
  std::transform(result.begin(), result.end(), result.begin(), lower_char);
  return result;
}

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && blank(text.back())) text.remove_suffix(1);
  return text;
}

std::optional<Number> parse_number(std::string_view text) {
  constexpr std::string_view kNode = "$nodeid";
  const std::string small = lower(trimmed(text));
  const auto node_at = small.find(kNode);
  if (node_at == std::string::npos) {
    const auto value = parse_plain(small);
    return value ? std::optional(Number{*value, false}) : std::nullopt;
  }
  const auto before = trimmed(std::string_view(small).substr(0, node_at));
  const auto after = trimmed(std::string_view(small).substr(node_at + kNode.size()));
  if (before.empty() && after.empty()) return Number{0, true};
  if (!before.empty() && !after.empty()) return std::nullopt;
  const bool adds = before.empty() ? after.front() == '+' : before.back() == '+';
  if (!adds) return std::nullopt;
  const auto value =
      parse_plain(trimmed(before.empty() ? after.substr(1) : before.substr(0, before.size() - 1)));
  return value ? std::optional(Number{*value, true}) : std::nullopt;
}

const Value* Section::find(const std::string& key) const {
  const auto found = values.find(key);
  return found == values.end() ? nullptr : &found->second;
}

Text::Text(std::string_view text, std::string_view file) : file_(file) {
  int number = 0;
  while (!text.empty()) {
    const auto end = text.find('\n');
    read_line(trimmed(text.substr(0, end)), ++number);
    text = end == std::string_view::npos ? std::string_view() : text.substr(end + 1);
  }
}

void Text::read_line(std::string_view line, int number) {
  if (line.empty() || line[0] == ';' || line[0] == '#') return;
  if (line[0] == '[') {
    const auto end = line.find(']');
    if (end == std::string_view::npos) {
      refuse(number, "", std::string(line), "close the section's name with ']'");
      section_ = nullptr;
      return;
    }
    section_name_ = lower(trimmed(line.substr(1, end - 1)));
    const auto [at, fresh] = sections_.try_emplace(section_name_);
    if (!fresh)
      refuse(number, "", std::string(line),
             "remove it: the section is at line " + std::to_string(at->second.line) + " already");
    else
      at->second.line = number;
    section_ = &at->second;
    return;
  }
  const auto equals = line.find('=');
  if (equals == std::string_view::npos) {
    if (section_name_ != "comments") refuse(number, "", std::string(line), "write KEY=VALUE");
    return;
  }
  if (section_ == nullptr) {
    refuse(number, std::string(trimmed(line.substr(0, equals))), std::string(line),
           "put a [Section] before it");
    return;
  }
  section_->values.insert_or_assign(lower(trimmed(line.substr(0, equals))),
                                    Value{std::string(trimmed(line.substr(equals + 1))), number});
}

const Section* Text::find(const std::string& name) const {
  const auto found = sections_.find(name);
  return found == sections_.end() ? nullptr : &found->second;
}

void Text::refuse(int line, std::string field, std::string value, std::string remedy) {
  if (errors_.size() > kErrorsMax) return;
  if (errors_.size() == kErrorsMax)
    errors_.push_back({file_, line, "", "", "correct the errors above: there are more"});
  else
    errors_.push_back({file_, line, std::move(field), std::move(value), std::move(remedy)});
}

}  // namespace drivers::eds
