// What the readers of clouds share: lines, words, numbers of every type.
#pragma once

#include <array>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "nav/registration/cloud_file.hpp"

namespace nav::fields {

// Lines one after the other, without their ends ("\n" or "\r\n").
class Lines {
 public:
  explicit Lines(std::string_view text) : text_(text) {}

  bool next(std::string_view& line) {
    if (at_ >= text_.size()) return false;
    const auto end = std::min(text_.find('\n', at_), text_.size());
    line = text_.substr(at_, end - at_);
    if (line.ends_with('\r')) line.remove_suffix(1);
    at_ = end + 1;
    ++number_;
    return true;
  }
  int number() const { return number_; }
  // What follows the last line taken.
  std::string_view rest() const { return text_.substr(std::min(at_, text_.size())); }

 private:
  std::string_view text_;
  std::size_t at_ = 0;
  int number_ = 0;
};

// The next word of the line, or empty; takes it off.
inline std::string_view take_word(std::string_view& line, std::string_view between = " \t") {
  const auto start = line.find_first_not_of(between);
  if (start == std::string_view::npos) return line = {};
  line.remove_prefix(start);
  const auto end = std::min(line.find_first_of(between), line.size());
  const std::string_view word = line.substr(0, end);
  line.remove_prefix(end);
  return word;
}

inline std::vector<std::string_view> words(std::string_view line,
                                           std::string_view between = " \t") {
  std::vector<std::string_view> all;
  for (auto word = take_word(line, between); !word.empty(); word = take_word(line, between))
    all.push_back(word);
  return all;
}

template <class Number>
std::optional<Number> number(std::string_view word) {
  if (word.starts_with('+')) word.remove_prefix(1);
  Number value{};
  const auto [end, problem] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (problem != std::errc{} || end != word.data() + word.size()) return std::nullopt;
  return value;
}

// A number in binary: 'i' signed, 'u' unsigned, 'f' floating, of so many bytes.
struct Type {
  char kind = 'f';
  std::size_t bytes = 4;
};
inline bool known(Type type) {
  const auto size = type.bytes;
  if (type.kind == 'f') return size == 4 || size == 8;
  return (type.kind == 'i' || type.kind == 'u') &&
         (size == 1 || size == 2 || size == 4 || size == 8);
}

template <class Number>
double as_double(const char* bytes, bool swap) {
  std::array<char, sizeof(Number)> raw;
  std::memcpy(raw.data(), bytes, raw.size());
  if (swap) std::reverse(raw.begin(), raw.end());
  Number value;
  std::memcpy(&value, raw.data(), raw.size());
  return static_cast<double>(value);
}

// Of a type that is known().
inline double decode(const char* bytes, Type type, bool swap) {
  if (type.kind == 'f')
    return type.bytes == 4 ? as_double<float>(bytes, swap) : as_double<double>(bytes, swap);
  const bool is_signed = type.kind == 'i';
  switch (type.bytes) {
    case 1:
      return is_signed ? as_double<std::int8_t>(bytes, swap) : as_double<std::uint8_t>(bytes, swap);
    case 2:
      return is_signed ? as_double<std::int16_t>(bytes, swap)
                       : as_double<std::uint16_t>(bytes, swap);
    case 4:
      return is_signed ? as_double<std::int32_t>(bytes, swap)
                       : as_double<std::uint32_t>(bytes, swap);
    default:
      return is_signed ? as_double<std::int64_t>(bytes, swap)
                       : as_double<std::uint64_t>(bytes, swap);
  }
}

// "'long word...'": what a file says, shortened so that a message stays a line.
inline std::string shown(std::string_view word) {
  std::string text = "'";
  for (const char c : word.substr(0, 40)) text += c >= 0x20 && c < 0x7f ? c : '?';
  return text + (word.size() > 40 ? "...'" : "'");
}

}  // namespace nav::fields
