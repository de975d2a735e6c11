#include "drivers/gnss_demux.hpp"

#include <algorithm>
#include <array>

#include "drivers/text.hpp"

namespace drivers {
namespace {

constexpr std::size_t kSentenceMax = 1024;  // The standard says 82; real ones with PUBX are longer.
constexpr std::size_t kUbxPayloadMax = kGnssFrameMax - 8;
constexpr std::uint8_t kUbx1 = 0xB5, kUbx2 = 0x62, kRtcm = 0xD3;

bool starts_frame(std::uint8_t byte) {
  return byte == '$' || byte == '!' || byte == kUbx1 || byte == kRtcm;
}

// With the line's end where it is there: some text ends at the checksum.
Look end_sentence(ByteView front, std::size_t end) {
  if (end == front.size()) return Look::more();
  if (front[end] == '\n') return Look::frame(end + 1);
  if (front[end] != '\r') return Look::frame(end);
  if (end + 1 == front.size()) return Look::more();
  return Look::frame(front[end + 1] == '\n' ? end + 2 : end + 1);
}

Look look_sentence(ByteView front) {
  std::uint8_t sum = 0;
  std::size_t at = 1;
  for (; at < front.size() && front[at] != '*'; ++at) {
    if (at == kSentenceMax) return Look::none("NMEA too long", at);
    if (starts_frame(front[at])) return Look::none("NMEA cut", at);
    if (front[at] < 0x20 || front[at] > 0x7E) return Look::none("NMEA cut", at);
    sum ^= front[at];
  }
  if (at + 3 > front.size()) return Look::more();
  if (hex_pair(as_text(front.subspan(at + 1, 2))) != sum) return Look::none("NMEA checksum");
  return end_sentence(front, at + 3);
}

Look look_ubx(ByteView front) {
  if (front.size() < 2) return Look::more();
  if (front[1] != kUbx2) return Look::none("no start");
  if (front.size() < 6) return Look::more();
  const std::size_t length = little<std::uint16_t>(front, 4);
  if (length > kUbxPayloadMax) return Look::none("UBX length");
  if (front.size() < 8 + length) return Look::more();
  std::uint8_t a = 0, b = 0;
  for (const std::uint8_t byte : front.subspan(2, 4 + length)) {
    a = static_cast<std::uint8_t>(a + byte);
    b = static_cast<std::uint8_t>(b + a);
  }
  if (front[6 + length] != a || front[7 + length] != b) return Look::none("UBX checksum");
  return Look::frame(8 + length);
}

Look look_rtcm3(ByteView front) {
  if (front.size() < 2) return Look::more();
  if ((front[1] & 0xFC) != 0) return Look::none("no start");
  if (front.size() < 3) return Look::more();
  const std::size_t size = 3 + big<std::uint16_t>(front, 1) + 3U;
  if (front.size() < size) return Look::more();
  // The checksum over a frame with its checksum is 0.
  return crc24q(front.first(size)) == 0 ? Look::frame(size) : Look::none("RTCM3 checksum");
}

constexpr std::array<std::uint32_t, 256> make_crc24q() {
  std::array<std::uint32_t, 256> table{};
  for (std::uint32_t byte = 0; byte < 256; ++byte) {
    std::uint32_t crc = byte << 16;
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 0x800000) != 0 ? crc << 1 ^ 0x1864CFB : crc << 1;
    table[byte] = crc & 0xFFFFFF;
  }
  return table;
}
constexpr auto kCrc24q = make_crc24q();

}  // namespace

std::uint32_t crc24q(ByteView bytes) {
  std::uint32_t crc = 0;
  for (const std::uint8_t byte : bytes)
    crc = (crc << 8 & 0xFFFFFF) ^ kCrc24q[(crc >> 16 ^ byte) & 0xFF];
  return crc;
}

Look look_gnss(ByteView front) {
  switch (front[0]) {
    case '$':
    case '!':
      return look_sentence(front);
    case kUbx1:
      return look_ubx(front);
    case kRtcm:
      return look_rtcm3(front);
    default:
      break;
  }
  const auto next = std::find_if(front.begin(), front.end(), starts_frame);
  return Look::none("no start", static_cast<std::size_t>(next - front.begin()));
}

GnssKind gnss_kind(ByteView frame) {
  if (frame[0] == kUbx1) return GnssKind::ubx;
  return frame[0] == kRtcm ? GnssKind::rtcm3 : GnssKind::nmea;
}

std::optional<std::uint16_t> rtcm3_type(ByteView frame) {
  if (frame.size() < 3 + 2 + 3) return std::nullopt;
  return static_cast<std::uint16_t>(big<std::uint16_t>(frame, 3) >> 4);
}

Bytes encode_rtcm3(ByteView payload) {
  Bytes frame{kRtcm};
  append_big<std::uint16_t>(frame, static_cast<std::uint16_t>(payload.size() & 0x3FF));
  frame.insert(frame.end(), payload.begin(), payload.end());
  const std::uint32_t crc = crc24q(frame);
  for (const int shift : {16, 8, 0}) frame.push_back(static_cast<std::uint8_t>(crc >> shift));
  return frame;
}

}  // namespace drivers
