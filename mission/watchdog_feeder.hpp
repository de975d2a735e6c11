// Feeds a watchdog only while every task of the program goes on, and names who does not.
#pragma once

#include <functional>

#include "hal/clock.hpp"
#include "mission/heartbeat.hpp"

namespace mission {

class WatchdogFeeder {
 public:
  struct Config {
    hal::Duration period{};      // Between two looks: a quarter of the watchdog's time, or less.
    std::function<void()> feed;  // In each look that finds all going on.
    // Who keeps it from feeding, when that begins and when it is another one.
    std::function<void(const Heartbeat::Late&)> hangs;
    std::function<void()> goes_on;  // All do again: it was late, not dead.
  };
  // Heartbeat and clock must outlive it.
  WatchdogFeeder(Config config, const Heartbeat& heartbeat, hal::Clock& clock)
      : config_(std::move(config)), heartbeat_(heartbeat), clock_(clock) {}

  // On an event loop that does nothing else: what hangs must not keep it from saying so. Ends only
  // by cancellation.
  hal::Task<void> run();
  void look();

 private:
  const Config config_;
  const Heartbeat& heartbeat_;
  hal::Clock& clock_;
  std::string_view named_;  // Whom it told of; empty: nobody.
};

}  // namespace mission
