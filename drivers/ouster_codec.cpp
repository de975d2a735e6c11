#include "drivers/ouster_codec.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace drivers {
namespace {

constexpr std::size_t kHeader = 32, kFooter = 32;  // Not in legacy packets.

struct Layout {
  std::size_t header, column_header, pixel, column_footer, footer;
};

constexpr Layout layout_of(OusterProfile profile) {
  switch (profile) {
    case OusterProfile::legacy:
      return {0, 16, 12, 4, 0};
    case OusterProfile::single:
      return {kHeader, 12, 12, 0, kFooter};
    case OusterProfile::low_rate:
      return {kHeader, 12, 4, 0, kFooter};
    case OusterProfile::dual:
      return {kHeader, 12, 16, 0, kFooter};
  }
  return {};
}

constexpr std::size_t column_size(const Layout& layout, std::size_t rows) {
  return layout.column_header + rows * layout.pixel + layout.column_footer;
}

constexpr std::uint32_t kRange19 = (1U << 19) - 1, kRange20 = (1U << 20) - 1;

void size_return(OusterReturn& values, std::size_t pixels, bool signal) {
  values.range_mm.resize(pixels);
  values.flags.resize(pixels);
  values.reflectivity.resize(pixels);
  values.signal.resize(signal ? pixels : 0);
}

// Pixel readers: `at` is the pixel in the packet, `to` its place in the arrays.
void read_legacy(ByteView bytes, std::size_t at, OusterPacket& p, std::size_t to) {
  const auto range = little<std::uint32_t>(bytes, at);
  p.returns[0].range_mm[to] = range & kRange20;
  p.returns[0].flags[to] = static_cast<std::uint8_t>(range >> 28);
  p.returns[0].reflectivity[to] = bytes[at + 4];
  p.returns[0].signal[to] = little<std::uint16_t>(bytes, at + 6);
  p.near_ir[to] = little<std::uint16_t>(bytes, at + 8);
}

void read_single(ByteView bytes, std::size_t at, OusterPacket& p, std::size_t to) {
  const auto range = little<std::uint32_t>(bytes, at);
  p.returns[0].range_mm[to] = range & kRange19;
  p.returns[0].flags[to] = static_cast<std::uint8_t>(range >> 19 & 31U);
  p.returns[0].reflectivity[to] = bytes[at + 4];
  p.returns[0].signal[to] = little<std::uint16_t>(bytes, at + 6);
  p.near_ir[to] = little<std::uint16_t>(bytes, at + 8);
  p.window[to] = bytes[at + 11];
}

void read_low_rate(ByteView bytes, std::size_t at, OusterPacket& p, std::size_t to) {
  const auto range = little<std::uint16_t>(bytes, at);
  p.returns[0].range_mm[to] = (range & 0x7FFFU) * 8U;
  p.returns[0].flags[to] = static_cast<std::uint8_t>(range >> 15);
  p.returns[0].reflectivity[to] = bytes[at + 2];
  p.near_ir[to] = static_cast<std::uint16_t>(bytes[at + 3] * 16);
}

void read_dual(ByteView bytes, std::size_t at, OusterPacket& p, std::size_t to) {
  for (std::size_t i = 0; i < 2; ++i) {
    const auto range = little<std::uint32_t>(bytes, at + 4 * i);
    p.returns[i].range_mm[to] = range & kRange19;
    p.returns[i].flags[to] = static_cast<std::uint8_t>(range >> 19 & 31U);
    p.returns[i].reflectivity[to] = bytes[at + 4 * i + 3];
    p.returns[i].signal[to] = little<std::uint16_t>(bytes, at + 8 + 2 * i);
  }
  p.near_ir[to] = little<std::uint16_t>(bytes, at + 12);
}

template <class ReadPixel>
void read_pixels(ByteView bytes, const OusterMetadata& m, OusterPacket& into, ReadPixel&& read) {
  const Layout layout = layout_of(m.profile);
  const std::size_t step = column_size(layout, m.rows);
  for (std::size_t row = 0; row < m.rows; ++row)
    for (std::size_t column = 0; column < m.columns_per_packet; ++column)
      read(bytes, layout.header + column * step + layout.column_header + row * layout.pixel, into,
           row * m.columns_per_packet + column);
}

void size_packet(const OusterMetadata& m, OusterPacket& into) {
  const std::size_t pixels = m.rows * m.columns_per_packet;
  into.columns.resize(m.columns_per_packet);
  size_return(into.returns[0], pixels, m.profile != OusterProfile::low_rate);
  size_return(into.returns[1], m.profile == OusterProfile::dual ? pixels : 0,
              m.profile == OusterProfile::dual);
  into.near_ir.resize(pixels);
  into.window.resize(m.profile == OusterProfile::single ? pixels : 0);
}

OusterColumn read_column(ByteView bytes, bool legacy) {
  OusterColumn column;
  column.timestamp_ns = little<std::uint64_t>(bytes, 0);
  column.measurement_id = little<std::uint16_t>(bytes, 8);
  if (legacy) {
    column.frame_id = little<std::uint16_t>(bytes, 10);
    column.encoder = little<std::uint32_t>(bytes, 12);
    column.status = little<std::uint32_t>(bytes, bytes.size() - 4);
    column.valid = column.status == 0xFFFFFFFF;
  } else {
    column.encoder = 0;
    column.status = little<std::uint16_t>(bytes, 10);
    column.valid = (column.status & 1U) != 0;
  }
  return column;
}

void read_header(ByteView bytes, OusterPacket& into) {
  into.frame_id = little<std::uint16_t>(bytes, 2);
  const auto ids = little<std::uint64_t>(bytes, 4);
  into.init_id = static_cast<std::uint32_t>(ids & 0xFFFFFF);
  into.serial_number = ids >> 24;
  into.alert_flags = bytes[12];
  into.shutdown_countdown_s = bytes[16];
  into.shot_limiting_countdown_s = bytes[17];
  into.thermal_shutdown = bytes[18] & 15;
  into.shot_limiting = bytes[19] & 15;
}

void write_header(const OusterPacket& packet, std::span<std::uint8_t> bytes) {
  put_little<std::uint16_t>(bytes, 0, 1);
  put_little<std::uint16_t>(bytes, 2, packet.frame_id);
  put_little<std::uint64_t>(bytes, 4, (packet.init_id & 0xFFFFFF) | packet.serial_number << 24);
  bytes[12] = packet.alert_flags;
  bytes[16] = packet.shutdown_countdown_s;
  bytes[17] = packet.shot_limiting_countdown_s;
  bytes[18] = packet.thermal_shutdown;
  bytes[19] = packet.shot_limiting;
}

void write_column(const OusterColumn& column, bool legacy, std::span<std::uint8_t> bytes) {
  put_little<std::uint64_t>(bytes, 0, column.timestamp_ns);
  put_little<std::uint16_t>(bytes, 8, column.measurement_id);
  if (legacy) {
    put_little<std::uint16_t>(bytes, 10, column.frame_id);
    put_little<std::uint32_t>(bytes, 12, column.encoder);
    put_little<std::uint32_t>(bytes, bytes.size() - 4, column.status);
  } else {
    put_little<std::uint16_t>(bytes, 10, static_cast<std::uint16_t>(column.status));
  }
}

// The pixel `from` of the arrays.
void write_pixel(OusterProfile profile, const OusterPacket& p, std::size_t from,
                 std::span<std::uint8_t> pixel) {
  const OusterReturn& first = p.returns[0];
  const std::uint32_t range = first.range_mm[from], flags = first.flags[from];
  switch (profile) {
    case OusterProfile::legacy:
    case OusterProfile::single:
      put_little<std::uint32_t>(
          pixel, 0, profile == OusterProfile::legacy ? range | flags << 28 : range | flags << 19);
      pixel[4] = first.reflectivity[from];
      put_little<std::uint16_t>(pixel, 6, first.signal[from]);
      put_little<std::uint16_t>(pixel, 8, p.near_ir[from]);
      if (profile == OusterProfile::single) pixel[11] = p.window[from];
      break;
    case OusterProfile::low_rate:
      put_little<std::uint16_t>(pixel, 0, static_cast<std::uint16_t>(range / 8 | flags << 15));
      pixel[2] = first.reflectivity[from];
      pixel[3] = static_cast<std::uint8_t>(p.near_ir[from] / 16);
      break;
    case OusterProfile::dual:
      for (std::size_t i = 0; i < 2; ++i) {
        const OusterReturn& one = p.returns[i];
        const std::uint32_t word = one.range_mm[from] | std::uint32_t{one.flags[from]} << 19 |
                                   std::uint32_t{one.reflectivity[from]} << 24;
        put_little<std::uint32_t>(pixel, 4 * i, word);
        put_little<std::uint16_t>(pixel, 8 + 2 * i, one.signal[from]);
      }
      put_little<std::uint16_t>(pixel, 12, p.near_ir[from]);
      break;
  }
}

constexpr Fault kThermalShutdown{1, "thermal shutdown", "the sensor is too hot and will stop",
                                 "shade it, improve its mounting's cooling"};
constexpr Fault kShotLimiting[] = {
    {1, "shot limiting imminent", "the sensor is getting hot", "shade it, improve the cooling"},
    {2, "shot limiting", "too hot: fewer pulses, shorter range", "shade it, improve the cooling"}};
constexpr Fault kAlert{1, "alert", "the sensor has an active alert",
                       "read /api/v1/sensor/alerts and act on it"};

}  // namespace

