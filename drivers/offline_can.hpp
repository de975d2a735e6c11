// What the offline decoders of CAN devices have in common.
#pragma once

#include <algorithm>
#include <optional>

#include "drivers/offline_fields.hpp"
#include "hal/frames.hpp"

namespace drivers {

// Nothing for what no classical CAN frame can be.
inline std::optional<hal::CanFrame> can_frame(const Captured& captured) {
  if (captured.bytes.size() > 8) return std::nullopt;
  hal::CanFrame frame;
  frame.id = captured.can_id;
  frame.size = static_cast<std::uint8_t>(captured.bytes.size());
  frame.extended = captured.can_extended;
  frame.remote = captured.can_remote;
  std::copy(captured.bytes.begin(), captured.bytes.end(), frame.data.begin());
  return frame;
}

}  // namespace drivers
