#include <utility>

#include "drivers/offline_stream.hpp"
#include "drivers/ouster_codec.hpp"

namespace drivers {
namespace {

void add_packet(Fields& fields, const OusterPacket& packet, bool legacy) {
  std::vector<std::uint64_t> ids, times, encoders;
  for (const OusterColumn& column : packet.columns) {
    ids.push_back(column.measurement_id);
    times.push_back(column.timestamp_ns);
    encoders.push_back(column.encoder);
  }
  fields.add("frame_id", packet.frame_id).add("measurement_id", ids);
  fields.add("first_timestamp_ns", times.front()).add("last_timestamp_ns", times.back());
  if (legacy)
    fields.add("encoder", encoders);
  else
    fields.add("init_id", packet.init_id).add("serial_number", packet.serial_number);
  for (std::size_t i = 0; i < 2; ++i) {
    const OusterReturn& values = packet.returns[i];
    if (values.range_mm.empty()) continue;
    const std::string suffix = i == 0 ? "" : "_2";
    fields.add("range_mm" + suffix, values.range_mm)
        .add("flags" + suffix, values.flags)
        .add("reflectivity" + suffix, values.reflectivity)
        .add("signal" + suffix, values.signal);
  }
  fields.add("near_ir", packet.near_ir).faults(ouster_faults(packet));
}

class Offline : public OfflineDatagrams {
 public:
  explicit Offline(OusterMetadata metadata) : metadata_(std::move(metadata)) {}

 private:
  std::string_view say(ByteView bytes, Message& message) override {
    Fields fields(message);
    OusterImu imu;
    const auto why = decode_ouster(bytes, metadata_, packet_);
    if (why.empty()) {
      message.name = "lidar packet";
      add_packet(fields, packet_, metadata_.profile == OusterProfile::legacy);
      return {};
    }
    if (!decode_ouster_imu(bytes, imu).empty()) return why;
    message.name = "IMU packet";
    fields.add("accel_ns", imu.accel_ns).add("gyro_ns", imu.gyro_ns);
    fields.add("accel_g", imu.accel_g).add("gyro_degps", imu.gyro_degps);
    return {};
  }

  OusterMetadata metadata_;
  OusterPacket packet_;
};

}  // namespace

std::unique_ptr<OfflineDecoder> ouster_offline(OusterMetadata metadata) {
  return std::make_unique<Offline>(std::move(metadata));
}

}  // namespace drivers