std::size_t OusterMetadata::packet_size() const {
  const Layout layout = layout_of(profile);
  return layout.header + columns_per_packet * column_size(layout, rows) + layout.footer;
}

std::string_view decode_ouster(ByteView packet, const OusterMetadata& m, OusterPacket& into) {
  if (packet.size() != m.packet_size()) return "size is not this profile's";
  const bool legacy = m.profile == OusterProfile::legacy;
  if (!legacy && little<std::uint16_t>(packet, 0) != 1) return "not a lidar packet";
  const Layout layout = layout_of(m.profile);
  const std::size_t step = column_size(layout, m.rows);
  size_packet(m, into);
  for (std::size_t i = 0; i < m.columns_per_packet; ++i)
    into.columns[i] = read_column(packet.subspan(layout.header + i * step, step), legacy);
  if (legacy)
    into.frame_id = into.columns[0].frame_id;
  else
    read_header(packet, into);
  if (!legacy)
    for (OusterColumn& column : into.columns) column.frame_id = into.frame_id;
  for (const OusterColumn& column : into.columns)
    if (column.valid && column.measurement_id >= m.columns_per_frame)
      return "measurement id beyond the frame";
  switch (m.profile) {
    case OusterProfile::legacy:
      read_pixels(packet, m, into, read_legacy);
      break;
    case OusterProfile::single:
      read_pixels(packet, m, into, read_single);
      break;
    case OusterProfile::low_rate:
      read_pixels(packet, m, into, read_low_rate);
      break;
    case OusterProfile::dual:
      read_pixels(packet, m, into, read_dual);
      break;
  }
  return {};
}

