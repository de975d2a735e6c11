// How the parts of a loop wait for each other with a deadline, and how one at a time uses a link.
#pragma once

#include <utility>

#include "hal/clock.hpp"
#include "hal/wake.hpp"

namespace drivers {

class Signal {
 public:
  void notify() { wake_.notify(); }
  // True when notified while waiting, false at the deadline.
  hal::Task<bool> wait_until(hal::Clock& clock, hal::Time deadline);

 private:
  hal::Wake wake_;
};

// Lets one through at a time.
class Turns {
 public:
  // Held until destroyed; must not outlive its Turns.
  class Turn {
   public:
    explicit Turn(Turns* of) : of_(of) {}
    Turn(Turn&& other) noexcept : of_(std::exchange(other.of_, nullptr)) {}
    Turn& operator=(Turn&&) = delete;
    ~Turn() {
      if (of_ != nullptr) of_->free();
    }

   private:
    Turns* of_;
  };
  hal::Task<Turn> take();

 private:
  void free();

  hal::Wake freed_;
  bool taken_{};
};

}  // namespace drivers
