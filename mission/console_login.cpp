#include "mission/console_login.hpp"

namespace mission {

std::optional<hal::Duration> LoginLimit::locked_for(hal::Time now) {
  if (!locked_since_) return std::nullopt;
  if (now - *locked_since_ < kLocked) return kLocked - (now - *locked_since_);
  locked_since_.reset();
  wrong_ = 0;
  return std::nullopt;
}

void LoginLimit::begin_try(hal::Time now) {
  if (++wrong_ >= kTriesMax) locked_since_ = now;
}

}  // namespace mission
