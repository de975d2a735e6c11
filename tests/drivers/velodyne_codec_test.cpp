#include "drivers/velodyne_codec.hpp"

#include "tests/drivers/recordings.hpp"

namespace drivers {
namespace {

// Distances count up, azimuths as given.
Bytes data_packet(const std::vector<std::uint16_t>& azimuths, std::uint8_t mode) {
  Bytes packet;
  std::uint16_t distance = 0;
  for (const auto azimuth : azimuths) {
    append_big<std::uint16_t>(packet, 0xFFEE);
    append_little<std::uint16_t>(packet, azimuth);
    for (int i = 0; i < 32; ++i) {
      append_little<std::uint16_t>(packet, distance++);
      packet.push_back(static_cast<std::uint8_t>(200 + i));
    }
  }
  append_little<std::uint32_t>(packet, 2467108343U);
  packet.push_back(mode);
  packet.push_back(0x22);
  return packet;
}

std::vector<std::uint16_t> turning(int first, int step, int repeat) {
  std::vector<std::uint16_t> azimuths;
  for (int i = 0; i < 12; ++i)
    azimuths.push_back(static_cast<std::uint16_t>((first + i / repeat * step) % 36000));
  return azimuths;
}

TEST(Velodyne, OneReturnIsReadWhole) {
  VelodynePacket got;
  ASSERT_EQ(decode_velodyne(data_packet(turning(22970, 39, 1), 0x37), got), "");
  EXPECT_EQ(got.timestamp_us, 2467108343U);
  EXPECT_EQ(got.mode, VelodyneReturn::strongest);
  EXPECT_EQ(got.product, 0x22);
  EXPECT_EQ(got.block_azimuth_centideg[0], 22970);
  EXPECT_EQ(got.block_azimuth_centideg[1], 23009);
  ASSERT_EQ(got.points.size(), 384U);
  for (std::size_t i = 0; i < 384; ++i) {
    const VelodynePoint& point = got.points[i];
    EXPECT_EQ(point.distance_2mm, i);
    EXPECT_EQ(point.reflectivity, 200 + i % 32);
    EXPECT_EQ(point.laser, i % 16);
    EXPECT_EQ(point.second_return, 0);
    const double in_block =
        static_cast<double>(i % 32 / 16) * 55.296 + static_cast<double>(i % 16) * 2.304;
    EXPECT_NEAR(point.delay_us, static_cast<double>(i / 32) * 110.592 + in_block, 1e-3);
    EXPECT_NEAR(point.azimuth_deg,
                229.70 + 0.39 * (static_cast<double>(i / 32) + in_block / 110.592), 1e-4);
  }
}

TEST(Velodyne, PacketsAreWrittenAsTheyAreRead) {
  VelodynePacket got;
  for (const Bytes& packet :
       {data_packet(turning(22970, 39, 1), 0x37), data_packet(turning(35980, 40, 2), 0x39)}) {
    ASSERT_EQ(decode_velodyne(packet, got), "");
    EXPECT_EQ(encode_velodyne(got), packet);
  }
}

TEST(Velodyne, TwoReturnsShareTheirFiring) {
  VelodynePacket got;
  ASSERT_EQ(decode_velodyne(data_packet(turning(35980, 40, 2), 0x39), got), "");
  for (std::size_t i = 0; i < 384; ++i) {
    const VelodynePoint& point = got.points[i];
    EXPECT_EQ(point.second_return, i / 32 % 2);
    const double cycles = static_cast<double>(i / 64);
    const double in_block =
        static_cast<double>(i % 32 / 16) * 55.296 + static_cast<double>(i % 16) * 2.304;
    EXPECT_NEAR(point.delay_us, cycles * 110.592 + in_block, 1e-3);
    double azimuth = 359.80 + 0.40 * (cycles + in_block / 110.592);
    if (azimuth >= 360) azimuth -= 360;
    EXPECT_NEAR(point.azimuth_deg, azimuth, 1e-4) << i;
    EXPECT_LT(point.azimuth_deg, 360);
  }
}

TEST(Velodyne, AJumpOfAzimuthIsNoTurn) {
  auto azimuths = turning(1000, 40, 1);
  azimuths[5] = 30000;
  VelodynePacket got;
  ASSERT_EQ(decode_velodyne(data_packet(azimuths, 0x38), got), "");
  EXPECT_NEAR(got.points[4 * 32 + 16].azimuth_deg, 11.60 + 0.20, 1e-4);
  EXPECT_NEAR(got.points[5 * 32 + 16].azimuth_deg, 300.00 + 0.20, 1e-4);
}

TEST(Velodyne, RefusesOddPacketsWithAReason) {
  VelodynePacket got;
  const Bytes good = data_packet(turning(0, 40, 1), 0x37);
  for (const std::size_t size : {0U, 1205U})
    EXPECT_EQ(decode_velodyne(ByteView(good).first(size), got), "not 1206 bytes");
  const auto with = [&](std::size_t at, std::uint8_t value) {
    Bytes bad = good;
    bad[at] = value;
    return decode_velodyne(bad, got);
  };
  EXPECT_EQ(with(300, 0xFE), "a block has no FF EE");
  EXPECT_EQ(with(303, 0xFF), "azimuth beyond a turn");
  EXPECT_EQ(with(1204, 0x36), "unknown return mode");
  EXPECT_EQ(with(1205, 0x21), "not a VLP-16");
  EXPECT_EQ(with(1203, 0xFF), "time stamp beyond the hour");
}

TEST(Velodyne, TheRecordedPacketOfOddLengthIsRefused) {
  RECORDING_OR_SKIP(pcap, "velodyne/VLI-16-one-packet.pcap");
  const auto packets = drivers_test::udp_payloads(pcap);
  ASSERT_EQ(packets.size(), 1U);
  EXPECT_EQ(packets[0].size(), 1212U);
  VelodynePacket got;
  EXPECT_EQ(decode_velodyne(packets[0], got), "not 1206 bytes");
  const auto decoder = velodyne_offline();
  Captured captured;
  captured.bytes = packets[0];
  decoder->feed(captured, [](const Message&) { FAIL(); });
  EXPECT_EQ(decoder->skipped().at("not 1206 bytes").bytes, 1212U);
}

TEST(Velodyne, PointsAreRep103) {
  VelodynePoint point;
  point.laser = 1;  // 1 degree up, 0.7 mm lower.
  point.distance_2mm = 5000;
  EXPECT_EQ(velodyne_elevation_deg(1), 1);
  EXPECT_LT((velodyne_point_m(point) - Eigen::Vector3d(9.99848, 0, 0.174524 - 0.0007)).norm(),
            1e-5);
  point.azimuth_deg = 90;  // Clockwise: to the right.
  EXPECT_LT((velodyne_point_m(point) - Eigen::Vector3d(0, -9.99848, 0.173824)).norm(), 1e-5);
  point.distance_2mm = 0;
  EXPECT_EQ(velodyne_point_m(point), Eigen::Vector3d::Zero());
}

TEST(Velodyne, TelemetryCarriesTimeAndSentence) {
  constexpr std::string_view kReal =
      "$GPRMC,214106,A,3707.8178,N,12139.2690,W,010.3,188.2,230715,013.8,E,D*05";
  Bytes packet(512);
  put_little<std::uint32_t>(packet, 198, 2467108343U);
  packet[202] = 2;
  std::copy(kReal.begin(), kReal.end(), packet.begin() + 206);
  VelodyneTelemetry got;
  ASSERT_EQ(decode_velodyne_telemetry(packet, got), "");
  EXPECT_EQ(got.timestamp_us, 2467108343U);
  EXPECT_EQ(fault_of(velodyne_pps_states(), got.pps)->name, "PPS locked");
  EXPECT_EQ(got.nmea, kReal);
  EXPECT_EQ(decode_velodyne_telemetry(ByteView(packet).first(511), got), "not 512 bytes");
}

}  // namespace
}  // namespace drivers
