#pragma once

#include "hal/task.hpp"
#include "hal/values.hpp"

namespace hal {

// The only source of time in the program. Real time on the robot, simulated time in a test.
class Clock {
 public:
  virtual ~Clock() = default;
  virtual Time now() const = 0;
  // Throws boost::system::system_error(operation_aborted) when the caller is cancelled.
  virtual Task<void> sleep_until(Time wake) = 0;

  Task<void> sleep_for(Duration pause) { return sleep_until(now() + pause); }
};

}  // namespace hal
