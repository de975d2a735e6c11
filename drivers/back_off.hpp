// How long to wait before something is tried again.
#pragma once

#include <algorithm>
#include <optional>

#include "hal/values.hpp"

namespace drivers {

// The pause before the next attempt: doubles up to a bound.
class BackOff {
 public:
  BackOff(hal::Duration first, hal::Duration longest) : first_(first), longest_(longest) {}

  hal::Duration next() {
    const hal::Duration pause = next_.value_or(first_);
    next_ = std::min(2 * pause, longest_);
    return pause;
  }
  void reset() { next_.reset(); }

 private:
  hal::Duration first_, longest_;
  std::optional<hal::Duration> next_;
};

}  // namespace drivers
