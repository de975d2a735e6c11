#include "drivers/scip_codec.hpp"

#include <numbers>

#include "tests/drivers/recordings.hpp"

namespace drivers {
namespace {

using drivers_test::bytes_of;
using drivers_test::frames_in;

std::string checked(std::string_view line) {
  return std::string(line) + scip_checksum(line) + "\n";
}

// The characters of values, most significant first.
std::string encoded(const std::vector<std::uint32_t>& values, int width) {
  std::string text;
  for (const auto value : values)
    for (int i = width - 1; i >= 0; --i) text += static_cast<char>((value >> (6 * i) & 63) + 0x30);
  return text;
}

Bytes scan_reply(std::string_view echo, std::string_view status, std::uint32_t time_ms,
                 const std::string& data) {
  std::string text = std::string(echo) + "\n" + checked(status) + checked(encoded({time_ms}, 4));
  for (std::size_t at = 0; at < data.size(); at += 64) text += checked(data.substr(at, 64));
  return bytes_of(text + "\n");
}

TEST(Scip, ChecksumsAreTheSheets) {
  for (const char* line : {"00P", "02R", "99b", "MODL:UTM-30LX-EW;I", "DMIN:23;7", "DMAX:60000;J",
                           "ARES:1440;^", "AMIN:0;?", "AMAX:1080;Z", "AFRT:540;0", "SCAN:2400;U",
                           "VEND:Hokuyo Automatic Co.,Ltd.;[", "PROT:SCIP 2.0;N"}) {
    const std::string_view text(line);
    EXPECT_EQ(scip_checksum(text.substr(0, text.size() - 1)), text.back()) << line;
  }
}

TEST(Scip, RealRepliesAreReadWhole) {
  RECORDING_OR_SKIP(text, "hokuyo/real_info_replies.scip");
  const auto frames = frames_in(as_bytes(text), look_scip, kScipFrameMax);
  ASSERT_EQ(frames.size(), 3U);
  ScipReply reply;
  ASSERT_EQ(parse_scip(frames[0], reply), "");
  EXPECT_EQ(reply.echo, "VV");
  EXPECT_EQ(reply.status, "00");
  EXPECT_EQ(scip_info(reply), (ScipInfo{{"VEND", "Hokuyo Automatic Co.,Ltd."},
                                        {"PROD", "SOKUIKI Sensor URG-04LX-UG01(Simple-URG)"},
                                        {"FIRM", "3.4.03(17/Dec./2012)"},
                                        {"PROT", "SCIP 2.0"},
                                        {"SERI", "H1510998"}}));
  ASSERT_EQ(parse_scip(frames[1], reply), "");
  ScipParameters parameters;
  ASSERT_EQ(scip_parameters(*scip_info(reply), parameters), "");
  EXPECT_EQ(parameters.model, "UTM-30LX-EW");
  EXPECT_EQ(parameters.range_min_mm, 23);
  EXPECT_EQ(parameters.range_max_mm, 60000);
  EXPECT_EQ(parameters.steps_per_turn, 1440);
  EXPECT_EQ(parameters.step_first, 0);
  EXPECT_EQ(parameters.step_last, 1080);
  EXPECT_EQ(parameters.step_front, 540);
  EXPECT_EQ(parameters.speed_rpm, 2400);
  ASSERT_EQ(parse_scip(frames[2], reply), "");
  EXPECT_EQ(reply.echo, "BM");
  EXPECT_EQ(reply.status, "02");
  EXPECT_EQ(scip_fault(reply), nullptr);  // Lit already.
}

TEST(Scip, LinesWithoutAKeyAreNoInformation) {
  ScipReply reply;
  reply.echo = "PP";
  reply.status = "00";
  for (const char* line : {":60000;", "DMAX60000;", "DMAX:60000"}) {
    reply.lines = {line};
    EXPECT_FALSE(scip_info(reply)) << line;
  }
  ScipParameters parameters;
  EXPECT_EQ(scip_parameters({{"DMIN", "x"}}, parameters), "DMIN is missing or no number");
  EXPECT_EQ(scip_parameters({{"DMIN", "20"}}, parameters), "DMAX is missing or no number");
}

TEST(Scip, ARealScanOfOneStepIsReadWhole) {
  RECORDING_OR_SKIP(text, "hokuyo/urg04lx_MD_one_step.scip");
  const auto frames = frames_in(as_bytes(text), look_scip, kScipFrameMax);
  ASSERT_EQ(frames.size(), 2U);
  ScipReply reply;
  ScipScan scan;
  ASSERT_EQ(parse_scip(frames[0], reply), "");
  EXPECT_EQ(decode_scip_scan(reply, scan), "no data");  // The acknowledgement.
  ASSERT_EQ(parse_scip(frames[1], reply), "");
  ASSERT_EQ(decode_scip_scan(reply, scan), "");
  EXPECT_EQ(scan.time_ms, ((0x18U * 64 + 0x0A) * 64 + 0x06) * 64 + 0x3D);      // "H:6m"
  EXPECT_EQ(scan.distances_mm, std::vector<std::uint32_t>{(3U * 64) + 0x3E});  // "03n"
  EXPECT_EQ(scan.step_first, 384);
  EXPECT_EQ(scan.step_last, 384);
  EXPECT_EQ(scan.group, 1);
  EXPECT_EQ(scan.remaining, 0);
}

TEST(Scip, ScansRunOverLines) {
  std::vector<std::uint32_t> distances, both, intensities;
  for (std::uint32_t i = 0; i <= 1080; ++i) {
    distances.push_back(i * 241 % 262144);
    intensities.push_back(i * 7);
    both.push_back(distances.back());
    both.push_back(intensities.back());
  }
  ScipReply reply;
  ScipScan scan;
  const Bytes md = scan_reply("MD0000108000000", "99", 0xFFFFFF, encoded(distances, 3));
  ASSERT_EQ(frames_in(md, look_scip, kScipFrameMax), std::vector<Bytes>{md});
  ASSERT_EQ(parse_scip(md, reply), "");
  ASSERT_EQ(decode_scip_scan(reply, scan), "");
  EXPECT_EQ(scan.distances_mm, distances);
  EXPECT_EQ(scan.time_ms, 0xFFFFFFU);
  EXPECT_TRUE(scan.intensities_raw.empty());
  const Bytes me = scan_reply("ME0000108000005", "99", 1, encoded(both, 3));
  ASSERT_EQ(parse_scip(me, reply), "");
  ASSERT_EQ(decode_scip_scan(reply, scan), "");
  EXPECT_EQ(scan.distances_mm, distances);
  EXPECT_EQ(scan.intensities_raw, intensities);
  EXPECT_EQ(scan.remaining, 5);
  const Bytes gs = scan_reply("GS0044004804", "00", 1, encoded({4095, 20}, 2));
  ASSERT_EQ(parse_scip(gs, reply), "");
  ASSERT_EQ(decode_scip_scan(reply, scan), "");
  EXPECT_EQ(scan.distances_mm, (std::vector<std::uint32_t>{4095, 20}));
  EXPECT_EQ(scan.group, 4);
  EXPECT_FALSE(scan.remaining);
}

TEST(Scip, ScansThatDoNotHoldTheirBeamsAreRefused) {
  ScipReply reply;
  ScipScan scan;
  const auto refuse = [&](std::string_view echo, const std::string& data) {
    const Bytes frame = scan_reply(echo, "99", 1, data);
    EXPECT_EQ(parse_scip(frame, reply), "");
    return std::string(decode_scip_scan(reply, scan));
  };
  EXPECT_EQ(refuse("MD0000000201000", encoded({1, 2}, 3)), "number of beams");
  EXPECT_EQ(refuse("MD0000000201000", encoded({1, 2, 3}, 3) + "0"), "value cut");
  EXPECT_EQ(refuse("MD0003000201000", encoded({1}, 3)), "echo cannot be read");
  EXPECT_EQ(refuse("ND0003000201000", encoded({1}, 3)), "no data");
  EXPECT_EQ(refuse("MD0000000201000", ""), "no data");
}

TEST(Scip, NoFlippedByteGivesOtherDistances) {
  const Bytes frame = scan_reply("MD0000000301000", "99", 7, encoded({900, 2, 3, 4}, 3));
  ScipReply reply;
  ScipScan scan;
  for (std::size_t at = 16; at < frame.size(); ++at)  // The echo has no checksum.
    for (int bit = 0; bit < 8; ++bit) {
      Bytes bad = frame;
      bad[at] = static_cast<std::uint8_t>(bad[at] ^ (1 << bit));
      for (const Bytes& got : frames_in(bad, look_scip, kScipFrameMax)) {
        ASSERT_EQ(parse_scip(got, reply), "");
        EXPECT_NE(decode_scip_scan(reply, scan), "") << at << ' ' << bit;
      }
    }
}

TEST(Scip, TheClockIsReadFromTm1) {
  const Bytes frame = bytes_of("TM1\n" + checked("00") + checked(encoded({0x123456}, 4)) + "\n");
  ScipReply reply;
  ASSERT_EQ(frames_in(frame, look_scip, kScipFrameMax), std::vector<Bytes>{frame});
  ASSERT_EQ(parse_scip(frame, reply), "");
  EXPECT_EQ(scip_time_ms(reply), 0x123456U);
  reply.echo = "TM0";
  EXPECT_FALSE(scip_time_ms(reply));
}

TEST(Scip, AnglesAreRep103) {
  ScipParameters parameters;
  parameters.steps_per_turn = 1440;
  parameters.step_front = 540;
  parameters.range_min_mm = 23;
  parameters.range_max_mm = 60000;
  ScipScan scan;
  scan.step_first = 0;
  scan.group = 2;
  EXPECT_DOUBLE_EQ(scip_angle_rad(parameters, scan, 0), -135 * std::numbers::pi / 180);
  EXPECT_DOUBLE_EQ(scip_angle_rad(parameters, scan, 270), 0);
  EXPECT_DOUBLE_EQ(scip_angle_rad(parameters, scan, 540), 135 * std::numbers::pi / 180);
  for (const auto& [mm, range] :
       {std::pair{0U, false}, {22U, false}, {23U, true}, {60000U, true}, {65533U, false}})
    EXPECT_EQ(scip_is_range(parameters, mm), range) << mm;
}

TEST(Scip, SmallDistancesOfAnUrgAreNamed) {
  for (const auto& [mm, name] : {std::pair{0U, "out of range"},
                                 {1U, "low confidence"},
                                 {5U, "low confidence"},
                                 {6U, "other"},
                                 {7U, "not measured"},
                                 {16U, "strong reflection"},
                                 {19U, "strong reflection"}}) {
    ASSERT_NE(scip_urg_distance(mm), nullptr);
    EXPECT_EQ(scip_urg_distance(mm)->name, name);
  }
  EXPECT_EQ(scip_urg_distance(20), nullptr);
}

TEST(Scip, RequestsAndFaultsAreTheProtocols) {
  EXPECT_EQ(scip_request("BM"), bytes_of("BM\n"));
  EXPECT_EQ(scip_stream_request(false, 0, 1080, 1, 0, 0), bytes_of("MD0000108001000\n"));
  EXPECT_EQ(scip_stream_request(true, 44, 725, 0, 3, 10), bytes_of("ME0044072500310\n"));
  const auto name = [](std::string_view echo, std::string_view status) {
    const Fault* fault = scip_fault({echo, status, {}});
    return fault == nullptr ? std::string_view("none") : fault->name;
  };
  EXPECT_EQ(name("BM", "01"), "laser malfunction");
  EXPECT_EQ(name("MD0000108001000", "10"), "laser off");
  EXPECT_EQ(name("MD0000108001000", "35"), "processing stopped");
  EXPECT_EQ(name("MD0000108001000", "71"), "hardware fault");
  EXPECT_EQ(name("MD0000108001000", "98"), "resumed");
  EXPECT_EQ(name("XX", "0E"), "undefined command");
  EXPECT_EQ(name("XX", "0G"), "unknown status");
  EXPECT_EQ(name("RB", "01"), "none");
  EXPECT_EQ(name("SS115200", "03"), "none");
}

TEST(Scip, WholeRepliesSurviveDamage) {
  const std::vector<Bytes> frames{
      bytes_of("PP\n" + checked("00") + checked("DMIN:23;") + checked("DMAX:60000;") + "\n"),
      scan_reply("MD0000000301000", "99", 7, encoded({900, 2, 3, 4}, 3)),
      bytes_of("QT\n" + checked("00") + "\n"), bytes_of("BM\n" + checked("02") + "\n"),
      scan_reply("MD0000000301000", "99", 8, encoded({5, 6, 7, 8}, 3))};
  ScipReply reply;
  for (const std::size_t piece : {1U, 3U, 1000U})
    EXPECT_EQ(frames_in(drivers_test::joined(frames), look_scip, kScipFrameMax, piece), frames);
  // Cut anywhere. (Six bits of checksum let one cut in 64 pass; none of these.)
  for (std::size_t f = 0; f + 1 < frames.size(); ++f)
    for (std::size_t at = 0; at + 1 < frames[f].size(); ++at) {
      std::vector<Bytes> cut = frames, rest = frames;
      cut[f].resize(at);
      rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(f));
      EXPECT_EQ(frames_in(drivers_test::joined(cut), look_scip, kScipFrameMax), rest)
          << f << " cut at " << at;
    }
}

TEST(Scip, OfflineNamesRepliesAndTheirFaults) {
  const auto decoder = scip_offline();
  const Bytes stream =
      bytes_of("xx\nBM\n" + checked("01") + "\nMD0000000201000\n" + checked("10") + "\n");
  Captured captured;
  captured.bytes = stream;
  std::vector<std::string> said;
  decoder->feed(captured, [&](const Message& m) {
    said.push_back(m.name + " " + std::get<std::string>(m.fields.back().value));
  });
  EXPECT_EQ(said, (std::vector<std::string>{"BM laser malfunction: restart it, then replace it",
                                            "MD laser off: send BM first"}));
  EXPECT_EQ(decoder->skipped().at("no echo").bytes, 3U);
}

}  // namespace
}  // namespace drivers
