// What the kernel writes beside a received message. For .cpp files of links.
#pragma once

#include <sys/socket.h>

#include <cstdint>
#include <cstring>
#include <optional>

#include "drivers/real_clock.hpp"

namespace drivers {

struct KernelNotes {
  hal::Duration age{};                   // How long ago it arrived; 0 where not stamped.
  std::optional<std::uint32_t> dropped;  // SO_RXQ_OVFL: since the socket was opened; wraps.
};

inline KernelNotes read_notes(msghdr& message) {
  KernelNotes notes;
  for (cmsghdr* head = CMSG_FIRSTHDR(&message); head != nullptr;
       head = CMSG_NXTHDR(&message, head)) {
    if (head->cmsg_level != SOL_SOCKET) continue;
    if (head->cmsg_type == SO_TIMESTAMPNS) {
      timespec stamp{};
      std::memcpy(&stamp, CMSG_DATA(head), sizeof stamp);
      notes.age = RealClock::age_of(stamp);
    } else if (head->cmsg_type == SO_RXQ_OVFL) {
      std::uint32_t dropped = 0;
      std::memcpy(&dropped, CMSG_DATA(head), sizeof dropped);
      notes.dropped = dropped;
    }
  }
  return notes;
}

}  // namespace drivers
