// Tasks that live together.
#pragma once

#include <vector>

#include "hal/task.hpp"

namespace hal {

// Runs all of them at once until the last has ended. What one throws cancels the others, and is
// thrown on; a cancellation cancels all.
Task<void> together(std::vector<Task<void>> tasks);

}  // namespace hal
