// What a CAN bus promises: two ends of one bus.
#pragma once

#include "tests/links/promises/promises.hpp"

namespace links_test {

struct CanRig {
  virtual ~CanRig() = default;
  virtual Loop& loop() = 0;
  virtual hal::CanBus& a() = 0;
  virtual hal::CanBus& b() = 0;
  // Takes the bus away from both, and gives it back. False: cannot.
  virtual bool cut() { return false; }
  virtual void mend() {}
  // Nobody is there to acknowledge what `a` sends. False: cannot.
  virtual bool silence(bool) { return false; }
  // Whether a frame that nobody acknowledged by its deadline is taken back from the controller.
  virtual bool recalls() const { return true; }
};

std::span<const Promise<CanRig>> can_promises();

}  // namespace links_test
