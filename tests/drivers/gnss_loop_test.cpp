// The loops of satellite receivers against their simulated units.
#include <cmath>

#include "drivers/gnss_demux.hpp"
#include "drivers/gpsd_client.hpp"
#include "drivers/nmea_gnss.hpp"
#include "drivers/ublox.hpp"
#include "sim/gpsd_unit.hpp"
#include "sim/nmea_unit.hpp"
#include "sim/ublox_unit.hpp"
#include "sim/vn100_unit.hpp"
#include "tests/drivers/stream_loop.hpp"

namespace {

using drivers::DeviceState;
using drivers_test::detail_of;
using drivers_test::names;
using sim::UnitFault;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

// W's y axis is turned away from north, so that a wrong turn shows.
constexpr drivers::GeoAnchor kAnchor{47.05, 8.31, 480, 0.4};

sim::GnssSourceConfig source_config() {
  sim::GnssSourceConfig config;
  config.anchor = kAnchor;
  return config;
}

drivers::GnssOutputConfig output_config() {
  drivers::GnssOutputConfig config;
  config.anchor = kAnchor;
  return config;
}

// A driver of any kind on a line, and what it gave.
struct Receiver : drivers_test::StreamLoop {
  virtual ~Receiver() = default;
  explicit Receiver(int fail_call, sim::StreamWire::Config config)
      : StreamLoop(config), link(wire.a(), fail_call) {}

  virtual drivers::Device& device() = 0;
  virtual const drivers::GnssOutput& output() = 0;
  virtual sim::GnssSky& sky() = 0;
  // When the unit asked the world, from the start until now.
  virtual std::vector<hal::Time> sampled_at() = 0;
  std::vector<hal::Time> every(double first_s, double period_s) const {
    std::vector<hal::Time> times;
    for (double at_s = first_s; at_s <= hal::seconds(clock.now()) + 1e-6; at_s += period_s)
      times.push_back(hal::Time(std::chrono::milliseconds(std::llround(at_s * 1e3))));
    return times;
  }

  hal::Task<void> take(hal::Gnss& gnss) {
    for (;;) {
      const auto fix = co_await gnss.next_fix();
      if (fix)
        fixes.push_back(*fix);
      else
        ++errors;
    }
  }
  std::size_t fixes_in(double span_s) {
    const std::size_t before = fixes.size();
    run_for(span_s);
    return fixes.size() - before;
  }

  drivers_test::FailingStream link;
  std::vector<hal::GnssFix> fixes;
  int errors = 0;
};

struct Options {
  int fail_call = 0;
  double clock_skew = 0;
  std::int64_t itow_ms = 302'400'000;
  sim::StreamWire::Config wire;
  bool sets_baud = true;
  int unit_baud = 0;  // 0: the driver's first.
  bool corrections = false;
};

struct UbloxLoop : Receiver {
  explicit UbloxLoop(const Options& options = {},
                     sim::UbloxUnitConfig unit_config = sim::UbloxUnitConfig())
      : Receiver(options.fail_call, options.wire),
        corrections(clock),
        unit(with(unit_config, options), world, clock, wire.b(), faults),
        driver({{}, output_config()}, clock, link, setter(options.sets_baud),
               options.corrections ? &corrections.a() : nullptr) {
    unit.uart().set_host_baud(drivers::UbloxSettings().baud);
    spawn(unit.run());
    spawn(driver.run());
    spawn(take(driver));
  }
  static sim::UbloxUnitConfig with(sim::UbloxUnitConfig config, const Options& options) {
    config.source = source_config();
    config.source.clock_skew = options.clock_skew;
    config.source.itow_ms = options.itow_ms;
    if (options.unit_baud != 0) config.baud = options.unit_baud;
    return config;
  }
  drivers::SetBaud setter(bool sets) {
    if (!sets) return {};
    return [this](int baud) -> hal::Result<void> {
      unit.uart().set_host_baud(baud);
      return {};
    };
  }
  drivers::Device& device() override { return driver; }
  const drivers::GnssOutput& output() override { return driver.output(); }
  sim::GnssSky& sky() override { return unit.sky(); }
  // At 1 Hz as sold: the first second was under way when the rate was set.
  std::vector<hal::Time> sampled_at() override { return every(1.0, 0.2); }

