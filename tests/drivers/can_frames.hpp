// CAN frames as candump writes them, for tests.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

#include "hal/frames.hpp"
#include "tools/captures.hpp"

namespace drivers_test {

inline hal::CanFrame can_frame(const captures::Piece& piece) {
  hal::CanFrame frame{piece.can_id, static_cast<std::uint8_t>(piece.bytes.size()), {},
                      piece.can_extended, piece.can_remote};
  std::copy(piece.bytes.begin(), piece.bytes.end(), frame.data.begin());
  return frame;
}

inline std::vector<hal::CanFrame> can_frames(std::string_view candump) {
  const auto capture = captures::read(candump, "log", {captures::Format::candump});
  EXPECT_TRUE(capture) << capture.error().text();
  std::vector<hal::CanFrame> frames;
  for (const auto& piece : capture->pieces) frames.push_back(can_frame(piece));
  EXPECT_TRUE(capture->skipped.empty());
  return frames;
}

// "123#AABB"
inline hal::CanFrame can(const std::string& text) {
  return can_frames("can0 " + text).at(0);
}

}  // namespace drivers_test
