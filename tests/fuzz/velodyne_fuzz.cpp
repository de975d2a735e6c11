// A data or telemetry packet, made as long as one so that more than its length is tried.
#include "drivers/velodyne_codec.hpp"
#include "tests/fuzz/stream_fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace drivers;
  drivers_fuzz::check_offline(*velodyne_offline(), ByteView(data, size));
  Bytes packet(data, data + size);
  packet.resize(size <= 512 ? 512 : 1206);
  drivers_fuzz::check_offline(*velodyne_offline(), packet);
  VelodynePacket decoded;
  if (!decode_velodyne(packet, decoded).empty()) return 0;
  for (const VelodynePoint& point : decoded.points) {
    drivers_fuzz::require(point.azimuth_deg >= 0 && point.azimuth_deg <= 360);
    drivers_fuzz::require(velodyne_point_m(point).allFinite());
  }
  return 0;
}
