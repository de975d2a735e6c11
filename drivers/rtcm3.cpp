#include "drivers/rtcm3.hpp"

#include <cmath>

#include "drivers/gnss_demux.hpp"

namespace drivers {
namespace {

constexpr std::size_t kHead = 3, kChecksum = 3;
constexpr double kUnit_m = 1e-4;
constexpr std::size_t kX = 34, kY = 74, kZ = 114, kCoordinate = 38;  // Bits.
constexpr std::size_t kBaseBytes = 19;
constexpr std::size_t kEpoch = 24, kEpochBits = 30;
constexpr std::uint32_t kWeek_ms = 604'800'000;

// Bits are counted from the first one that is sent.
std::uint64_t bits(ByteView bytes, std::size_t from, std::size_t count) {
  std::uint64_t value = 0;
  for (std::size_t at = from; at < from + count; ++at)
    value = value << 1 | (bytes[at / 8] >> (7 - at % 8) & 1U);
  return value;
}
std::int64_t signed_bits(ByteView bytes, std::size_t from, std::size_t count) {
  const auto value = static_cast<std::int64_t>(bits(bytes, from, count));
  return value >> (count - 1) != 0 ? value - (std::int64_t{1} << count) : value;
}
void put_bits(Bytes& bytes, std::size_t from, std::size_t count, std::uint64_t value) {
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t at = from + i;
    const auto mask = static_cast<std::uint8_t>(0x80U >> at % 8);
    if ((value >> (count - 1 - i) & 1U) != 0) bytes[at / 8] |= mask;
  }
}

ByteView payload(ByteView frame) {
  return frame.size() < kHead + kChecksum ? ByteView()
                                          : frame.subspan(kHead, frame.size() - kHead - kChecksum);
}

// GPS, Galileo, SBAS and QZSS; BeiDou's week began 14 s later, GLONASS counts days.
bool counts_as_gps(std::uint16_t type) {
  return (type >= 1071 && type <= 1077) || (type >= 1091 && type <= 1117);
}

}  // namespace

std::optional<Rtcm3Epoch> rtcm3_epoch(ByteView frame) {
  const std::uint16_t type = rtcm3_type(frame).value_or(0);
  const ByteView p = payload(frame);
  const bool msm = type >= 1071 && type <= 1137 && type % 10 >= 1 && type % 10 <= 7;
  if (!msm || p.size() * 8 < kEpoch + kEpochBits) return std::nullopt;
  const auto raw = static_cast<std::uint32_t>(bits(p, kEpoch, kEpochBits));
  Rtcm3Epoch epoch{type, raw, {}};
  if (counts_as_gps(type) && raw < kWeek_ms) epoch.tow_ms = raw;
  return epoch;
}

std::optional<Eigen::Vector3d> rtcm3_base_m(ByteView frame) {
  const std::uint16_t type = rtcm3_type(frame).value_or(0);
  const ByteView p = payload(frame);
  if ((type != 1005 && type != 1006) || p.size() < kBaseBytes) return std::nullopt;
  const auto at = [&](std::size_t from) {
    return static_cast<double>(signed_bits(p, from, kCoordinate)) * kUnit_m;
  };
  return Eigen::Vector3d(at(kX), at(kY), at(kZ));
}

Bytes encode_rtcm3_base(std::uint16_t station, const Eigen::Vector3d& ecef_m) {
  Bytes p(kBaseBytes);
  put_bits(p, 0, 12, 1005);
  put_bits(p, 12, 12, station);
  put_bits(p, 30, 1, 1);  // Serves GPS.
  const std::size_t from[] = {kX, kY, kZ};
  for (int axis = 0; axis < 3; ++axis)
    put_bits(p, from[axis], kCoordinate,
             static_cast<std::uint64_t>(std::llround(ecef_m[axis] / kUnit_m)));
  return encode_rtcm3(p);
}

Bytes encode_rtcm3_msm(std::uint16_t type, std::uint16_t station, std::uint32_t epoch_raw,
                       ByteView content) {
  Bytes p(8);
  put_bits(p, 0, 12, type);
  put_bits(p, 12, 12, station);
  put_bits(p, kEpoch, kEpochBits, epoch_raw);
  p.insert(p.end(), content.begin(), content.end());
  return encode_rtcm3(p);
}

}  // namespace drivers
