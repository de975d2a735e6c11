// What a VN-100 sends, for simulated ones.
#include <cstdio>

#include "drivers/vn100_codec.hpp"

namespace drivers {
namespace {

constexpr std::size_t kSentMax = 64;  // A packet with all of kKnown has fewer bytes.

void append(Bytes& bytes, const std::optional<Vn100Vector>& values) {
  for (const float value : values.value_or(Vn100Vector{})) append_little<float>(bytes, value);
}

// Fields in the order of their bits.
void append_fields(Bytes& bytes, std::uint16_t common, const Vn100Sample& sample) {
  const auto asked = [&](int bit) { return (common >> bit & 1U) != 0; };
  if (asked(0)) append_little<std::uint64_t>(bytes, sample.startup_ns.value_or(0));
  if (asked(3)) append(bytes, sample.yaw_pitch_roll_deg);
  if (asked(5)) append(bytes, sample.rate_radps);
  if (asked(8)) append(bytes, sample.accel_mps2);
  if (asked(12)) append_little<std::uint16_t>(bytes, sample.vpe_status.value_or(0));
}

}  // namespace

Bytes encode_vn100_binary(std::uint16_t common, const Vn100Sample& sample) {
  constexpr std::uint16_t kKnown = 1U << 0 | 1U << 3 | 1U << 5 | 1U << 8 | 1U << 12;
  common &= kKnown;
  Bytes packet;
  packet.reserve(kSentMax);
  packet.insert(packet.end(), {0xFA, 1});
  append_little<std::uint16_t>(packet, common);
  append_fields(packet, common, sample);
  append_big<std::uint16_t>(packet, crc16_ccitt(ByteView(packet).subspan(1)));
  return packet;
}

Bytes encode_vn100_line(const Vn100Sample& sample) {
  const auto ypr = sample.yaw_pitch_roll_deg.value_or(Vn100Vector{});
  const auto mag = sample.magnetic_gauss.value_or(Vn100Vector{});
  const auto acc = sample.accel_mps2.value_or(Vn100Vector{});
  const auto rate = sample.rate_radps.value_or(Vn100Vector{});
  char text[512];
  std::snprintf(text, sizeof text,
                "VNYMR,%+08.3f,%+08.3f,%+08.3f,%+08.4f,%+08.4f,%+08.4f,%+07.3f,%+07.3f,%+07.3f,"
                "%+010.6f,%+010.6f,%+010.6f",
                double{ypr[0]}, double{ypr[1]}, double{ypr[2]}, double{mag[0]}, double{mag[1]},
                double{mag[2]}, double{acc[0]}, double{acc[1]}, double{acc[2]}, double{rate[0]},
                double{rate[1]}, double{rate[2]});
  return vn100_request(text);
}

}  // namespace drivers
