// The client of a caster against a simulated one, and a receiver that gets what it brings.
#include "drivers/ntrip.hpp"
#include "drivers/ublox.hpp"
#include "sim/ntrip_unit.hpp"
#include "sim/ublox_unit.hpp"
#include "tests/drivers/stream_loop.hpp"

namespace ntrip_loop {

using drivers::NtripVersion;
using drivers_test::detail_of;
using drivers_test::names;
using sim::UnitFault;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

constexpr drivers::GeoAnchor kAnchor{48.0, 11.0, 500, 0};
constexpr char kPassword[] = "quite-secret";

// The caster is at the end of the line that StreamLoop has; the receiver has one of its own.
struct RtkLoop : drivers_test::StreamLoop {
  RtkLoop() : RtkLoop(account(NtripVersion::v2)) {}
  explicit RtkLoop(const sim::NtripUnitConfig& caster_config)
      : RtkLoop(caster_config, asks(NtripVersion::v2)) {}
  RtkLoop(const sim::NtripUnitConfig& caster_config, const drivers::NtripConfig& config)
      : receiver_wire(clock),
        caster(caster_config, clock, wire.b(), faults),
        client(config, clock, wire.a(), [this] { drop(); }),
        unit(receiver_config(), world, clock, receiver_wire.b(), receiver_faults),
        driver({{}, output_config()}, clock, receiver_wire.a(), {}, &client) {
    client.watch_position([this] { return driver.output().last(); });
    spawn(caster.run());
    spawn(client.run());
    spawn(unit.run());
    spawn(driver.run());
  }
  static sim::NtripUnitConfig account(NtripVersion version) {
    sim::NtripUnitConfig config;
    config.user = "robot";
    config.password = kPassword;
    config.version = version;
    return config;
  }
  static drivers::NtripConfig asks(NtripVersion version) {
    drivers::NtripConfig config;
    config.request.host = "rtk.example.org";
    config.request.mountpoint = "SITE0";
    config.request.user = "robot";
    config.request.password = kPassword;
    config.request.version = version;
    return config;
  }
  static sim::UbloxUnitConfig receiver_config() {
    sim::UbloxUnitConfig config;
    config.source.anchor = kAnchor;
    return config;
  }
  static drivers::GnssOutputConfig output_config() {
    drivers::GnssOutputConfig config;
    config.anchor = kAnchor;
    return config;
  }
  void drop() {
    ++drops;
    if (network_gone) return;
    wire.cut();
    wire.mend();
  }
  bool comes_to(const std::string& name, double within_s) {
    for (double waited_s = 0; waited_s < within_s; waited_s += 0.1) {
      run_for(0.1);
      const auto now = names(client);
      if (std::find(now.begin(), now.end(), name) != now.end()) return true;
    }
    return false;
  }

