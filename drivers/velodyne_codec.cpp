#include "drivers/velodyne_codec.hpp"

#include <cmath>
#include <numbers>

#include "drivers/offline_stream.hpp"
#include "drivers/text.hpp"

namespace drivers {
namespace {

constexpr std::size_t kBlocks = 12, kBlock = 100, kLasers = 16, kDataSize = 1206;
constexpr std::size_t kTelemetrySize = 512;
constexpr double kCycle_us = 55.296, kLaser_us = 2.304;
constexpr int kTurn_centideg = 36000;
// At 20 turns a second two cycles take 0.8 degrees; what is more is a jump, not a turn.
constexpr int kGapMax_centideg = 200;

struct Laser {
  double elevation_deg, offset_mm;
};
constexpr Laser kVlp16[kLasers] = {
    {-15, 11.2}, {1, -0.7}, {-13, 9.7}, {3, -2.2},  {-11, 8.1}, {5, -3.7},  {-9, 6.6}, {7, -5.1},
    {-7, 5.1},   {9, -6.6}, {-5, 3.7},  {11, -8.1}, {-3, 2.2},  {13, -9.7}, {-1, 0.7}, {15, -11.2}};

constexpr Fault kPps[] = {
    {0, "no PPS", "no receiver is connected", "connect one, or use arrival times"},
    {1, "PPS synchronising", "the receiver was just connected", "wait"},
    {2, "PPS locked", "none: this is how it works", "none"},
    {3, "PPS error", "pulse and NMEA disagree", "check the receiver's pulse and sentence"}};

// How far the head turns in a block, from the azimuths of this block and the next of other
// firings; the last blocks take the gap before them.
int turn_centideg(const std::array<std::uint16_t, kBlocks>& azimuths, std::size_t block,
                  std::size_t step, int before) {
  if (block + step >= kBlocks) return before;
  const int gap = (azimuths[block + step] - azimuths[block] + kTurn_centideg) % kTurn_centideg;
  return gap <= kGapMax_centideg ? gap : before;
}

std::string_view check_blocks(ByteView packet, VelodynePacket& into) {
  for (std::size_t block = 0; block < kBlocks; ++block) {
    if (little<std::uint16_t>(packet, block * kBlock) != 0xEEFF) return "a block has no FF EE";
    into.block_azimuth_centideg[block] = little<std::uint16_t>(packet, block * kBlock + 2);
    if (into.block_azimuth_centideg[block] >= kTurn_centideg) return "azimuth beyond a turn";
  }
  return {};
}

void read_block(ByteView block, const VelodynePacket& packet, std::size_t number, bool dual,
                int turn, VelodynePoint* to) {
  const double start_us = static_cast<double>(dual ? number / 2 : number) * 2 * kCycle_us;
  for (std::size_t i = 0; i < 2 * kLasers; ++i, ++to) {
    const double in_block_us =
        static_cast<double>(i / kLasers) * kCycle_us + static_cast<double>(i % kLasers) * kLaser_us;
    double azimuth = packet.block_azimuth_centideg[number] + turn * in_block_us / (2 * kCycle_us);
    if (azimuth >= kTurn_centideg) azimuth -= kTurn_centideg;
    to->laser = static_cast<std::uint8_t>(i % kLasers);
    to->second_return = dual && number % 2 == 1;
    to->distance_2mm = little<std::uint16_t>(block, 4 + 3 * i);
    to->reflectivity = block[4 + 3 * i + 2];
    to->azimuth_deg = static_cast<float>(azimuth / 100);
    to->delay_us = static_cast<float>(start_us + in_block_us);
  }
}

class Offline : public OfflineDatagrams {
  std::string_view say(ByteView bytes, Message& message) override {
    Fields fields(message);
    VelodyneTelemetry telemetry;
    const auto why = decode_velodyne(bytes, packet_);
    if (why.empty()) {
      message.name = "data packet";
      add(fields);
      return {};
    }
    if (!decode_velodyne_telemetry(bytes, telemetry).empty()) return why;
    message.name = "telemetry";
    fields.add("timestamp_us", telemetry.timestamp_us).add("nmea", telemetry.nmea);
    if (const Fault* state = fault_of(kPps, telemetry.pps)) fields.add("pps", state->name);
    return {};
  }

