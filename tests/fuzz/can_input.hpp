// Fuzz input as CAN frames: per frame two bytes of id and flags, one of size, eight of data.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

#include "hal/frames.hpp"

namespace fuzz {

constexpr std::size_t kFrameBytes = 11;

inline hal::CanFrame frame_at(std::span<const std::uint8_t> bytes) {
  hal::CanFrame frame;
  frame.id = static_cast<std::uint32_t>(bytes[0] | (bytes[1] & 7) << 8);
  frame.extended = (bytes[1] & 0x80) != 0;
  frame.remote = (bytes[1] & 0x40) != 0;
  frame.size = bytes[2];
  std::copy_n(bytes.begin() + 3, 8, frame.data.begin());
  return frame;
}

}  // namespace fuzz
