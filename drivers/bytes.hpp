// Numbers in bytes, both ends. The caller has checked that the bytes are there.
#pragma once

#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <type_traits>
#include <vector>

namespace drivers {

using Bytes = std::vector<std::uint8_t>;
using ByteView = std::span<const std::uint8_t>;

template <std::size_t kSize>
using Unsigned = std::conditional_t<
    kSize == 1, std::uint8_t,
    std::conditional_t<kSize == 2, std::uint16_t,
                       std::conditional_t<kSize == 4, std::uint32_t, std::uint64_t>>>;

// T: any integer or floating-point type of 1, 2, 4 or 8 bytes.
template <class T>
T little(ByteView bytes, std::size_t at) {
  Unsigned<sizeof(T)> raw = 0;
  for (std::size_t i = 0; i < sizeof(T); ++i)
    raw = static_cast<Unsigned<sizeof(T)>>(raw | static_cast<Unsigned<sizeof(T)>>(bytes[at + i])
                                                     << (8 * i));
  return std::bit_cast<T>(raw);
}

template <class T>
T big(ByteView bytes, std::size_t at) {
  Unsigned<sizeof(T)> raw = 0;
  for (std::size_t i = 0; i < sizeof(T); ++i)
    raw = static_cast<Unsigned<sizeof(T)>>(raw | static_cast<Unsigned<sizeof(T)>>(bytes[at + i])
                                                     << (8 * (sizeof(T) - 1 - i)));
  return std::bit_cast<T>(raw);
}

template <class T>
void put_little(std::span<std::uint8_t> bytes, std::size_t at, std::type_identity_t<T> value) {
  const auto raw = std::bit_cast<Unsigned<sizeof(T)>>(value);
  for (std::size_t i = 0; i < sizeof(T); ++i)
    bytes[at + i] = static_cast<std::uint8_t>(raw >> (8 * i));
}

template <class T>
void put_big(std::span<std::uint8_t> bytes, std::size_t at, std::type_identity_t<T> value) {
  const auto raw = std::bit_cast<Unsigned<sizeof(T)>>(value);
  for (std::size_t i = 0; i < sizeof(T); ++i)
    bytes[at + i] = static_cast<std::uint8_t>(raw >> (8 * (sizeof(T) - 1 - i)));
}

// For messages that grow.
template <class T>
void append_little(Bytes& bytes, std::type_identity_t<T> value) {
  bytes.resize(bytes.size() + sizeof(T));
  put_little<T>(bytes, bytes.size() - sizeof(T), value);
}
template <class T>
void append_big(Bytes& bytes, std::type_identity_t<T> value) {
  bytes.resize(bytes.size() + sizeof(T));
  put_big<T>(bytes, bytes.size() - sizeof(T), value);
}

}  // namespace drivers
