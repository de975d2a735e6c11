// What can go wrong on a wire, and the dice that decide when.
#pragma once

#include <cstdint>
#include <optional>

#include "hal/values.hpp"
#include "sim/noise.hpp"

namespace sim {

// Probabilities are per frame, datagram, request or piece of a stream.
struct LinkFaults {
  hal::Duration delay{}, jitter{};  // Arrives after delay + [0, jitter), still in order.
  double loss{};
  double corruption{};      // One bit of one byte turns.
  double duplication{};     // Arrives twice.
  double reordering{};      // Comes kHeldBack later: what was sent in the meantime overtakes it.
  std::size_t chunk_max{};  // Streams arrive in pieces of 1 to so many bytes; 0: as written.
  // After so many more bytes of a stream (both ways together), frames, datagrams or requests the
  // wire is cut, until it is mended. Counts down from when the faults are set.
  std::optional<std::uint64_t> cut_after{};

  static constexpr hal::Duration kHeldBack = std::chrono::milliseconds(10);
};

// The same throws for the same seed and the same questions.
class Dice {
 public:
  explicit Dice(std::uint64_t seed) : state_(mix(seed)) {}

  std::uint64_t next() { return mix(state_++); }
  std::uint64_t below(std::uint64_t bound) { return bound == 0 ? 0 : next() % bound; }
  double uniform() { return static_cast<double>(next() >> 11) * 0x1p-53; }  // [0, 1)
  bool hit(double probability) { return probability > 0 && uniform() < probability; }

 private:
  std::uint64_t state_;
};

}  // namespace sim