  void add(Fields& fields) const {
    std::vector<double> distance_m, azimuth_deg, reflectivity;
    for (const VelodynePoint& point : packet_.points) {
      distance_m.push_back(point.distance_2mm * 0.002);
      azimuth_deg.push_back(point.azimuth_deg);
      reflectivity.push_back(point.reflectivity);
    }
    fields.add("timestamp_us", packet_.timestamp_us)
        .add("mode", static_cast<unsigned>(packet_.mode))
        .add("product", packet_.product)
        .add("distance_m", distance_m)
        .add("azimuth_deg", azimuth_deg)
        .add("reflectivity", reflectivity);
  }

  VelodynePacket packet_;
};

}  // namespace

std::string_view decode_velodyne(ByteView packet, VelodynePacket& into) {
  if (packet.size() != kDataSize) return "not 1206 bytes";
  if (const auto why = check_blocks(packet, into); !why.empty()) return why;
  into.timestamp_us = little<std::uint32_t>(packet, 1200);
  into.mode = static_cast<VelodyneReturn>(packet[1204]);
  into.product = packet[1205];
  if (packet[1204] < 0x37 || packet[1204] > 0x39) return "unknown return mode";
  if (into.product != 0x22) return "not a VLP-16";
  // Just before the hour turns it may be a little too long, when a receiver locks.
  if (into.timestamp_us > kVelodyneHour_us + 1'000'000) return "time stamp beyond the hour";
  const bool dual = into.mode == VelodyneReturn::dual;
  const std::size_t step = dual ? 2 : 1;
  into.points.resize(kBlocks * 2 * kLasers);
  int turn = turn_centideg(into.block_azimuth_centideg, step, step, 0);
  for (std::size_t block = 0; block < kBlocks; ++block) {
    turn = turn_centideg(into.block_azimuth_centideg, block, step, turn);
    read_block(packet.subspan(block * kBlock, kBlock), into, block, dual, turn,
               &into.points[block * 2 * kLasers]);
  }
  return {};
}

Bytes encode_velodyne(const VelodynePacket& packet) {
  Bytes bytes(kDataSize);
  for (std::size_t block = 0; block < kBlocks; ++block) {
    put_little<std::uint16_t>(bytes, block * kBlock, 0xEEFF);
    put_little<std::uint16_t>(bytes, block * kBlock + 2, packet.block_azimuth_centideg[block]);
    for (std::size_t i = 0; i < 2 * kLasers; ++i) {
      const VelodynePoint& point = packet.points[block * 2 * kLasers + i];
      const std::size_t at = block * kBlock + 4 + 3 * i;
      put_little<std::uint16_t>(bytes, at, point.distance_2mm);
      bytes[at + 2] = point.reflectivity;
    }
  }
  put_little<std::uint32_t>(bytes, 1200, packet.timestamp_us);
  bytes[1204] = static_cast<std::uint8_t>(packet.mode);
  bytes[1205] = packet.product;
  return bytes;
}

double velodyne_offset_m(std::size_t laser) {
  return kVlp16[laser % kLasers].offset_mm / 1000;
}

double velodyne_elevation_deg(std::size_t laser) {
  return kVlp16[laser % kLasers].elevation_deg;
}

Eigen::Vector3d velodyne_point_m(const VelodynePoint& point) {
  if (point.distance_2mm == 0) return Eigen::Vector3d::Zero();
  constexpr double kDegree = std::numbers::pi / 180;
  const Laser& laser = kVlp16[point.laser % kLasers];
  const double range = point.distance_2mm * 0.002, azimuth = point.azimuth_deg * kDegree;
  const double level = range * std::cos(laser.elevation_deg * kDegree);
  return {level * std::cos(azimuth), -level * std::sin(azimuth),
          range * std::sin(laser.elevation_deg * kDegree) + laser.offset_mm / 1000};
}

std::string_view decode_velodyne_telemetry(ByteView packet, VelodyneTelemetry& into) {
  if (packet.size() != kTelemetrySize) return "not 512 bytes";
  into.timestamp_us = little<std::uint32_t>(packet, 198);
  into.pps = packet[202];
  const std::string_view text = as_text(packet.subspan(206));
  into.nmea = text.substr(0, text.find_first_of(std::string_view("\0\r\n", 3)));
  return {};
}

std::span<const Fault> velodyne_pps_states() {
  return kPps;
}

std::unique_ptr<OfflineDecoder> velodyne_offline() {
  return std::make_unique<Offline>();
}

}  // namespace drivers
