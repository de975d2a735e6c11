// How often a password may be tried, over all consoles together. Pure.
#pragma once

#include <optional>

#include "hal/values.hpp"

namespace mission {

class LoginLimit {
 public:
  static constexpr int kTriesMax = 5;
  static constexpr hal::Duration kLocked = std::chrono::seconds(60);

  // How long nobody may try any more; nothing: a try may begin, and counts as wrong until it turns
  // out right.
  std::optional<hal::Duration> locked_for(hal::Time now);
  void begin_try(hal::Time now);
  void was_right() {
    wrong_ = 0;
    locked_since_.reset();
  }
  int tries_left() const { return kTriesMax - wrong_; }

 private:
  int wrong_ = 0;
  std::optional<hal::Time> locked_since_;
};

}  // namespace mission
