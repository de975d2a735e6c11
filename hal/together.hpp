// Tasks that live together.
#pragma once

#include <vector>

#include "hal/task.hpp"

namespace hal {

// Runs all of them at once until the last has ended. What one throws cancels the others, and is
// thrown on; a cancellation cancels all.
Task<void> together(std::vector<Task<void>> tasks);

// Runs both until the first has ended, cancels the other and waits for its end. What the first one
// throws is thrown on; what the other throws is not. Returns which was first: 0 or 1.
Task<int> first_of(Task<void> one, Task<void> other);

}  // namespace hal
