// How the parts of a loop wake each other, and how one at a time uses a link.
#pragma once

#include <memory>
#include <utility>

#include "hal/clock.hpp"

namespace drivers {

// Wakes one who waits. A notice with nobody waiting is kept for the next one, once.
class Signal {
 public:
  Signal();
  ~Signal();

  void notify();
  // True when notified, false at the deadline.
  hal::Task<bool> wait_until(hal::Clock& clock, hal::Time deadline);

 private:
  struct Channel;
  std::unique_ptr<Channel> channel_;
  bool noticed_{};
};

// Lets one through at a time, in the order of asking.
class Turns {
 public:
  Turns();
  ~Turns();

  // Holds the turn until it is destroyed.
  class Turn {
   public:
    explicit Turn(Turns* of) : of_(of) {}
    Turn(Turn&& other) noexcept : of_(std::exchange(other.of_, nullptr)) {}
    Turn& operator=(Turn&&) = delete;
    ~Turn();

   private:
    Turns* of_;
  };
  // Outlives every turn it gave.
  hal::Task<Turn> take();

 private:
  struct Channel;
  std::unique_ptr<Channel> channel_;
};

}  // namespace drivers
