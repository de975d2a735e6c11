// Real time. The only class that may look at the machine's clocks.
#pragma once

#include <ctime>

#include "hal/clock.hpp"

namespace drivers {

// The steady clock since the machine started; no step of the date disturbs it. now() may be called
// from any thread.
class RealClock final : public hal::Clock {
 public:
  hal::Time now() const override;
  hal::Task<void> sleep_until(hal::Time wake) override;

  // How long ago the kernel wrote this time stamp (CLOCK_REALTIME, as SO_TIMESTAMPNS gives). 0 for
  // stamps of the future and for those older than a second: the date was set in between.
  static hal::Duration age_of(const timespec& stamp);
};

}  // namespace drivers
