#include "drivers/ouster_codec.hpp"

#include "tests/drivers/recordings.hpp"

namespace drivers {
namespace {

constexpr std::string_view kFrame = "ouster/OS-1-32-G_v2.1.1_1024x10";
constexpr std::string_view kDual = "ouster/OS-0-32-U1_v2.2.0_1024x10";

// A small sensor: 2 rows, 2 columns a packet.
OusterMetadata small(OusterProfile profile) {
  OusterMetadata m;
  m.profile = profile;
  m.rows = 2;
  m.columns_per_packet = 2;
  m.columns_per_frame = 1024;
  m.beam_altitude_deg = {10, -10};
  m.beam_azimuth_deg = {4, -4};
  m.pixel_shift_by_row = {0, 0};
  m.lidar_to_sensor_mm = {-1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1, 36.18, 0, 0, 0, 1};
  return m;
}

template <class T>
void add_wire(Bytes& wire, const std::vector<T>& values) {
  for (const T value : values) append_little<T>(wire, value);
}

TEST(Ouster, EveryPacketOfAFrameHasTheMakersDigests) {
  RECORDING_OR_SKIP(pcap, std::string(kFrame) + ".pcap");
  RECORDING_OR_SKIP(json, std::string(kFrame) + ".json");
  RECORDING_OR_SKIP(digest, std::string(kFrame) + "_digest.json");
  OusterMetadata metadata;
  ASSERT_EQ(parse_ouster_metadata(json, metadata), "");
  EXPECT_EQ(metadata.model, "OS-1-32-G");
  EXPECT_EQ(metadata.profile, OusterProfile::legacy);
  EXPECT_EQ(metadata.packet_size(), 6464U);
  std::map<std::string, Bytes> fields;
  OusterPacket packet;
  const auto packets = drivers_test::udp_payloads(pcap);
  ASSERT_EQ(packets.size(), 64U);
  for (const Bytes& bytes : packets) {
    ASSERT_EQ(decode_ouster(bytes, metadata, packet), "");
    for (const OusterColumn& column : packet.columns) {
      append_little<std::uint64_t>(fields["TIMESTAMP"], column.timestamp_ns);
      append_little<std::uint32_t>(fields["ENCODER_COUNT"], column.encoder);
      append_little<std::uint16_t>(fields["MEASUREMENT_ID"], column.measurement_id);
      append_little<std::uint32_t>(fields["STATUS"], column.status);
      append_little<std::uint16_t>(fields["FRAME_ID"], column.frame_id);
    }
    add_wire(fields["RANGE"], packet.returns[0].range_mm);
    add_wire(fields["SIGNAL"], packet.returns[0].signal);
    add_wire(fields["REFLECTIVITY"], packet.returns[0].reflectivity);
    add_wire(fields["FLAGS"], packet.returns[0].flags);
    add_wire(fields["NEAR_IR"], packet.near_ir);
  }
  const auto expected = boost::json::parse(digest);
  const auto& hashes = expected.at("packet_hash").as_object();
  EXPECT_EQ(hashes.size(), fields.size());
  for (const auto& [name, bytes] : fields)
    EXPECT_EQ(drivers_test::md5_hex(bytes), std::string(hashes.at(name).as_string().c_str()))
        << name;
}

TEST(Ouster, ARecordedPacketOfTwoReturnsHasThemBoth) {
  RECORDING_OR_SKIP(pcap, std::string(kDual) + "-single-packet.pcap");
  RECORDING_OR_SKIP(json, std::string(kDual) + ".json");
  OusterMetadata metadata;
  ASSERT_EQ(parse_ouster_metadata(json, metadata), "");
  EXPECT_EQ(metadata.profile, OusterProfile::dual);
  const auto packets = drivers_test::udp_payloads(pcap);
  ASSERT_EQ(packets.size(), 1U);
  OusterPacket packet;
  ASSERT_EQ(decode_ouster(packets[0], metadata, packet), "");
  EXPECT_EQ(packet.init_id, 9599938U);               // As the metadata say.
  EXPECT_EQ(packet.serial_number, 992137000142ULL);  // As the metadata say.
  for (std::size_t i = 0; i < 16; ++i) {
    EXPECT_TRUE(packet.columns[i].valid);
    EXPECT_EQ(packet.columns[i].measurement_id, packet.columns[0].measurement_id + i);
  }
  // Against the layout bit by bit.
  const auto bits = [&](std::size_t byte, std::size_t from, std::size_t count) {
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < count; ++i)
      value |= (packets[0][byte + (from + i) / 8] >> ((from + i) % 8) & 1U) << i;
    return value;
  };
  ASSERT_EQ(packet.returns[1].range_mm.size(), 512U);
  std::size_t seen = 0;
  for (std::size_t i = 0; i < 512; ++i) {
    const std::size_t pixel = 32 + i % 16 * (12 + 32 * 16) + 12 + i / 16 * 16;
    const auto& [first, second] = packet.returns;
    seen += first.range_mm[i] > 0;
    EXPECT_EQ(first.range_mm[i], bits(pixel, 0, 19));
    EXPECT_EQ(first.flags[i], bits(pixel, 19, 5));
    EXPECT_EQ(first.reflectivity[i], bits(pixel, 24, 8));
    EXPECT_EQ(second.range_mm[i], bits(pixel, 32, 19));
    EXPECT_EQ(second.flags[i], bits(pixel, 51, 5));
    EXPECT_EQ(second.reflectivity[i], bits(pixel, 56, 8));
    EXPECT_EQ(first.signal[i], bits(pixel, 64, 16));
    EXPECT_EQ(second.signal[i], bits(pixel, 80, 16));
    EXPECT_EQ(packet.near_ir[i], bits(pixel, 96, 16));
  }
  EXPECT_GT(seen, 0U);
}

TEST(Ouster, LegacyPixelsAreReadWhole) {
  const Bytes column = drivers_test::from_hex(
      "0807060504030201 0500 7e02 01020000"
      "ffff1fa0 aa00 3412 7856 0000"
      "39300000 01ff ffff 0000 0000"
      "ffffffff");
  const OusterMetadata metadata = small(OusterProfile::legacy);
  OusterPacket got;
  Bytes packet = drivers_test::joined({column, column});
  packet[column.size() + 16 + 12] = 0;  // Of the second column, second row: 0x3000.
  packet[2 * column.size() - 1] = 0;    // Its status: not valid.
  ASSERT_EQ(decode_ouster(packet, metadata, got), "");
  EXPECT_EQ(got.frame_id, 0x027E);
  EXPECT_EQ(got.columns[0].timestamp_ns, 0x0102030405060708U);
  EXPECT_EQ(got.columns[0].measurement_id, 5);
  EXPECT_EQ(got.columns[0].encoder, 0x0201U);
  EXPECT_TRUE(got.columns[0].valid);
  EXPECT_FALSE(got.columns[1].valid);
  EXPECT_EQ(got.returns[0].range_mm, (std::vector<std::uint32_t>{0xFFFFF, 0xFFFFF, 12345, 0x3000}));
  EXPECT_EQ(got.returns[0].flags, (std::vector<std::uint8_t>{10, 10, 0, 0}));
  EXPECT_EQ(got.returns[0].reflectivity, (std::vector<std::uint8_t>{0xAA, 0xAA, 1, 1}));
  EXPECT_EQ(got.returns[0].signal, (std::vector<std::uint16_t>{0x1234, 0x1234, 0xFFFF, 0xFFFF}));
  EXPECT_EQ(got.near_ir, (std::vector<std::uint16_t>{0x5678, 0x5678, 0, 0}));
}

// Header, two columns of two pixels, footer.
Bytes newer(const std::vector<std::string>& pixels) {
  std::string hex = "0100 7e02 c27b92 8e5aecffe6 80 000000 1e 05 01 02" + std::string(24, '0');
  for (int column = 0; column < 2; ++column) {
    hex += "0807060504030201 0" + std::to_string(column) + "00 0" + std::to_string(column) + "00";
    hex += pixels[2 * static_cast<std::size_t>(column)] +
           pixels[2 * static_cast<std::size_t>(column) + 1];
  }
  return drivers_test::from_hex(hex + std::string(64, '0'));
}

TEST(Ouster, NewerProfilesAreReadWhole) {
  OusterPacket got;
  const std::string single = "ffff7fff 7f00 3412 7856 0009", dark = "000000000000000000000000";
  ASSERT_EQ(decode_ouster(newer({single, dark, dark, single}), small(OusterProfile::single), got),
            "");
  EXPECT_EQ(got.frame_id, 0x027E);
  EXPECT_EQ(got.init_id, 9599938U);
  EXPECT_EQ(got.serial_number, 0xE6FFEC5A8EU);
  EXPECT_EQ(got.alert_flags, 0x80);
  EXPECT_EQ(got.shutdown_countdown_s, 30);
  EXPECT_EQ(got.shot_limiting_countdown_s, 5);
  EXPECT_FALSE(got.columns[0].valid);
  EXPECT_TRUE(got.columns[1].valid);
  EXPECT_EQ(got.columns[1].measurement_id, 1);
  EXPECT_EQ(got.returns[0].range_mm, (std::vector<std::uint32_t>{0x7FFFF, 0, 0, 0x7FFFF}));
  EXPECT_EQ(got.returns[0].flags, (std::vector<std::uint8_t>{15, 0, 0, 15}));
  EXPECT_EQ(got.returns[0].reflectivity, (std::vector<std::uint8_t>{0x7F, 0, 0, 0x7F}));
  EXPECT_EQ(got.returns[0].signal, (std::vector<std::uint16_t>{0x1234, 0, 0, 0x1234}));
  EXPECT_EQ(got.near_ir, (std::vector<std::uint16_t>{0x5678, 0, 0, 0x5678}));
  EXPECT_EQ(got.window, (std::vector<std::uint8_t>{9, 0, 0, 9}));
  std::vector<std::string_view> names;
  for (const Fault* fault : ouster_faults(got)) names.push_back(fault->name);
  EXPECT_EQ(names, (std::vector<std::string_view>{"thermal shutdown", "shot limiting", "alert"}));

  const std::string low = "0a80 7f 10", none = "00000000";
  ASSERT_EQ(decode_ouster(newer({low, none, none, low}), small(OusterProfile::low_rate), got), "");
  EXPECT_EQ(got.returns[0].range_mm, (std::vector<std::uint32_t>{80, 0, 0, 80}));
  EXPECT_EQ(got.returns[0].flags, (std::vector<std::uint8_t>{1, 0, 0, 1}));
  EXPECT_EQ(got.near_ir, (std::vector<std::uint16_t>{256, 0, 0, 256}));
  EXPECT_TRUE(got.returns[0].signal.empty());

  const std::string dual = "01000811 02001022 3412 7856 bc9a 0000", empty(32, '0');
  ASSERT_EQ(decode_ouster(newer({dual, empty, empty, dual}), small(OusterProfile::dual), got), "");
  EXPECT_EQ(got.returns[0].range_mm, (std::vector<std::uint32_t>{1, 0, 0, 1}));
  EXPECT_EQ(got.returns[0].flags, (std::vector<std::uint8_t>{1, 0, 0, 1}));
  EXPECT_EQ(got.returns[0].reflectivity, (std::vector<std::uint8_t>{0x11, 0, 0, 0x11}));
  EXPECT_EQ(got.returns[0].signal, (std::vector<std::uint16_t>{0x1234, 0, 0, 0x1234}));
  EXPECT_EQ(got.returns[1].range_mm, (std::vector<std::uint32_t>{2, 0, 0, 2}));
  EXPECT_EQ(got.returns[1].flags, (std::vector<std::uint8_t>{2, 0, 0, 2}));
  EXPECT_EQ(got.returns[1].reflectivity, (std::vector<std::uint8_t>{0x22, 0, 0, 0x22}));
  EXPECT_EQ(got.returns[1].signal, (std::vector<std::uint16_t>{0x5678, 0, 0, 0x5678}));
  EXPECT_EQ(got.near_ir, (std::vector<std::uint16_t>{0x9ABC, 0, 0, 0x9ABC}));
}

TEST(Ouster, PacketsAreWrittenAsTheyAreRead) {
  const Bytes column = drivers_test::from_hex(
      "0807060504030201 0500 7e02 01020000"
      "ffff0fa0 aa00 3412 7856 0000"
      "39300000 0100 ffff 0000 0000"
      "ffffffff");
  const std::string single = "ffff7f00 7f00 3412 7856 0009", low = "0a80 7f 10";
  const std::string dual = "01000811 02001022 3412 7856 bc9a 0000";
  const std::pair<OusterProfile, Bytes> packets[] = {
      {OusterProfile::legacy, drivers_test::joined({column, column})},
      {OusterProfile::single, newer({single, single, single, single})},
      {OusterProfile::low_rate, newer({low, low, low, low})},
      {OusterProfile::dual, newer({dual, dual, dual, dual})}};
  for (const auto& [profile, packet] : packets) {
    OusterPacket got;
    ASSERT_EQ(decode_ouster(packet, small(profile), got), "");
    EXPECT_EQ(encode_ouster(small(profile), got), packet) << static_cast<int>(profile);
  }
}

TEST(Ouster, RefusesWhatIsNoPacketOfTheSensor) {
  OusterPacket got;
  const OusterMetadata metadata = small(OusterProfile::low_rate);
  Bytes packet = newer({"00000000", "00000000", "00000000", "00000000"});
  for (std::size_t size = 0; size < packet.size(); ++size)
    EXPECT_EQ(decode_ouster(ByteView(packet).first(size), metadata, got),
              "size is not this profile's");
  packet[0] = 2;
  EXPECT_EQ(decode_ouster(packet, metadata, got), "not a lidar packet");
  packet[0] = 1;
  packet[32 + 20 + 9] = 4;  // Measurement 1025 of 1024, and valid.
  EXPECT_EQ(decode_ouster(packet, metadata, got), "measurement id beyond the frame");
}

TEST(Ouster, PacketSizesAreTheSheets) {
  OusterMetadata metadata;
  for (const auto& [rows, size] :
       {std::pair{16U, 3392U}, {32U, 6464U}, {64U, 12608U}, {128U, 24896U}}) {
    metadata.rows = rows;
    EXPECT_EQ(metadata.packet_size(), size);
  }
}

TEST(Ouster, MetadataProblemsNameTheKey) {
  OusterMetadata metadata;
  EXPECT_TRUE(parse_ouster_metadata("{", metadata).starts_with("metadata: no JSON"));
  EXPECT_EQ(parse_ouster_metadata("[]", metadata), "metadata: must be an object");
  EXPECT_EQ(parse_ouster_metadata("{}", metadata),
            "metadata: pixels_per_column: must be a number from 1 to 256");
  EXPECT_EQ(parse_ouster_metadata(R"({"data_format":{"udp_profile_lidar":"X"}})", metadata),
            "metadata: udp_profile_lidar: \"X\" is not read; set LEGACY, RNG19_RFL8_SIG16_NIR16, "
            "RNG15_RFL8_NIR8 or RNG19_RFL8_SIG16_NIR16_DUAL");
}

TEST(Ouster, MetadataOfNewerFirmwareIsGrouped) {
  OusterMetadata metadata;
  ASSERT_EQ(parse_ouster_metadata(R"({
    "sensor_info": {"prod_line": "OS-0-1", "prod_sn": "7", "build_rev": "v3.1.0"},
    "config_params": {"lidar_mode": "512x10"},
    "beam_intrinsics": {"beam_altitude_angles": [1.5], "beam_azimuth_angles": [-2],
                        "lidar_origin_to_beam_origin_mm": 27.67},
    "lidar_intrinsics": {"lidar_to_sensor_transform": [-1,0,0,0, 0,-1,0,0, 0,0,1,36.18, 0,0,0,1]},
    "lidar_data_format": {"pixels_per_column": 1, "columns_per_packet": 16,
      "columns_per_frame": 512, "column_window": [0, 511], "pixel_shift_by_row": [-3],
      "udp_profile_lidar": "RNG15_RFL8_NIR8"}})",
                                  metadata),
            "");
  EXPECT_EQ(metadata.profile, OusterProfile::low_rate);
  EXPECT_EQ(metadata.rows, 1U);
  EXPECT_EQ(metadata.columns_per_frame, 512U);
  EXPECT_EQ(metadata.column_window[1], 511U);
  EXPECT_EQ(metadata.pixel_shift_by_row, std::vector<int>{-3});
  EXPECT_EQ(metadata.beam_altitude_deg, std::vector<double>{1.5});
  EXPECT_EQ(metadata.beam_azimuth_deg, std::vector<double>{-2});
  EXPECT_EQ(metadata.beam_origin_mm, 27.67);
  EXPECT_EQ(metadata.lidar_to_sensor_mm[11], 36.18);
  EXPECT_EQ(metadata.model + metadata.serial_number + metadata.firmware + metadata.lidar_mode,
            "OS-0-17v3.1.0512x10");
}