Bytes encode_ouster(const OusterMetadata& m, const OusterPacket& packet) {
  Bytes bytes(m.packet_size());
  const bool legacy = m.profile == OusterProfile::legacy;
  const Layout layout = layout_of(m.profile);
  const std::size_t step = column_size(layout, m.rows);
  if (!legacy) write_header(packet, bytes);
  for (std::size_t c = 0; c < m.columns_per_packet; ++c) {
    const std::size_t at = layout.header + c * step;
    write_column(packet.columns[c], legacy, std::span(bytes).subspan(at, step));
    for (std::size_t row = 0; row < m.rows; ++row)
      write_pixel(
          m.profile, packet, row * m.columns_per_packet + c,
          std::span(bytes).subspan(at + layout.column_header + row * layout.pixel, layout.pixel));
  }
  return bytes;
}

std::vector<const Fault*> ouster_faults(const OusterPacket& packet) {
  std::vector<const Fault*> found;
  if (packet.thermal_shutdown != 0) found.push_back(&kThermalShutdown);
  if (const Fault* fault = fault_of(kShotLimiting, packet.shot_limiting)) found.push_back(fault);
  if (packet.alert_flags != 0) found.push_back(&kAlert);
  return found;
}

std::string_view decode_ouster_imu(ByteView packet, OusterImu& into) {
  if (packet.size() != 48) return "not 48 bytes";
  into.diagnostic_ns = little<std::uint64_t>(packet, 0);
  into.accel_ns = little<std::uint64_t>(packet, 8);
  into.gyro_ns = little<std::uint64_t>(packet, 16);
  for (std::size_t i = 0; i < 3; ++i) {
    into.accel_g[i] = little<float>(packet, 24 + 4 * i);
    into.gyro_degps[i] = little<float>(packet, 36 + 4 * i);
  }
  return {};
}

Eigen::Vector3d ouster_point_m(const OusterMetadata& m, std::size_t row,
                               std::uint16_t measurement_id, std::uint32_t range_mm) {
  if (range_mm == 0) return Eigen::Vector3d::Zero();
  constexpr double kTurn = 2 * std::numbers::pi;
  const double encoder = kTurn * (1.0 - measurement_id / static_cast<double>(m.columns_per_frame));
  const double azimuth = -kTurn * m.beam_azimuth_deg[row] / 360;
  const double altitude = kTurn * m.beam_altitude_deg[row] / 360;
  const double along = range_mm - m.beam_origin_mm;
  const Eigen::Vector4d lidar_mm(along * std::cos(encoder + azimuth) * std::cos(altitude) +
                                     m.beam_origin_mm * std::cos(encoder),
                                 along * std::sin(encoder + azimuth) * std::cos(altitude) +
                                     m.beam_origin_mm * std::sin(encoder),
                                 along * std::sin(altitude), 1);
  const Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> T_sensor_lidar(
      m.lidar_to_sensor_mm.data());
  return (T_sensor_lidar * lidar_mm).head<3>() / 1000;
}

}  // namespace drivers
