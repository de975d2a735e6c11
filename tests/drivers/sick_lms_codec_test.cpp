#include "drivers/sick_lms_codec.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "drivers/sick_lms_startup.hpp"
#include "tests/drivers/recordings.hpp"

namespace drivers {
namespace {

using drivers_test::bytes_of;
using drivers_test::from_hex;

struct Segment {
  double t_s{};
  Bytes bytes;
};

std::vector<Segment> json_segments(std::string_view text) {
  std::vector<Segment> segments;
  const auto whole = boost::json::parse(boost::json::string_view(text.data(), text.size()));
  for (const auto& packet : whole.as_array()) {
    const auto& tcp = packet.at("_source").at("layers").at("tcp").as_object();
    const auto* payload = tcp.if_contains("tcp.payload");
    if (payload == nullptr) continue;
    segments.push_back(
        {std::stod(std::string(tcp.at("Timestamps").at("tcp.time_relative").as_string().c_str())),
         from_hex(payload->as_string().c_str())});
  }
  return segments;
}

std::string first_eight(const std::vector<std::uint16_t>& raw) {
  std::string text;
  for (std::size_t i = 0; i < 8 && i < raw.size(); ++i)
    text += (i ? " " : "") + std::to_string(raw[i]);
  return text;
}

// A scan in the columns of the decoded recording, without the capture's time.
std::string csv_row(const LmsScan& scan) {
  const LmsChannel& channel = scan.channels16.at(0);
  Bytes wire;
  for (const auto raw : channel.raw) append_big<std::uint16_t>(wire, raw);
  std::uint32_t least = 65535, most = 0;
  for (const auto raw : channel.raw) {
    if (raw > 0) least = std::min<std::uint32_t>(least, raw);
    most = std::max<std::uint32_t>(most, raw);
  }
  const auto sum = std::accumulate(channel.raw.begin(), channel.raw.end(), std::uint64_t{0});
  std::ostringstream row;
  row.precision(1);
  row << std::fixed << scan.telegram_counter << ',' << scan.scan_counter << ','
      << scan.scan_start_us << ',' << scan.transmit_us << ',' << int{scan.status[0]} << '/'
      << int{scan.status[1]} << ',' << scan.scan_frequency_centihz << ','
      << scan.measurement_frequency_100hz << ',' << scan.encoders.size() << ',' << channel.label()
      << ',' << channel.scale << ',' << channel.offset << ',' << channel.start_1e4deg << ','
      << channel.step_1e4deg << ',' << channel.raw.size() << ',' << first_eight(channel.raw) << ','
      << least << ',' << most << ',' << sum << ',' << drivers_test::md5_hex(wire);
  return row.str();
}

TEST(SickLms, EveryScanOfALms111EqualsItsDecodedRecording) {
  RECORDING_OR_SKIP(json, "sick/20210302_lms111.pcapng.json");
  RECORDING_OR_SKIP(csv, "sick/20210302_lms111.expected.csv");
  std::vector<std::string> got, expected;
  Resync stream(kColaFrameMax);
  LmsScan scan;
  LmsSequence sequence;
  for (const Segment& segment : json_segments(json)) {
    stream.feed(segment.bytes);
    while (const auto frame = stream.next(look_cola)) {
      const auto message = parse_cola(*frame);
      ASSERT_TRUE(message);
      if (message->command != "sSN" || message->name != "LMDscandata") continue;
      ASSERT_EQ(decode_lms_scan(*message, scan), "");
      EXPECT_EQ(encode_lms_scan(ColaDialect::binary, "sSN", scan),
                Bytes(frame->begin(), frame->end()));
      sequence.see(scan);
      char t[32];
      got.push_back(std::string(t, std::to_chars(t, t + sizeof t, segment.t_s).ptr) + "," +
                    csv_row(scan));
    }
  }
  std::istringstream lines(csv);
  std::string line;
  std::getline(lines, line);
  while (std::getline(lines, line)) {
    if (line.ends_with('\r')) line.pop_back();
    expected.push_back(line);
  }
  EXPECT_EQ(expected.size(), 175U);
  EXPECT_EQ(got, expected);
  EXPECT_TRUE(stream.skipped().empty());
  EXPECT_EQ(stream.waiting(), 0U);
  EXPECT_EQ(sequence.repeated(), 3U);
  EXPECT_EQ(sequence.lost(), 0U);
}

TEST(SickLms, ATim781sCaptureHasNothingLeftOver) {
  RECORDING_OR_SKIP(pcapng, "sick/20210106_tim781s_1s.pcapng");
  Resync stream(kColaFrameMax);
  std::size_t scans = 0;
  LmsScan scan;
  for (const Bytes& payload : drivers_test::tcp_payloads(pcapng, 2112)) {
    stream.feed(payload);
    while (const auto frame = stream.next(look_cola)) {
      const auto message = parse_cola(*frame);
      ASSERT_TRUE(message);
      ASSERT_EQ(decode_lms_scan(*message, scan), "");
      EXPECT_EQ(encode_lms_scan(ColaDialect::binary, "sSN", scan),
                Bytes(frame->begin(), frame->end()));
      ++scans;
      ASSERT_EQ(scan.channels16.size(), 2U);
      EXPECT_EQ(scan.channels16[0].label(), "DIST1");
      EXPECT_EQ(scan.channels16[1].label(), "RSSI1");
      EXPECT_EQ(scan.channels16[0].raw.size(), 811U);
      EXPECT_EQ(scan.scan_frequency_centihz, 1500U);
    }
  }
  EXPECT_GT(scans, 10U);
  EXPECT_TRUE(stream.skipped().empty());
  EXPECT_EQ(stream.waiting(), 0U);
}

TEST(SickLms, TheRecordedDialogueIsTheOneThatWeHold) {
  RECORDING_OR_SKIP(json, "sick/20210302_lms111.pcapng.json");
  const auto steps = lms_startup(ColaDialect::binary, {});
  std::vector<std::string> unsaid, unanswered;
  const auto segments = json_segments(json);
  for (const LmsStep& step : steps) {
    const auto said = std::any_of(segments.begin(), segments.end(),
                                  [&](const Segment& s) { return s.bytes == step.request; });
    if (!said) unsaid.emplace_back(step.name);
    bool answered = false;
    for (const Segment& segment : segments)
      for (const Bytes& frame : drivers_test::frames_in(segment.bytes, look_cola, kColaFrameMax))
        answered |= lms_judge(step, *parse_cola(frame)) == LmsAnswer::accepted;
    if (!answered) unanswered.emplace_back(step.name);
  }
  // The recorded client left the scan as it was (it read a sector of -449997 and wrote it back).
  EXPECT_EQ(unsaid, (std::vector<std::string>{"LMCstopmeas", "mLMPsetscancfg", "LMPoutputRange"}));
  EXPECT_EQ(unanswered, (std::vector<std::string>{"LMCstopmeas", "mLMPsetscancfg"}));
}

LmsScan sample_scan() {
  LmsScan scan;
  scan.version = 1;
  scan.device_number = 2;
  scan.serial_number = 20439907;
  scan.status = {0, 5};
  scan.telegram_counter = 65535;
  scan.scan_counter = 3;
  scan.scan_start_us = 0xFFFFFFF0;
  scan.transmit_us = 7;
  scan.inputs = {1, 2};
  scan.outputs = {3, 4};
  scan.layer_angle = -250;
  scan.scan_frequency_centihz = 2500;
  scan.measurement_frequency_100hz = 540;
  scan.encoders = {{0x80000001, 65000}};
  scan.channels16 = {{{'D', 'I', 'S', 'T', '1'}, 2.0F, 1.5F, -50000, 1667, {0, 1, 2, 3, 4, 65535}},
                     {{'R', 'S', 'S', 'I', '1'}, 1.0F, 0.0F, -50000, 1667, {9, 8, 7, 6, 5, 4}}};
  scan.channels8 = {{{'R', 'S', 'S', 'I', '2'}, 1.0F, 0.0F, 0, 5000, {255, 0, 16}}};
  scan.position = LmsPosition{{1, 2, 3}, {-0.5F, 0, 0.25F}, 7};
  scan.name = "left tower";
  scan.comment = "b c";
  scan.time = LmsTime{2026, 11, 23, 9, 5, 1, 123456};
  scan.event = LmsEvent{{'F', 'E', 'V', '1'}, 4, 5, -6};
  return scan;
}

// Every field, in the order of the telegram.
std::string dump(const LmsScan& s) {
  std::ostringstream out;
  out << s.version << ' ' << s.device_number << ' ' << s.serial_number << ' ' << int{s.status[0]}
      << int{s.status[1]} << ' ' << s.telegram_counter << ' ' << s.scan_counter << ' '
      << s.scan_start_us << ' ' << s.transmit_us << ' ' << int{s.inputs[0]} << int{s.inputs[1]}
      << ' ' << int{s.outputs[0]} << int{s.outputs[1]} << ' ' << s.layer_angle << ' '
      << s.scan_frequency_centihz << ' ' << s.measurement_frequency_100hz << " |";
  for (const auto& e : s.encoders) out << ' ' << e.position << ':' << e.speed;
  for (const auto* list : {&s.channels16, &s.channels8}) {
    out << " |";
    for (const auto& c : *list) {
      out << ' ' << c.label() << ' ' << c.scale << ' ' << c.offset << ' ' << c.start_1e4deg << ' '
          << c.step_1e4deg << " [";
      for (const auto raw : c.raw) out << raw << ' ';
      out << ']';
    }
  }
  if (s.position) {
    for (const float x : s.position->xyz) out << ' ' << x;
    for (const float x : s.position->rotation) out << ' ' << x;
    out << ' ' << int{s.position->type};
  }
  out << " '" << s.name << "' '" << s.comment << "'";
  if (s.time)
    out << ' ' << s.time->year << '-' << int{s.time->month} << '-' << int{s.time->day} << ' '
        << int{s.time->hour} << ':' << int{s.time->minute} << ':' << int{s.time->second} << '.'
        << s.time->microsecond;
  if (s.event)
    out << ' ' << std::string_view(s.event->type.data(), 4) << ' ' << s.event->encoder_position
        << ' ' << s.event->time_us << ' ' << s.event->angle_1e4deg;
  return out.str();
}

constexpr std::string_view kAsciiScan =
    "\x02sSN LMDscandata 1 2 137E363 0 5 FFFF 3 FFFFFFF0 7 1 2 3 4 FF06 9C4 21C 1 80000001 FDE8 "
    "2 DIST1 40000000 3FC00000 FFFF3CB0 683 6 0 1 2 3 4 FFFF "
    "RSSI1 3F800000 0 FFFF3CB0 683 6 9 8 7 6 5 4 1 RSSI2 3F800000 0 0 1388 3 FF 0 10 "
    "1 3F800000 40000000 40400000 BF000000 0 3E800000 7 1 A left tower 1 3 b c "
    "1 7EA B 17 9 5 1 1E240 1 FEV1 4 5 FFFFFFFA\x03";

TEST(SickLms, BothDialectsCarryTheWholeScan) {
  const LmsScan scan = sample_scan();
  EXPECT_EQ(encode_lms_scan(ColaDialect::ascii, "sSN", scan), bytes_of(kAsciiScan));
  for (const auto dialect : {ColaDialect::ascii, ColaDialect::binary}) {
    const Bytes frame = encode_lms_scan(dialect, "sSN", scan);
    LmsScan got;
    got.channels16.resize(5);  // Of the scan before.
    ASSERT_EQ(decode_lms_scan(*parse_cola(frame), got), "");
    EXPECT_EQ(dump(got), dump(scan));
    const auto faults = lms_faults(got);
    ASSERT_EQ(faults.size(), 1U);
    EXPECT_EQ(faults[0]->name, "pollution error");
  }
}

TEST(SickLms, RefusesBodiesThatEndEarlyOrLate) {
  for (const auto dialect : {ColaDialect::ascii, ColaDialect::binary}) {
    const Bytes frame = encode_lms_scan(dialect, "sSN", sample_scan());
    const auto whole = *parse_cola(frame);
    LmsScan got;
    // In ascii the parts at the end may be missing, and numbers may be cut into shorter ones.
    const std::size_t most = dialect == ColaDialect::ascii ? 200 : whole.body.size();
    for (std::size_t size = 0; size < most; ++size) {
      ColaMessage cut = whole;
      cut.body = cut.body.first(size);
      EXPECT_NE(decode_lms_scan(cut, got), "") << size;
    }
    Bytes longer(whole.body.begin(), whole.body.end());
    for (const char c : {' ', '0'}) longer.push_back(static_cast<std::uint8_t>(c));
    ColaMessage late = whole;
    late.body = longer;
    EXPECT_EQ(decode_lms_scan(late, got), "bytes left over");
  }
}

TEST(SickLms, AnglesAreRep103) {
  LmsChannel channel;
  channel.start_1e4deg = -450000;
  channel.step_1e4deg = 5000;
  EXPECT_DOUBLE_EQ(beam_angle_rad(channel, 0), -135 * std::numbers::pi / 180);
  EXPECT_DOUBLE_EQ(beam_angle_rad(channel, 270), 0);
  EXPECT_DOUBLE_EQ(beam_angle_rad(channel, 540), 135 * std::numbers::pi / 180);
  LmsScan scan;
  scan.scan_frequency_centihz = 5000;
  EXPECT_NEAR(beam_delay_s(scan, channel, 540), 0.015, 1e-12);
  channel.scale = 2;
  channel.offset = -100;
  EXPECT_DOUBLE_EQ(lms_range_m(channel, 1000), 1.9);
}

TEST(SickLms, SpecialRawValuesAreNoRanges) {
  EXPECT_EQ(lms_raw_meaning(0, false), LmsRaw::nothing);
  EXPECT_EQ(lms_raw_meaning(1, false), LmsRaw::range);
  EXPECT_EQ(lms_raw_meaning(0, true), LmsRaw::nothing);
  EXPECT_EQ(lms_raw_meaning(1, true), LmsRaw::dazzled);
  EXPECT_EQ(lms_raw_meaning(2, true), LmsRaw::implausible);
  EXPECT_EQ(lms_raw_meaning(3, true), LmsRaw::filtered);
  EXPECT_EQ(lms_raw_meaning(4, true), LmsRaw::range);
  LmsChannel channel;
  channel.scale = 2;
  channel.offset = 500;
  channel.raw = {0, 1, 3, 4, 65535};
  const auto ranges_m = lms_ranges_m(channel, true);
  ASSERT_EQ(ranges_m.size(), 5U);
  EXPECT_EQ(ranges_m[0], 0);
  EXPECT_TRUE(std::isnan(ranges_m[1]) && std::isnan(ranges_m[2]));
  EXPECT_EQ(ranges_m[3], 0.508F);
  EXPECT_EQ(ranges_m[4], 131.57F);
  EXPECT_EQ(lms_ranges_m(channel, false), (std::vector{0.0F, 0.502F, 0.506F, 0.508F, 131.57F}));
}

TEST(SickLms, CountersTellRepeatedLostAndRestarted) {
  using Seen = LmsSequence::Seen;
  LmsSequence sequence;
  LmsScan scan;
  const auto see = [&](std::uint16_t counter, std::uint32_t start_us) {
    scan.scan_counter = scan.telegram_counter = counter;
    scan.scan_start_us = start_us;
    return sequence.see(scan);
  };
  EXPECT_EQ(see(65534, 0xFFFF0000), Seen::next);
  EXPECT_EQ(see(65535, 0xFFFF4E20), Seen::next);
  EXPECT_EQ(see(65535, 0xFFFF4E20), Seen::repeated);
  EXPECT_EQ(see(0, 20000), Seen::next);
  EXPECT_EQ(see(3, 80000), Seen::gap);
  EXPECT_EQ(sequence.lost(), 2U);
  EXPECT_EQ(see(1, 100), Seen::restarted);
}

TEST(SickLms, SettingsThatNoScannerHasAreRefusedWithThoseThatItHas) {
  EXPECT_EQ(lms_settings_problem({}), "");
  LmsSettings settings;
  settings.resolution_1e4deg = 2500;
  EXPECT_EQ(lms_settings_problem(settings),
            "no such frequency and resolution; in 0.01 Hz and 1e-4 deg there are 2500/2500 "
            "2500/5000 5000/5000");
  settings = {};
  settings.lms5xx = true;
  EXPECT_EQ(lms_settings_problem(settings),
            "the sector must lie within -50000 .. 1850000 (1e-4 deg)");
  settings.start_1e4deg = -50000;
  settings.stop_1e4deg = 1850000;
  settings.frequency_centihz = 2500;
  settings.resolution_1e4deg = 1667;
  EXPECT_EQ(lms_settings_problem(settings), "");
}

TEST(SickLms, TheAsciiDialogueIsTheSheets) {
  const auto steps = lms_startup(ColaDialect::ascii, {});
  std::vector<std::string> texts;
  for (const LmsStep& step : steps)
    texts.emplace_back(step.request.begin() + 1, step.request.end() - 1);
  EXPECT_EQ(texts, (std::vector<std::string>{
                       "sMN SetAccessMode 3 F4724744", "sWN EIHstCola 0", "sRN FirmwareVersion",
                       "sRN SCdevicestate", "sRN ODoprh", "sRN ODpwrc", "sRN LocationName",
                       "sMN LMCstopmeas", "sMN mLMPsetscancfg +5000 +1 +5000 -450000 +2250000",
                       "sWN LMPoutputRange 1 1388 FFF92230 225510",
                       "sWN LMDscandatacfg 01 00 0 0 0 00 00 0 0 0 1 +1", "sMN LMCstartmeas",
                       "sMN Run", "sEN LMDscandata 1"}));
  const auto answer = [](std::string_view text) {
    return drivers::frame_cola(ColaDialect::ascii, as_bytes(text));
  };
  const auto judge = [&](std::size_t step, std::string_view text) {
    const Bytes frame = answer(text);
    return lms_judge(steps[step], *parse_cola(frame));
  };
  EXPECT_EQ(judge(0, "sAN SetAccessMode 1"), LmsAnswer::accepted);
  EXPECT_EQ(judge(0, "sAN SetAccessMode 0"), LmsAnswer::refused);
  EXPECT_EQ(judge(0, "sEA LIDinputstate 1"), LmsAnswer::unrelated);
  EXPECT_EQ(judge(8, "sAN mLMPsetscancfg 0 1388 1 1388 FFF92230 225510"), LmsAnswer::accepted);
  const Bytes bad = answer("sAN mLMPsetscancfg 2 1388 1 9C4 FFF92230 225510");
  EXPECT_EQ(lms_judge(steps[8], *parse_cola(bad)), LmsAnswer::refused);
  EXPECT_EQ(lms_refusal(steps[8], *parse_cola(bad)),
            "scanner refused to set the scan: resolution (this model has no such resolution): "
            "choose a listed resolution");
  const Bytes denied = answer("sFA 1");
  EXPECT_EQ(lms_refusal(steps[8], *parse_cola(denied)),
            "scanner refused to set the scan: access denied (not logged in for this): log in with "
            "SetAccessMode 3 first");
}

TEST(SickLms, StatesAreNamed) {
  for (std::uint32_t state = 0; state <= 7; ++state)
    EXPECT_NE(fault_of(lms_states(), state), nullptr);
  for (std::uint32_t state = 0; state <= 3; ++state)
    EXPECT_NE(fault_of(lms_device_states(), state), nullptr);
  EXPECT_EQ(fault_of(lms_states(), 7)->name, "measuring");
  const auto faults = [](std::uint8_t first, std::uint8_t second) {
    LmsScan scan;
    scan.status = {first, second};
    std::vector<std::string_view> names;
    for (const Fault* fault : lms_faults(scan)) names.push_back(fault->name);
    return names;
  };
  using Names = std::vector<std::string_view>;
  EXPECT_EQ(faults(0, 0), Names{});
  EXPECT_EQ(faults(1, 0), Names{"just started"});
  EXPECT_EQ(faults(0, 1), Names{"device error"});
  EXPECT_EQ(faults(0, 2), Names{"pollution warning"});
  EXPECT_EQ(faults(0, 4), Names{"pollution error"});
  EXPECT_EQ(faults(1, 5), (Names{"pollution error", "just started"}));
}

TEST(SickLms, OfflineNamesEveryTelegram) {
  const auto decoder = sick_lms_offline();
  std::vector<Message> messages;
  Captured captured;
  captured.t_s = 1.5;
  const Bytes stream = drivers_test::joined({frame_cola(ColaDialect::binary, from_hex("734641 01")),
                                             bytes_of("xx"), bytes_of(kAsciiScan)});
  captured.bytes = stream;
  decoder->feed(captured, [&](Message m) { messages.push_back(std::move(m)); });
  ASSERT_EQ(messages.size(), 2U);
  EXPECT_EQ(messages[0].name, "sFA");
  EXPECT_EQ(std::get<std::string>(messages[0].fields.back().value),
            "access denied: log in with SetAccessMode 3 first");
  EXPECT_EQ(messages[1].name, "LMDscandata");
  EXPECT_EQ(messages[1].fields.size(), 38U);
  EXPECT_EQ(decoder->skipped().at("no start").bytes, 2U);
}

}  // namespace
}  // namespace drivers
