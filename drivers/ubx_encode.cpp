#include "drivers/ubx_encode.hpp"

#include <algorithm>

namespace drivers {
namespace {

using Payload = std::span<std::uint8_t>;

std::uint8_t bits(std::initializer_list<bool> values) {
  unsigned word = 0, at = 0;
  for (const bool value : values) word |= (value ? 1U : 0U) << at++;
  return static_cast<std::uint8_t>(word);
}

void put_text(Payload payload, std::size_t at, std::size_t size, const std::string& text) {
  std::copy_n(text.begin(), std::min(text.size(), size - 1),
              payload.begin() + static_cast<std::ptrdiff_t>(at));
}

void put_time(Payload p, const UbxNavPvt& pvt) {
  put_little<std::uint32_t>(p, 0, pvt.itow_ms);
  put_little<std::uint16_t>(p, 4, pvt.year);
  p[6] = pvt.month;
  p[7] = pvt.day;
  p[8] = pvt.hour;
  p[9] = pvt.minute;
  p[10] = pvt.second;
  p[11] = bits({pvt.date_valid, pvt.time_valid, pvt.fully_resolved, pvt.magnetic_valid});
  put_little<std::uint32_t>(p, 12, pvt.time_accuracy_ns);
  put_little<std::int32_t>(p, 16, pvt.nano);
}

void put_position(Payload p, const UbxNavPvt& pvt) {
  p[20] = pvt.fix_type;
  p[21] = static_cast<std::uint8_t>(
      bits({pvt.fix_ok, pvt.differential, false, false, false, pvt.heading_valid}) |
      static_cast<unsigned>(pvt.carrier) << 6);
  p[22] = pvt.flags2;
  p[23] = pvt.satellites;
  put_little<std::int32_t>(p, 24, pvt.longitude_1e7deg);
  put_little<std::int32_t>(p, 28, pvt.latitude_1e7deg);
  put_little<std::int32_t>(p, 32, pvt.height_mm);
  put_little<std::int32_t>(p, 36, pvt.height_msl_mm);
  put_little<std::uint32_t>(p, 40, pvt.horizontal_accuracy_mm);
  put_little<std::uint32_t>(p, 44, pvt.vertical_accuracy_mm);
}

void put_motion(Payload p, const UbxNavPvt& pvt) {
  put_little<std::int32_t>(p, 48, pvt.north_mmps);
  put_little<std::int32_t>(p, 52, pvt.east_mmps);
  put_little<std::int32_t>(p, 56, pvt.down_mmps);
  put_little<std::int32_t>(p, 60, pvt.ground_speed_mmps);
  put_little<std::int32_t>(p, 64, pvt.motion_heading_1e5deg);
  put_little<std::uint32_t>(p, 68, pvt.speed_accuracy_mmps);
  put_little<std::uint32_t>(p, 72, pvt.heading_accuracy_1e5deg);
  put_little<std::uint16_t>(p, 76, pvt.pdop_centi);
  put_little<std::uint16_t>(p, 78,
                            static_cast<std::uint16_t>((pvt.position_invalid ? 1U : 0U) |
                                                       (pvt.correction_age_code & 15U) << 1));
  put_little<std::int32_t>(p, 84, pvt.vehicle_heading_1e5deg);
  put_little<std::int16_t>(p, 88, pvt.declination_centideg);
  put_little<std::uint16_t>(p, 90, pvt.declination_accuracy_centideg);
}

// A fine integer as its coarse one and an i8 rest.
struct Split {
  std::int32_t coarse;
  std::int8_t rest;
};
Split split(std::int64_t fine, std::int64_t unit) {
  const std::int64_t coarse = fine / unit;
  return {static_cast<std::int32_t>(coarse), static_cast<std::int8_t>(fine - coarse * unit)};
}

void append_value(Bytes& bytes, std::uint64_t value, int width) {
  for (int i = 0; i < width; ++i) bytes.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
}

bool is_configuration(const UbxMessage& m, std::uint8_t id) {
  return m.cls == 0x06 && m.id == id && m.payload.size() >= 4;
}

constexpr std::uint8_t kValset = 0x8A, kValget = 0x8B;

}  // namespace

Bytes encode_ubx(const UbxNavPvt& pvt) {
  Bytes p(92);
  put_time(p, pvt);
  put_position(p, pvt);
  put_motion(p, pvt);
  return encode_ubx(0x01, 0x07, p);
}

Bytes encode_ubx(const UbxNavHpposllh& h) {
  Bytes p(36);
  p[3] = bits({h.invalid});
  put_little<std::uint32_t>(p, 4, h.itow_ms);
  const Split parts[] = {split(h.longitude_1e9deg, 100), split(h.latitude_1e9deg, 100),
                         split(h.height_01mm, 10), split(h.height_msl_01mm, 10)};
  for (std::size_t i = 0; i < 4; ++i) {
    put_little<std::int32_t>(p, 8 + 4 * i, parts[i].coarse);
    p[24 + i] = static_cast<std::uint8_t>(parts[i].rest);
  }
  put_little<std::uint32_t>(p, 28, h.horizontal_accuracy_01mm);
  put_little<std::uint32_t>(p, 32, h.vertical_accuracy_01mm);
  return encode_ubx(0x01, 0x14, p);
}

Bytes encode_ubx(const UbxNavCov& cov) {
  Bytes p(64);
  put_little<std::uint32_t>(p, 0, cov.itow_ms);
  p[5] = cov.position_valid;
  p[6] = cov.velocity_valid;
  for (std::size_t i = 0; i < 6; ++i) {
    put_little<float>(p, 16 + 4 * i, cov.position_m2[i]);
    put_little<float>(p, 40 + 4 * i, cov.velocity_m2ps2[i]);
  }
  return encode_ubx(0x01, 0x36, p);
}

Bytes encode_ubx(const UbxNavEoe& end) {
  Bytes p(4);
  put_little<std::uint32_t>(p, 0, end.itow_ms);
  return encode_ubx(0x01, 0x61, p);
}

Bytes encode_ubx(const UbxMonVer& version) {
  Bytes p(40 + 30 * version.extensions.size());
  put_text(p, 0, 30, version.software);
  put_text(p, 30, 10, version.hardware);
  for (std::size_t i = 0; i < version.extensions.size(); ++i)
    put_text(p, 40 + 30 * i, 30, version.extensions[i]);
  return encode_ubx(0x0A, 0x04, p);
}

Bytes encode_ubx(const UbxMonRf& rf) {
  Bytes p(4 + 24 * rf.blocks.size());
  p[1] = static_cast<std::uint8_t>(rf.blocks.size());
  for (std::size_t i = 0; i < rf.blocks.size(); ++i) {
    const UbxMonRf::Block& block = rf.blocks[i];
    const Payload b = Payload(p).subspan(4 + 24 * i, 24);
    b[0] = block.id;
    b[1] = block.jamming & 3U;
    b[2] = block.antenna;
    b[3] = block.power;
    put_little<std::uint32_t>(b, 4, block.post_status);
    put_little<std::uint16_t>(b, 12, block.noise);
    put_little<std::uint16_t>(b, 14, block.gain);
    b[16] = block.jamming_indicator;
  }
  return encode_ubx(0x0A, 0x38, p);
}

Bytes encode_ubx(const UbxRxmRtcm& rtcm) {
  Bytes p(8);
  p[0] = 2;
  p[1] = static_cast<std::uint8_t>((rtcm.crc_failed ? 1U : 0U) | (rtcm.used & 3U) << 1);
  put_little<std::uint16_t>(p, 2, rtcm.sub_type);
  put_little<std::uint16_t>(p, 4, rtcm.station);
  put_little<std::uint16_t>(p, 6, rtcm.type);
  return encode_ubx(0x02, 0x32, p);
}

Bytes encode_ubx(const UbxAck& ack) {
  return encode_ubx(0x05, ack.accepted ? 1 : 0, Bytes{ack.cls, ack.id});
}

int ubx_width(std::uint32_t key) {
  constexpr int kWidths[8] = {0, 1, 1, 2, 4, 8, 0, 0};  // One bit takes a byte.
  return kWidths[key >> 28 & 7U];
}

std::optional<std::vector<UbxSetting>> ubx_settings(const UbxMessage& m) {
  if (!is_configuration(m, kValset) && !is_configuration(m, kValget)) return std::nullopt;
  std::vector<UbxSetting> settings;
  ByteView rest = m.payload.subspan(4);
  while (rest.size() >= 4) {
    UbxSetting setting{little<std::uint32_t>(rest, 0), 0};
    const auto width = static_cast<std::size_t>(ubx_width(setting.key));
    if (width == 0 || rest.size() < 4 + width) return std::nullopt;
    for (std::size_t i = 0; i < width; ++i) setting.value |= std::uint64_t{rest[4 + i]} << (8 * i);
    settings.push_back(setting);
    rest = rest.subspan(4 + width);
  }
  return rest.empty() ? std::optional(std::move(settings)) : std::nullopt;
}

std::optional<std::vector<std::uint32_t>> ubx_asked_keys(const UbxMessage& m) {
  if (!is_configuration(m, kValget) || m.payload.size() % 4 != 0) return std::nullopt;
  std::vector<std::uint32_t> keys;
  for (std::size_t at = 4; at < m.payload.size(); at += 4)
    keys.push_back(little<std::uint32_t>(m.payload, at));
  return keys;
}

Bytes ubx_valget(std::span<const std::uint32_t> keys) {
  Bytes p{0, 0, 0, 0};
  for (const std::uint32_t key : keys) append_little<std::uint32_t>(p, key);
  return encode_ubx(0x06, kValget, p);
}

Bytes ubx_valget_answer(std::span<const UbxSetting> settings) {
  Bytes p{1, 0, 0, 0};
  for (const UbxSetting& setting : settings) {
    append_little<std::uint32_t>(p, setting.key);
    append_value(p, setting.value, ubx_width(setting.key));
  }
  return encode_ubx(0x06, kValget, p);
}

}  // namespace drivers
