#include "tests/links/promises/datagram_promises.hpp"

namespace links_test {
namespace {

namespace errc = boost::system::errc;

hal::Task<Bytes> next(DatagramRig& rig, std::size_t longest = 2000) {
  Bytes buffer(longest);
  const auto received = co_await patiently(rig.loop(), 5s, rig.port().receive(buffer));
  require(received.has_value(), "nothing arrives within 5 s");
  require_success(*received, "receive");
  buffer.resize((*received)->size);
  co_return buffer;
}

hal::Task<void> arrive_whole_and_in_order(DatagramRig& rig) {
  for (std::uint32_t i = 0; i < 50; ++i) co_await rig.send(some_bytes(i * 29, i));
  for (std::uint32_t i = 0; i < 50; ++i)
    require(co_await next(rig) == some_bytes(i * 29, i), "datagram " + std::to_string(i));
}

hal::Task<void> are_stamped_when_they_arrive(DatagramRig& rig) {
  co_await rig.loop().clock().sleep_for(100ms);  // A kernel takes a while to begin stamping.
  const hal::Time sent = rig.loop().clock().now();
  co_await rig.send(Bytes(1, 1));
  co_await rig.loop().clock().sleep_for(200ms);  // Nobody receives in the meantime.
  Bytes buffer(10);
  const auto received = co_await rig.port().receive(buffer);
  require_success(received, "receive");
  const hal::Duration after = received->stamp - sent;
  require(after >= -1ms && after < 100ms,
          "stamped " + std::to_string(hal::seconds(after)) + " s after it was sent");
}

hal::Task<void> too_long_ones_are_told_and_gone(DatagramRig& rig) {
  co_await rig.send(Bytes(101, 1));
  co_await rig.send(Bytes(100, 2));
  Bytes buffer(100);
  require_error(co_await rig.port().receive(buffer), errc::message_size, "101 bytes into 100");
  require(co_await next(rig, 100) == Bytes(100, 2), "the next one");
}

hal::Task<void> a_cancelled_receive_loses_nothing(DatagramRig& rig) {
  for (std::uint8_t i = 0; i < 10; ++i) {
    Bytes buffer(10);
    require(!co_await patiently(rig.loop(), 5ms, rig.port().receive(buffer)), "something came");
    co_await rig.send(Bytes(1, i));
    require(co_await next(rig) == Bytes(1, i), "the one behind a cancelled call");
  }
}

hal::Task<void> what_does_not_fit_is_counted(DatagramRig& rig) {
  constexpr std::size_t kSent = 20'000;
  for (std::size_t i = 0; i < kSent; ++i) co_await rig.send(Bytes(1400, 1));
  std::size_t got = 0;
  Bytes buffer(1400);
  for (;;) {
    const auto received = co_await patiently(rig.loop(), 100ms, rig.port().receive(buffer));
    if (!received) break;
    ++got;
  }
  // The counter comes with the next datagram.
  co_await rig.send(Bytes(1, 1));
  co_await next(rig);
  require(got < kSent, "28 MB wait for a receiver");
  require(got + rig.lost() == kSent,
          std::to_string(got) + " received and " + std::to_string(rig.lost()) + " counted as lost");
}

hal::Task<void> waiting_costs_nothing(DatagramRig& rig) {
  const auto wait = [&]() -> hal::Task<void> {
    Bytes buffer(10);
    static_cast<void>(co_await rig.port().receive(buffer));
  };
  const auto rested = co_await (wait() || rest(rig.loop(), "a silent port"));
  require(rested.index() == 1, "something came");
}

constexpr Promise<DatagramRig> kDatagramPromises[] = {
    {"DatagramsArriveWholeAndInOrder", arrive_whole_and_in_order},
    {"DatagramsAreStampedWhenTheyArrive", are_stamped_when_they_arrive},
    {"TooLongOnesAreToldAndGone", too_long_ones_are_told_and_gone},
    {"ACancelledReceiveLosesNothing", a_cancelled_receive_loses_nothing},
    {"WhatDoesNotFitIsCounted", what_does_not_fit_is_counted},
    {"WaitingCostsNothing", waiting_costs_nothing},
};

}  // namespace

std::span<const Promise<DatagramRig>> datagram_promises() {
  return kDatagramPromises;
}

}  // namespace links_test
