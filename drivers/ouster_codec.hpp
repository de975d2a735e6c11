// Ouster OS sensors: metadata, lidar packets of the profiles that it names, IMU packets.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/bytes.hpp"
#include "drivers/fault.hpp"
#include "drivers/offline.hpp"

namespace drivers {

enum class OusterProfile { legacy, single, low_rate, dual };

// What is needed to read packets, from the sensor's metadata (of firmware 2 or 3).
struct OusterMetadata {
  OusterProfile profile{};
  std::size_t rows{};  // pixels_per_column
  std::size_t columns_per_packet = 16;
  std::size_t columns_per_frame{};
  std::array<std::size_t, 2> column_window{};  // First and last measurement id, both within.
  std::vector<int> pixel_shift_by_row;
  std::vector<double> beam_altitude_deg, beam_azimuth_deg;
  double beam_origin_mm{};                      // From the lidar's axis.
  std::array<double, 16> lidar_to_sensor_mm{};  // 4 x 4, row by row.
  std::string model, serial_number, firmware, lidar_mode;

  std::size_t packet_size() const;
};

// Empty, or what is wrong: the key and its value.
std::string parse_ouster_metadata(std::string_view json, OusterMetadata& into);

struct OusterColumn {
  std::uint64_t timestamp_ns{};
  std::uint16_t measurement_id{};
  std::uint16_t frame_id{};
  std::uint32_t encoder{};  // Legacy only: 0..90111.
  std::uint32_t status{};   // As sent; see valid.
  bool valid{};
};

// One return's values, rows x columns, row by row.
struct OusterReturn {
  std::vector<std::uint32_t> range_mm;
  std::vector<std::uint8_t> flags, reflectivity;
  std::vector<std::uint16_t> signal;
};

struct OusterPacket {
  std::uint16_t frame_id{};
  std::uint32_t init_id{};  // The rest of the header: not in legacy packets.
  std::uint64_t serial_number{};
  std::uint8_t alert_flags{};  // Firmware 3
  std::uint8_t shutdown_countdown_s{}, shot_limiting_countdown_s{};
  std::uint8_t thermal_shutdown{}, shot_limiting{};  // Codes: see ouster_faults().
  std::vector<OusterColumn> columns;
  std::array<OusterReturn, 2> returns;  // The second is empty unless dual.
  std::vector<std::uint16_t> near_ir;
  std::vector<std::uint8_t> window;  // Single profile only.
};

// Empty, or why this is no lidar packet of this sensor. Memory of `into` is reused.
std::string_view decode_ouster(ByteView packet, const OusterMetadata& metadata, OusterPacket& into);

// The other way round, for simulated scanners.
Bytes encode_ouster(const OusterMetadata& metadata, const OusterPacket& packet);

std::vector<const Fault*> ouster_faults(const OusterPacket& packet);

struct OusterImu {
  std::uint64_t diagnostic_ns{}, accel_ns{}, gyro_ns{};
  std::array<float, 3> accel_g{}, gyro_degps{};
};
std::string_view decode_ouster_imu(ByteView packet, OusterImu& into);

// A range in the sensor's frame (x towards the connector's opposite side as the maker draws it, z
// up), metres. Zero range has no point: the origin comes back.
Eigen::Vector3d ouster_point_m(const OusterMetadata& metadata, std::size_t row,
                               std::uint16_t measurement_id, std::uint32_t range_mm);

// Lidar and IMU packets as captured; packets of other sizes are counted as skipped.
std::unique_ptr<OfflineDecoder> ouster_offline(OusterMetadata metadata);

}  // namespace drivers
