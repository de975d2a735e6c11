// Many missions, one for each seed, on several threads.
#pragma once

#include <functional>

#include "tests/dst/rig/mission.hpp"

namespace dst {

// In numbers; of all missions that were run.
struct Sums {
  int missions{}, completed{}, resumed{}, stops{}, violated{};
  std::size_t scans{};
  double virtual_s{}, cpu_s{}, driven_m{};  // Of all threads together.
  double wall_s{};                          // By the clock, from the first to the last.
  int jobs{};
  hal::Duration slowest_stop{};

  void add(const Outcome& outcome);
  double factor() const { return virtual_s / wall_s; }         // Times real time, by the clock.
  double factor_of_core() const { return virtual_s / cpu_s; }  // On one core.
  std::string text() const;
};

// Seeds first, first + 1, ...; `each` is called in their order, by one thread at a time.
Sums run_seeds(std::uint64_t first, int count, int jobs,
               const std::function<void(std::uint64_t seed, const Outcome&)>& each);

}  // namespace dst
