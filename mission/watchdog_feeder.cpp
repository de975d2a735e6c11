#include "mission/watchdog_feeder.hpp"

#include <utility>

namespace mission {

hal::Task<void> WatchdogFeeder::run() {
  for (;;) {
    look();
    co_await clock_.sleep_for(config_.period);
  }
}

void WatchdogFeeder::look() {
  const auto late = heartbeat_.late(clock_.now());
  if (late) {
    if (std::exchange(named_, late->name) != late->name) config_.hangs(*late);
    return;
  }
  if (!std::exchange(named_, {}).empty()) config_.goes_on();
  config_.feed();
}

}  // namespace mission
