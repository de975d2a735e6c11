// What the loops of profile scanners share: the queue of profiles, and whether they come as they
// should.
#pragma once

#include <cstdint>
#include <deque>
#include <string>

#include "drivers/signal.hpp"
#include "drivers/troubles.hpp"
#include "hal/clock.hpp"
#include "hal/values.hpp"

namespace drivers {

// At most `most` wait; then the oldest is lost, and told in lost_before of the next.
class ProfileQueue {
 public:
  explicit ProfileQueue(std::size_t most) : most_(most) {}

  void put(hal::Profile profile);
  void clear() { profiles_.clear(); }
  // Fails with errc::timed_out.
  hal::Task<hal::Result<hal::Profile>> next(hal::Clock& clock, hal::Duration timeout);
  std::uint64_t dropped() const { return dropped_; }

 private:
  std::size_t most_;
  std::deque<hal::Profile> profiles_;
  Signal arrived_;
  std::uint64_t dropped_{};
};

// Judges the stream scan by scan and keeps the troubles up to date: the same scan again and again,
// scans out of order, too slow, late, or lost.
class ScanWatch {
 public:
  explicit ScanWatch(Troubles& troubles) : troubles_(troubles) {}

  void repeated(const std::string& which);
  void out_of_order();
  // A new scan: `step_s` after the one before (0: not known) instead of `period_s`, arriving
  // `late_s` later than the fastest do, with so many lost before it.
  void came(double step_s, double period_s, double late_s, std::uint64_t lost);

  std::uint64_t repetitions() const { return repetitions_; }
  std::uint64_t disorders() const { return disorders_; }
  double jitter_s() const { return jitter_s_; }  // Of arrivals, over the last second or so.

 private:
  void in_a_row(bool bad, int& count, const Fault& fault, const std::string& detail);

  Troubles& troubles_;
  std::uint64_t repetitions_{}, disorders_{};
  int stuck_{}, slow_{}, late_{}, in_order_{};  // How often in a row.
  double lost_share_{}, jitter_s_{};
};

}  // namespace drivers
