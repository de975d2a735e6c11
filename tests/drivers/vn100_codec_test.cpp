#include "drivers/vn100_codec.hpp"

#include <cmath>
#include <numbers>
#include <random>

#include "tests/drivers/recordings.hpp"

namespace drivers {
namespace {

using drivers_test::bytes_of;
using drivers_test::frames_in;
using drivers_test::from_hex;

const Bytes kYprPacket = from_hex("fa01080093502e42833ef13f48b504bb9288");

std::vector<std::vector<double>> logged_rows(std::string_view text) {
  std::vector<std::vector<double>> rows;
  take_field(text, '\n');
  while (!text.empty()) {
    std::string_view line = take_field(text, '\n');
    std::vector<double> row;
    while (!line.empty())
      if (const auto value = whole_real(take_field(line, ','))) row.push_back(*value);
    if (!row.empty()) rows.push_back(row);
  }
  return rows;
}

std::vector<double> row_of(const Vn100Sample& s) {
  std::vector<double> row;
  const auto add = [&](const auto& values) {
    row.insert(row.end(), values->begin(), values->end());
  };
  add(s.raw_magnetic_gauss);
  add(s.raw_accel_mps2);
  add(s.raw_rate_radps);
  row.push_back(*s.temperature_c);
  row.push_back(*s.pressure_kpa);
  add(s.yaw_pitch_roll_deg);
  add(s.rotation);
  add(s.magnetic_ned_gauss);
  add(s.accel_ned_mps2);
  return row;
}

TEST(Vn100, EveryRecordedPacketEqualsTheLoggersRow) {
  RECORDING_OR_SKIP(log, "vn100/F00294");
  RECORDING_OR_SKIP(csv, "vn100/F00294_B");
  const auto rows = logged_rows(csv);
  ASSERT_EQ(rows.size(), 98U);
  std::size_t packets = 0, sentences = 0;
  for (const Bytes& frame : frames_in(as_bytes(log), look_vn100, kVn100FrameMax)) {
    if (frame[0] == '$') {
      EXPECT_FALSE(parse_vn100_line(frame));  // Of the receiver on the same card.
      ++sentences;
      continue;
    }
    EXPECT_EQ(frame.size(), 124U);
    const std::size_t k = packets++;
    if (k == 78) continue;  // The logger lost it.
    const auto got = row_of(decode_vn100_binary(frame));
    const auto& row = rows.at(k < 78 ? k : k - 1);
    ASSERT_EQ(got.size(), row.size());
    for (std::size_t i = 0; i < row.size(); ++i)
      EXPECT_LE(std::abs(got[i] - row[i]),
                0.5001e-6 * std::pow(10, std::floor(std::log10(std::abs(row[i])))))
          << "packet " << k << " value " << i;
  }
  EXPECT_EQ(packets, 99U);
  EXPECT_GT(sentences, 0U);
}

TEST(Vn100, RecordedLinesAreRead) {
  RECORDING_OR_SKIP(text, "vn100/vnymr_lines.txt");
  std::size_t lines = 0, samples = 0, errors = 0;
  for (const Bytes& frame : frames_in(as_bytes(text), look_vn100, kVn100FrameMax)) {
    const auto line = parse_vn100_line(frame);
    ASSERT_TRUE(line);
    ++lines;
    samples += vn100_sample(*line).has_value();
    errors += vn100_error(*line) != nullptr;
  }
  EXPECT_EQ(lines, static_cast<std::size_t>(std::count(text.begin(), text.end(), '$')));
  EXPECT_EQ(samples, 10U);
  EXPECT_EQ(errors, 1U);
}

TEST(Vn100, TheSheetsPacketIsReadWhole) {
  const auto frames = frames_in(kYprPacket, look_vn100, kVn100FrameMax);
  ASSERT_EQ(frames.size(), 1U);
  const auto sample = decode_vn100_binary(frames[0]);
  ASSERT_TRUE(sample.yaw_pitch_roll_deg);
  EXPECT_NEAR((*sample.yaw_pitch_roll_deg)[0], 43.5787, 1e-4);
  EXPECT_NEAR((*sample.yaw_pitch_roll_deg)[1], 1.8847, 1e-4);
  EXPECT_NEAR((*sample.yaw_pitch_roll_deg)[2], -0.0020, 1e-4);
  EXPECT_FALSE(sample.rate_radps);
}

Bytes packet(std::uint8_t groups, const std::vector<std::uint16_t>& fields, const Bytes& payload) {
  Bytes bytes{0xFA, groups};
  for (const auto field : fields) append_little<std::uint16_t>(bytes, field);
  bytes.insert(bytes.end(), payload.begin(), payload.end());
  append_big<std::uint16_t>(bytes, crc16_ccitt(ByteView(bytes).subspan(1)));
  return bytes;
}

// Floats that count up, so that a value at a wrong place shows.
struct Payload {
  Bytes bytes;
  float next = 1;
  Payload& floats(int count) {
    for (int i = 0; i < count; ++i) append_little<float>(bytes, next++);
    return *this;
  }
  template <class T>
  Payload& number(T value) {
    append_little<T>(bytes, value);
    return *this;
  }
};

TEST(Vn100, EveryFieldOfTheCommonGroupIsRead) {
  Payload p;
  p.number<std::uint64_t>(11).number<std::uint64_t>(0).number<std::uint64_t>(13);
  p.floats(3).floats(4).floats(3).floats(6).floats(3).floats(3).floats(6).floats(5).floats(7);
  p.number<std::uint16_t>(0x1A5F).number<std::uint32_t>(17).number<std::uint64_t>(0);
  const auto frames = frames_in(packet(1, {0x7FFF}, p.bytes), look_vn100, kVn100FrameMax);
  ASSERT_EQ(frames.size(), 1U);
  const auto s = decode_vn100_binary(frames[0]);
  EXPECT_EQ(s.startup_ns, 11U);
  EXPECT_EQ(s.sync_in_ns, 13U);
  EXPECT_EQ(s.yaw_pitch_roll_deg, (Vn100Vector{1, 2, 3}));
  EXPECT_EQ(s.quaternion, (std::array<float, 4>{4, 5, 6, 7}));
  EXPECT_EQ(s.rate_radps, (Vn100Vector{8, 9, 10}));
  EXPECT_EQ(s.accel_mps2, (Vn100Vector{20, 21, 22}));
  EXPECT_EQ(s.raw_accel_mps2, (Vn100Vector{23, 24, 25}));
  EXPECT_EQ(s.raw_rate_radps, (Vn100Vector{26, 27, 28}));
  EXPECT_EQ(s.magnetic_gauss, (Vn100Vector{29, 30, 31}));
  EXPECT_EQ(s.temperature_c, 32);
  EXPECT_EQ(s.pressure_kpa, 33);
  EXPECT_EQ(s.delta_time_s, 34);
  EXPECT_EQ(s.delta_theta_deg, (Vn100Vector{35, 36, 37}));
  EXPECT_EQ(s.delta_velocity_mps, (Vn100Vector{38, 39, 40}));
  EXPECT_EQ(s.vpe_status, 0x1A5F);
  EXPECT_EQ(s.sync_in_count, 17U);
}

TEST(Vn100, EveryFieldOfTheOtherGroupsIsRead) {
  Payload p;
  p.number<std::uint16_t>(5).floats(9).floats(2).floats(4).floats(3).floats(9);
  p.number<std::uint16_t>(6).floats(10);
  p.number<std::uint16_t>(7)
      .floats(3)
      .floats(4)
      .floats(9)
      .floats(3)
      .floats(3)
      .floats(3)
      .floats(3)
      .floats(3);
  const auto frames =
      frames_in(packet(0x14, {0x1FFF, 0x01FF}, p.bytes), look_vn100, kVn100FrameMax);
  ASSERT_EQ(frames.size(), 1U);
  const auto s = decode_vn100_binary(frames[0]);
  EXPECT_EQ(s.imu_status, 5);
  EXPECT_EQ(s.raw_magnetic_gauss, (Vn100Vector{1, 2, 3}));
  EXPECT_EQ(s.raw_accel_mps2, (Vn100Vector{4, 5, 6}));
  EXPECT_EQ(s.raw_rate_radps, (Vn100Vector{7, 8, 9}));
  EXPECT_EQ(s.temperature_c, 10);
  EXPECT_EQ(s.pressure_kpa, 11);
  EXPECT_EQ(s.delta_time_s, 12);
  EXPECT_EQ(s.delta_theta_deg, (Vn100Vector{13, 14, 15}));
  EXPECT_EQ(s.delta_velocity_mps, (Vn100Vector{16, 17, 18}));
  EXPECT_EQ(s.magnetic_gauss, (Vn100Vector{19, 20, 21}));
  EXPECT_EQ(s.accel_mps2, (Vn100Vector{22, 23, 24}));
  EXPECT_EQ(s.rate_radps, (Vn100Vector{25, 26, 27}));
  EXPECT_EQ(s.saturation, 6);
  EXPECT_EQ(s.vpe_status, 7);
  EXPECT_EQ(s.yaw_pitch_roll_deg, (Vn100Vector{38, 39, 40}));
  EXPECT_EQ(s.quaternion, (std::array<float, 4>{41, 42, 43, 44}));
  EXPECT_EQ(s.rotation, (std::array<float, 9>{45, 46, 47, 48, 49, 50, 51, 52, 53}));
  EXPECT_EQ(s.magnetic_ned_gauss, (Vn100Vector{54, 55, 56}));
  EXPECT_EQ(s.accel_ned_mps2, (Vn100Vector{57, 58, 59}));
  EXPECT_EQ(s.linear_body_mps2, (Vn100Vector{60, 61, 62}));
  EXPECT_EQ(s.linear_ned_mps2, (Vn100Vector{63, 64, 65}));
  EXPECT_EQ(s.yaw_pitch_roll_sigma_deg, (Vn100Vector{66, 67, 68}));
}

TEST(Vn100, LinesAreReadWhole) {
  const auto line = parse_vn100_line(vn100_request(
      "VNYMR,-165.981,-037.301,+001.245,+00.2901,+00.0720,+00.7482,-05.966,-00.150,-07.836,"
      "+00.001373,-00.001533,-00.001054,T1162704"));
  ASSERT_TRUE(line);
  EXPECT_EQ(line->time_ms, 1162704U);
  const auto s = vn100_sample(*line);
  ASSERT_TRUE(s);
  EXPECT_EQ(s->yaw_pitch_roll_deg, (Vn100Vector{-165.981F, -37.301F, 1.245F}));
  EXPECT_EQ(s->magnetic_gauss, (Vn100Vector{0.2901F, 0.0720F, 0.7482F}));
  EXPECT_EQ(s->accel_mps2, (Vn100Vector{-5.966F, -0.150F, -7.836F}));
  EXPECT_EQ(s->rate_radps, (Vn100Vector{0.001373F, -0.001533F, -0.001054F}));
  EXPECT_EQ(parse_vn100_line(bytes_of("$VNYPR,+010.071,+000.278,-002.026,S00A0*1F"))->status, 0xA0);
  EXPECT_FALSE(vn100_sample({"VNYPR", {"1", "x", "2"}, {}, {}}));
  EXPECT_FALSE(vn100_sample({"VNYPR", {"1", "2"}, {}, {}}));
}

// The sheet's: polynomial 0x1021 from 0, the highest bit first.
std::uint16_t crc_bit_by_bit(ByteView bytes) {
  std::uint32_t crc = 0;
  for (const std::uint8_t byte : bytes) {
    crc ^= static_cast<std::uint32_t>(byte) << 8;
    for (int bit = 0; bit < 8; ++bit)
      crc = (crc << 1 ^ ((crc & 0x8000) != 0 ? 0x1021 : 0)) & 0xFFFF;
  }
  return static_cast<std::uint16_t>(crc);
}

TEST(Vn100, TheCrcOfAnyLengthIsThatOfItsBits) {
  EXPECT_EQ(crc16_ccitt(bytes_of("123456789")), 0x31C3);  // As catalogues of CRCs list it.
  std::mt19937 random(1);
  for (std::size_t size = 0; size < 600; ++size) {
    Bytes bytes(size);
    for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random());
    ASSERT_EQ(crc16_ccitt(bytes), crc_bit_by_bit(bytes)) << size;
  }
}

TEST(Vn100, LinesMayEndInACrc) {
  std::string text = "VNRRG,5,9600";
  const std::uint16_t crc = crc16_ccitt(as_bytes(text));
  char hex[8];
  std::snprintf(hex, sizeof hex, "%04X", crc);
  const Bytes good = bytes_of("$" + text + "*" + hex + "\r\n");
  Bytes bad = good;
  bad[3] ^= 1;
  for (const std::size_t piece : {1U, 100U})
    EXPECT_EQ(frames_in(drivers_test::joined({good, bad, good}), look_vn100, kVn100FrameMax, piece),
              (std::vector<Bytes>{good, good}));
}

TEST(Vn100, RequestsAreTheSheets) {
  EXPECT_EQ(vn100_request("VNRRG,5"), bytes_of("$VNRRG,5*46\r\n"));
  EXPECT_EQ(vn100_request("VNWRG,5,9600"), bytes_of("$VNWRG,5,9600*60\r\n"));
  EXPECT_EQ(vn100_request("VNWNV"), bytes_of("$VNWNV*57\r\n"));
  EXPECT_EQ(vn100_request("VNRRG,01"), bytes_of("$VNRRG,01*72\r\n"));
  Vn100Output output;
  output.common = 0x0029;
  const std::string request(as_text(vn100_output_request(75, output)));
  EXPECT_TRUE(request.starts_with("$VNWRG,75,1,16,01,0029*")) << request;
  output.attitude = 0x0002;
  EXPECT_TRUE(std::string(as_text(vn100_output_request(75, output)))
                  .starts_with("$VNWRG,75,1,16,11,0029,0002*"));
  EXPECT_EQ(vn100_startup(output).size(), 7U);
}

TEST(Vn100, ErrorsAndStatusAreNamed) {
  for (const auto& [code, known] :
       {std::pair{"01", true}, {"0C", true}, {"FF", true}, {"0D", false}})
    EXPECT_EQ(vn100_error({"VNERR", {code}, {}, {}}) != nullptr, known) << code;
  EXPECT_EQ(vn100_error({"VNERR", {"03"}, {}, {}})->name, "invalid checksum");
  EXPECT_TRUE(vn100_faults(1).empty());  // Good.
  std::vector<std::string_view> names;
  for (const Fault* fault : vn100_faults(0xFFFF)) names.push_back(fault->name);
  EXPECT_EQ(names, (std::vector<std::string_view>{
                       "attitude lost", "gyroscope saturated", "gyroscope recovering",
                       "magnetometer saturated", "accelerometer saturated",
                       "known magnetic disturbance", "known acceleration disturbance",
                       "magnetic disturbance", "acceleration disturbance"}));
}

TEST(Vn100, FramesAreTheRobots) {
  EXPECT_EQ(vn100_flu({1, 2, -9.81F}), Eigen::Vector3d(1, -2, 9.81F));
  EXPECT_EQ(vn100_enu({1, 2, 3}), Eigen::Vector3d(2, 1, -3));
  EXPECT_DOUBLE_EQ(vn100_heading_rad(0), std::numbers::pi / 2);  // North.
  EXPECT_DOUBLE_EQ(vn100_heading_rad(90), 0);                    // East.
  EXPECT_DOUBLE_EQ(vn100_heading_rad(-90), std::numbers::pi);    // West.
  // Level, looking north-east: forward is north-east, left is north-west, up is up.
  const auto level = vn100_orientation(Vn100Vector{45, 0, 0});
  const double h = std::sqrt(0.5);
  EXPECT_LT((level * Eigen::Vector3d::UnitX() - Eigen::Vector3d(h, h, 0)).norm(), 1e-6);
  EXPECT_LT((level * Eigen::Vector3d::UnitY() - Eigen::Vector3d(-h, h, 0)).norm(), 1e-6);
  EXPECT_LT((level * Eigen::Vector3d::UnitZ() - Eigen::Vector3d(0, 0, 1)).norm(), 1e-6);
  // Nose up by 30 degrees, looking north.
  const auto up = vn100_orientation(Vn100Vector{0, 30, 0});
  EXPECT_LT((up * Eigen::Vector3d::UnitX() - Eigen::Vector3d(0, std::sqrt(0.75), 0.5)).norm(),
            1e-6);
  // Right side down by 30 degrees: left points up.
  const auto rolled = vn100_orientation(Vn100Vector{0, 0, 30});
  EXPECT_NEAR((rolled * Eigen::Vector3d::UnitY()).z(), 0.5, 1e-6);
  // The same from the device's quaternion of a quarter turn to the right.
  const auto east =
      vn100_orientation(std::array<float, 4>{0, 0, static_cast<float>(h), static_cast<float>(h)});
  EXPECT_LT((east * Eigen::Vector3d::UnitX() - Eigen::Vector3d(1, 0, 0)).norm(), 1e-6);
}

TEST(Vn100, WholeFramesSurviveDamage) {
  const std::vector<Bytes> frames{kYprPacket, vn100_request("VNRRG,5,9600"),
                                  packet(1, {0x0001}, Bytes(8, 0xFA)), vn100_request("VNERR,03"),
                                  kYprPacket};
  drivers_test::expect_whole_frames_survive(frames, look_vn100, kVn100FrameMax,
                                            from_hex("fa fa01 fa02 24 2a ff fa8000"));
  drivers_test::expect_flips_cost_one_frame({frames[0], frames[2], frames[4]}, look_vn100,
                                            kVn100FrameMax);
}

TEST(Vn100, OfflineNamesPacketsLinesAndStrangers) {
  const auto decoder = vn100_offline();
  std::vector<std::string> names;
  Captured captured;
  const Bytes stream =
      drivers_test::joined({kYprPacket, vn100_request("VNERR,03"), vn100_request("GPHDT,,T")});
  captured.bytes = stream;
  decoder->feed(captured, [&](const Message& m) { names.push_back(m.name); });
  EXPECT_EQ(names, (std::vector<std::string>{"binary", "VNERR"}));
  EXPECT_EQ(decoder->skipped().at("line of another device").times, 1U);
}

}  // namespace
}  // namespace drivers
