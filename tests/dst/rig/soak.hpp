// One long mission in which devices come and go all the time: memory and descriptors stay flat.
#pragma once

#include <string>

#include "tests/dst/rig/mission.hpp"

namespace dst {

struct SoakResult {
  Outcome outcome;
  double resident_early_mib{}, resident_late_mib{};  // The most in the first tenth, and after it.
  int descriptors_early{}, descriptors_late{};
  int faults{};

  // A little for what the allocator keeps.
  static constexpr double kGrowthMax_mib = 2;
  bool flat() const {
    return resident_late_mib - resident_early_mib <= kGrowthMax_mib &&
           descriptors_late <= descriptors_early;
  }
  std::string text() const;
};

// A person holds the robot by its e-stop for `during` of virtual time, in the middle of a mission
// that then goes on to its end.
SoakResult soak(std::uint64_t seed, hal::Duration during);

}  // namespace dst
