// What the kernel tells of network interfaces: up or down, and of CAN controllers their state and
// settings. Pure. In the machine's own byte order.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/bytes.hpp"
#include "drivers/gs_usb_codec.hpp"

namespace drivers::rtnetlink {

struct CanSettings {
  std::optional<gs_usb::BusState> state;
  std::optional<std::uint32_t> bit_rate_bps, restart_ms;
  std::optional<std::uint16_t> transmit_errors, receive_errors;
  bool one_shot{}, listen_only{}, loop_back{};
  bool operator==(const CanSettings&) const = default;
};

struct Interface {
  int index{};
  bool removed{};  // It is gone.
  bool up{};       // Somebody started it.
  bool running{};  // It has a carrier, or nobody can say.
  std::string name;
  std::string kind;  // "can", "vcan", "slcan" ...; empty where it says nothing.
  CanSettings can;
  bool operator==(const Interface&) const = default;
};

// Of one datagram; messages of other kinds, and what follows a damaged one, are passed over.
std::vector<Interface> decode(ByteView datagram);

// Asks for one interface.
Bytes ask_for(std::string_view name);

}  // namespace drivers::rtnetlink
