// What codecs return for bytes that are no message of their device.
#pragma once

#include <string_view>

namespace drivers {

struct Unread {
  std::string_view why;  // The same words for the same reason.

  bool operator==(const Unread&) const = default;
};

}  // namespace drivers
