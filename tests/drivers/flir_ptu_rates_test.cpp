// A pan unit on a serial line that is set to another rate than the unit: it is told apart from one
// without power, with what to write instead, and nobody is asked at other rates without need.
#include <algorithm>
#include <memory>
#include <string>

#include "drivers/flir_ptu.hpp"
#include "drivers/text.hpp"
#include "sim/flir_ptu_unit.hpp"
#include "sim/nmea_unit.hpp"
#include "sim/uart.hpp"
#include "tests/drivers/loop_rig.hpp"

namespace ptu_rates {
namespace {

using namespace std::chrono_literals;
using drivers::FlirPtu;
using sim::UnitFault;

constexpr hal::Duration kOneRound = 14s;  // Through all rates, in the pauses between starts.

// Remembers what was written.
class Tap final : public hal::ByteStream {
 public:
  explicit Tap(hal::ByteStream& link) : link_(link) {}
  hal::Task<hal::Result<void>> write(std::span<const std::uint8_t> bytes) override {
    written += drivers::as_text(bytes);
    return link_.write(bytes);
  }
  hal::Task<hal::Result<std::size_t>> read_some(std::span<std::uint8_t> into) override {
    return link_.read_some(into);
  }
  std::string written;

 private:
  hal::ByteStream& link_;
};

class FlirPtuRates : public drivers_test::LoopRig {
 protected:
  ~FlirPtuRates() override { halt_all(); }

  // The line is as slow as its unit's rate.
  void lay_line(int unit_baud) {
    wire.emplace(clock, sim::StreamWire::Config{.bytes_per_s = unit_baud / 10.0});
    tap.emplace(wire->a());
    uart.emplace(wire->b(), unit_baud);
    faults.emplace(clock, 5);
  }
  drivers::SettableLine line_at(int baud) {
    uart->set_host_baud(baud);
    return {{"/dev/ttyUSB0", static_cast<std::uint32_t>(baud)},
            [this](int other) -> hal::Result<void> {
              if (cut) return boost::system::errc::make_error_code(boost::system::errc::io_error);
              uart->set_host_baud(other);
              asked_at.push_back(other);
              return {};
            }};
  }
  void drive_at(int baud, bool settable = true) {
    auto line = line_at(baud);
    device.emplace(drivers::FlirPtuConfig{}, clock, *tap,
                   settable ? std::optional(std::move(line)) : std::nullopt);
    spawn(device->run());
  }
  void build(int unit_baud, int host_baud, bool settable = true, hal::Duration reset_time = 12s) {
    lay_line(unit_baud);
    sim::FlirPtuUnitConfig config;
    config.reset_time = reset_time;
    unit.emplace(config, clock, *uart, *faults);
    spawn(unit->run());
    drive_at(host_baud, settable);
  }
  // How long it takes from when the unit can answer until it runs.
  hal::Duration start(bool settable, hal::Duration silence = {}) {
    halt_all();
    build(9600, 9600, settable, 0s);
    faults->set({UnitFault::off, 0});
    run_for(silence);
    faults->clear();
    const hal::Time from = clock.now();
    EXPECT_TRUE(comes_up(*device, 60s)) << told(*device);
    EXPECT_EQ(told(*device), "");
    return clock.now() - from;
  }
  static std::string says(int right, int wrong) {
    return "not understood: answers at " + std::to_string(right) + " baud, not at " +
           std::to_string(wrong) + ": set link = \"serial:/dev/ttyUSB0@" + std::to_string(right) +
           "\"\n";
  }

