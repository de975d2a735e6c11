// VectorNav VN-100: binary output and ASCII lines, mixed in one stream.
//
// The device speaks of a body frame x forward, y right, z down and of north-east-down; the helpers
// below turn that into the robot's x forward, y left, z up and east-north-up.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/bytes.hpp"
#include "drivers/fault.hpp"
#include "drivers/offline.hpp"
#include "drivers/resync.hpp"

namespace drivers {

inline constexpr std::size_t kVn100FrameMax = 1100;

// For Resync: binary packets (0xFA ...) and lines ("$VN...").
Look look_vn100(ByteView front);

// CRC-16/CCITT, polynomial 0x1021, from 0.
std::uint16_t crc16_ccitt(ByteView bytes);

using Vn100Vector = std::array<float, 3>;

// What a packet or a line said; absent is unknown. Body and NED axes as the device has them.
struct Vn100Sample {
  std::optional<std::uint64_t> startup_ns, sync_in_ns;
  std::optional<Vn100Vector> yaw_pitch_roll_deg;
  std::optional<std::array<float, 4>> quaternion;  // x y z w
  std::optional<Vn100Vector> rate_radps, accel_mps2, magnetic_gauss;
  std::optional<Vn100Vector> raw_magnetic_gauss, raw_accel_mps2, raw_rate_radps;
  std::optional<float> temperature_c, pressure_kpa;
  std::optional<float> delta_time_s;
  std::optional<Vn100Vector> delta_theta_deg, delta_velocity_mps;
  std::optional<std::uint16_t> vpe_status, imu_status, saturation;
  std::optional<std::uint32_t> sync_in_count;
  std::optional<std::array<float, 9>> rotation;  // Row by row.
  std::optional<Vn100Vector> magnetic_ned_gauss, accel_ned_mps2, linear_body_mps2, linear_ned_mps2;
  std::optional<Vn100Vector> yaw_pitch_roll_sigma_deg;
};

// A binary frame that look_vn100() found.
Vn100Sample decode_vn100_binary(ByteView frame);

// The packet of group 1 with these fields of it (bits 0, 3, 5, 8 and 12 of `common` only), as the
// device sends it; what the sample does not say is zero. For simulated units.
Bytes encode_vn100_binary(std::uint16_t common, const Vn100Sample& sample);
// "VNYMR,..." with its checksum.
Bytes encode_vn100_line(const Vn100Sample& sample);

// A line that look_vn100() found: "VNYMR" and the fields after it.
struct Vn100Line {
  std::string type;
  std::vector<std::string> fields;
  std::optional<std::uint32_t> time_ms;  // ",T..." where the device appends it.
  std::optional<std::uint16_t> status;   // ",S..."
};
std::optional<Vn100Line> parse_vn100_line(ByteView frame);
// Of VNYMR and VNYPR.
std::optional<Vn100Sample> vn100_sample(const Vn100Line& line);
// Of VNERR, by its hex code; null for other lines.
const Fault* vn100_error(const Vn100Line& line);

std::vector<const Fault*> vn100_faults(std::uint16_t vpe_status);

Bytes vn100_request(std::string_view text);
// Registers 75 to 77: which fields to send at 800 Hz / divisor.
struct Vn100Output {
  int port = 1, divisor = 16;
  std::uint16_t common{}, imu{}, attitude{};  // Field bits of groups 1, 3 and 5.
};
Bytes vn100_output_request(int reg, const Vn100Output& output);
// Quiet, who is there, no lines, this packet, and go. Every answer echoes its request.
std::vector<Bytes> vn100_startup(const Vn100Output& output);

Eigen::Vector3d vn100_flu(const Vn100Vector& body);
Eigen::Vector3d vn100_enu(const Vn100Vector& ned);
// From x forward, y left, z up to east-north-up.
Eigen::Quaterniond vn100_orientation(const Vn100Vector& yaw_pitch_roll_deg);
Eigen::Quaterniond vn100_orientation(const std::array<float, 4>& quaternion);
// Counter-clockwise from east, (-pi, pi].
double vn100_heading_rad(double yaw_deg);

std::unique_ptr<OfflineDecoder> vn100_offline();

}  // namespace drivers
