// CAN frames as candump writes them, for tests.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <string_view>
#include <vector>

#include "drivers/offline_can.hpp"
#include "hal/frames.hpp"
#include "tools/captures.hpp"

namespace drivers_test {

inline std::vector<hal::CanFrame> can_frames(std::string_view candump) {
  const auto capture = captures::read(candump, "log", {captures::Format::candump});
  EXPECT_TRUE(capture) << capture.error().text();
  std::vector<hal::CanFrame> frames;
  for (const auto& piece : capture->pieces)
    frames.push_back(drivers::can_frame({piece.t_s, piece.from_device, piece.bytes, piece.can_id,
                                         piece.can_extended, piece.can_remote})
                         .value());
  EXPECT_TRUE(capture->skipped.empty());
  return frames;
}

// "123#AABB"
inline hal::CanFrame can(const std::string& text) {
  return can_frames("can0 " + text).at(0);
}

}  // namespace drivers_test
