// Short ways to fill an offline message.
#pragma once

#include <concepts>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "drivers/fault.hpp"
#include "drivers/offline.hpp"

namespace drivers {

class Fields {
 public:
  explicit Fields(Message& message) : fields_(message.fields) {}

  template <class T>
  Fields& add(std::string name, const T& value) {
    if constexpr (std::same_as<T, bool>)
      fields_.push_back({std::move(name), value});
    else if constexpr (std::unsigned_integral<T>)
      fields_.push_back({std::move(name), std::uint64_t{value}});
    else if constexpr (std::signed_integral<T>)
      fields_.push_back({std::move(name), std::int64_t{value}});
    else if constexpr (std::floating_point<T>)
      fields_.push_back({std::move(name), double{value}});
    else if constexpr (std::convertible_to<const T&, std::string_view>)
      fields_.push_back({std::move(name), std::string(std::string_view(value))});
    else
      fields_.push_back({std::move(name), std::vector<double>(value.begin(), value.end())});
    return *this;
  }
  // Nothing where there is nothing: an absent field is unknown, not zero.
  template <class T>
  Fields& maybe(std::string name, const std::optional<T>& value) {
    return value ? add(std::move(name), *value) : *this;
  }
  Fields& faults(std::span<const Fault* const> faults) {
    for (const Fault* fault : faults)
      add("fault", std::string(fault->name) + ": " + std::string(fault->remedy));
    return *this;
  }

 private:
  std::vector<Field>& fields_;
};

// The two directions of a captured connection, each its own stream.
class TwoStreams {
 public:
  explicit TwoStreams(std::size_t frame_max) : from_(frame_max), to_(frame_max) {}
  Resync& of(bool from_device) { return from_device ? from_ : to_; }
  SkippedBy skipped() const {
    SkippedBy all = from_.skipped();
    drivers::add(all, to_.skipped());
    return all;
  }

 private:
  Resync from_, to_;
};

inline std::string hex_text(ByteView bytes) {
  std::string text;
  for (const std::uint8_t byte : bytes) {
    text += "0123456789ABCDEF"[byte >> 4];
    text += "0123456789ABCDEF"[byte & 15];
  }
  return text;
}

}  // namespace drivers
