// What every device loop has in common: it starts (identification, settings with read-back), runs,
// recovers, and can say how it is.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "drivers/fault.hpp"
#include "hal/task.hpp"
#include "hal/values.hpp"

namespace drivers {

// Who answered.
struct Identity {
  std::string maker, model, serial, firmware;
};

// One thing that is wrong with a device. `detail` names the value and the place: "answered 115200
// baud garbage", "node 5 sent no heartbeat for 320 ms".
struct Trouble {
  const Fault* fault{};  // Of a static table; never null.
  std::string detail;
};

enum class DeviceState { off, starting, running, lost };

class Device {
 public:
  virtual ~Device() = default;

  virtual std::string_view model() const = 0;  // As in the robot file: "sick-lms5xx".

  // Starts, and keeps it running: restarts it after cable or power loss as its sheet says. Ends
  // only by cancellation. To be spawned once.
  virtual hal::Task<void> run() = 0;

  // Changes while run() runs.
  virtual DeviceState state() const = 0;
  virtual const Identity& identity() const = 0;       // Empty before it was identified.
  virtual std::vector<Trouble> troubles() const = 0;  // Present now; empty when healthy.
  // What else is worth knowing now, for a person, in one line; empty: nothing.
  virtual std::string condition() const { return {}; }
};

}  // namespace drivers
