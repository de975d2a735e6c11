#include "tools/captures.hpp"

#include <gtest/gtest.h>

#include <random>

#include "drivers/text.hpp"
#include "tests/drivers/recordings.hpp"
#include "tools/captures_tcp.hpp"
#include "tools/decoders.hpp"

namespace captures {
namespace {

using drivers::append_big;
using drivers::append_little;
using drivers::Bytes;
using drivers::ByteView;
using drivers_test::from_hex;

Capture must_read(std::string_view file, const Options& options = {}) {
  auto capture = read(file, "file", options);
  EXPECT_TRUE(capture) << capture.error().text();
  return capture ? *capture : Capture{};
}

std::string as_string(const Bytes& bytes) {
  return {bytes.begin(), bytes.end()};
}

Bytes text_bytes(std::string_view text) {
  return {text.begin(), text.end()};
}

// --- Text

TEST(Candump, ReadsEveryWayInWhichFramesAreWritten) {
  const auto capture = must_read(
      "# a comment\n\n"
      "(1436509052.249713) vcan0 123#DEADBEEF\n"
      " (0.5) can1 18DA10F1#0102\r\n"
      "can0 080#\n"
      "can0 705#R\n"
      "  can1   131   [8]  00 00 00 00 00 00 E4 1E\n"
      " (010.5)  can0  RX - -  211   [2]  01 ff   '..'\n"
      "can0 080 [0]\n"
      "can0 705 [0] remote request\n");
  ASSERT_EQ(capture.pieces.size(), 8U);
  EXPECT_EQ(capture.format, Format::candump);
  EXPECT_TRUE(capture.skipped.empty());
  EXPECT_EQ(capture.conversations, (std::vector<std::string>{"vcan0", "can1", "can0"}));
  const auto& p = capture.pieces;
  EXPECT_DOUBLE_EQ(p[0].t_s.value(), 1436509052.249713);
  EXPECT_EQ(p[0].bytes, from_hex("DEADBEEF"));
  EXPECT_TRUE(p[1].can_extended);
  EXPECT_EQ(p[1].can_id, 0x18DA10F1U);
  EXPECT_EQ(p[2].t_s, std::nullopt);
  EXPECT_TRUE(p[2].bytes.empty() && !p[2].can_remote);
  EXPECT_TRUE(p[3].can_remote);
  EXPECT_EQ(p[4].bytes, from_hex("000000000000E41E"));
  EXPECT_EQ(p[4].conversation, 1U);
  EXPECT_EQ(p[5].t_s, 10.5);
  EXPECT_EQ(p[5].bytes, from_hex("01FF"));
  EXPECT_TRUE(p[6].bytes.empty());
  EXPECT_TRUE(p[7].can_remote);
}

TEST(Candump, SkipsAndCountsWhatIsNoClassicalFrame) {
  const auto capture = must_read(
      "can0 123#01\n"
      "can0 123##10102\n"
      "can0 20000004#0000000000000000\n"
      "can0 123#0\n"
      "can0 800#00\n"
      "can0 123#010203040506070809\n"
      "can0 123 [2] 01\n"
      "what is this\n");
  EXPECT_EQ(capture.pieces.size(), 1U);
  EXPECT_EQ(capture.skipped.at("CAN FD frame").times, 1U);
  EXPECT_EQ(capture.skipped.at("CAN error frame").times, 1U);
  EXPECT_EQ(capture.skipped.at("line that is no CAN frame").times, 5U);
}

TEST(Candump, RefusesAFileWithoutFrames) {
  const auto capture = read("\nhello\n", "drive.log", {Format::candump});
  ASSERT_FALSE(capture);
  EXPECT_EQ(capture.error().text(),
            "drive.log:2: no CAN frame: write \"(t) can0 123#AABB\" or \"can0 123 [2] AA BB\"");
}

TEST(Socat, ReadsBlocksWithTheirTimesAndSides) {
  const auto capture = must_read(
      "> 1970/01/02 00:00:01.5  length=20 from=0 to=19\n"
      " 00 01 02 03 04 05 06 07 08 09 0a 0b 0c 0d 0e 0f  ................\n"
      " 10 11 12 61                                      ...a\n"
      "--\n"
      "< 1970/01/02 00:00:02.000000  length=3 from=0 to=2\n"
      " ff fe\n"
      "--\n");
  ASSERT_EQ(capture.pieces.size(), 2U);
  EXPECT_EQ(capture.pieces[0].t_s, 86401.5);
  EXPECT_TRUE(capture.pieces[0].from_device);
  EXPECT_EQ(capture.pieces[0].bytes, from_hex("000102030405060708090a0b0c0d0e0f10111261"));
  EXPECT_FALSE(capture.pieces[1].from_device);
  EXPECT_EQ(capture.pieces[1].bytes, from_hex("FFFE"));
  EXPECT_EQ(capture.skipped.at("cut short").times, 1U);
  EXPECT_TRUE(
      must_read("< 1970/01/02 00:00:02.0  length=1 from=0 to=0\n ff\n", {Format::detect, true, {}})
          .pieces[0]
          .from_device);
  EXPECT_FALSE(read("hello\n", "x", {Format::socat}));
}

TEST(Json, ReadsTsharksPayloads) {
  const auto capture = must_read(
      R"([{"_source":{"layers":{"tcp":{"Timestamps":{"tcp.time_relative":"0.25"},"tcp.payload":"02:7f"}}}},)"
      R"({"_source":{"layers":{"udp":{}}}},{"_source":{"layers":{"tcp":{"tcp.payload":"xy"}}}}])");
  ASSERT_EQ(capture.pieces.size(), 1U);
  EXPECT_EQ(capture.pieces[0].t_s, 0.25);
  EXPECT_EQ(capture.pieces[0].bytes, from_hex("027F"));
  EXPECT_EQ(capture.skipped.at("packet without TCP payload").times, 1U);
  EXPECT_EQ(capture.skipped.at("payload is not hex").times, 1U);
  EXPECT_FALSE(read("[{\"_source\":", "x"));
  EXPECT_FALSE(read("{}", "x", {Format::json}));
}

TEST(Captures, WhatIsNothingElseIsRaw) {
  const auto capture = must_read("$GPGGA,...\r\n");
  ASSERT_EQ(capture.pieces.size(), 1U);
  EXPECT_EQ(capture.format, Format::raw);
  EXPECT_EQ(as_string(capture.pieces[0].bytes), "$GPGGA,...\r\n");
}

// --- Packets

struct Packet {
  Bytes bytes;
  double t_s = 0;
};

Bytes ip(std::uint8_t protocol, std::uint8_t from, std::uint8_t to, const Bytes& inside) {
  Bytes bytes = from_hex("000000000001 000000000002 0800 45 00");
  append_big<std::uint16_t>(bytes, static_cast<std::uint16_t>(20 + inside.size()));
  for (const auto byte : from_hex("0000 4000 40")) bytes.push_back(byte);
  bytes.push_back(protocol);
  for (const auto byte : Bytes{0, 0, 10, 0, 0, from, 10, 0, 0, to}) bytes.push_back(byte);
  bytes.insert(bytes.end(), inside.begin(), inside.end());
  return bytes;
}

Bytes udp(std::uint16_t from, std::uint16_t to, std::string_view data) {
  Bytes bytes;
  append_big<std::uint16_t>(bytes, from);
  append_big<std::uint16_t>(bytes, to);
  append_big<std::uint16_t>(bytes, static_cast<std::uint16_t>(8 + data.size()));
  append_big<std::uint16_t>(bytes, 0);
  bytes.insert(bytes.end(), data.begin(), data.end());
  return bytes;
}

Bytes tcp(std::uint16_t from, std::uint16_t to, std::uint32_t sequence, std::uint8_t flags,
          std::string_view data) {
  Bytes bytes;
  append_big<std::uint16_t>(bytes, from);
  append_big<std::uint16_t>(bytes, to);
  append_big<std::uint32_t>(bytes, sequence);
  append_big<std::uint32_t>(bytes, 0);
  for (const auto byte : Bytes{0x50, flags, 1, 0, 0, 0, 0, 0}) bytes.push_back(byte);
  bytes.insert(bytes.end(), data.begin(), data.end());
  return bytes;
}

std::string pcap(const std::vector<Bytes>& packets, std::uint32_t link = 1) {
  Bytes bytes;
  append_little<std::uint32_t>(bytes, 0xA1B2C3D4);
  for (const auto byte : from_hex("0200 0400 00000000 00000000 FFFF0000")) bytes.push_back(byte);
  append_little<std::uint32_t>(bytes, link);
  std::uint32_t t = 100;
  for (const Bytes& packet : packets) {
    append_little<std::uint32_t>(bytes, t++);
    append_little<std::uint32_t>(bytes, 500000);
    append_little<std::uint32_t>(bytes, static_cast<std::uint32_t>(packet.size()));
    append_little<std::uint32_t>(bytes, static_cast<std::uint32_t>(packet.size()));
    bytes.insert(bytes.end(), packet.begin(), packet.end());
  }
  return as_string(bytes);
}

// The same packets in the other byte order, in nanoseconds, as pcapng.
std::string pcapng(const std::vector<Bytes>& packets, std::uint16_t link) {
  Bytes bytes;
  const auto block = [&](std::uint32_t type, Bytes body) {
    while (body.size() % 4 != 0) body.push_back(0);
    append_big<std::uint32_t>(bytes, type);
    append_big<std::uint32_t>(bytes, static_cast<std::uint32_t>(body.size() + 12));
    bytes.insert(bytes.end(), body.begin(), body.end());
    append_big<std::uint32_t>(bytes, static_cast<std::uint32_t>(body.size() + 12));
  };
  block(0x0A0D0D0A, from_hex("1A2B3C4D 0001 0000 FFFFFFFFFFFFFFFF"));
  Bytes interface;
  append_big<std::uint16_t>(interface, link);
  for (const auto byte : from_hex("0000 00000000 0009 0001 09000000 0000 0000"))
    interface.push_back(byte);
  block(1, interface);
  std::uint64_t t_ns = 100'500'000'000;
  for (const Bytes& packet : packets) {
    Bytes body;
    append_big<std::uint32_t>(body, 0);
    append_big<std::uint64_t>(body, t_ns);
    append_big<std::uint32_t>(body, static_cast<std::uint32_t>(packet.size()));
    append_big<std::uint32_t>(body, static_cast<std::uint32_t>(packet.size()));
    body.insert(body.end(), packet.begin(), packet.end());
    block(6, body);
    t_ns += 1'000'000'000;
  }
  return as_string(bytes);
}

void expect_same(const Capture& a, const Capture& b) {
  ASSERT_EQ(a.pieces.size(), b.pieces.size());
  for (std::size_t i = 0; i < a.pieces.size(); ++i) {
    EXPECT_NEAR(a.pieces[i].t_s.value(), b.pieces[i].t_s.value(), 1e-6);
    EXPECT_EQ(a.pieces[i].bytes, b.pieces[i].bytes);
    EXPECT_EQ(a.pieces[i].from_device, b.pieces[i].from_device);
    EXPECT_EQ(a.pieces[i].can_id, b.pieces[i].can_id);
  }
  EXPECT_EQ(a.conversations, b.conversations);
}

TEST(Pcap, ReadsDatagramsAndCountsTheRest) {
  Bytes fragment = ip(17, 1, 2, udp(1, 2, "x"));
  fragment[20] = 0x20;
  Bytes cut = ip(17, 1, 2, udp(1, 2, "long enough"));
  cut.resize(cut.size() - 4);
  const std::vector<Bytes> packets{ip(17, 1, 2, udp(2368, 2368, "scan")),
                                   ip(1, 1, 2, text_bytes("ping")),
                                   from_hex("000000000001 000000000002 86DD 60"),
                                   fragment,
                                   cut,
                                   ip(17, 1, 3, udp(7503, 7503, "imu"))};
  const auto capture = must_read(pcap(packets));
  ASSERT_EQ(capture.pieces.size(), 2U);
  EXPECT_EQ(as_string(capture.pieces[0].bytes), "scan");
  EXPECT_EQ(capture.pieces[0].t_s, 100.5);
  EXPECT_EQ(as_string(capture.pieces[1].bytes), "imu");
  EXPECT_EQ(capture.conversations[1], "10.0.0.1:7503 - 10.0.0.3:7503");
  EXPECT_EQ(capture.skipped.size(), 4U);
  expect_same(must_read(pcapng(packets, 1)), capture);
  const auto one = must_read(pcap(packets), {Format::detect, false, 7503});
  EXPECT_EQ(one.pieces.size(), 1U);
}

TEST(Pcap, ReadsSocketCan) {
  const std::vector<Bytes> frames{from_hex("00000211 08000000 0100010000800005"),
                                  from_hex("98DA10F1 02000000 0102"), from_hex("40000705 00000000"),
                                  from_hex("20000004 08000000 0000000000000000"),
                                  from_hex("00000211 08000000 01")};
  const auto capture = must_read(pcap(frames, 227));
  ASSERT_EQ(capture.pieces.size(), 3U);
  EXPECT_EQ(capture.pieces[0].can_id, 0x211U);
  EXPECT_EQ(capture.pieces[0].bytes, from_hex("0100010000800005"));
  EXPECT_TRUE(capture.pieces[1].can_extended);
  EXPECT_EQ(capture.pieces[1].can_id, 0x18DA10F1U);
  EXPECT_TRUE(capture.pieces[2].can_remote);
  EXPECT_EQ(capture.skipped.at("CAN error frame").times, 1U);
  EXPECT_EQ(capture.skipped.at("packet cut short").times, 1U);
  expect_same(must_read(pcapng(frames, 227)), capture);
}

TEST(Pcap, PutsTcpInOrderAndKnowsTheDevice) {
  constexpr std::uint8_t kSyn = 2, kAck = 16;
  const auto up = [](std::uint32_t sequence, std::uint8_t flags, std::string_view data) {
    return ip(6, 1, 2, tcp(51000, 52111, sequence, flags, data));
  };
  const auto down = [](std::uint32_t sequence, std::uint8_t flags, std::string_view data) {
    return ip(6, 2, 1, tcp(52111, 51000, sequence, flags, data));
  };
  const std::vector<Bytes> packets{
      up(0xFFFFFFFE, kSyn, ""),       down(500, kSyn | kAck, ""), up(0xFFFFFFFF, kAck, "ab"),
      down(504, kAck, "45"),          up(1, kAck, "cd"),          down(501, kAck, "123"),
      up(0xFFFFFFFF, kAck, "abcdef"), down(501, kAck, "123"),     down(510, kAck, "late")};
  const auto capture = must_read(pcap(packets));
  std::string to, from;
  for (const auto& piece : capture.pieces)
    (piece.from_device ? from : to) += as_string(piece.bytes);
  EXPECT_EQ(to, "abcdef");
  EXPECT_EQ(from, "12345late");
  EXPECT_EQ(capture.skipped.at("gap in a TCP stream").bytes, 4U);
  EXPECT_EQ(capture.conversations, (std::vector<std::string>{"10.0.0.2:52111 - 10.0.0.1:51000"}));
}

TEST(Pcap, RefusesOtherFilesAndEndsWhereTheyAreCut) {
  const auto refused = read("hello, this is no capture at all", "x.pcap", {Format::pcap});
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().text().find("x.pcap: no pcap"), std::string::npos);
  const std::string whole = pcap({ip(17, 1, 2, udp(1, 2, "one")), ip(17, 1, 2, udp(1, 2, "two"))});
  for (std::size_t size = 24; size < whole.size(); ++size) {
    const auto capture = must_read(std::string_view(whole).substr(0, size));
    EXPECT_LE(capture.pieces.size(), 1U);
  }
}

// Segments cut, doubled and shuffled within a window give the same bytes as were sent.
TEST(TcpSide, DeliversWhatWasSentHoweverItWasCaptured) {
  std::mt19937 random(9);
  for (int round = 0; round < 200; ++round) {
    std::string sent(500 + random() % 500, ' ');
    for (char& c : sent) c = static_cast<char>(random());
    const auto start = static_cast<std::uint32_t>(random());
    std::vector<TcpSide::Segment> segments;
    for (std::size_t at = 0; at < sent.size();) {
      const std::size_t size = std::min<std::size_t>(1 + random() % 60, sent.size() - at);
      const auto all = drivers::as_bytes(sent);
      segments.push_back(
          {start + static_cast<std::uint32_t>(at), false, 1.0, all.subspan(at, size)});
      if (random() % 5 == 0) {  // Sent again, longer.
        const std::size_t more = std::min<std::size_t>(size + random() % 50, sent.size() - at);
        segments.push_back(
            {start + static_cast<std::uint32_t>(at), false, 1.0, all.subspan(at, more)});
      }
      at += size;
    }
    for (std::size_t i = 2; i < segments.size(); ++i)
      std::swap(segments[i], segments[1 + (i - 1) - random() % std::min<std::size_t>(i - 1, 5)]);
    TcpSide side;
    std::string got;
    std::size_t lost = 0;
    const auto out = [&](std::optional<double>, ByteView bytes) {
      got.append(bytes.begin(), bytes.end());
    };
    const auto gap = [&](std::size_t bytes) { lost += bytes; };
    for (const auto& segment : segments) side.add(segment, out, gap);
    side.finish(out, gap);
    EXPECT_EQ(lost, 0U);
    EXPECT_EQ(got, sent);
  }
}

TEST(TcpSide, GivesUpAGapWhenTooMuchWaits) {
  TcpSide side;
  std::size_t got = 0, lost = 0;
  const auto out = [&](std::optional<double>, ByteView bytes) { got += bytes.size(); };
  const auto gap = [&](std::size_t bytes) { lost += bytes; };
  const Bytes piece(1000);
  side.add({0, false, {}, piece}, out, gap);
  for (std::uint32_t i = 2; i < 1100; ++i) side.add({i * 1000, false, {}, piece}, out, gap);
  EXPECT_EQ(lost, 1000U);
  EXPECT_EQ(got, 1099U * 1000);
}

// --- Recordings

std::map<std::string, int> decoded(const Capture& capture, const std::string& device,
                                   drivers::SkippedBy& skipped) {
  std::map<std::size_t, std::unique_ptr<drivers::OfflineDecoder>> decoders;
  std::map<std::string, int> names;
  for (const auto& piece : capture.pieces) {
    auto& decoder = decoders[piece.conversation];
    if (!decoder) decoder = decoders::make_decoder(device, {});
    decoder->feed({piece.t_s, piece.from_device, piece.bytes, piece.can_id, piece.can_extended,
                   piece.can_remote},
                  [&](const drivers::Message& message) { ++names[message.name]; });
  }
  for (const auto& [conversation, decoder] : decoders)
    for (const auto& [why, by] : decoder->skipped()) skipped[why].times += by.times;
  return names;
}

TEST(Decode, ReadsTheCanRecordings) {
  RECORDING_OR_SKIP(scout, "can/agilex_scout_v1_candump_short.txt");
  RECORDING_OR_SKIP(slave, "can/pycanopen_localnode_sdo_heartbeat.log");
  RECORDING_OR_SKIP(mixed, "can/real_device_snippets.candump.txt");
  drivers::SkippedBy skipped;
  EXPECT_EQ(decoded(must_read(scout), "agilex", skipped),
            (std::map<std::string, int>{{"motion state, version 1", 1},
                                        {"light state, version 1", 1},
                                        {"system state, version 1", 1},
                                        {"motor, version 1", 4}}));
  EXPECT_EQ(decoded(must_read(slave), "canopen", skipped),
            (std::map<std::string, int>{{"heartbeat", 38},
                                        {"SDO read request", 4},
                                        {"SDO read reply", 3},
                                        {"SDO write request", 1},
                                        {"SDO write reply", 1},
                                        {"SDO abort", 1},
                                        {"NMT", 1}}));
  EXPECT_TRUE(skipped.empty());
  EXPECT_EQ(decoded(must_read(mixed), "agilex", skipped).at("system state"), 3);
  EXPECT_GT(skipped.at("unknown id").times, 40U);
}

TEST(Decode, ReadsTheScannerRecordings) {
  RECORDING_OR_SKIP(json, "sick/20210302_lms111.pcapng.json");
  RECORDING_OR_SKIP(pcapng_file, "sick/20210106_tim781s_1s.pcapng");
  drivers::SkippedBy skipped;
  const auto lms = must_read(json);
  EXPECT_EQ(lms.format, Format::json);
  EXPECT_EQ(decoded(lms, "sick-lms", skipped).at("LMDscandata"),
            2 + 175);  // Subscription, its answer, scans.
  const auto tim = must_read(pcapng_file);
  EXPECT_EQ(tim.format, Format::pcap);
  EXPECT_FALSE(tim.pieces.empty());
  RECORDING_OR_SKIP(ouster, "ouster/OS-1-32-G_v2.1.1_1024x10.pcap");
  const auto packets = must_read(ouster);
  EXPECT_EQ(packets.pieces.size(), drivers_test::udp_payloads(ouster).size());
  RECORDING_OR_SKIP(velodyne, "velodyne/VLI-16-one-packet.pcap");
  ASSERT_EQ(must_read(velodyne).pieces.size(), 1U);
  EXPECT_EQ(must_read(velodyne).pieces[0].bytes.size(), 1212U);
}

TEST(Decode, ReadsARecordingOfEveryOtherDevice) {
  const std::pair<const char*, const char*> files[] = {
      {"nmea", "gnss/nmea-rtk.log"},
      {"ublox", "gnss/ublox-neo-m8n.log"},
      {"gpsd", "gnss/nmea-rtk.log.chk"},
      {"hokuyo", "hokuyo/urg04lx_MD_one_step.scip"},
      {"ptu", "ptu/transcripts.txt"},
      {"vn100", "vn100/F00294"},
      {"modbus", "modbus/pymodbus_rtu_mbpoll.socat_hex.txt"}};
  for (const auto& [device, file] : files) {
    RECORDING_OR_SKIP(text, file);
    drivers::SkippedBy skipped;
    EXPECT_FALSE(decoded(must_read(text), device, skipped).empty()) << device << " " << file;
  }
  RECORDING_OR_SKIP(pcap_file, "ouster/OS-1-32-G_v2.1.1_1024x10.pcap");
  RECORDING_OR_SKIP(metadata, "ouster/OS-1-32-G_v2.1.1_1024x10.json");
  const auto decoder = decoders::make_decoder("ouster", {metadata});
  std::map<std::string, int> names;
  const auto capture = must_read(pcap_file);
  for (const auto& piece : capture.pieces)
    decoder->feed({piece.t_s, piece.from_device, piece.bytes},
                  [&](const drivers::Message& message) { ++names[message.name]; });
  EXPECT_EQ(static_cast<std::size_t>(names["lidar packet"] + names["IMU packet"]),
            capture.pieces.size());
  EXPECT_THROW(decoders::make_decoder("ouster", {"no json"}), std::runtime_error);
}

TEST(Decode, KeepsConversationsApart) {
  // Replies of two gateways, each cut in two, one between the other's halves.
  const auto part = [](std::uint8_t from, std::uint32_t sequence, const char* hex) {
    return ip(6, from, 9, tcp(502, 50000, sequence, 16, as_string(from_hex(hex))));
  };
  const auto capture =
      must_read(pcap({part(1, 10, "0001 0000 0005 64"), part(2, 90, "0001 0000 0005 E1 03 02"),
                      part(1, 17, "03 02 000A"), part(2, 99, "000B")}));
  EXPECT_EQ(capture.conversations.size(), 2U);
  drivers::SkippedBy skipped;
  EXPECT_EQ(decoded(capture, "modbus", skipped),
            (std::map<std::string, int>{{"read holding registers", 2}}));
}

TEST(Decode, KnowsItsDevices) {
  for (const auto& device : decoders::devices()) {
    if (device.needs_metadata) continue;
    EXPECT_NE(decoders::make_decoder(device.name, {}), nullptr) << device.name;
  }
  EXPECT_EQ(decoders::make_decoder("toaster", {}), nullptr);
}

}  // namespace
}  // namespace captures
