// Numbers and fields in the lines that devices send. Locale-free, exact, no allocation.
#pragma once

#include <charconv>
#include <cstdint>
#include <optional>
#include <string_view>
#include <system_error>

#include "drivers/bytes.hpp"

namespace drivers {

inline std::string_view as_text(ByteView bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}
inline ByteView as_bytes(std::string_view text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

// The whole of `text` as a number of this type (an explicit + is allowed), or nothing.
template <class T>
std::optional<T> whole_number(std::string_view text, int base = 10) {
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
  T value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, base);
  if (error != std::errc() || end != text.data() + text.size() || text.empty()) return std::nullopt;
  return value;
}

inline std::optional<double> whole_real(std::string_view text) {
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
  double value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || text.empty()) return std::nullopt;
  if (!(value - value == 0)) return std::nullopt;  // "inf" and "nan" are words, not measurements.
  return value;
}

// Takes what stands before the next `separator` off the front of `rest`; at the end, all of it.
inline std::string_view take_field(std::string_view& rest, char separator) {
  const auto cut = rest.find(separator);
  const std::string_view field = rest.substr(0, cut);
  rest = cut == std::string_view::npos ? std::string_view{} : rest.substr(cut + 1);
  return field;
}

// The value of two hex digits, or -1.
inline int hex_pair(std::string_view text) {
  if (text.size() < 2) return -1;
  const auto value = whole_number<std::uint8_t>(text.substr(0, 2), 16);
  return value && text[0] != '+' ? *value : -1;
}

}  // namespace drivers
