#include <utility>

#include "drivers/offline_fields.hpp"
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

class Offline : public OfflineDecoder {
 public:
  explicit Offline(OusterMetadata metadata) : metadata_(std::move(metadata)) {}

  void feed(const Captured& captured, const std::function<void(Message)>& out) override {
    OusterImu imu;
    Message message{"lidar packet", captured.t_s, captured.from_device, {}};
    Fields fields(message);
    const auto why = decode_ouster(captured.bytes, metadata_, packet_);
    if (why.empty()) {
      add_packet(fields, packet_, metadata_.profile == OusterProfile::legacy);
    } else if (decode_ouster_imu(captured.bytes, imu).empty()) {
      message.name = "IMU packet";
      fields.add("accel_ns", imu.accel_ns).add("gyro_ns", imu.gyro_ns);
      fields.add("accel_g", imu.accel_g).add("gyro_degps", imu.gyro_degps);
    } else {
      Skipped& skipped = skipped_[std::string(why)];
      ++skipped.times;
      skipped.bytes += captured.bytes.size();
      return;
    }
    out(std::move(message));
  }
  SkippedBy skipped() const override { return skipped_; }

 private:
  OusterMetadata metadata_;
  OusterPacket packet_;
  SkippedBy skipped_;
};

}  // namespace

std::unique_ptr<OfflineDecoder> ouster_offline(OusterMetadata metadata) {
  return std::make_unique<Offline>(std::move(metadata));
}

}  // namespace drivers