  // A base sends one frame a second.
  hal::Task<void> send_corrections(double until_s) {
    drivers::Bytes payload(200);
    drivers::put_big<std::uint16_t>(payload, 0, 1077 << 4);
    const auto frame = drivers::encode_rtcm3(payload);
    while (hal::seconds(clock.now()) < until_s) {
      co_await clock.sleep_for(std::chrono::seconds(1));
      EXPECT_TRUE(co_await corrections.b().write(frame));
    }
    co_await clock.sleep_until(hal::Time::max());
  }

  sim::StreamWire corrections;
  sim::UbloxUnit unit;
  drivers::Ublox driver;
};

struct NmeaLoop : Receiver {
  explicit NmeaLoop(const Options& options = {}, const sim::NmeaForm& form = {})
      : Receiver(options.fail_call, options.wire),
        unit(unit_config(options, form), world, clock, wire.b(), faults),
        driver({output_config(), 9600}, clock, link, setter(options.sets_baud)) {
    unit.uart().set_host_baud(9600);
    spawn(unit.run());
    spawn(driver.run());
    spawn(take(driver));
  }
  static sim::NmeaUnitConfig unit_config(const Options& options, const sim::NmeaForm& form) {
    sim::NmeaUnitConfig config{source_config(), form, 9600};
    config.source.clock_skew = options.clock_skew;
    config.source.itow_ms = options.itow_ms;
    if (options.unit_baud != 0) config.baud = options.unit_baud;
    return config;
  }
  drivers::SetBaud setter(bool sets) {
    if (!sets) return {};
    return [this](int baud) -> hal::Result<void> {
      unit.uart().set_host_baud(baud);
      return {};
    };
  }
  drivers::Device& device() override { return driver; }
  const drivers::GnssOutput& output() override { return driver.output(); }
  sim::GnssSky& sky() override { return unit.sky(); }
  std::vector<hal::Time> sampled_at() override { return every(0.2, 0.2); }

  sim::NmeaUnit unit;
  drivers::NmeaGnss driver;
};

struct GpsdLoop : Receiver {
  explicit GpsdLoop(const Options& options = {}, sim::GpsdUnitConfig config = sim::GpsdUnitConfig(),
                    const std::string& wanted = {})
      : Receiver(options.fail_call, options.wire),
        unit(with(config, options), world, clock, wire.b(), faults),
        driver({output_config(), wanted}, clock, link) {
    spawn(unit.run());
    spawn(driver.run());
    spawn(take(driver));
  }
  static sim::GpsdUnitConfig with(sim::GpsdUnitConfig config, const Options& options) {
    config.source = source_config();
    config.source.clock_skew = options.clock_skew;
    config.source.itow_ms = options.itow_ms;
    return config;
  }
  drivers::Device& device() override { return driver; }
  const drivers::GnssOutput& output() override { return driver.output(); }
  sim::GnssSky& sky() override { return unit.sky(); }
  std::vector<hal::Time> sampled_at() override { return every(0.2, 0.2); }

