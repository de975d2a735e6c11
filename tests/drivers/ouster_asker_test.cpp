// An Ouster that is asked over HTTP who it is and how it is set, against a simulated one.
#include <gmock/gmock.h>

#include "drivers/http.hpp"
#include "drivers/ouster.hpp"
#include "sim/ouster_unit.hpp"
#include "tests/drivers/loop_rig.hpp"
#include "tests/drivers/recordings.hpp"

namespace drivers {
namespace {

using namespace std::chrono_literals;
using sim::UnitFault;
using testing::HasSubstr;

std::string with(std::string text, const std::string& what, const std::string& instead) {
  const auto at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return text.replace(at, what.size(), instead);
}

class OusterAsks : public drivers_test::LoopRig {
 protected:
  OusterAsks() {
    sim::OusterUnitConfig unit_config = drivers_test::exact<sim::OusterUnitConfig>();
    EXPECT_EQ(parse_ouster_metadata(sim::sample_ouster_metadata(), unit_config.metadata), "");
    unit_config.settings.udp_dest = "192.168.1.10";
    unit.emplace(unit_config, world, clock, packets.sender(), faults, &http.b());
    by_a_file_of("1");  // Another one of that kind.
  }
  ~OusterAsks() override { halt_all(); }
  void by_a_file_of(const std::string& serial) {
    OusterConfig config;
    EXPECT_EQ(parse_ouster_metadata(sim::sample_ouster_metadata(), config.metadata), "");
    config.metadata.serial_number = serial;
    config.scan.turns = 2;
    OusterApi api;
    api.config.host = "192.168.1.50";
    api.config.own_address = [this] { return own_address; };
    api.link = &http.a();
    api.drop = [this] {
      ++drops;
      if (network_gone) return;
      http.cut();
      spawn(mend_later());
    };
    device.emplace(config, clock, packets.receiver(), api);
  }
  // A link connects anew after a while only.
  hal::Task<void> mend_later() {
    co_await clock.sleep_for(150ms);
    if (!network_gone) http.mend();
  }
  void go() {
    spawn(unit->run());
    spawn(device->run());
  }
  std::string detail(std::string_view name) const {
    for (const Trouble& trouble : device->troubles())
      if (trouble.fault->name == name) return trouble.detail;
    return "(no such trouble)";
  }

