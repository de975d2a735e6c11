#include "drivers/rtnetlink_codec.hpp"

#include <linux/can/netlink.h>
#include <linux/if.h>
#include <linux/if_link.h>
#include <linux/netlink.h>
#include <linux/rtnetlink.h>

#include <algorithm>
#include <cstring>

namespace drivers::rtnetlink {
namespace {

constexpr std::size_t kAlign = 4;

std::size_t aligned(std::size_t size) {
  return (size + kAlign - 1) / kAlign * kAlign;
}

template <class T>
std::optional<T> read(ByteView bytes) {
  if (bytes.size() < sizeof(T)) return std::nullopt;
  T value;
  std::memcpy(&value, bytes.data(), sizeof value);
  return value;
}

std::string text(ByteView bytes) {
  return {bytes.begin(), std::find(bytes.begin(), bytes.end(), 0)};
}

// Calls f(type, payload) for each attribute.
template <class F>
void for_each_attribute(ByteView bytes, F&& f) {
  while (const auto head = read<rtattr>(bytes)) {
    if (head->rta_len < sizeof(rtattr) || head->rta_len > bytes.size()) return;
    f(head->rta_type & NLA_TYPE_MASK,
      bytes.subspan(sizeof(rtattr), head->rta_len - sizeof(rtattr)));
    bytes = bytes.subspan(std::min(aligned(head->rta_len), bytes.size()));
  }
}

void read_can(CanSettings& can, int type, ByteView payload) {
  if (type == IFLA_CAN_STATE) {
    if (const auto state = read<std::uint32_t>(payload); state && *state <= CAN_STATE_SLEEPING)
      can.state = gs_usb::BusState{*state};
  } else if (type == IFLA_CAN_BITTIMING) {
    if (const auto timing = read<can_bittiming>(payload)) can.bit_rate_bps = timing->bitrate;
  } else if (type == IFLA_CAN_RESTART_MS) {
    can.restart_ms = read<std::uint32_t>(payload);
  } else if (type == IFLA_CAN_CTRLMODE) {
    const auto flags = read<can_ctrlmode>(payload).value_or(can_ctrlmode{}).flags;
    can.one_shot = (flags & CAN_CTRLMODE_ONE_SHOT) != 0;
    can.listen_only = (flags & CAN_CTRLMODE_LISTENONLY) != 0;
    can.loop_back = (flags & CAN_CTRLMODE_LOOPBACK) != 0;
  } else if (type == IFLA_CAN_BERR_COUNTER) {
    if (const auto counter = read<can_berr_counter>(payload)) {
      can.transmit_errors = counter->txerr;
      can.receive_errors = counter->rxerr;
    }
  }
}

void read_info(Interface& interface, ByteView info) {
  ByteView data;
  for_each_attribute(info, [&](int type, ByteView payload) {
    if (type == IFLA_INFO_KIND) interface.kind = text(payload);
    if (type == IFLA_INFO_DATA) data = payload;
  });
  if (interface.kind != "can") return;  // Other kinds number their attributes differently.
  for_each_attribute(data,
                     [&](int type, ByteView payload) { read_can(interface.can, type, payload); });
}

std::optional<Interface> decode_message(std::uint16_t type, ByteView payload) {
  if (type != RTM_NEWLINK && type != RTM_DELLINK) return std::nullopt;
  const auto head = read<ifinfomsg>(payload);
  if (!head) return std::nullopt;
  Interface interface;
  interface.index = head->ifi_index;
  interface.removed = type == RTM_DELLINK;
  interface.up = (head->ifi_flags & IFF_UP) != 0;
  interface.running = (head->ifi_flags & IFF_RUNNING) != 0;
  for_each_attribute(payload.subspan(aligned(sizeof(ifinfomsg))), [&](int kind, ByteView value) {
    if (kind == IFLA_IFNAME) interface.name = text(value);
    if (kind == IFLA_LINKINFO) read_info(interface, value);
  });
  return interface;
}

template <class T>
void append(Bytes& bytes, const T& value) {
  const auto* begin = reinterpret_cast<const std::uint8_t*>(&value);
  bytes.insert(bytes.end(), begin, begin + sizeof value);
}

}  // namespace

std::vector<Interface> decode(ByteView datagram) {
  std::vector<Interface> interfaces;
  while (const auto head = read<nlmsghdr>(datagram)) {
    if (head->nlmsg_len < sizeof(nlmsghdr) || head->nlmsg_len > datagram.size()) break;
    const ByteView payload = datagram.subspan(sizeof(nlmsghdr), head->nlmsg_len - sizeof(nlmsghdr));
    if (auto interface = decode_message(head->nlmsg_type, payload))
      interfaces.push_back(std::move(*interface));
    datagram = datagram.subspan(std::min(aligned(head->nlmsg_len), datagram.size()));
  }
  return interfaces;
}

Bytes ask_for(std::string_view name) {
  nlmsghdr head{};
  ifinfomsg info{};
  rtattr attribute{};
  attribute.rta_type = IFLA_IFNAME;
  attribute.rta_len = static_cast<unsigned short>(sizeof attribute + name.size() + 1);
  head.nlmsg_type = RTM_GETLINK;
  head.nlmsg_flags = NLM_F_REQUEST;
  head.nlmsg_len =
      static_cast<std::uint32_t>(sizeof head + sizeof info + aligned(attribute.rta_len));
  Bytes bytes;
  append(bytes, head);
  append(bytes, info);
  append(bytes, attribute);
  bytes.insert(bytes.end(), name.begin(), name.end());
  bytes.resize(head.nlmsg_len);
  return bytes;
}

}  // namespace drivers::rtnetlink
