#include "tests/links/promises/stream_promises.hpp"

#include <algorithm>

namespace links_test {
namespace {

namespace errc = boost::system::errc;

constexpr std::uint8_t kProbe = 0xA5;

// What has arrived or arrives within a moment.
hal::Task<Bytes> drain(StreamRig& rig, hal::ByteStream& stream) {
  Bytes all, buffer(4096);
  for (;;) {
    const auto size = co_await patiently(rig.loop(), 30ms, stream.read_some(buffer));
    if (!size) co_return all;
    if (*size)
      all.insert(all.end(), buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(**size));
  }
}

hal::Task<bool> probe(StreamRig& rig, hal::ByteStream& from, hal::ByteStream& to) {
  const Bytes byte{kProbe};
  if (!co_await from.write(byte)) {
    co_await rig.loop().clock().sleep_for(20ms);
    co_return false;
  }
  const Bytes heard = co_await drain(rig, to);
  co_return std::find(heard.begin(), heard.end(), kProbe) != heard.end();
}

// Until bytes go both ways; losses may be told in the meantime. Leaves nothing unread.
hal::Task<void> up(StreamRig& rig) {
  const hal::Time late = rig.loop().clock().now() + 20s;
  bool there = false, back = false;
  while (!there || !back) {
    require(rig.loop().clock().now() < late, "it does not come up within 20 s");
    if (!there)
      there = co_await probe(rig, rig.a(), rig.b());
    else
      back = co_await probe(rig, rig.b(), rig.a());
  }
  co_await drain(rig, rig.a());
  co_await drain(rig, rig.b());
}

hal::Task<void> write_in_pieces(hal::ByteStream& stream, const Bytes& bytes) {
  sim::Dice dice(5);
  for (std::size_t at = 0; at < bytes.size();) {
    const std::size_t size = std::min<std::size_t>(bytes.size() - at, 1 + dice.below(700));
    require_success(co_await stream.write(std::span(bytes).subspan(at, size)), "write");
    at += size;
  }
}

hal::Task<void> read_all(hal::ByteStream& stream, const Bytes& wanted) {
  Bytes got, buffer(333);
  while (got.size() < wanted.size()) {
    const auto size = co_await stream.read_some(buffer);
    require_success(size, "read");
    require(*size > 0, "read nothing");
    got.insert(got.end(), buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(*size));
  }
  require(got == wanted, "the bytes differ");
}

hal::Task<void> arrive_whole_and_in_order(StreamRig& rig) {
  co_await up(rig);
  const Bytes bytes = some_bytes(50'000, 1);
  co_await within(rig.loop(), 30s, "50 kB",
                  (write_in_pieces(rig.a(), bytes) && read_all(rig.b(), bytes)));
}

hal::Task<void> go_both_ways_at_once(StreamRig& rig) {
  co_await up(rig);
  const Bytes there = some_bytes(20'000, 2), back = some_bytes(20'000, 3);
  co_await within(rig.loop(), 30s, "20 kB each way",
                  (write_in_pieces(rig.a(), there) && read_all(rig.b(), there) &&
                   write_in_pieces(rig.b(), back) && read_all(rig.a(), back)));
}

// Every value of a byte: nothing is translated, echoed or taken for a command.
hal::Task<void> every_byte_passes_as_it_is(StreamRig& rig) {
  co_await up(rig);
  Bytes all(256);
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<std::uint8_t>(i);
  co_await within(rig.loop(), 10s, "256 bytes there",
                  (write_in_pieces(rig.a(), all) && read_all(rig.b(), all)));
  co_await within(rig.loop(), 10s, "256 bytes back",
                  (write_in_pieces(rig.b(), all) && read_all(rig.a(), all)));
  require((co_await drain(rig, rig.a())).empty(), "an echo");
}

hal::Task<void> writing_nothing_is_nothing(StreamRig& rig) {
  co_await up(rig);
  require_success(co_await rig.a().write({}), "write nothing");
  require((co_await drain(rig, rig.b())).empty(), "something arrived");
}

// Two writers do not mix their messages.
hal::Task<void> writes_do_not_mix(StreamRig& rig) {
  co_await up(rig);
  const Bytes ones(20'000, 1), twos(20'000, 2);
  Bytes got;
  const auto read = [&]() -> hal::Task<void> {
    Bytes buffer(1000);
    while (got.size() < ones.size() + twos.size()) {
      const auto size = co_await rig.b().read_some(buffer);
      require_success(size, "read");
      got.insert(got.end(), buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(*size));
    }
  };
  const auto write = [&](const Bytes& bytes) -> hal::Task<void> {
    require_success(co_await rig.a().write(bytes), "write");
  };
  co_await within(rig.loop(), 30s, "two messages", (write(ones) && write(twos) && read()));
  Bytes wanted = ones;
  wanted.insert(wanted.end(), twos.begin(), twos.end());
  require(got == wanted, "the messages are mixed");
}

void demand_cut(StreamRig& rig) {
  if (!rig.cut()) throw Skipped("cannot be cut here");
}

hal::Task<void> told(StreamRig& rig) {
  Bytes buffer(100);
  const auto size = co_await patiently(rig.loop(), 15s, rig.a().read_some(buffer));
  require(size.has_value(), "the loss is not told within 15 s");
  require_error(*size, errc::not_connected, "read on a cut stream");
}

hal::Task<void> a_loss_is_told_once_and_ends_by_itself(StreamRig& rig) {
  co_await up(rig);
  demand_cut(rig);
  co_await told(rig);
  require_error(co_await rig.a().write(Bytes(1, 1)), errc::not_connected, "write on a cut stream");
  Bytes buffer(100);
  require(!co_await patiently(rig.loop(), 300ms, rig.a().read_some(buffer)),
          "the loss is told twice");
  rig.mend();
  co_await up(rig);
  const Bytes bytes = some_bytes(2000, 4);
  co_await within(rig.loop(), 10s, "bytes after the loss",
                  (write_in_pieces(rig.a(), bytes) && read_all(rig.b(), bytes)));
}

hal::Task<void> whoever_waits_hears_of_the_loss(StreamRig& rig) {
  co_await up(rig);
  const auto later = [&]() -> hal::Task<void> {
    co_await rig.loop().clock().sleep_for(50ms);
    demand_cut(rig);
  };
  co_await (told(rig) && later());
  rig.mend();
  co_await up(rig);
}

hal::Task<void> a_dead_link_rests(StreamRig& rig) {
  co_await up(rig);
  demand_cut(rig);
  co_await told(rig);
  const auto wait = [&]() -> hal::Task<void> {
    Bytes buffer(100);
    for (;;) static_cast<void>(co_await rig.a().read_some(buffer));
  };
  const auto rested = co_await (wait() || rest(rig.loop(), "a cut stream"));
  require(rested.index() == 1, "unreachable");
  rig.mend();
  co_await up(rig);
}

hal::Task<void> a_cancelled_read_loses_nothing(StreamRig& rig) {
  co_await up(rig);
  Bytes buffer(100);
  for (std::uint8_t i = 0; i < 10; ++i) {
    require(!co_await patiently(rig.loop(), 5ms, rig.a().read_some(buffer)), "read something");
    const Bytes byte{i};
    require_success(co_await rig.b().write(byte), "write");
    co_await within(rig.loop(), 5s, "what came in between", read_all(rig.a(), byte));
  }
}

hal::Task<void> a_cancelled_write_leaves_it_usable(StreamRig& rig) {
  co_await up(rig);
  // Nobody reads: it has to wait at some time.
  const Bytes much(16 << 20, 7);
  require(!co_await patiently(rig.loop(), 200ms, rig.a().write(much)),
          "16 MB vanish though nobody reads");
  for (;;) {
    const Bytes rest = co_await drain(rig, rig.b());
    if (rest.empty()) break;
  }
  const Bytes bytes = some_bytes(2000, 6);
  co_await within(rig.loop(), 10s, "bytes after a cancelled write",
                  (write_in_pieces(rig.a(), bytes) && read_all(rig.b(), bytes)));
}

hal::Task<void> exchange(StreamRig& rig, std::uint32_t number) {
  const Bytes bytes = some_bytes(50, number);
  co_await within(rig.loop(), 5s, "a message there",
                  (write_in_pieces(rig.a(), bytes) && read_all(rig.b(), bytes)));
  co_await within(rig.loop(), 5s, "a message back",
                  (write_in_pieces(rig.b(), bytes) && read_all(rig.a(), bytes)));
}

hal::Task<void> a_dialogue_survives_a_cut_at_any_call(StreamRig& rig) {
  constexpr std::uint32_t kCalls = 4;
  for (std::uint32_t fails = 0; fails < kCalls; ++fails) {
    co_await up(rig);
    for (std::uint32_t i = 0; i < kCalls; ++i) {
      if (i == fails) {
        demand_cut(rig);
        co_await told(rig);
        rig.mend();
        co_await up(rig);
      }
      co_await exchange(rig, i);
    }
  }
}

constexpr Promise<StreamRig> kStreamPromises[] = {
    {"BytesArriveWholeAndInOrder", arrive_whole_and_in_order},
    {"BytesGoBothWaysAtOnce", go_both_ways_at_once},
    {"EveryBytePassesAsItIs", every_byte_passes_as_it_is},
    {"WritingNothingIsNothing", writing_nothing_is_nothing},
    {"WritesDoNotMix", writes_do_not_mix},
    {"ALossIsToldOnceAndEndsByItself", a_loss_is_told_once_and_ends_by_itself},
    {"WhoeverWaitsHearsOfTheLoss", whoever_waits_hears_of_the_loss},
    {"ADeadLinkRests", a_dead_link_rests},
    {"ACancelledReadLosesNothing", a_cancelled_read_loses_nothing},
    {"ACancelledWriteLeavesItUsable", a_cancelled_write_leaves_it_usable},
    {"ADialogueSurvivesACutAtAnyCall", a_dialogue_survives_a_cut_at_any_call},
};

}  // namespace

std::span<const Promise<StreamRig>> stream_promises() {
  return kStreamPromises;
}

}  // namespace links_test