  sim::DatagramWire packets{clock};
  sim::StreamWire http{clock};
  sim::UnitFaults faults{clock};
  std::string own_address = "192.168.1.10";
  int drops = 0;
  bool network_gone = false;
  std::optional<sim::OusterUnit> unit;
  std::optional<Ouster> device;
};

TEST_F(OusterAsks, TakesTheSensorsOwnMetadata) {
  go();
  ASSERT_TRUE(comes_up(*device, 3s)) << told(*device);
  run_for(15s);
  EXPECT_EQ(told(*device), "");
  EXPECT_EQ(device->identity().serial, "992000000042") << "not the file's";
  EXPECT_TRUE(result_of(device->scan())) << told(*device);
  EXPECT_EQ(drops, 0);
}

TEST_F(OusterAsks, AConnectionThatComesLaterIsNotEndedAtOnce) {
  http.cut();
  go();
  run_for(300ms);
  http.mend();
  run_for(5s);
  EXPECT_EQ(device->identity().serial, "992000000042");
  EXPECT_EQ(told(*device), "");
  EXPECT_EQ(drops, 0);
}

struct Refused {
  const char *what, *instead, *named, *detail;
};

TEST_F(OusterAsks, RefusesWhatItCannotUseAndNamesTheRemedy) {
  go();
  const Refused all[] = {
      {"RNG19_RFL8_SIG16_NIR16", "FIVE_WORD_PIXEL", "packet format not supported",
       "FIVE_WORD_PIXEL"},
      {"v2.5.2", "v1.13.0", "firmware too old", "v1.13.0"},
      {"\"columns_per_frame\": 1024", "\"columns_per_frame\": 2048",
       "another sensor than the metadata's", "2048 columns"},
      {"[21.5", "[45.5", "another sensor than the metadata's", "other heights"},
      {"{\"prod_line\"", "{\"x\": 1} {\"prod_line\"", "not an Ouster", "no JSON"}};
  for (const Refused& each : all) {
    unit->serve_metadata(with(sim::sample_ouster_metadata(), each.what, each.instead));
    http.cut();  // It restarts.
    http.mend();
    EXPECT_TRUE(comes_to(*device, each.named, 15s)) << each.named << '\n' << told(*device);
    EXPECT_THAT(detail(each.named), HasSubstr(each.detail));
    run_for(2s);
    EXPECT_FALSE(running(*device)) << "its packets are not used: " << each.named;
    unit->serve_metadata(sim::sample_ouster_metadata());
    run_for(25s);
    EXPECT_EQ(told(*device), "") << each.named;
    EXPECT_TRUE(running(*device));
  }
}

TEST_F(OusterAsks, NamesPacketsThatGoElsewhereAndStandby) {
  go();
  run_for(2s);
  unit->settings().udp_port_lidar = 7600;
  EXPECT_TRUE(comes_to(*device, "sends to another port", 12s));
  EXPECT_THAT(detail("sends to another port"), HasSubstr("to 7600, expected at 7502"));
  unit->settings().udp_port_lidar = 7502;
  unit->settings().udp_dest = "192.168.1.11";
  EXPECT_TRUE(comes_to(*device, "sends to another computer", 12s));
  EXPECT_THAT(detail("sends to another computer"), HasSubstr("192.168.1.11"));
  for (const char* fine : {"255.255.255.255", "192.168.1.255", "239.1.2.3", "robot.local"}) {
    unit->settings().udp_dest = fine;
    run_for(12s);
    EXPECT_EQ(told(*device), "") << fine;
  }
  unit->settings().operating_mode = "STANDBY";
  EXPECT_TRUE(comes_to(*device, "sensor in standby", 12s));
  unit->settings().operating_mode = "NORMAL";
  unit->alerts().push_back({"0x01000001", "WARNING", "OVERTEMP", "Unit is hot"});
  EXPECT_TRUE(comes_to(*device, "sensor complains", 12s));
  EXPECT_THAT(detail("sensor complains"), HasSubstr("OVERTEMP: Unit is hot"));
  unit->alerts().clear();
  run_for(12s);
  EXPECT_EQ(told(*device), "");
}

TEST_F(OusterAsks, NamesWhoeverElseAnswersThere) {
  go();
  unit->serve_metadata("");
  EXPECT_TRUE(comes_to(*device, "firmware too old", 15s)) << told(*device);
  unit->serve_metadata(sim::sample_ouster_metadata());
  run_for(15s);
  EXPECT_FALSE(has(*device, "settings not answered"));
}

TEST_F(OusterAsks, GoesByTheFileWhileNobodyAnswers) {
  network_gone = true;
  http.cut();
  by_a_file_of("992000000042");
  go();
  ASSERT_TRUE(comes_up(*device, 3s)) << "packets come";
  EXPECT_TRUE(comes_to(*device, "settings not answered", 15s));
  network_gone = false;
  http.mend();
  run_for(5s);
  EXPECT_EQ(told(*device), "");
}

TEST_F(OusterAsks, EveryFaultOfTheUnitIsOver) {
  go();
  run_for(3s);
  for (const UnitFault fault : {UnitFault::off, UnitFault::garbage, UnitFault::delayed,
                                UnitFault::intermittent, UnitFault::stuck}) {
    faults.set({fault, fault == UnitFault::delayed || fault == UnitFault::intermittent ? 4.0 : 0});
    run_for(30s);
    faults.clear();
    run_for(30s);
    EXPECT_EQ(told(*device), "") << sim::to_text({fault, 0});
    EXPECT_TRUE(running(*device));
  }
  EXPECT_GT(drops, 0) << "an answer that came too late is not taken for the next";
}

TEST(Http, AnAnswerIsTheSameHoweverItArrives) {
  const std::string text = http_answer(200, R"({"a": 1})");
  for (const std::size_t piece : {std::size_t{1}, std::size_t{7}, text.size()}) {
    HttpAnswer answer;
    for (std::size_t at = 0; at < text.size(); at += piece) {
      EXPECT_FALSE(answer.whole());
      answer.feed(as_bytes(std::string_view(text).substr(at, piece)));
    }
    ASSERT_TRUE(answer.whole());
    EXPECT_EQ(answer.status(), 200);
    EXPECT_EQ(answer.take_body(), R"({"a": 1})");
  }
}

TEST(Http, ChunksAreReadAndWhatIsNoHttpOrTooLongIsBroken) {
  HttpAnswer chunked;
  chunked.feed(as_bytes(
      "HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n3\r\nabc\r\n2\r\nde\r\n0\r\n\r\n"));
  ASSERT_TRUE(chunked.whole());
  EXPECT_EQ(chunked.take_body(), "abcde");
  for (const std::string& text :
       {std::string("SSH-2.0-OpenSSH_9.2p1\r\n\r\n"), std::string(20000, 'x'),
        std::string("HTTP/1.1 200 OK\r\nContent-Length: 99999999\r\n\r\n") +
            std::string(HttpAnswer::kBodyMax + 10, 'x')}) {
    HttpAnswer answer;
    answer.feed(as_bytes(text));
    EXPECT_TRUE(answer.broken()) << text.substr(0, 40);
  }
}

TEST(Http, ASensorReadsWhatWeAsk) {
  const std::string text = http_get("192.168.1.50", kOusterAlertsPath);
  for (std::size_t size = 0; size < text.size(); ++size)
    EXPECT_FALSE(parse_http_get(text.substr(0, size)));
  const auto asked = parse_http_get(text + "GET");
  ASSERT_TRUE(asked);
  EXPECT_EQ(asked->path, kOusterAlertsPath);
  EXPECT_EQ(asked->size, text.size());
  EXPECT_THAT(text, HasSubstr("Host: 192.168.1.50\r\n"));
}

TEST(OusterApi, ReadsVersionsSettingsAndAlerts) {
  EXPECT_EQ(ouster_version("v2.5.2"), (OusterVersion{2, 5, 2}));
  EXPECT_EQ(ouster_version("3.1.0-rc.2"), (OusterVersion{3, 1, 0}));
  EXPECT_FALSE(ouster_version("v2"));
  EXPECT_FALSE(ouster_version("ousteros"));
  OusterSettings settings;
  EXPECT_EQ(parse_ouster_settings(R"({"udp_ip": "10.0.0.1", "udp_port_lidar": 7502})", settings),
            "");
  EXPECT_EQ(settings.udp_dest, "10.0.0.1");
  EXPECT_THAT(parse_ouster_settings(R"({"udp_port_lidar": 75020})", settings), HasSubstr("port"));
  EXPECT_THAT(parse_ouster_settings("[]", settings), HasSubstr("object"));
  std::vector<OusterAlert> alerts;
  EXPECT_THAT(parse_ouster_alerts("{}", alerts), HasSubstr("list"));
  EXPECT_EQ(parse_ouster_alerts(ouster_alerts_json({{"0x1", "ERROR", "SHOT_LIMITING", "too hot"}}),
                                alerts),
            "");
  ASSERT_EQ(alerts.size(), 1U);
  EXPECT_EQ(alerts[0].category, "SHOT_LIMITING");
}

// What a real one serves is what its packets need, over HTTP as from a file.
TEST(OusterApi, ARealSensorsMetadataComeThroughHttp) {
  RECORDING_OR_SKIP(json, "ouster/OS-1-32-G_v2.1.1_1024x10.json");
  HttpAnswer answer;
  answer.feed(as_bytes(http_answer(200, json)));
  ASSERT_TRUE(answer.whole());
  OusterMetadata by_http, by_file;
  EXPECT_EQ(parse_ouster_metadata(answer.take_body(), by_http), "");
  EXPECT_EQ(parse_ouster_metadata(json, by_file), "");
  EXPECT_EQ(by_http.beam_altitude_deg, by_file.beam_altitude_deg);
  EXPECT_EQ(by_http.serial_number, "992101000280");
  EXPECT_EQ(ouster_version(by_http.firmware), (OusterVersion{2, 1, 1}));
}

}  // namespace
}  // namespace drivers
