// A scanner with beams above each other that looks ahead while its robot drives.
#pragma once

#include "hal/devices.hpp"
#include "hal/turns.hpp"

namespace hal {

// Its profiles are what level_profile() makes of its turns.
class TurnScanner : public ProfileScanner {
 public:
  // As next_profile(); each turn is told once, by one of the two.
  virtual Task<Result<Turn>> next_turn() = 0;
};

}  // namespace hal
