// The wires in memory: faults on demand, bounds, and the same run for the same seed.
#include <boost/asio/bind_cancellation_slot.hpp>
#include <boost/asio/cancellation_signal.hpp>

#include "sim/links.hpp"
#include "sim/unit_faults.hpp"
#include "tests/links/promises/register_promises.hpp"
#include "tests/links/promises_test.hpp"

namespace links_test {
namespace {

namespace errc = boost::system::errc;

hal::CanFrame numbered(std::uint32_t id) {
  hal::CanFrame frame{id, 8};
  for (std::uint8_t i = 0; i < 8; ++i) frame.data[i] = static_cast<std::uint8_t>(id + i);
  return frame;
}

struct Wires : testing::Test {
  SimLoop loop;
  hal::Clock& clock = loop.clock();

  void run(const std::function<hal::Task<void>()>& task) { loop.run(task()); }
};

// What comes out of 200 frames, one each millisecond.
std::vector<hal::ReceivedFrame> through_can(const sim::LinkFaults& faults, std::uint64_t seed) {
  SimLoop loop;
  sim::CanWire wire(loop.clock(), {0, 256, seed});
  auto& a = wire.attach();
  auto& b = wire.attach();
  wire.set_faults(faults);
  std::vector<hal::ReceivedFrame> heard;
  const auto send = [&]() -> hal::Task<void> {
    for (std::uint32_t i = 0; i < 200; ++i) {
      static_cast<void>(co_await a.send(numbered(i), loop.clock().now()));
      co_await loop.clock().sleep_for(1ms);
    }
    co_await loop.clock().sleep_for(1s);
  };
  const auto receive = [&]() -> hal::Task<void> {
    for (;;) {
      const auto received = co_await b.receive();
      if (received) heard.push_back(*received);
    }
  };
  const auto both = [&]() -> hal::Task<void> { co_await (send() || receive()); };
  loop.run(both());
  return heard;
}

std::vector<std::uint32_t> ids(const std::vector<hal::ReceivedFrame>& frames) {
  std::vector<std::uint32_t> all;
  for (const auto& each : frames) all.push_back(each.frame.id);
  return all;
}

TEST_F(Wires, AnEndHearsWhatPassesItsFilters) {
  sim::CanWire wire(clock);
  hal::CanBus& from = wire.attach();
  hal::CanBus& all = wire.attach();
  hal::CanBus& some = wire.attach({{0x100, 0x700}, {0x3, 0x1FFFFFFF, true}});
  std::vector<hal::ReceivedFrame> by_all, by_some;
  const auto hear = [](hal::CanBus& bus, std::vector<hal::ReceivedFrame>& into) -> hal::Task<void> {
    for (;;) into.push_back((co_await bus.receive()).value());
  };
  const auto send = [&]() -> hal::Task<void> {
    for (const std::uint32_t id : {0x0FFu, 0x100u, 0x1FFu, 0x200u, 0x3u})
      for (const bool extended : {false, true})
        (co_await from.send({.id = id, .extended = extended}, clock.now() + 1s)).value();
    co_await clock.sleep_for(1s);
  };
  run([&]() -> hal::Task<void> { co_await (send() || hear(all, by_all) || hear(some, by_some)); });
  EXPECT_EQ(by_all.size(), 10);
  EXPECT_EQ(ids(by_some), (std::vector<std::uint32_t>{0x100, 0x1FF, 0x3}));
}

TEST(CanWireFaults, DelayAndJitterKeepTheOrder) {
  const auto heard = through_can({.delay = 20ms, .jitter = 5ms}, 1);
  ASSERT_EQ(heard.size(), 200U);
  for (std::uint32_t i = 0; i < 200; ++i) {
    EXPECT_EQ(heard[i].frame, numbered(i));
    const hal::Duration late = heard[i].stamp - hal::Time{i * 1ms};
    EXPECT_GE(late, 20ms);
    EXPECT_LE(late, 25ms);
  }
}

TEST(CanWireFaults, LossTakesItsShare) {
  const auto heard = through_can({.loss = 0.25}, 1);
  EXPECT_NEAR(static_cast<double>(heard.size()), 150, 20);
}

TEST(CanWireFaults, CorruptionTurnsOneBit) {
  const auto heard = through_can({.corruption = 1}, 1);
  ASSERT_EQ(heard.size(), 200U);
  for (std::uint32_t i = 0; i < 200; ++i) {
    int turned = 0;
    for (std::size_t k = 0; k < 8; ++k)
      turned += __builtin_popcount(heard[i].frame.data[k] ^ numbered(i).data[k]);
    EXPECT_EQ(turned, 1);
  }
}

TEST(CanWireFaults, DuplicationBringsAllTwice) {
  const auto heard = through_can({.duplication = 1}, 1);
  ASSERT_EQ(heard.size(), 400U);
  for (std::uint32_t i = 0; i < 400; ++i) EXPECT_EQ(heard[i].frame.id, i / 2);
}

TEST(CanWireFaults, ReorderingLetsLaterFramesOvertake) {
  auto order = ids(through_can({.reordering = 0.2}, 1));
  ASSERT_EQ(order.size(), 200U);
  EXPECT_FALSE(std::is_sorted(order.begin(), order.end()));
  std::sort(order.begin(), order.end());
  for (std::uint32_t i = 0; i < 200; ++i) EXPECT_EQ(order[i], i);
}

TEST(CanWireFaults, CutAfterSoManyFrames) {
  for (std::uint64_t n = 1; n < 200; n += 33)
    EXPECT_EQ(through_can({.delay = 3ms, .cut_after = n}, 1).size(), n) << n;
}

TEST(CanWireFaults, TheSameSeedGivesTheSameRun) {
  const sim::LinkFaults all{.delay = 2ms,
                            .jitter = 9ms,
                            .loss = 0.1,
                            .corruption = 0.1,
                            .duplication = 0.1,
                            .reordering = 0.1};
  const auto one = through_can(all, 5), same = through_can(all, 5), other = through_can(all, 6);
  ASSERT_EQ(one.size(), same.size());
  for (std::size_t i = 0; i < one.size(); ++i) {
    EXPECT_EQ(one[i].frame, same[i].frame);
    EXPECT_EQ(one[i].stamp, same[i].stamp);
  }
  EXPECT_NE(ids(one), ids(other));
}

TEST_F(Wires, EveryOtherEndOfACanBusHearsEveryFrame) {
  sim::CanWire wire(clock);
  auto& a = wire.attach();
  auto& b = wire.attach();
  auto& c = wire.attach();
  run([&]() -> hal::Task<void> {
    EXPECT_TRUE(co_await a.send(numbered(1), clock.now()));
    EXPECT_EQ((co_await b.receive())->frame, numbered(1));
    EXPECT_EQ((co_await c.receive())->frame, numbered(1));
    b.cut();
    EXPECT_TRUE(co_await a.send(numbered(2), clock.now())) << "c still acknowledges";
    EXPECT_EQ((co_await c.receive())->frame, numbered(2));
    b.mend();
    EXPECT_TRUE((co_await b.receive()).has_error()) << "it was unplugged";
    EXPECT_FALSE(co_await patiently(loop, 1s, b.receive())) << "and missed the second";
  });
}

TEST_F(Wires, CanFramesTakeTheirBitTime) {
  sim::CanWire wire(clock, {500'000});
  auto& a = wire.attach();
  auto& b = wire.attach();
  run([&]() -> hal::Task<void> {
    EXPECT_TRUE(co_await a.send(numbered(1), clock.now() + 1s));
    EXPECT_EQ(clock.now(), hal::Time{222us}) << "111 bits";
    EXPECT_EQ((co_await b.receive())->stamp, hal::Time{222us});
    const auto early = co_await b.send(numbered(2), clock.now() + 221us);
    EXPECT_EQ(early, errc::make_error_code(errc::timed_out));
    EXPECT_FALSE(co_await patiently(loop, 1s, a.receive())) << "never sent";
  });
}

TEST_F(Wires, ACanInboxThatIsFullLosesAndCountsTheNewest) {
  sim::CanWire wire(clock, {0, 10, 1});
  auto& a = wire.attach();
  auto& b = wire.attach();
  run([&]() -> hal::Task<void> {
    for (std::uint32_t i = 0; i < 15; ++i) EXPECT_TRUE(co_await a.send(numbered(i), clock.now()));
    EXPECT_EQ(b.lost_frames(), 5U);
    for (std::uint32_t i = 0; i < 10; ++i) EXPECT_EQ((co_await b.receive())->frame.id, i);
  });
}

TEST_F(Wires, AStreamCutAtAnyByteGivesExactlyTheBytesBefore) {
  const Bytes message = some_bytes(40, 1);
  for (std::uint64_t n = 1; n < message.size(); ++n) {
    sim::StreamWire wire(clock);
    wire.set_faults({.delay = 2ms, .cut_after = n});
    run([&]() -> hal::Task<void> {
      EXPECT_TRUE((co_await wire.a().write(message)).has_error());
      Bytes got, buffer(100);
      for (;;) {
        const auto size = co_await wire.b().read_some(buffer);
        if (!size) {
          EXPECT_EQ(size.error(), errc::make_error_code(errc::not_connected));
          break;
        }
        got.insert(got.end(), buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(*size));
      }
      EXPECT_EQ(got, Bytes(message.begin(), message.begin() + static_cast<std::ptrdiff_t>(n)));
      wire.mend();
      EXPECT_TRUE(co_await wire.a().write(message)) << "the cut is used up";
      EXPECT_EQ(*(co_await wire.b().read_some(buffer)), message.size());
    });
  }
}

TEST_F(Wires, AStreamThatNobodyReadsHoldsTheWriterBack) {
  sim::StreamWire wire(clock, {0, 1000, 1});
  run([&]() -> hal::Task<void> {
    const Bytes much(5000, 1);
    EXPECT_FALSE(co_await patiently(loop, 10s, wire.a().write(much)));
    Bytes buffer(10'000);
    EXPECT_EQ(*(co_await wire.b().read_some(buffer)), 1000U);
  });
}

TEST_F(Wires, AStreamIsAsFastAsItsLine) {
  sim::StreamWire wire(clock, {960, 65536, 1});
  run([&]() -> hal::Task<void> {
    const Bytes second(960, 1);
    EXPECT_TRUE(co_await wire.a().write(second));
    Bytes buffer(1000);
    EXPECT_EQ(*(co_await wire.b().read_some(buffer)), 960U);
    EXPECT_EQ(clock.now(), hal::Time{1s});
  });
}

TEST_F(Wires, ChunksSplitAStreamAnywhere) {
  sim::StreamWire wire(clock);
  wire.set_faults({.chunk_max = 7});
  run([&]() -> hal::Task<void> {
    const Bytes message = some_bytes(500, 1);
    EXPECT_TRUE(co_await wire.a().write(message));
    Bytes got, buffer(100);
    while (got.size() < message.size()) {
      const auto size = co_await wire.b().read_some(buffer);
      EXPECT_LE(*size, 7U);
      got.insert(got.end(), buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(*size));
    }
    EXPECT_EQ(got, message);
  });
}

TEST_F(Wires, DatagramsVanishWhileTheWireIsCutAndNobodyIsTold) {
  sim::DatagramWire wire(clock);
  const Bytes one(1, 1), two(1, 2);
  run([&]() -> hal::Task<void> {
    wire.cut();
    co_await wire.sender().send(one);
    Bytes buffer(10);
    EXPECT_FALSE(co_await patiently(loop, 1s, wire.receiver().receive(buffer)));
    wire.mend();
    co_await wire.sender().send(two);
    EXPECT_EQ((co_await wire.receiver().receive(buffer))->size, 1U);
    EXPECT_EQ(buffer[0], 2);
  });
}

TEST_F(Wires, AUnitsFaultsShowInItsReplies) {
  TableUnit unit(clock);
  sim::RegisterWire wire(clock, unit);
  auto& client = wire.client();
  sim::UnitFaults& faults = *unit.faults();
  run([&]() -> hal::Task<void> {
    faults.set({sim::UnitFault::garbage, 0});
    EXPECT_EQ((co_await client.read_input({0, 1})).error(),
              errc::make_error_code(errc::bad_message));
    faults.set({sim::UnitFault::delayed, 0.2});
    const hal::Time asked = clock.now();
    EXPECT_TRUE(co_await client.read_input({0, 1}));
    EXPECT_EQ(clock.now() - asked, 205ms);
    faults.set({sim::UnitFault::delayed, 0.6});
    EXPECT_EQ((co_await client.read_input({0, 1})).error(), errc::make_error_code(errc::timed_out));
    faults.clear();
    EXPECT_TRUE(co_await client.write_register(3, 1));
    faults.set({sim::UnitFault::stuck, 0});
    EXPECT_EQ((co_await client.read_holding({3, 1}))->at(0), 1);
    EXPECT_TRUE(co_await client.write_register(3, 2));
    EXPECT_EQ((co_await client.read_holding({3, 1}))->at(0), 1);
    faults.clear();
    EXPECT_EQ((co_await client.read_holding({3, 1}))->at(0), 2);
  });
}

// --- Faults of units.

TEST(UnitFaultText, ReadsWhatItWrites) {
  for (const char* text : {"none", "off", "stuck", "garbage", "wrong:0.5", "slow:2.5",
                           "delayed:0.2", "intermittent:4", "duplicated_reordered"}) {
    const auto parsed = sim::parse_unit_fault(text);
    EXPECT_EQ(parsed.error, "");
    EXPECT_EQ(sim::to_text(parsed.setting), text);
  }
  EXPECT_EQ(sim::parse_unit_fault("slow").setting, (sim::FaultSetting{sim::UnitFault::slow, 3}));
}

TEST(UnitFaultText, RefusesWhatCannotBeAndSaysWhatCan) {
  const std::pair<const char*, const char*> cases[] = {
      {"", "is no fault of a unit"},    {"Off", "is no fault of a unit"},
      {"slow:", "a factor above 1"},    {"slow:1", "a factor above 1"},
      {"slow:nan", "a factor above 1"}, {"delayed:-1", "seconds above 0"},
      {"off:1", "takes no amount"},     {"wrong:0", "other than 0"},
      {"intermittent:0", "0.01"},       {"slow:2x", "a factor above 1"},
      {"wrong:x", "other than 0"},
  };
  for (const auto& [text, why] : cases) {
    const auto parsed = sim::parse_unit_fault(text);
    EXPECT_NE(parsed.error.find(why), std::string::npos) << text << ": " << parsed.error;
    EXPECT_EQ(parsed.setting, sim::FaultSetting{}) << text;
  }
}

struct UnitFaults : Wires {
  sim::CanWire wire{clock};
  sim::CanWire::End& host = wire.attach();
  sim::CanWire::End& end = wire.attach();
  sim::UnitFaults faults{clock, 3};
  sim::FaultyCan unit{end, clock, faults};

  // What the host hears of so many frames, one each 10 ms, and half a second later.
  std::vector<hal::ReceivedFrame> hear(std::uint32_t first, std::uint32_t count) {
    std::vector<hal::ReceivedFrame> heard;
    const auto send = [&]() -> hal::Task<void> {
      for (std::uint32_t i = first; i < first + count; ++i) {
        static_cast<void>(co_await unit.send(numbered(i % 5 + 1000 * (i / 5)), clock.now()));
        co_await clock.sleep_for(10ms);
      }
      co_await clock.sleep_for(500ms);
    };
    const auto receive = [&]() -> hal::Task<void> {
      for (;;) heard.push_back(*(co_await host.receive()));
    };
    const auto both = [&]() -> hal::Task<void> { co_await (send() || receive()); };
    loop.run(both());
    return heard;
  }
};

TEST_F(UnitFaults, OffSendsAndHearsNothing) {
  faults.set({sim::UnitFault::off, 0});
  EXPECT_TRUE(hear(0, 5).empty());
  run([&]() -> hal::Task<void> {
    EXPECT_TRUE(co_await host.send(numbered(1), clock.now()));
    EXPECT_FALSE(co_await patiently(loop, 1s, unit.receive()));
    faults.clear();
    EXPECT_TRUE(co_await host.send(numbered(2), clock.now()));
    EXPECT_EQ((co_await unit.receive())->frame.id, 2U);
  });
  EXPECT_EQ(hear(0, 5).size(), 5U);
}

TEST_F(UnitFaults, StuckRepeatsTheFirstOfEachKind) {
  const auto send_twice = [&](std::uint8_t value) {
    run([&]() -> hal::Task<void> {
      for (std::uint32_t id = 1; id <= 2; ++id) {
        hal::CanFrame frame{id, 1};
        frame.data[0] = value;
        EXPECT_TRUE(co_await unit.send(frame, clock.now()));
        EXPECT_EQ((co_await host.receive())->frame.data[0],
                  faults.is(sim::UnitFault::stuck) ? 5 : value);
      }
    });
  };
  send_twice(1);
  faults.set({sim::UnitFault::stuck, 0});
  send_twice(5);
  send_twice(6);
  faults.clear();
  send_twice(7);
}

TEST_F(UnitFaults, GarbageIsNothingThatWasSent) {
  faults.set({sim::UnitFault::garbage, 0});
  const auto heard = hear(0, 20);
  ASSERT_EQ(heard.size(), 20U);
  for (std::uint32_t i = 0; i < 20; ++i) EXPECT_NE(heard[i].frame.data, numbered(i).data);
}

TEST_F(UnitFaults, DelayedComesLateButAsFast) {
  faults.set({sim::UnitFault::delayed, 0.2});
  const auto heard = hear(0, 20);
  ASSERT_EQ(heard.size(), 20U);
  for (std::uint32_t i = 0; i < 20; ++i) EXPECT_EQ(heard[i].stamp, hal::Time{i * 10ms + 200ms});
}

TEST_F(UnitFaults, IntermittentIsOffAndWellByTurns) {
  faults.set({sim::UnitFault::intermittent, 0.2});
  const auto heard = hear(0, 40);
  ASSERT_EQ(heard.size(), 20U);
  EXPECT_EQ(heard.front().stamp, hal::Time{100ms});
  EXPECT_EQ(heard[10].stamp, hal::Time{300ms});
}

TEST_F(UnitFaults, DuplicatedReorderedLosesNothing) {
  faults.set({sim::UnitFault::duplicated_reordered, 0});
  auto order = ids(hear(0, 100));
  faults.clear();
  const auto rest = ids(hear(100, 1));
  EXPECT_FALSE(std::is_sorted(order.begin(), order.end()));
  order.insert(order.end(), rest.begin(), rest.end());
  EXPECT_GT(order.size(), 110U);
  std::sort(order.begin(), order.end());
  order.erase(std::unique(order.begin(), order.end()), order.end());
  EXPECT_EQ(order.size(), 101U);
}

TEST_F(UnitFaults, WrongAndSlowAreTheUnitsOwnAffair) {
  EXPECT_EQ(faults.wrong_factor(), 1);
  EXPECT_EQ(faults.slowed(2s), 2s);
  faults.set({sim::UnitFault::wrong, 0.5});
  EXPECT_EQ(faults.wrong_factor(), 1.5);
  faults.set({sim::UnitFault::slow, 2.5});
  EXPECT_EQ(faults.slowed(2s), 5s);
  EXPECT_EQ(hear(0, 3).size(), 3U) << "but frames pass";
}

TEST_F(UnitFaults, WhatIsDelayedWhenTheUnitGoesIsNeverSent) {
  faults.set({sim::UnitFault::delayed, 1});
  auto short_lived = std::make_unique<sim::FaultyCan>(end, clock, faults);
  run([&]() -> hal::Task<void> {
    EXPECT_TRUE(co_await short_lived->send(numbered(1), clock.now()));
    short_lived.reset();
    EXPECT_FALSE(co_await patiently(loop, 5s, host.receive()));
  });
}

TEST_F(Wires, StreamsAndDatagramsHaveUnitFaultsToo) {
  sim::UnitFaults faults(clock);
  sim::StreamWire stream(clock);
  sim::FaultyStream unit(stream.b(), clock, faults);
  sim::DatagramWire net(clock);
  sim::FaultySender sender(net.sender(), clock, faults);
  const Bytes one(3, 1), two(3, 2);
  run([&]() -> hal::Task<void> {
    Bytes buffer(10);
    faults.set({sim::UnitFault::stuck, 0});
    for (const Bytes* message : std::array{&one, &two}) {
      EXPECT_TRUE(co_await unit.write(*message, 7));
      EXPECT_EQ(*(co_await stream.a().read_some(buffer)), 3U);
      EXPECT_EQ(buffer[0], 1);
      co_await sender.send(*message);
      EXPECT_EQ((co_await net.receiver().receive(buffer))->size, 3U);
      EXPECT_EQ(buffer[0], 1);
    }
    faults.set({sim::UnitFault::off, 0});
    EXPECT_TRUE(co_await unit.write(one));
    co_await sender.send(one);
    EXPECT_FALSE(co_await patiently(loop, 1s, stream.a().read_some(buffer)));
    EXPECT_FALSE(co_await patiently(loop, 1s, net.receiver().receive(buffer)));
  });
}

}  // namespace
}  // namespace links_test