TEST(Ouster, PointsStandWhereTheBeamsLook) {
  OusterMetadata metadata = small(OusterProfile::legacy);
  metadata.beam_altitude_deg = {0, 90};
  metadata.beam_azimuth_deg = {0, 0};
  metadata.beam_origin_mm = 20;
  // The lidar frame is turned by half a turn: measurement 0 looks along -x of the sensor.
  EXPECT_LT((ouster_point_m(metadata, 0, 0, 1000) - Eigen::Vector3d(-1, 0, 0.03618)).norm(), 1e-12);
  // A quarter of the turn later, clockwise.
  EXPECT_LT((ouster_point_m(metadata, 0, 256, 1000) - Eigen::Vector3d(0, 1, 0.03618)).norm(),
            1e-12);
  EXPECT_LT((ouster_point_m(metadata, 1, 0, 1020) - Eigen::Vector3d(-0.02, 0, 1.03618)).norm(),
            1e-12);
  EXPECT_EQ(ouster_point_m(metadata, 0, 0, 0), Eigen::Vector3d::Zero());
}

TEST(Ouster, ImuPacketsAreReadWhole) {
  Bytes packet;
  for (const std::uint64_t t : {1U, 2U, 3U}) append_little<std::uint64_t>(packet, t);
  for (const float x : {0.5F, 0.25F, 1.0F, -1.0F, -2.0F, -3.0F}) append_little<float>(packet, x);
  OusterImu imu;
  ASSERT_EQ(decode_ouster_imu(packet, imu), "");
  EXPECT_EQ(imu.diagnostic_ns, 1U);
  EXPECT_EQ(imu.accel_ns, 2U);
  EXPECT_EQ(imu.gyro_ns, 3U);
  EXPECT_EQ(imu.accel_g, (std::array<float, 3>{0.5F, 0.25F, 1.0F}));
  EXPECT_EQ(imu.gyro_degps, (std::array<float, 3>{-1, -2, -3}));
  EXPECT_EQ(decode_ouster_imu(ByteView(packet).first(47), imu), "not 48 bytes");
  std::vector<std::string> names;
  const auto decoder = ouster_offline(small(OusterProfile::legacy));
  Captured captured;
  captured.bytes = packet;
  decoder->feed(captured, [&](Message m) { names.push_back(m.name); });
  captured.bytes = ByteView(packet).first(9);
  decoder->feed(captured, [&](Message m) { names.push_back(m.name); });
  EXPECT_EQ(names, std::vector<std::string>{"IMU packet"});
  EXPECT_EQ(decoder->skipped().at("size is not this profile's").bytes, 9U);
}

}  // namespace
}  // namespace drivers