  sim::GpsdUnit unit;
  drivers::GpsdClient driver;
};

template <class Loop>
struct GnssLoops : testing::Test {};
using Loops = testing::Types<UbloxLoop, NmeaLoop, GpsdLoop>;
TYPED_TEST_SUITE(GnssLoops, Loops);

TYPED_TEST(GnssLoops, StartsAndGivesFiveFixesASecond) {
  TypeParam loop;
  loop.run_for(5);
  EXPECT_EQ(loop.device().state(), DeviceState::running);
  EXPECT_FALSE(loop.device().identity().model.empty());
  EXPECT_EQ(loop.fixes_in(10), 50U);
  EXPECT_EQ(loop.output().last().quality, drivers::GnssQuality::rtk_fixed);
  // Of the world's antenna on the body at (3, 4), to what the world says its noise is.
  double sum2_m2 = 0;
  for (const auto& fix : loop.fixes) {
    EXPECT_NEAR(fix.sigma_m, loop.world.config().gnss_sigma_m, 0.0002);
    sum2_m2 += (fix.position_m - Eigen::Vector2d(3, 4)).squaredNorm();
  }
  const double sigma_m = std::sqrt(sum2_m2 / 2 / static_cast<double>(loop.fixes.size()));
  EXPECT_GT(sigma_m, 0.01);
  EXPECT_LT(sigma_m, 0.06);
}

// The same world read without a wire gives the same fixes to half a millimetre, though W is turned
// against north.
TYPED_TEST(GnssLoops, TheWireCarriesMillimetres) {
  TypeParam loop;
  loop.run_for(8);
  ASSERT_GE(loop.fixes.size(), 20U);
  sim::World other(loop.scene, sim::WorldConfig());
  ASSERT_TRUE(other.put_robot({{3, 4}, 0.3}, 0));
  std::vector<Eigen::Vector2d> said;
  for (const hal::Time at : loop.sampled_at()) {
    other.advance(at);
    said.push_back(other.sample_gnss().position_m);
  }
  const auto same = [](const Eigen::Vector2d& a, const hal::GnssFix& b) {
    return (a - b.position_m).norm() < 0.0005;
  };
  EXPECT_NE(std::search(said.begin(), said.end(), loop.fixes.begin(), loop.fixes.end(), same),
            said.end());
}

TYPED_TEST(GnssLoops, StampsWithTheReceiversTime) {
  for (const double skew : {-50e-6, 50e-6}) {
    Options options;
    options.clock_skew = skew;
    TypeParam loop(options);
    sim::LinkFaults hiccups;
    hiccups.jitter = std::chrono::milliseconds(30);
    loop.wire.set_faults(hiccups);
    loop.run_for(200);
    loop.fixes.clear();
    loop.run_for(60);
    ASSERT_GE(loop.fixes.size(), 299U);
    double worst_s = 0;
    for (const auto& fix : loop.fixes) {
      const double since_s = hal::seconds(fix.stamp);
      worst_s = std::max(worst_s, std::abs(since_s - std::round(since_s * 5) / 5));
    }
    EXPECT_LT(worst_s, 0.02) << skew;
    EXPECT_NEAR(loop.output().clock_fit().skew(), -skew, 25e-6);
  }
}

// The week of GPS and the day of UTC end while it runs.
TYPED_TEST(GnssLoops, TimeGoesOnWhenTheWeekAndTheDayEnd) {
  Options options;
  options.itow_ms = 604'800'000 - 20'000;
  TypeParam loop(options);
  loop.run_for(10);
  EXPECT_EQ(loop.fixes_in(60), 300U);
  EXPECT_EQ(loop.output().clock_fit().restarts(), 0U);
  EXPECT_THAT(names(loop.device()), IsEmpty());
  for (std::size_t i = 1; i < loop.fixes.size(); ++i)
    EXPECT_NEAR(hal::seconds(loop.fixes[i].stamp - loop.fixes[i - 1].stamp), 0.2, 0.01);
}

TYPED_TEST(GnssLoops, NamesWhereThereIsNoFixAndWaits) {
  TypeParam loop;
  loop.run_for(5);
  loop.sky().quality = drivers::GnssQuality::none;
  loop.run_for(1);
  EXPECT_THAT(names(loop.device()), Contains("no fix"));
  EXPECT_EQ(loop.fixes_in(10), 0U);
  EXPECT_EQ(loop.device().state(), DeviceState::running);
  EXPECT_EQ(loop.errors, 0);
  loop.sky().quality = drivers::GnssQuality::rtk_float;
  loop.run_for(4);
  EXPECT_THAT(names(loop.device()), IsEmpty());
  EXPECT_EQ(loop.output().last().quality, drivers::GnssQuality::rtk_float);
  EXPECT_EQ(loop.fixes_in(2), 10U);
}

struct Case {
  sim::FaultSetting fault;
  std::string named;
};

TYPED_TEST(GnssLoops, EveryFaultIsNamedAndOver) {
  const Case cases[] = {
      {{UnitFault::off, 0}, "silent"},
      {{UnitFault::stuck, 0}, "frozen"},
      {{UnitFault::garbage, 0}, "damaged bytes"},
      {{UnitFault::wrong, 0.5}, "fix far from the site"},
      {{UnitFault::slow, 3}, "slower than set"},
      {{UnitFault::delayed, 0.5}, "messages late"},
      {{UnitFault::intermittent, 4}, "silent"},
      {{UnitFault::duplicated_reordered, 0}, "messages repeated or out of order"}};
  for (const Case& each : cases) {
    const std::string what = sim::to_text(each.fault);
    TypeParam loop;
    loop.run_for(10);
    ASSERT_EQ(loop.device().state(), DeviceState::running) << what;
    loop.faults.set(each.fault);
    bool named = false;
    for (int i = 0; i < 200; ++i) {
      loop.run_for(0.1);
      const auto now = names(loop.device());
      named |= std::find(now.begin(), now.end(), each.named) != now.end();
    }
    EXPECT_TRUE(named) << what << " was not named " << each.named;
    loop.faults.clear();
    loop.run_for(30);
    EXPECT_EQ(loop.device().state(), DeviceState::running) << what;
    EXPECT_THAT(names(loop.device()), IsEmpty()) << what;
    EXPECT_EQ(loop.fixes_in(2), 10U) << what;
  }
}

TYPED_TEST(GnssLoops, ComesBackAfterACutCable) {
  TypeParam loop;
  loop.run_for(5);
  loop.wire.cut();
  loop.run_for(8);
  EXPECT_EQ(loop.device().state(), DeviceState::lost);
  EXPECT_THAT(names(loop.device()), Contains("link lost"));
  EXPECT_GE(loop.errors, 1);
  loop.wire.mend();
  loop.run_for(20);
  EXPECT_EQ(loop.device().state(), DeviceState::running);
  EXPECT_THAT(names(loop.device()), IsEmpty());
}

TYPED_TEST(GnssLoops, ComesBackWhicheverCallFails) {
  for (int nth = 1; nth <= 50; ++nth) {
    Options options;
    options.fail_call = nth;
    TypeParam loop(options);
    loop.run_for(25);
    EXPECT_TRUE(loop.link.failed());
    EXPECT_EQ(loop.device().state(), DeviceState::running) << nth;
    EXPECT_EQ(loop.fixes_in(2), 10U) << nth;
    EXPECT_THAT(names(loop.device()), IsEmpty()) << nth;
  }
}

TYPED_TEST(GnssLoops, RepeatsToTheLastBit) {
  std::vector<std::vector<hal::GnssFix>> runs;
  for (int run = 0; run < 2; ++run) {
    TypeParam loop;
    loop.run_for(5);
    loop.faults.set({UnitFault::duplicated_reordered, 0});
    loop.run_for(20);
    runs.push_back(loop.fixes);
  }
  ASSERT_EQ(runs[0].size(), runs[1].size());
  for (std::size_t i = 0; i < runs[0].size(); ++i) {
    EXPECT_EQ(runs[0][i].stamp, runs[1][i].stamp);
    EXPECT_EQ(runs[0][i].position_m, runs[1][i].position_m);
  }
}

TEST(UbloxLoop, SaysWhoItIs) {
  UbloxLoop loop;
  loop.run_for(5);
  EXPECT_EQ(loop.driver.identity().maker, "u-blox");
  EXPECT_EQ(loop.driver.identity().model, "ZED-F9P");
  EXPECT_EQ(loop.driver.identity().firmware, "HPG 1.32");
  EXPECT_THAT(names(loop.driver), IsEmpty());
}

sim::UbloxUnitConfig eighth() {
  sim::UbloxUnitConfig config;
  config.software = "ROM CORE 3.01 (107888)";
  config.hardware = "00080000";
  config.extensions = {"FWVER=SPG 3.01", "PROTVER=18.00", "GPS;GLO;GAL;BDS"};
  config.baud = 9600;
  return config;
}

TEST(UbloxLoop, SpeaksTheDialectOfTheEighthGeneration) {
  UbloxLoop loop({}, eighth());
  loop.run_for(6);
  EXPECT_EQ(loop.driver.state(), DeviceState::running);
  EXPECT_EQ(loop.driver.baud(), 9600);
  EXPECT_EQ(loop.driver.identity().model, "00080000");
  EXPECT_EQ(loop.fixes_in(10), 50U);
  EXPECT_THAT(names(loop.driver), IsEmpty());
  EXPECT_NEAR(loop.fixes.back().sigma_m, 0.03, 0.0005) << "from the radius of NAV-PVT";
}

TEST(UbloxLoop, RefusesAReceiverWithoutNavPvt) {
  sim::UbloxUnitConfig sixth = eighth();
  sixth.extensions = {"PROTVER 13.00"};
  UbloxLoop loop({}, sixth);
  loop.run_for(6);
  EXPECT_EQ(loop.driver.state(), DeviceState::starting);
  EXPECT_THAT(names(loop.driver), ElementsAre("protocol too old"));
}

TEST(UbloxLoop, FindsTheRateOfThePort) {
  for (const int baud : drivers::kUbloxBauds) {
    Options options;
    options.unit_baud = baud;
    UbloxLoop loop(options);
    loop.run_for(10);
    EXPECT_EQ(loop.driver.state(), DeviceState::running) << baud;
    EXPECT_EQ(loop.driver.baud(), baud);
  }
}

TEST(UbloxLoop, NamesAnotherBitRateThatItCannotSet) {
  Options options;
  options.unit_baud = 9600;
  options.sets_baud = false;
  UbloxLoop loop(options);
  loop.run_for(10);
  EXPECT_THAT(names(loop.driver), ElementsAre("not understood"));
}

TEST(UbloxLoop, NamesARefusedSettingAndOneThatIsNotKept) {
  UbloxLoop refused;
  refused.unit.refuse_key(drivers::ubx_key::kDynamicModel);
  refused.run_for(6);
  EXPECT_THAT(names(refused.driver), ElementsAre("setting refused"));
  EXPECT_THAT(detail_of(refused.driver, "setting refused"), HasSubstr("dynamic model"));
  UbloxLoop forgot;
  forgot.unit.forget_key(drivers::ubx_key::kRateMeas_ms);
  forgot.run_for(6);
  EXPECT_THAT(names(forgot.driver), ElementsAre("setting not kept"));
}

TEST(UbloxLoop, NamesAntennaAndJamming) {
  UbloxLoop loop;
  loop.run_for(5);
  loop.unit.set_radio(3, 4);
  loop.run_for(2);
  EXPECT_THAT(names(loop.driver), testing::UnorderedElementsAre("jammed", "antenna open"));
  loop.unit.set_radio(1, 2);
  loop.run_for(2);
  EXPECT_THAT(names(loop.driver), IsEmpty());
}

TEST(UbloxLoop, PassesCorrectionsOnAndMissesThem) {
  Options options;
  options.corrections = true;
  UbloxLoop loop(options);
  loop.spawn(loop.send_corrections(60));
  loop.run_for(60);
  EXPECT_GE(loop.driver.corrections_passed(), 55U);
  EXPECT_EQ(loop.unit.corrections().size(), loop.driver.corrections_passed());
  EXPECT_THAT(loop.unit.corrections(), testing::Each(1077));
  EXPECT_THAT(names(loop.driver), IsEmpty());
  loop.run_for(70);
  EXPECT_THAT(names(loop.driver), ElementsAre("no corrections"));
}

TEST(UbloxLoop, IsToldAgainAfterALossOfPower) {
  UbloxLoop loop;
  loop.run_for(10);
  loop.unit.restart();
  loop.run_for(12);
  EXPECT_EQ(loop.driver.state(), DeviceState::running);
  EXPECT_EQ(loop.fixes_in(2), 10U);
  EXPECT_THAT(names(loop.driver), IsEmpty());
}

TEST(UbloxLoop, TellsAnNmeaReceiverFromAUblox) {
  drivers_test::StreamLoop loop;
  sim::NmeaUnit unit({source_config(), {}, 38400}, loop.world, loop.clock, loop.wire.b(),
                     loop.faults);
  drivers::Ublox driver({{}, output_config()}, loop.clock, loop.wire.a());
  loop.spawn(unit.run());
  loop.spawn(driver.run());
  loop.run_for(5);
  EXPECT_THAT(names(driver), ElementsAre("another device"));
  EXPECT_THAT(detail_of(driver, "another device"), HasSubstr("NMEA"));
}

TEST(NmeaLoop, FindsTheRateOfThePort) {
  for (const int baud : {38400, 4800, 460800}) {
    Options options;
    options.unit_baud = baud;
    NmeaLoop loop(options);
    loop.run_for(15);
    EXPECT_EQ(loop.driver.state(), DeviceState::running) << baud;
    EXPECT_EQ(loop.driver.baud(), baud);
  }
}

TEST(NmeaLoop, NamesAnotherBitRateThatItCannotSet) {
  Options options;
  options.unit_baud = 4800;
  options.sets_baud = false;
  NmeaLoop loop(options);
  loop.run_for(10);
  EXPECT_THAT(names(loop.driver), ElementsAre("not understood"));
}

TEST(NmeaLoop, TakesTheDilutionWhereNoAccuracyIsSent) {
  sim::NmeaForm form;
  form.accuracy = false;
  NmeaLoop loop({}, form);
  loop.run_for(5);
  loop.fixes.clear();
  loop.run_for(5);
  ASSERT_GE(loop.fixes.size(), 24U);
  EXPECT_NEAR(loop.fixes.back().sigma_m, 0.7 * 0.02, 1e-9);
}

TEST(NmeaLoop, NamesAVectorNavOnItsPort) {
  drivers_test::StreamLoop loop;
  sim::Vn100Unit unit({}, loop.world, loop.clock, loop.wire.b(), loop.faults);
  drivers::NmeaGnss driver({output_config(), 9600}, loop.clock, loop.wire.a());
  loop.spawn(unit.run());
  loop.spawn(driver.run());
  loop.run_for(5);
  EXPECT_THAT(names(driver), ElementsAre("another device"));
  EXPECT_THAT(detail_of(driver, "another device"), HasSubstr("VectorNav"));
}

TEST(GpsdLoop, NamesWhatIsWrongWithAServer) {
  sim::GpsdUnitConfig old;
  old.protocol_major = 2;
  GpsdLoop loop({}, old);
  loop.run_for(5);
  EXPECT_THAT(names(loop.driver), ElementsAre("gpsd of another protocol"));

  GpsdLoop bare;
  bare.unit.unplug(true);
  bare.run_for(5);
  EXPECT_THAT(names(bare.driver), Contains("gpsd has no receiver"));
  bare.unit.unplug(false);
  bare.run_for(15);
  EXPECT_THAT(names(bare.driver), IsEmpty());

  GpsdLoop other({}, {}, "/dev/ttyS7");
  other.run_for(5);
  EXPECT_THAT(detail_of(other.driver, "gpsd has no receiver"), HasSubstr("/dev/ttyACM0"));
  EXPECT_TRUE(other.fixes.empty());
}

TEST(GpsdLoop, NamesAnotherServer) {
  drivers_test::StreamLoop loop;
  drivers::GpsdClient driver({output_config(), {}}, loop.clock, loop.wire.a());
  loop.spawn(driver.run());
  loop.spawn([](drivers_test::StreamLoop& on) -> hal::Task<void> {
    const std::string banner = "SSH-2.0-OpenSSH_9.2p1 Debian-2\r\n";
    const std::vector<std::uint8_t> bytes(banner.begin(), banner.end());
    EXPECT_TRUE(co_await on.wire.b().write(bytes));
    co_await on.clock.sleep_until(hal::Time::max());
  }(loop));
  loop.run_for(5);
  EXPECT_THAT(detail_of(driver, "another device"), HasSubstr("SSH"));
}

}  // namespace