  std::optional<sim::StreamWire> wire;
  std::optional<Tap> tap;
  std::optional<sim::Uart> uart;
  std::optional<sim::UnitFaults> faults;
  std::optional<sim::FlirPtuUnit> unit;
  std::optional<FlirPtu> device;
  std::vector<int> asked_at;
  bool cut = false;
};

class FlirPtuAtAnotherRate : public FlirPtuRates, public testing::WithParamInterface<int> {};

TEST_P(FlirPtuAtAnotherRate, IsNamedWithTheRightOne) {
  const int right = GetParam(), wrong = right == 9600 ? 19200 : 9600;
  build(right, wrong);
  ASSERT_TRUE(comes_to(*device, "not understood", kOneRound)) << told(*device);
  EXPECT_EQ(told(*device), says(right, wrong));
  EXPECT_EQ(uart->host_baud(), wrong) << "it was not put back";
  for (int looks = 0; looks < 600; ++looks) {
    run_for(50ms);
    ASSERT_EQ(told(*device), says(right, wrong)) << "after " << looks;
    ASSERT_FALSE(running(*device)) << "it is not to be used at that rate";
  }
}

INSTANTIATE_TEST_SUITE_P(All, FlirPtuAtAnotherRate, testing::ValuesIn(drivers::kPtuBauds));

TEST_F(FlirPtuRates, NoPowerIsNoAnswer) {
  build(9600, 9600);
  faults->set({UnitFault::off, 0});
  ASSERT_TRUE(comes_to(*device, "no answer", 5s));
  for (int looks = 0; looks < 1200; ++looks) {
    run_for(50ms);
    ASSERT_EQ(told(*device), "no answer: to \"ED \"\n");
  }
  for (const int baud : drivers::kPtuBauds)
    EXPECT_GE(std::ranges::count(asked_at, baud), 4) << "of " << baud << " in a minute";
}

TEST_F(FlirPtuRates, TheRightRateCostsNothing) {
  const hal::Duration before = start(false);
  const std::string said = tap->written;
  EXPECT_EQ(start(true), before);
  EXPECT_EQ(tap->written, said);
  EXPECT_TRUE(asked_at.empty());
}

// After power-up it does not answer for twenty seconds.
TEST_F(FlirPtuRates, AUnitThatBeginsToAnswerIsHeardAlmostAsSoon) {
  hal::Duration before{}, now{};
  for (hal::Duration silence = 0s; silence < 25s; silence += 100ms) {
    before = std::max(before, start(false, silence));
    now = std::max(now, start(true, silence));
  }
  EXPECT_LT(before, 6s);
  EXPECT_GT(now, before) << "nobody was asked at other rates";
  EXPECT_LT(now, before + 1600ms);
}

TEST_F(FlirPtuRates, RunsOnceTheUnitIsPutRight) {
  build(19200, 9600);
  ASSERT_TRUE(comes_to(*device, "not understood", 20s));
  uart->set_baud(9600);
  EXPECT_TRUE(comes_up(*device, 8s)) << told(*device);
  EXPECT_EQ(told(*device), "");
  EXPECT_TRUE(result_of(device->move_to(0.5)));
}

TEST_F(FlirPtuRates, RunsOnceTheRobotFileIsPutRight) {
  build(19200, 9600);
  ASSERT_TRUE(comes_to(*device, "not understood", 20s));
  halt_all();
  spawn(unit->run());
  drive_at(19200);
  EXPECT_TRUE(comes_up(*device, 8s)) << told(*device);
  EXPECT_EQ(told(*device), "");
}

TEST_F(FlirPtuRates, OneThatWasNamedAndIsGoneIsNoAnswer) {
  build(19200, 9600);
  ASSERT_TRUE(comes_to(*device, "not understood", 20s));
  faults->set({UnitFault::off, 0});
  for (int looks = 0; looks < 400; ++looks) {
    run_for(50ms);
    ASSERT_NE(told(*device), "") << "no reason after " << looks;
    ASSERT_NE(has(*device, "no answer"), has(*device, "not understood"));
  }
  EXPECT_TRUE(has(*device, "no answer"));
  faults->clear();
  EXPECT_TRUE(comes_to(*device, "not understood", 12s + kOneRound)) << told(*device);
}

TEST_F(FlirPtuRates, AnotherModelIsNotAskedAtOthers) {
  lay_line(9600);
  unit.emplace(sim::FlirPtuUnitConfig{}, clock, *uart, *faults);
  spawn(unit->run());
  drivers::FlirPtuConfig config;
  config.arcsec_per_step = 185.1428;
  device.emplace(config, clock, *tap, line_at(9600));
  spawn(device->run());
  run_for(60s);
  EXPECT_TRUE(has(*device, "wrong model")) << told(*device);
  EXPECT_TRUE(asked_at.empty());
}

// A mission runs then, perhaps.
TEST_F(FlirPtuRates, IsNeverAskedAtOthersOnceItRan) {
  build(9600, 9600);
  ASSERT_TRUE(comes_up(*device, 10s));
  faults->set({UnitFault::off, 0});
  run_for(60s);
  EXPECT_TRUE(has(*device, "no answer")) << told(*device);
  faults->clear();
  uart->set_baud(19200);
  run_for(60s);
  EXPECT_TRUE(asked_at.empty());
}

// Checksums of receivers stand behind an asterisk, as a unit's numbers do.
TEST_F(FlirPtuRates, AReceiverAtAnotherRateIsNotTakenForIt) {
  lay_line(38400);
  sim::NmeaUnit receiver(sim::NmeaUnitConfig{{}, {}, 38400}, world, clock, wire->b(), *faults);
  auto line = line_at(9600);
  line.set_baud = [&](int baud) -> hal::Result<void> {
    receiver.uart().set_host_baud(baud);
    return {};
  };
  receiver.uart().set_host_baud(9600);
  device.emplace(drivers::FlirPtuConfig{}, clock, *tap, std::move(line));
  spawn(receiver.run());
  spawn(device->run());
  for (int looks = 0; looks < 1200; ++looks) {
    run_for(50ms);
    ASSERT_FALSE(has(*device, "not understood")) << told(*device);
  }
  EXPECT_TRUE(has(*device, "no pan-tilt unit's answers")) << told(*device);
  halt_all();
}

TEST_F(FlirPtuRates, IsNamedAfterTheCableWasOut) {
  build(19200, 9600);
  for (int tenths = 1; tenths < 60; ++tenths) {
    cut = true;
    wire->cut();
    run_for(3s);
    EXPECT_TRUE(has(*device, "no connection")) << tenths << told(*device);
    cut = false;
    uart->set_host_baud(9600);  // As it is opened.
    wire->mend();
    ASSERT_TRUE(comes_to(*device, "not understood", 20s)) << tenths << told(*device);
    run_for(tenths * 100ms);
  }
  uart->set_baud(9600);
  EXPECT_TRUE(comes_up(*device, 20s)) << told(*device);
  EXPECT_EQ(told(*device), "");
}

TEST_F(FlirPtuRates, IsNamedWhicheverCallOfTheLinkFails) {
  for (int n = 1; n <= 40; ++n) {
    halt_all();
    build(19200, 9600);
    halt_all();
    drivers_test::FailsOnce failing(wire->a(), n);
    FlirPtu once({}, clock, failing, line_at(9600));
    spawn(unit->run());
    spawn(once.run());
    run_for(20s);
    ASSERT_TRUE(failing.failed()) << n;
    EXPECT_TRUE(comes_to(once, "not understood", kOneRound)) << n << told(once);
    uart->set_baud(9600);
    ASSERT_TRUE(comes_up(once, 30s)) << n << '\n' << told(once);
    EXPECT_EQ(told(once), "") << n;
    halt_all();
  }
}

}  // namespace
}  // namespace ptu_rates
