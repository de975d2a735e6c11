// Looks for a device on a port whose bit rate may have to be found.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "drivers/frame_reader.hpp"
#include "drivers/link_address.hpp"

namespace drivers {

// A serial line whose rate can be set; `line` is as its robot file says.
struct SettableLine {
  SerialLine line;
  SetBaud set_baud;
};

enum class Found : std::uint8_t { nothing, other, ours };

// The last rate first: after a loss the device is there most likely. The others only where the
// port's rate can be set.
std::vector<int> rates_to_try(int last_baud, std::span<const int> known_bauds,
                              const SetBaud& set_baud);

// Asks at each rate until something answers; when nothing does, again until over a second has
// passed: who else is on the port may speak but once a second, and is heard then.
hal::Task<Found> search_port(hal::Clock& clock, const std::vector<int>& bauds,
                             std::function<hal::Task<Found>(int baud)> ask_at);

}  // namespace drivers
