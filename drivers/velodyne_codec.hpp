// Velodyne VLP-16: data packets (1206 bytes, one or two returns) and telemetry packets (512 bytes).
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

inline constexpr std::uint32_t kVelodyneHour_us = 3'600'000'000;  // Time stamps wrap here.

enum class VelodyneReturn : std::uint8_t { strongest = 0x37, last = 0x38, dual = 0x39 };

struct VelodynePoint {
  std::uint8_t laser{};          // 0..15
  std::uint8_t second_return{};  // 1 for the other return of dual packets.
  std::uint8_t reflectivity{};
  std::uint16_t distance_2mm{};  // 0: nothing came back.
  float azimuth_deg{};           // At the laser's own firing; clockwise from straight ahead.
  float delay_us{};              // After the packet's time stamp.
};

struct VelodynePacket {
  std::uint32_t timestamp_us{};  // Since the full hour.
  VelodyneReturn mode{};
  std::uint8_t product{};  // 0x22 is the VLP-16.
  std::array<std::uint16_t, 12> block_azimuth_centideg{};
  std::vector<VelodynePoint> points;  // 384, as they stand in the packet.
};

// Empty, or why it is no data packet of a VLP-16. Memory of `into` is reused.
std::string_view decode_velodyne(ByteView packet, VelodynePacket& into);

// The other way round, for simulated scanners: azimuths of the blocks, and of the points distance
// and reflectivity, as they stand in the packet.
Bytes encode_velodyne(const VelodynePacket& packet);

// From one packet to the next of single returns.
inline constexpr double kVelodynePacket_us = 12 * 2 * 55.296;

double velodyne_elevation_deg(std::size_t laser);
double velodyne_offset_m(std::size_t laser);  // Of its optics above the origin.
// REP-103: x ahead, y left, z up, metres. Nothing coming back gives the origin.
Eigen::Vector3d velodyne_point_m(const VelodynePoint& point);

struct VelodyneTelemetry {
  std::uint32_t timestamp_us{};
  std::uint8_t pps{};  // By code: velodyne_pps_states().
  std::string nmea;    // The receiver's $GPRMC, without padding.
};
std::string_view decode_velodyne_telemetry(ByteView packet, VelodyneTelemetry& into);
std::span<const Fault> velodyne_pps_states();

std::unique_ptr<OfflineDecoder> velodyne_offline();

}  // namespace drivers
