#include "drivers/ubx_codec.hpp"

#include <algorithm>

#include "drivers/text.hpp"

namespace drivers {
namespace {

bool is(const UbxMessage& m, std::uint8_t cls, std::uint8_t id, std::size_t size) {
  return m.cls == cls && m.id == id && m.payload.size() == size;
}

bool bit(std::uint32_t word, int number) {
  return (word >> number & 1U) != 0;
}

UbxCarrier carrier_of(std::uint32_t bits) {
  return static_cast<UbxCarrier>(std::min<std::uint32_t>(bits & 3U, 2));
}

std::string padded_text(ByteView bytes) {
  const std::string_view text = as_text(bytes);
  return std::string(text.substr(0, text.find('\0')));
}

void read_flags(UbxNavPvt& pvt, ByteView p) {
  pvt.date_valid = bit(p[11], 0);
  pvt.time_valid = bit(p[11], 1);
  pvt.fully_resolved = bit(p[11], 2);
  pvt.magnetic_valid = bit(p[11], 3);
  pvt.fix_ok = bit(p[21], 0);
  pvt.differential = bit(p[21], 1);
  pvt.heading_valid = bit(p[21], 5);
  pvt.carrier = carrier_of(p[21] >> 6);
  const auto flags3 = little<std::uint16_t>(p, 78);
  pvt.position_invalid = bit(flags3, 0);
  pvt.correction_age_code = static_cast<std::uint8_t>(flags3 >> 1 & 15U);
}

void read_motion(UbxNavPvt& pvt, ByteView p) {
  pvt.north_mmps = little<std::int32_t>(p, 48);
  pvt.east_mmps = little<std::int32_t>(p, 52);
  pvt.down_mmps = little<std::int32_t>(p, 56);
  pvt.ground_speed_mmps = little<std::int32_t>(p, 60);
  pvt.motion_heading_1e5deg = little<std::int32_t>(p, 64);
  pvt.speed_accuracy_mmps = little<std::uint32_t>(p, 68);
  pvt.heading_accuracy_1e5deg = little<std::uint32_t>(p, 72);
  pvt.pdop_centi = little<std::uint16_t>(p, 76);
  if (p.size() < 92) return;
  pvt.vehicle_heading_1e5deg = little<std::int32_t>(p, 84);
  pvt.declination_centideg = little<std::int16_t>(p, 88);
  pvt.declination_accuracy_centideg = little<std::uint16_t>(p, 90);
}

std::int64_t with_part(ByteView p, std::size_t at, std::size_t part) {
  return std::int64_t{little<std::int32_t>(p, at)} * 100 + little<std::int8_t>(p, part);
}

// A whole one of 1e-7 degrees or millimetres with its i8 of a finer unit.
std::int64_t with_part10(ByteView p, std::size_t at, std::size_t part) {
  return std::int64_t{little<std::int32_t>(p, at)} * 10 + little<std::int8_t>(p, part);
}

}  // namespace

UbxMessage parse_ubx(ByteView frame) {
  return {frame[2], frame[3], frame.subspan(6, frame.size() - 8)};
}

std::optional<UbxNavPvt> ubx_nav_pvt(const UbxMessage& m) {
  if (!is(m, 0x01, 0x07, 92) && !is(m, 0x01, 0x07, 84)) return std::nullopt;
  const ByteView p = m.payload;
  UbxNavPvt pvt;
  pvt.itow_ms = little<std::uint32_t>(p, 0);
  pvt.year = little<std::uint16_t>(p, 4);
  pvt.month = p[6];
  pvt.day = p[7];
  pvt.hour = p[8];
  pvt.minute = p[9];
  pvt.second = p[10];
  pvt.time_accuracy_ns = little<std::uint32_t>(p, 12);
  pvt.nano = little<std::int32_t>(p, 16);
  pvt.fix_type = p[20];
  pvt.flags2 = p[22];
  pvt.satellites = p[23];
  pvt.longitude_1e7deg = little<std::int32_t>(p, 24);
  pvt.latitude_1e7deg = little<std::int32_t>(p, 28);
  pvt.height_mm = little<std::int32_t>(p, 32);
  pvt.height_msl_mm = little<std::int32_t>(p, 36);
  pvt.horizontal_accuracy_mm = little<std::uint32_t>(p, 40);
  pvt.vertical_accuracy_mm = little<std::uint32_t>(p, 44);
  read_flags(pvt, p);
  read_motion(pvt, p);
  return pvt;
}

std::optional<UbxNavHpposllh> ubx_nav_hpposllh(const UbxMessage& m) {
  if (!is(m, 0x01, 0x14, 36)) return std::nullopt;
  const ByteView p = m.payload;
  UbxNavHpposllh got;
  got.itow_ms = little<std::uint32_t>(p, 4);
  got.invalid = bit(p[3], 0);
  got.longitude_1e9deg = with_part(p, 8, 24);
  got.latitude_1e9deg = with_part(p, 12, 25);
  got.height_01mm = with_part10(p, 16, 26);
  got.height_msl_01mm = with_part10(p, 20, 27);
  got.horizontal_accuracy_01mm = little<std::uint32_t>(p, 28);
  got.vertical_accuracy_01mm = little<std::uint32_t>(p, 32);
  return got;
}

std::optional<UbxNavRelposned> ubx_nav_relposned(const UbxMessage& m) {
  if (!is(m, 0x01, 0x3C, 64)) return std::nullopt;
  const ByteView p = m.payload;
  UbxNavRelposned got;
  got.station = little<std::uint16_t>(p, 2);
  got.itow_ms = little<std::uint32_t>(p, 4);
  got.north_01mm = with_part(p, 8, 32);
  got.east_01mm = with_part(p, 12, 33);
  got.down_01mm = with_part(p, 16, 34);
  got.length_01mm = with_part(p, 20, 35);
  got.heading_1e5deg = little<std::int32_t>(p, 24);
  got.north_accuracy_01mm = little<std::uint32_t>(p, 36);
  got.east_accuracy_01mm = little<std::uint32_t>(p, 40);
  got.down_accuracy_01mm = little<std::uint32_t>(p, 44);
  got.length_accuracy_01mm = little<std::uint32_t>(p, 48);
  got.heading_accuracy_1e5deg = little<std::uint32_t>(p, 52);
  const auto flags = little<std::uint32_t>(p, 60);
  got.fix_ok = bit(flags, 0);
  got.differential = bit(flags, 1);
  got.position_valid = bit(flags, 2);
  got.carrier = carrier_of(flags >> 3);
  got.heading_valid = bit(flags, 8);
  return got;
}

std::optional<UbxNavStatus> ubx_nav_status(const UbxMessage& m) {
  if (!is(m, 0x01, 0x03, 16)) return std::nullopt;
  const ByteView p = m.payload;
  return UbxNavStatus{
      little<std::uint32_t>(p, 0), p[4], p[5], p[6], p[7], little<std::uint32_t>(p, 8),
      little<std::uint32_t>(p, 12)};
}

std::optional<UbxNavDop> ubx_nav_dop(const UbxMessage& m) {
  if (!is(m, 0x01, 0x04, 18)) return std::nullopt;
  UbxNavDop dop;
  dop.itow_ms = little<std::uint32_t>(m.payload, 0);
  std::size_t at = 4;
  for (auto* value : {&dop.geometric, &dop.position, &dop.time, &dop.vertical, &dop.horizontal,
                      &dop.northing, &dop.easting}) {
    *value = little<std::uint16_t>(m.payload, at);
    at += 2;
  }
  return dop;
}

std::optional<UbxNavCov> ubx_nav_cov(const UbxMessage& m) {
  if (!is(m, 0x01, 0x36, 64)) return std::nullopt;
  UbxNavCov cov;
  cov.itow_ms = little<std::uint32_t>(m.payload, 0);
  cov.position_valid = m.payload[5] != 0;
  cov.velocity_valid = m.payload[6] != 0;
  for (std::size_t i = 0; i < 6; ++i) {
    cov.position_m2[i] = little<float>(m.payload, 16 + 4 * i);
    cov.velocity_m2ps2[i] = little<float>(m.payload, 40 + 4 * i);
  }
  return cov;
}

std::optional<UbxNavEoe> ubx_nav_eoe(const UbxMessage& m) {
  if (!is(m, 0x01, 0x61, 4)) return std::nullopt;
  return UbxNavEoe{little<std::uint32_t>(m.payload, 0)};
}

std::optional<UbxMonVer> ubx_mon_ver(const UbxMessage& m) {
  if (m.cls != 0x0A || m.id != 0x04 || m.payload.size() < 40 || m.payload.size() % 30 != 10)
    return std::nullopt;
  UbxMonVer version{padded_text(m.payload.first(30)), padded_text(m.payload.subspan(30, 10)), {}};
  for (std::size_t at = 40; at < m.payload.size(); at += 30)
    version.extensions.push_back(padded_text(m.payload.subspan(at, 30)));
  return version;
}

std::optional<UbxMonRf> ubx_mon_rf(const UbxMessage& m) {
  if (m.cls != 0x0A || m.id != 0x38 || m.payload.size() < 4) return std::nullopt;
  const std::size_t count = m.payload[1];
  if (m.payload.size() != 4 + 24 * count) return std::nullopt;
  UbxMonRf rf;
  for (std::size_t i = 0; i < count; ++i) {
    const ByteView p = m.payload.subspan(4 + 24 * i, 24);
    rf.blocks.push_back({p[0], static_cast<std::uint8_t>(p[1] & 3U), p[2], p[3],
                         little<std::uint32_t>(p, 4), little<std::uint16_t>(p, 12),
                         little<std::uint16_t>(p, 14), p[16]});
  }
  return rf;
}

std::optional<UbxRxmRtcm> ubx_rxm_rtcm(const UbxMessage& m) {
  if (!is(m, 0x02, 0x32, 8)) return std::nullopt;
  const ByteView p = m.payload;
  return UbxRxmRtcm{bit(p[1], 0), static_cast<std::uint8_t>(p[1] >> 1 & 3U),
                    little<std::uint16_t>(p, 2), little<std::uint16_t>(p, 4),
                    little<std::uint16_t>(p, 6)};
}

std::optional<UbxAck> ubx_ack(const UbxMessage& m) {
  if (!is(m, 0x05, 0x01, 2) && !is(m, 0x05, 0x00, 2)) return std::nullopt;
  return UbxAck{m.id == 1, m.payload[0], m.payload[1]};
}

Bytes encode_ubx(std::uint8_t cls, std::uint8_t id, ByteView payload) {
  Bytes frame;
  frame.reserve(payload.size() + 8);
  frame.insert(frame.end(), {0xB5, 0x62, cls, id});
  append_little<std::uint16_t>(frame, static_cast<std::uint16_t>(payload.size()));
  frame.insert(frame.end(), payload.begin(), payload.end());
  std::uint8_t a = 0, b = 0;
  for (std::size_t i = 2; i < frame.size(); ++i) {
    a = static_cast<std::uint8_t>(a + frame[i]);
    b = static_cast<std::uint8_t>(b + a);
  }
  frame.push_back(a);
  frame.push_back(b);
  return frame;
}

std::optional<Bytes> ubx_valset(std::uint8_t layers, std::span<const UbxSetting> settings) {
  Bytes payload{0, layers, 0, 0};
  if (settings.size() > 64) return std::nullopt;
  for (const UbxSetting& setting : settings) {
    append_little<std::uint32_t>(payload, setting.key);
    constexpr int kWidths[8] = {0, 1, 1, 2, 4, 8, 0, 0};  // One bit takes a byte.
    const int width = kWidths[setting.key >> 28 & 7U];
    if (width == 0) return std::nullopt;
    for (int i = 0; i < width; ++i)
      payload.push_back(static_cast<std::uint8_t>(setting.value >> (8 * i)));
  }
  return encode_ubx(0x06, 0x8A, payload);
}

Bytes ubx_cfg_rate(std::uint16_t measurement_ms, std::uint16_t navigation,
                   std::uint16_t reference) {
  Bytes payload;
  for (const auto value : {measurement_ms, navigation, reference})
    append_little<std::uint16_t>(payload, value);
  return encode_ubx(0x06, 0x08, payload);
}

Bytes ubx_cfg_msg(std::uint8_t cls, std::uint8_t id, std::uint8_t rate) {
  return encode_ubx(0x06, 0x01, Bytes{cls, id, rate});
}

Bytes ubx_cfg_nav5_model(std::uint8_t dynamic_model) {
  Bytes payload(36);
  payload[0] = 1;  // Only the model is set.
  payload[2] = dynamic_model;
  return encode_ubx(0x06, 0x24, payload);
}

}  // namespace drivers
