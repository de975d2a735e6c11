// When a machine took a processor away from everything that ran on it: a host with other guests
// does, for tens of milliseconds, and no program can be on time then.
#pragma once

#include <algorithm>
#include <vector>

#include "hal/clock.hpp"

namespace test {

struct Away {
  hal::Time from, until;
};

// What of the lateness of something that was due at `due` and came at `came` is not the machine's.
// `away`: of the processor it ran on, in order, none over another.
inline hal::Duration own_lateness(hal::Time due, hal::Time came, const std::vector<Away>& away) {
  hal::Duration own = came - due;
  for (const Away& gap : away)
    own -= std::max(hal::Duration(0), std::min(came, gap.until) - std::max(due, gap.from));
  return std::max(hal::Duration(0), own);
}

}  // namespace test
