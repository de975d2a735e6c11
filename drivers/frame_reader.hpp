// Whole frames off a byte stream, for loops.
#pragma once

#include <array>
#include <cstdint>
#include <functional>

#include "drivers/resync.hpp"
#include "hal/clock.hpp"
#include "hal/links.hpp"

namespace drivers {

// Sets the bit rate of the port that a stream goes through. Empty where there is none to set: TCP,
// USB.
using SetBaud = std::function<hal::Result<void>(int baud)>;

class FrameReader {
 public:
  using LookAt = Look (*)(ByteView front);

  // Holds at most frame_max bytes that belong to no whole frame yet.
  FrameReader(hal::ByteStream& stream, hal::Clock& clock, LookAt look, std::size_t frame_max)
      : stream_(stream), clock_(clock), look_(look), resync_(frame_max) {}

  // The next whole frame; the view holds until the next call. Fails as the stream does.
  hal::Task<hal::Result<ByteView>> next();
  // Fails also with errc::timed_out when there is none by the deadline.
  hal::Task<hal::Result<ByteView>> next(hal::Time deadline);

  hal::Time arrival() const { return arrival_; }  // Of the last bytes, by our clock.
  std::uint64_t bytes() const { return bytes_; }
  std::uint64_t damaged_bytes() const;  // Of these, what belonged to no frame.

  // The first bytes since forget(), at most 2 KiB: to say who else is there.
  ByteView heard() const { return heard_; }
  void forget() { heard_.clear(); }

 private:
  hal::Task<void> fill();

  hal::ByteStream& stream_;
  hal::Clock& clock_;
  LookAt look_;
  Resync resync_;
  std::array<std::uint8_t, 4096> piece_{};
  hal::Result<void> filled_;
  Bytes heard_;
  hal::Time arrival_{};
  std::uint64_t bytes_{};
};

}  // namespace drivers
