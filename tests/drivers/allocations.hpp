// How often this thread has allocated: the program's operator new counts.
#pragma once

#include <cstdint>

namespace drivers_test {

std::uint64_t allocations();

}  // namespace drivers_test
