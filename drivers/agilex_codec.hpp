// AgileX bases on CAN, standard ids, 500 kbit/s, everything big-endian: frames <-> values.
#pragma once

#include <optional>

#include "drivers/agilex_messages.hpp"
#include "drivers/bytes.hpp"
#include "drivers/resync.hpp"
#include "hal/frames.hpp"
#include "hal/values.hpp"

namespace drivers::agilex {

// Unread for ids that are not of this dialect, wrong lengths, remote and extended frames, values
// that the protocol does not have, and version 1 frames whose checksum is wrong. Allocates nothing.
Message decode(const hal::CanFrame& frame, Dialect dialect);

// Of any message but Unread. Numbers out of the wire's range are clamped. Allocates nothing.
hal::CanFrame encode(const Message& message);

// Sent by the base; else sent to it. Unread counts as from the base.
bool from_base(const Message& message);

// What one frame says about who speaks: nothing for frames that either could have sent.
std::optional<Dialect> dialect_of(const hal::CanFrame& frame);

// Of a version 1 frame: over its id, length and bytes 0 to 6.
std::uint8_t v1_checksum(const hal::CanFrame& frame);

std::span<const Fault> system_faults();  // Of SystemState::fault_bits, all 16 bits.
std::span<const Fault> motor_faults();   // Of MotorSlow::fault_bits, all 8 bits.
std::span<const Fault> v1_faults();      // Of V1State::fault_bits, all 16 bits.

// From one Odometry value to the next, right across the wrap from 2^31 - 1 to -2^31.
constexpr std::int32_t travelled_mm(std::int32_t before, std::int32_t now) {
  return static_cast<std::int32_t>(static_cast<std::uint32_t>(now) -
                                   static_cast<std::uint32_t>(before));
}

// The fastest that may be commanded.
struct Limits {
  std::int16_t forward_mmps{};
  std::int16_t turn_mradps{};
};
constexpr Limits kScout2{1500, 2523};
constexpr Limits kScoutMini{3000, 2523};  // And Bunker.

// Within the limits. Too fast is slowed down as a whole, so that the path stays the same; what is
// not a number stops the base.
MotionCommand motion_command(hal::Twist twist, Limits limits);

// The same base on its serial port: 115200 baud, 8N1.
namespace uart {

constexpr std::size_t kFrameMax = 3 + 255;

struct Frame {
  bool from_base{};
  std::uint8_t id{};
  ByteView data;  // Into the bytes that were given.
  std::uint8_t count{};
};

Look look(ByteView front);
// Of a frame that look() has seen.
Frame decode(ByteView frame);
// data: at most 251 bytes.
Bytes encode(const Frame& frame);

}  // namespace uart

}  // namespace drivers::agilex