  sim::StreamWire receiver_wire;
  sim::UnitFaults receiver_faults{clock};
  sim::NtripUnit caster;
  drivers::NtripClient client;
  sim::UbloxUnit unit;
  drivers::Ublox driver;
  int drops = 0;
  bool network_gone = false;
};

TEST(Ntrip, CorrectionsReachTheReceiverInEveryVersion) {
  for (const auto version : {NtripVersion::v1, NtripVersion::v2})
    for (const bool chunked : {false, true}) {
      auto caster = RtkLoop::account(version);
      caster.chunked = chunked;
      RtkLoop loop(caster, RtkLoop::asks(version));
      loop.run_for(30.5);
      EXPECT_THAT(names(loop.client), IsEmpty());
      EXPECT_THAT(names(loop.driver), IsEmpty());
      EXPECT_EQ(loop.client.requests(), 1U);
      // Four systems a second and the base every ten; the receiver took the first 3 s to start.
      EXPECT_GE(loop.client.frames(), 29U * 4 + 3);
      EXPECT_GE(loop.driver.corrections_passed(), 27U * 4);
      EXPECT_EQ(loop.unit.corrections().size(), loop.driver.corrections_passed());
      EXPECT_THAT(loop.unit.corrections(), Contains(1005));
      EXPECT_EQ(loop.client.identity().model, "SITE0");
      EXPECT_LT(loop.driver.since_correction_s().value_or(99), 1.1);
      EXPECT_NEAR(loop.client.age_s().value_or(99), 0, 0.5);
      EXPECT_THAT(loop.client.condition(), HasSubstr("base 0.0 km away"));
      EXPECT_THAT(loop.driver.condition(), HasSubstr("since the last came"));
    }
}

TEST(Ntrip, AReceiverOfTheOldVersionIsServedByANewCaster) {
  RtkLoop loop(RtkLoop::account(NtripVersion::v1), RtkLoop::asks(NtripVersion::v2));
  loop.run_for(10);
  EXPECT_THAT(names(loop.client), IsEmpty()) << "an old caster does not know version 2";
}

TEST(Ntrip, NamesARefusalAndAsksAgainLessAndLessOften) {
  auto caster = RtkLoop::account(NtripVersion::v2);
  caster.password = "another";
  RtkLoop loop(caster);
  loop.run_for(5);
  EXPECT_THAT(names(loop.client), ElementsAre("caster refuses user or password"));
  EXPECT_THAT(detail_of(loop.client, "caster refuses user or password"), HasSubstr("401"));
  loop.run_for(595);
  // 1, 2, 4, 8, 16, 32 and then 60 s: six, and then one a minute.
  EXPECT_GE(loop.client.requests(), 14U);
  EXPECT_LE(loop.client.requests(), 17U);
  EXPECT_EQ(static_cast<std::uint64_t>(loop.caster.asked()), loop.client.requests());
  EXPECT_EQ(loop.client.state(), drivers::DeviceState::running) << "a mission goes on without";
}

TEST(Ntrip, TellsNobodyThePassword) {
  auto caster = RtkLoop::account(NtripVersion::v2);
  caster.user = "nobody";
  RtkLoop loop(caster);
  loop.run_for(100);
  const std::string secret = drivers::base64(std::string("robot:") + kPassword);
  for (const drivers::Trouble& trouble : loop.client.troubles()) {
    EXPECT_THAT(trouble.detail, Not(HasSubstr(kPassword)));
    EXPECT_THAT(trouble.detail, Not(HasSubstr(secret)));
    EXPECT_THAT(trouble.detail, Not(HasSubstr("robot")));
  }
  EXPECT_THAT(loop.client.condition(), Not(HasSubstr(kPassword)));
}

TEST(Ntrip, NamesMountpointsThatThereAre) {
  for (const auto version : {NtripVersion::v1, NtripVersion::v2}) {
    auto config = RtkLoop::asks(version);
    config.request.mountpoint = "SITEO";
    RtkLoop loop(RtkLoop::account(version), config);
    loop.run_for(10);
    ASSERT_THAT(names(loop.client), ElementsAre("no such mountpoint"));
    const std::string detail = detail_of(loop.client, "no such mountpoint");
    EXPECT_THAT(detail, HasSubstr(version == NtripVersion::v1 ? "SITE0, OTHER1" : "404"));
  }
}

struct WrongAnswer {
  std::string text, name;
};

TEST(Ntrip, EveryWrongAnswerIsNamed) {
  const WrongAnswer answers[] = {
      {"HTTP/1.1 404 Not Found\r\n\r\n", "no such mountpoint"},
      {"ERROR - Bad Password\r\n", "caster refuses user or password"},
      {"HTTP/1.1 503 Service Unavailable\r\n\r\n", "caster refuses"},
      {"SSH-2.0-OpenSSH_9.2p1 Debian-2\r\n", "not a caster"},
      {"HTTP/1.1 200 OK\r\nContent-Type: text/html\r\n\r\n<html></html>", "not a caster"},
      {"HTTP/1.1 ", "caster does not answer"},
      {"HTTP/1.1 200 OK\r\nContent-Type: gnss/data\r\nTransfer-Encoding: chunked\r\n\r\nzz\r\n",
       "caster's answer damaged"}};
  for (const WrongAnswer& each : answers) {
    RtkLoop loop;
    loop.caster.answer_with(each.text);
    EXPECT_TRUE(loop.comes_to(each.name, 15)) << each.text;
    loop.caster.answer_with("");
    loop.run_for(60);
    EXPECT_THAT(names(loop.client), IsEmpty()) << each.text;
    EXPECT_GT(loop.drops, 0);
  }
}

TEST(Ntrip, NamesSilenceAnotherFormatAndTheEndOfAStream) {
  RtkLoop loop;
  loop.run_for(10);
  loop.caster.mute(true);
  EXPECT_TRUE(loop.comes_to("caster sends nothing", 12));
  loop.caster.mute(false);
  loop.run_for(30);
  EXPECT_THAT(names(loop.client), IsEmpty());
  loop.caster.speak_rtcm2(true);
  EXPECT_TRUE(loop.comes_to("no RTCM 3 in what the caster sends", 12));
  loop.caster.speak_rtcm2(false);
  loop.run_for(30);
  EXPECT_THAT(names(loop.client), IsEmpty());
  loop.caster.hang_up();
  EXPECT_TRUE(loop.comes_to("caster lost", 3));
  loop.run_for(10);
  EXPECT_THAT(names(loop.client), IsEmpty());
}

TEST(Ntrip, ComesBackAfterTheNetworkWasGone) {
  RtkLoop loop;
  loop.run_for(10);
  loop.network_gone = true;
  loop.wire.cut();
  EXPECT_TRUE(loop.comes_to("caster lost", 3));
  EXPECT_TRUE(loop.comes_to("caster not reached", 30));
  loop.run_for(70);
  EXPECT_THAT(names(loop.driver), Contains("no corrections")) << "older than a minute";
  loop.network_gone = false;
  loop.wire.mend();
  loop.run_for(70);
  EXPECT_THAT(names(loop.client), IsEmpty());
  EXPECT_THAT(names(loop.driver), IsEmpty());
}

TEST(Ntrip, ANetworkIsToldWhereTheRobotIs) {
  for (const auto version : {NtripVersion::v1, NtripVersion::v2}) {
    auto caster = RtkLoop::account(version);
    caster.wants_position = true;
    auto config = RtkLoop::asks(version);
    config.tells_position = true;
    RtkLoop loop(caster, config);
    loop.run_for(45);
    EXPECT_THAT(names(loop.client), IsEmpty());
    EXPECT_GE(loop.caster.positions().size(), 4U) << "every 10 s";
    EXPECT_LE(loop.caster.positions().size(), 6U);
    for (const std::string& gga : loop.caster.positions())
      EXPECT_THAT(gga, HasSubstr(",N,01100.00")) << gga;
    EXPECT_GT(loop.driver.corrections_passed(), 100U);
  }
}

TEST(Ntrip, NamesANetworkThatWaitsForAPosition) {
  auto caster = RtkLoop::account(NtripVersion::v2);
  caster.wants_position = true;
  RtkLoop untold(caster);
  EXPECT_TRUE(untold.comes_to("caster sends nothing", 12));
  auto config = RtkLoop::asks(NtripVersion::v2);
  config.tells_position = true;
  RtkLoop lost(caster, config);
  lost.unit.sky().quality = drivers::GnssQuality::none;
  EXPECT_TRUE(lost.comes_to("no position for the caster", 12));
  lost.unit.sky().quality = drivers::GnssQuality::single;
  lost.run_for(30);
  EXPECT_THAT(names(lost.client), IsEmpty());
}

struct CasterFault {
  sim::FaultSetting setting;
  std::string named;
};

TEST(Ntrip, EveryFaultIsNamedAndOver) {
  const CasterFault faults[] = {
      {{UnitFault::off, 0}, "caster sends nothing"},
      {{UnitFault::stuck, 0}, "corrections frozen"},
      {{UnitFault::garbage, 0}, "no RTCM 3 in what the caster sends"},
      {{UnitFault::wrong, 0.5}, "base far away"},
      {{UnitFault::slow, 3}, "corrections slow"},
      {{UnitFault::delayed, 8}, "corrections old"},
      {{UnitFault::intermittent, 24}, "caster sends nothing"},
      {{UnitFault::duplicated_reordered, 0}, "corrections repeated or out of order"}};
  for (const CasterFault& each : faults) {
    const std::string what = sim::to_text(each.setting);
    RtkLoop loop(RtkLoop::account(NtripVersion::v1), RtkLoop::asks(NtripVersion::v1));
    loop.run_for(12);
    ASSERT_THAT(names(loop.client), IsEmpty()) << what;
    loop.faults.set(each.setting);
    EXPECT_TRUE(loop.comes_to(each.named, 25)) << what;
    loop.faults.clear();
    loop.run_for(75);
    EXPECT_THAT(names(loop.client), IsEmpty()) << what;
    EXPECT_THAT(names(loop.driver), IsEmpty()) << what;
  }
}

TEST(Ntrip, GarbageInChunksIsNamedToo) {
  RtkLoop loop;
  loop.run_for(12);
  loop.faults.set({UnitFault::garbage, 0});
  EXPECT_TRUE(loop.comes_to("caster's answer damaged", 12));
  EXPECT_TRUE(loop.comes_to("not a caster", 30));
  loop.faults.clear();
  loop.run_for(75);
  EXPECT_THAT(names(loop.client), IsEmpty());
}

TEST(Ntrip, NamesDamagedFramesAndPassesNone) {
  RtkLoop loop(RtkLoop::account(NtripVersion::v1), RtkLoop::asks(NtripVersion::v1));
  loop.run_for(5);
  sim::LinkFaults noisy;
  noisy.corruption = 0.3;
  loop.wire.set_faults(noisy);
  EXPECT_TRUE(loop.comes_to("corrections damaged", 10));
  loop.run_for(20);
  EXPECT_EQ(loop.unit.corrections().size(), loop.driver.corrections_passed());
  for (const std::uint16_t type : loop.unit.corrections())
    EXPECT_THAT((std::vector<int>{1005, 1077, 1087, 1097, 1127}), Contains(type));
  loop.wire.set_faults({});
  loop.run_for(8);
  EXPECT_THAT(names(loop.client), IsEmpty());
}

// Nobody reads while the receiver is away: the oldest are lost, the newest wait.
TEST(Ntrip, HoldsNoMoreThanItSays) {
  drivers_test::StreamLoop loop;
  sim::NtripUnit caster(RtkLoop::account(NtripVersion::v2), loop.clock, loop.wire.b(), loop.faults);
  drivers::NtripClient client(RtkLoop::asks(NtripVersion::v2), loop.clock, loop.wire.a());
  loop.spawn(caster.run());
  loop.spawn(client.run());
  loop.run_for(60);
  EXPECT_EQ(client.frames() - client.frames_lost(), drivers::NtripClient::kFramesMax);
  std::vector<std::uint8_t> piece(4096);
  loop.spawn([](drivers::NtripClient& from, std::vector<std::uint8_t>& into) -> hal::Task<void> {
    const std::vector<std::uint8_t> nothing{1};
    const auto refused = co_await from.write(nothing);
    EXPECT_FALSE(refused);
    for (std::size_t i = 0; i < drivers::NtripClient::kFramesMax; ++i) {
      const auto size = co_await from.read_some(into);
      EXPECT_TRUE(size);
      const drivers::ByteView frame = drivers::ByteView(into).first(*size);
      EXPECT_EQ(drivers::look_gnss(frame).size, *size) << "whole frames";
    }
    co_await from.read_some(into);
    for (;;) co_await from.read_some(into);
  }(client, piece));
  loop.run_for(1);
}

}  // namespace ntrip_loop
