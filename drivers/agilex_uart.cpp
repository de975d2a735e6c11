#include <cassert>

#include "drivers/agilex_codec.hpp"

namespace drivers::agilex::uart {
namespace {

// Length, type, id, count; the length counts these and the data.
constexpr std::size_t kFixed = 4;

std::uint8_t sum(ByteView bytes) {
  std::uint8_t total = 0;
  for (const auto byte : bytes) total = static_cast<std::uint8_t>(total + byte);
  return total;
}

}  // namespace

Look look(ByteView front) {
  if (front[0] != 0x5A) return Look::none("no start of frame");
  if (front.size() < 2) return Look::more();
  if (front[1] != 0xA5) return Look::none("no start of frame");
  if (front.size() < 4) return Look::more();
  if (front[2] < kFixed) return Look::none("length");
  if (front[3] != 0xAA && front[3] != 0x55) return Look::none("type");
  const std::size_t size = 3U + front[2];
  if (front.size() < size) return Look::more();
  return sum(front.first(size - 1)) == front[size - 1] ? Look::frame(size) : Look::none("checksum");
}

Frame decode(ByteView frame) {
  return {frame[3] == 0xAA, frame[4], frame.subspan(5, frame[2] - kFixed), frame[frame.size() - 2]};
}

Bytes encode(const Frame& frame) {
  assert(frame.data.size() + kFixed <= 255);
  Bytes bytes{0x5A, 0xA5, static_cast<std::uint8_t>(frame.data.size() + kFixed),
              static_cast<std::uint8_t>(frame.from_base ? 0xAA : 0x55), frame.id};
  bytes.insert(bytes.end(), frame.data.begin(), frame.data.end());
  bytes.push_back(frame.count);
  bytes.push_back(sum(bytes));
  return bytes;
}

}  // namespace drivers::agilex::uart
