// Where long computations run: on a robot beside the event loop, in simulation in its place.
#pragma once

#include <functional>

#include "hal/task.hpp"

namespace hal {

class Compute {
 public:
  virtual ~Compute() = default;
  // Ends when the work has; throws what it throws. A caller that is cancelled still waits for it:
  // what the work refers to stays alive until then.
  virtual Task<void> run(std::function<void()> work) = 0;
};

// At once, on the event loop: time stands still meanwhile.
class ComputeHere final : public Compute {
 public:
  Task<void> run(std::function<void()> work) override {
    work();
    co_return;
  }
};

}  // namespace hal
