// The loop of gs_usb adapters, against an adapter that answers by the protocol.
#include "drivers/gs_usb.hpp"

#include <boost/asio/io_context.hpp>

#include "tests/links/fake_gs_usb.hpp"
#include "tests/links/promises/can_promises.hpp"
#include "tests/links/promises_test.hpp"

namespace links_test {
namespace {

namespace errc = boost::system::errc;
using drivers::LinkFault;

class GsUsbRig final : public CanRig {
 public:
  Loop& loop() override { return loop_; }
  hal::CanBus& a() override { return a_; }
  hal::CanBus& b() override { return b_; }
  bool cut() override {
    fake_.unplug();
    return true;
  }
  void mend() override {
    fake_.plug_in();
    adapter_.look_again();
  }
  bool silence(bool on) override {
    fake_.silence(on);
    return true;
  }

 private:
  SimLoop loop_;
  FakeGsUsb fake_;
  drivers::GsUsbAdapter adapter_{fake_.open(), loop_.io().get_executor(), loop_.clock()};
  drivers::GsUsbAdapter::Channel& a_ = adapter_.channel(0, 500'000, "gs_usb:any/0@500000");
  drivers::GsUsbAdapter::Channel& b_ = adapter_.channel(1, 500'000, "gs_usb:any/1@500000");
};

const bool kHeld =
    hold<CanRig>("GsUsbAdapter", can_promises(), [] { return std::make_unique<GsUsbRig>(); });

struct GsUsb : testing::Test {
  SimLoop loop;
  FakeGsUsb fake;
  std::unique_ptr<drivers::GsUsbAdapter> adapter;

  drivers::GsUsbAdapter::Channel& channel(std::uint8_t number, std::uint32_t bit_rate_bps) {
    if (!adapter)
      adapter = std::make_unique<drivers::GsUsbAdapter>(fake.open(), loop.io().get_executor(),
                                                        loop.clock());
    return adapter->channel(number, bit_rate_bps, "gs_usb:any/" + std::to_string(number));
  }
  void pass(hal::Duration span) { loop.run(loop.clock().sleep_for(span)); }
  hal::Result<void> send(hal::CanBus& bus, hal::CanFrame frame) {
    hal::Result<void> result;
    const auto task = [&]() -> hal::Task<void> {
      result = co_await bus.send(frame, loop.clock().now() + 100ms);
    };
    loop.run(task());
    return result;
  }
  static std::uint32_t fault(const drivers::Link& link) {
    const auto troubles = link.troubles();
    return troubles.empty() ? 0 : troubles[0].fault->value;
  }
};

constexpr std::uint32_t value(LinkFault fault) {
  return static_cast<std::uint32_t>(fault);
}

TEST_F(GsUsb, NamesWhatIsWrongWithTheSettings) {
  auto& third = channel(2, 500'000);
  pass(1s);
  EXPECT_EQ(fault(third), value(LinkFault::bad_settings));
  EXPECT_NE(third.troubles()[0].detail.find("has 2 channels"), std::string::npos)
      << third.troubles()[0].detail;
}

TEST_F(GsUsb, NamesABitRateThatItsClockCannotMake) {
  auto& odd = channel(0, 333'333);
  pass(1s);
  EXPECT_EQ(fault(odd), value(LinkFault::bad_settings));
  EXPECT_NE(odd.troubles()[0].detail.find("48000000 Hz"), std::string::npos)
      << odd.troubles()[0].detail;
  EXPECT_EQ(send(odd, {1, 0}), errc::make_error_code(errc::network_down));
}

TEST_F(GsUsb, ThrowsAwayWhatTheAdapterKeptFromBefore) {
  fake.keep_stale({0x123, 0});
  auto& first = channel(0, 500'000);
  channel(1, 500'000);
  pass(1s);
  const auto nothing = [&]() -> hal::Task<void> {
    EXPECT_FALSE(co_await patiently(loop, 100ms, first.receive()));
  };
  loop.run(nothing());
}

TEST_F(GsUsb, RestartsAfterBusOffButNotForEver) {
  auto& first = channel(0, 500'000);
  channel(1, 500'000);
  pass(1s);
  ASSERT_TRUE(send(first, {1, 0}));
  for (int i = 1; i <= 5; ++i) {
    fake.go_bus_off(0);
    pass(50ms);
    EXPECT_EQ(fault(first), value(LinkFault::bus_off));
    EXPECT_NE(first.troubles()[0].fault->remedy.find("bit rate"), std::string_view::npos);
    EXPECT_EQ(send(first, {1, 0}), errc::make_error_code(errc::network_down));
    pass(100ms);
    EXPECT_TRUE(first.troubles().empty());
    EXPECT_EQ(first.restarts(), static_cast<std::uint64_t>(i));
    EXPECT_TRUE(send(first, {1, 0}));
  }
  fake.go_bus_off(0);
  pass(10s);
  EXPECT_EQ(first.restarts(), 5U) << "five a minute";
  pass(60s);
  EXPECT_EQ(first.restarts(), 6U);
  EXPECT_TRUE(send(first, {1, 0}));
}

TEST_F(GsUsb, NamesABusWhereNobodyAcknowledges) {
  auto& first = channel(0, 500'000);
  channel(1, 500'000);
  pass(1s);
  fake.silence(true);
  const auto watch = [&]() -> hal::Task<void> {
    co_await loop.clock().sleep_for(150ms);
    EXPECT_EQ(fault(first), value(LinkFault::not_acknowledged));
  };
  const auto try_it = [&]() -> hal::Task<void> {
    EXPECT_TRUE((co_await first.send({1, 0}, loop.clock().now() + 200ms)).has_error());
  };
  const auto both = [&]() -> hal::Task<void> { co_await (try_it() && watch()); };
  loop.run(both());
  EXPECT_EQ(fake.starts(0), 2) << "the frame was recalled by a restart";
}

TEST_F(GsUsb, NamesADisturbedBusAndCountsWhatTheAdapterLost) {
  auto& first = channel(0, 500'000);
  channel(1, 500'000);
  pass(1s);
  fake.go_passive(0);
  fake.hear(0, {7, 0}, true);
  pass(10ms);
  EXPECT_EQ(fault(first), value(LinkFault::bus_passive));
  EXPECT_NE(first.troubles()[0].fault->remedy.find("bit rate"), std::string_view::npos);
  EXPECT_EQ(first.lost_frames(), 1U);
}

TEST_F(GsUsb, LosesTheNewestWhenNobodyReceives) {
  auto& first = channel(0, 500'000);
  channel(1, 500'000);
  pass(1s);
  const std::uint32_t all = drivers::GsUsbAdapter::kReceivedMax + 10;
  for (std::uint32_t i = 0; i < all; ++i) fake.hear(0, {i % 0x700, 0}, false);
  pass(10ms);
  EXPECT_EQ(first.lost_frames(), 10U);
  const auto receive = [&]() -> hal::Task<void> {
    for (std::uint32_t i = 0; i < drivers::GsUsbAdapter::kReceivedMax; ++i)
      EXPECT_EQ((co_await first.receive())->frame.id, i % 0x700);
  };
  loop.run(receive());
}

// Whichever of its calls fails first: it starts anew, and works.
TEST_F(GsUsb, StartsAgainAfterAnyFailedCall) {
  auto& first = channel(0, 500'000);
  channel(1, 500'000);
  for (int n = 1; n <= 14; ++n) {
    fake.unplug();
    pass(100ms);
    fake.plug_in();
    fake.fail_call(n);
    adapter->look_again();
    pass(5s);
    hal::Result<void> sent = send(first, {1, 0});
    for (int tries = 0; tries < 5 && !sent; ++tries) {
      pass(1s);
      sent = send(first, {1, 0});
    }
    EXPECT_TRUE(sent) << "call " << n;
    EXPECT_TRUE(first.troubles().empty()) << "call " << n;
  }
}

TEST(GsUsbBus, SaysSoWhereThereIsNoAdapterAndRests) {
  RealLoop loop;
  drivers::GsUsbBus bus(loop.io().get_executor(), loop.clock());
  auto& channel = bus.channel({"no-such-serial", 0, 500'000});
  loop.run(rest(loop, "looking for an adapter"));
  ASSERT_EQ(channel.troubles().size(), 1U);
  const drivers::Trouble trouble = channel.troubles()[0];
  const auto named = trouble.fault->value;
  EXPECT_TRUE(named == value(LinkFault::absent) || named == value(LinkFault::no_driver))
      << trouble.fault->name;
  EXPECT_FALSE(trouble.detail.empty());
}

}  // namespace
}  // namespace links_test
