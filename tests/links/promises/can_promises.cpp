#include "tests/links/promises/can_promises.hpp"

namespace links_test {
namespace {

namespace errc = boost::system::errc;

constexpr std::uint32_t kProbeId = 0x7E5;

hal::Time in(CanRig& rig, hal::Duration span) {
  return rig.loop().clock().now() + span;
}

hal::CanFrame frame_number(std::uint32_t number) {
  hal::CanFrame frame;
  frame.extended = number % 3 == 0;
  frame.id = frame.extended ? 0x10000 + number : number % 0x700;
  frame.size = static_cast<std::uint8_t>(number % 9);
  frame.remote = number % 11 == 0;
  if (!frame.remote)
    for (std::uint8_t i = 0; i < frame.size; ++i)
      frame.data[i] = static_cast<std::uint8_t>(number * 31 + i);
  return frame;
}

// The next frame that is no probe.
hal::Task<hal::CanFrame> next(hal::CanBus& bus) {
  for (;;) {
    const auto received = co_await bus.receive();
    require_success(received, "receive");
    if (received->frame.id != kProbeId) co_return received->frame;
  }
}

hal::Task<bool> probe(CanRig& rig, hal::CanBus& from, hal::CanBus& to) {
  if (!co_await from.send({kProbeId, 0}, in(rig, 1s))) {
    co_await rig.loop().clock().sleep_for(20ms);
    co_return false;
  }
  const auto heard = co_await patiently(rig.loop(), 1s, to.receive());
  co_return heard && heard->has_value();
}

hal::Task<void> drain(CanRig& rig, hal::CanBus& bus) {
  for (;;) {
    const auto received = co_await patiently(rig.loop(), 20ms, bus.receive());
    if (!received) co_return;
  }
}

// Until frames go both ways; losses may be told in the meantime. Leaves nothing unread.
hal::Task<void> up(CanRig& rig) {
  const hal::Time late = in(rig, 60s);
  bool there = false, back = false;
  while (!there || !back) {
    require(rig.loop().clock().now() < late, "it does not come up within a minute");
    if (!there)
      there = co_await probe(rig, rig.a(), rig.b());
    else
      back = co_await probe(rig, rig.b(), rig.a());
  }
  co_await drain(rig, rig.a());
  co_await drain(rig, rig.b());
}

hal::Task<void> send_numbers(CanRig& rig, hal::CanBus& bus, std::uint32_t first,
                             std::uint32_t count) {
  for (std::uint32_t i = first; i < first + count; ++i)
    require_success(co_await bus.send(frame_number(i), in(rig, 2s)), "send");
}

hal::Task<void> receive_numbers(CanRig& rig, hal::CanBus& bus, std::uint32_t first,
                                std::uint32_t count) {
  hal::Time last{};
  for (std::uint32_t i = first; i < first + count; ++i) {
    const auto received = co_await bus.receive();
    require_success(received, "receive");
    require(received->frame == frame_number(i), "frame " + std::to_string(i) + " arrives wrong");
    require(received->stamp >= last && received->stamp <= rig.loop().clock().now(),
            "stamps go back, or are of the future");
    last = received->stamp;
  }
}

hal::Task<void> arrive_whole_and_in_order(CanRig& rig) {
  co_await up(rig);
  co_await within(rig.loop(), 30s, "300 frames",
                  (send_numbers(rig, rig.a(), 0, 300) && receive_numbers(rig, rig.b(), 0, 300)));
}

hal::Task<void> go_both_ways_at_once(CanRig& rig) {
  co_await up(rig);
  const auto there = [&]() -> hal::Task<void> {
    co_await (send_numbers(rig, rig.a(), 0, 100) && receive_numbers(rig, rig.b(), 0, 100));
  };
  const auto back = [&]() -> hal::Task<void> {
    co_await (send_numbers(rig, rig.b(), 500, 100) && receive_numbers(rig, rig.a(), 500, 100));
  };
  co_await within(rig.loop(), 30s, "100 frames each way", (there() && back()));
}

hal::Task<void> nobody_hears_himself(CanRig& rig) {
  co_await up(rig);
  co_await send_numbers(rig, rig.a(), 1, 1);
  require(!co_await patiently(rig.loop(), 100ms, rig.a().receive()), "heard its own frame");
}

hal::Task<void> a_frame_past_its_deadline_is_never_sent(CanRig& rig) {
  co_await up(rig);
  require_error(co_await rig.a().send(frame_number(1), in(rig, -1ms)), errc::timed_out,
                "a deadline that has passed");
  co_await send_numbers(rig, rig.a(), 2, 1);
  co_await within(rig.loop(), 5s, "the next frame", receive_numbers(rig, rig.b(), 2, 1));
}

void demand_silence(CanRig& rig, bool on) {
  if (!rig.silence(on)) throw Skipped("the other end cannot be silenced here");
}

hal::Task<void> unacknowledged_frames_end_at_their_deadline(CanRig& rig) {
  co_await up(rig);
  demand_silence(rig, true);
  const hal::Time deadline = in(rig, 200ms);
  require_error(co_await rig.a().send(frame_number(1), deadline), errc::timed_out,
                "nobody acknowledges");
  const hal::Duration late = rig.loop().clock().now() - deadline;
  require(late >= 0ms && late < 500ms, "ends " + std::to_string(hal::seconds(late)) + " s late");
  demand_silence(rig, false);
  co_await up(rig);
}

hal::Task<void> try_and_fail(CanRig& rig, std::uint32_t number, hal::Time deadline) {
  require_error(co_await rig.a().send(frame_number(number), deadline), errc::timed_out,
                "nobody acknowledges");
}

// Not even one, where the controller gives it back.
hal::Task<void> at_most_one_frame_waits(CanRig& rig) {
  co_await up(rig);
  demand_silence(rig, true);
  const hal::Time deadline = in(rig, 100ms);
  co_await (try_and_fail(rig, 1, deadline) && try_and_fail(rig, 2, deadline) &&
            try_and_fail(rig, 3, deadline + 50ms) && try_and_fail(rig, 4, deadline + 100ms));
  demand_silence(rig, false);
  int old_frames = 0;
  const auto wait_for_the_new_one = [&]() -> hal::Task<void> {
    for (;;) {
      const auto received = co_await rig.b().receive();
      if (!received) continue;  // It may have been unplugged meanwhile, and is told so.
      if (received->frame == frame_number(9)) co_return;
      if (received->frame.id != kProbeId) ++old_frames;
    }
  };
  const auto send_until_it_goes = [&]() -> hal::Task<void> {
    for (;;) {
      const auto sent = co_await rig.a().send(frame_number(9), in(rig, 200ms));
      if (sent) co_return;
      co_await rig.loop().clock().sleep_for(10ms);
    }
  };
  co_await within(rig.loop(), 10s, "the new frame",
                  (send_until_it_goes() && wait_for_the_new_one()));
  require(old_frames <= (rig.recalls() ? 0 : 1),
          std::to_string(old_frames) + " frames went after their deadline");
}

void demand_cut(CanRig& rig) {
  if (!rig.cut()) throw Skipped("cannot be cut here");
}

// A call that ends with the loss.
hal::Task<void> told(CanRig& rig, hal::CanBus& bus) {
  const auto received = co_await patiently(rig.loop(), 10s, bus.receive());
  require(received.has_value(), "the loss is not told within 10 s");
  require_error(*received, errc::network_down, "receive on a cut bus");
}

hal::Task<void> a_loss_is_told_once_and_ends_by_itself(CanRig& rig) {
  co_await up(rig);
  demand_cut(rig);
  co_await told(rig, rig.a());
  co_await told(rig, rig.b());
  require_error(co_await rig.a().send(frame_number(1), in(rig, 1s)), errc::network_down,
                "send on a cut bus");
  require(!co_await patiently(rig.loop(), 300ms, rig.a().receive()), "the loss is told twice");
  rig.mend();
  co_await up(rig);
  co_await within(rig.loop(), 10s, "frames after the loss",
                  (send_numbers(rig, rig.a(), 0, 20) && receive_numbers(rig, rig.b(), 0, 20)));
}

hal::Task<void> whoever_waits_hears_of_the_loss(CanRig& rig) {
  co_await up(rig);
  const auto later = [&]() -> hal::Task<void> {
    co_await rig.loop().clock().sleep_for(50ms);
    demand_cut(rig);
  };
  co_await (told(rig, rig.a()) && later());
  rig.mend();
  co_await up(rig);
}

hal::Task<void> a_dead_link_rests(CanRig& rig) {
  co_await up(rig);
  demand_cut(rig);
  co_await told(rig, rig.a());
  const auto wait = [&]() -> hal::Task<void> {
    for (;;) static_cast<void>(co_await rig.a().receive());
  };
  const auto rested = co_await (wait() || rest(rig.loop(), "a cut bus"));
  require(rested.index() == 1, "unreachable");
  rig.mend();
  co_await up(rig);
}

hal::Task<void> a_cancelled_receive_loses_nothing(CanRig& rig) {
  co_await up(rig);
  for (std::uint32_t i = 0; i < 10; ++i) {
    require(!co_await patiently(rig.loop(), 5ms, rig.a().receive()), "heard something");
    co_await send_numbers(rig, rig.b(), i, 1);
    co_await within(rig.loop(), 5s, "what came in between", receive_numbers(rig, rig.a(), i, 1));
  }
}

hal::Task<void> a_cancelled_send_leaves_it_usable(CanRig& rig) {
  co_await up(rig);
  for (std::uint32_t i = 0; i < 10; ++i)
    co_await patiently(rig.loop(), 0ms, rig.a().send(frame_number(1), in(rig, 1s)));
  const auto receive = [&]() -> hal::Task<void> {
    for (;;) {
      const hal::CanFrame frame = co_await next(rig.b());
      if (frame == frame_number(2)) co_return;
    }
  };
  co_await within(rig.loop(), 10s, "a frame after cancelled ones",
                  (send_numbers(rig, rig.a(), 2, 1) && receive()));
}

// A dialogue of so many frames, of which call `fails` meets a cut bus: it goes on where it stood.
hal::Task<void> a_dialogue_survives_a_cut_at_any_call(CanRig& rig) {
  constexpr std::uint32_t kCalls = 6;
  for (std::uint32_t fails = 0; fails < kCalls; ++fails) {
    co_await up(rig);
    for (std::uint32_t i = 0; i < kCalls; ++i) {
      auto& from = i % 2 == 0 ? rig.a() : rig.b();
      auto& to = i % 2 == 0 ? rig.b() : rig.a();
      if (i == fails) {
        demand_cut(rig);
        require_error(co_await from.send(frame_number(i), in(rig, 1s)), errc::network_down,
                      "send on a cut bus");
        rig.mend();
        co_await up(rig);
      }
      co_await send_numbers(rig, from, i, 1);
      co_await within(rig.loop(), 5s, "an answer", receive_numbers(rig, to, i, 1));
    }
  }
}

constexpr Promise<CanRig> kCanPromises[] = {
    {"FramesArriveWholeAndInOrder", arrive_whole_and_in_order},
    {"FramesGoBothWaysAtOnce", go_both_ways_at_once},
    {"NobodyHearsHimself", nobody_hears_himself},
    {"AFramePastItsDeadlineIsNeverSent", a_frame_past_its_deadline_is_never_sent},
    {"UnacknowledgedFramesEndAtTheirDeadline", unacknowledged_frames_end_at_their_deadline},
    {"AtMostOneFrameWaits", at_most_one_frame_waits},
    {"ALossIsToldOnceAndEndsByItself", a_loss_is_told_once_and_ends_by_itself},
    {"WhoeverWaitsHearsOfTheLoss", whoever_waits_hears_of_the_loss},
    {"ADeadLinkRests", a_dead_link_rests},
    {"ACancelledReceiveLosesNothing", a_cancelled_receive_loses_nothing},
    {"ACancelledSendLeavesItUsable", a_cancelled_send_leaves_it_usable},
    {"ADialogueSurvivesACutAtAnyCall", a_dialogue_survives_a_cut_at_any_call},
};

}  // namespace

std::span<const Promise<CanRig>> can_promises() {
  return kCanPromises;
}

}  // namespace links_test
