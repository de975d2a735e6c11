// What the kernel says of interfaces: messages as it builds them, and this machine's own.
#include <gtest/gtest.h>
#include <linux/can/netlink.h>
#include <linux/if.h>
#include <linux/if_link.h>
#include <linux/netlink.h>
#include <linux/rtnetlink.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstring>

#include "drivers/rtnetlink_codec.hpp"

namespace {

using drivers::Bytes;
using drivers::ByteView;
using drivers::rtnetlink::Interface;

template <class T>
Bytes raw(const T& value) {
  Bytes bytes(sizeof value);
  std::memcpy(bytes.data(), &value, sizeof value);
  return bytes;
}

Bytes joined(std::initializer_list<Bytes> parts) {
  Bytes all;
  for (const Bytes& part : parts) all.insert(all.end(), part.begin(), part.end());
  return all;
}

Bytes text(const std::string& value) {
  Bytes bytes(value.begin(), value.end());
  bytes.push_back(0);
  return bytes;
}

Bytes attribute(int type, const Bytes& payload) {
  rtattr head{};
  head.rta_len = static_cast<unsigned short>(sizeof head + payload.size());
  head.rta_type = static_cast<unsigned short>(type);
  Bytes bytes = joined({raw(head), payload});
  bytes.resize((bytes.size() + 3) / 4 * 4);
  return bytes;
}

Bytes message(int type, int index, unsigned flags, const Bytes& attributes) {
  ifinfomsg info{};
  info.ifi_index = index;
  info.ifi_flags = flags;
  nlmsghdr head{};
  head.nlmsg_type = static_cast<std::uint16_t>(type);
  head.nlmsg_len = static_cast<std::uint32_t>(sizeof head + sizeof info + attributes.size());
  return joined({raw(head), raw(info), attributes});
}

Bytes can_link() {
  can_bittiming timing{};
  timing.bitrate = 500'000;
  const can_ctrlmode mode{CAN_CTRLMODE_ONE_SHOT, CAN_CTRLMODE_ONE_SHOT};
  const can_berr_counter counter{128, 7};
  const Bytes data = joined({attribute(IFLA_CAN_STATE, raw(std::uint32_t{CAN_STATE_BUS_OFF})),
                             attribute(IFLA_CAN_BITTIMING, raw(timing)),
                             attribute(IFLA_CAN_RESTART_MS, raw(std::uint32_t{100})),
                             attribute(IFLA_CAN_CTRLMODE, raw(mode)),
                             attribute(IFLA_CAN_BERR_COUNTER, raw(counter))});
  const Bytes info = joined(
      {attribute(IFLA_INFO_KIND, text("can")), attribute(IFLA_INFO_DATA | NLA_F_NESTED, data)});
  return message(RTM_NEWLINK, 7, IFF_UP | IFF_RUNNING,
                 joined({attribute(IFLA_IFNAME, text("can0")), attribute(IFLA_LINKINFO, info)}));
}

TEST(Rtnetlink, ReadsACanInterfaceWhole) {
  const auto interfaces = drivers::rtnetlink::decode(can_link());
  ASSERT_EQ(interfaces.size(), 1U);
  Interface wanted;
  wanted.index = 7;
  wanted.up = wanted.running = true;
  wanted.name = "can0";
  wanted.kind = "can";
  wanted.can = {drivers::gs_usb::BusState::bus_off, 500'000, 100, 128, 7, true, false, false};
  EXPECT_EQ(interfaces[0], wanted);
}

TEST(Rtnetlink, ReadsSeveralMessagesAndRemovals) {
  const Bytes gone = message(RTM_DELLINK, 3, 0, attribute(IFLA_IFNAME, text("vcan0")));
  const Bytes other = message(RTM_NEWADDR, 1, 0, {});
  const auto interfaces = drivers::rtnetlink::decode(joined({other, can_link(), gone}));
  ASSERT_EQ(interfaces.size(), 2U);
  EXPECT_EQ(interfaces[0].name, "can0");
  EXPECT_EQ(interfaces[1].name, "vcan0");
  EXPECT_TRUE(interfaces[1].removed);
  EXPECT_FALSE(interfaces[1].up);
}

TEST(Rtnetlink, TakesNoAttributesOfOtherKindsForCan) {
  const Bytes data = attribute(IFLA_CAN_STATE, raw(std::uint32_t{CAN_STATE_BUS_OFF}));
  const Bytes info =
      joined({attribute(IFLA_INFO_KIND, text("vxlan")), attribute(IFLA_INFO_DATA, data)});
  const auto interfaces =
      drivers::rtnetlink::decode(message(RTM_NEWLINK, 1, IFF_UP, attribute(IFLA_LINKINFO, info)));
  ASSERT_EQ(interfaces.size(), 1U);
  EXPECT_EQ(interfaces[0].can, drivers::rtnetlink::CanSettings{});
}

// Cut anywhere, or with any length claimed: it ends, with what was whole.
TEST(Rtnetlink, EndsOnDamage) {
  const Bytes whole = can_link();
  for (std::size_t size = 0; size < whole.size(); ++size)
    EXPECT_TRUE(drivers::rtnetlink::decode(ByteView(whole).first(size)).empty()) << size;
  for (std::size_t at = 0; at + 1 < whole.size(); at += 2)
    for (const std::uint8_t byte : {0, 1, 3, 255}) {
      Bytes damaged = whole;
      damaged[at] = byte;
      EXPECT_LE(drivers::rtnetlink::decode(damaged).size(), 1U);
    }
}

TEST(Rtnetlink, TheKernelAnswersTheQuestion) {
  const int socket = ::socket(AF_NETLINK, SOCK_RAW | SOCK_CLOEXEC, NETLINK_ROUTE);
  ASSERT_GE(socket, 0);
  const Bytes question = drivers::rtnetlink::ask_for("lo");
  ASSERT_EQ(::send(socket, question.data(), question.size(), 0),
            static_cast<ssize_t>(question.size()));
  Bytes answer(32768);
  const auto size = ::recv(socket, answer.data(), answer.size(), 0);
  close(socket);
  ASSERT_GT(size, 0);
  const auto interfaces =
      drivers::rtnetlink::decode(ByteView(answer).first(static_cast<std::size_t>(size)));
  ASSERT_EQ(interfaces.size(), 1U);
  EXPECT_EQ(interfaces[0].name, "lo");
  EXPECT_EQ(interfaces[0].index, 1);
}

}  // namespace
