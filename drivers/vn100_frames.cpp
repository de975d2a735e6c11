// The VN-100's frames in the robot's, and its stream for people.
#include <cmath>
#include <numbers>

#include "drivers/offline_stream.hpp"
#include "drivers/vn100_codec.hpp"

namespace drivers {
namespace {

Eigen::Quaterniond to_enu_flu(const Eigen::Quaterniond& q_ned_frd) {
  const double half = std::sqrt(0.5);
  const Eigen::Quaterniond q_enu_ned(0, half, half, 0);  // Swaps x and y, turns z over.
  const Eigen::Quaterniond q_frd_flu(0, 1, 0, 0);        // Half a turn about x.
  return (q_enu_ned * q_ned_frd * q_frd_flu).normalized();
}

class Offline : public OfflineStream {
 public:
  Offline() : OfflineStream(look_vn100, kVn100FrameMax) {}

 private:
  std::string_view say(ByteView frame, Message& message) override {
    Fields fields(message);
    if (frame[0] == '$') return say_line(frame, message);
    message.name = "binary";
    say_sample(fields, decode_vn100_binary(frame));
    return {};
  }

  static std::string_view say_line(ByteView frame, Message& message) {
    const auto line = parse_vn100_line(frame);
    if (!line) return "line of another device";
    message.name = line->type;
    Fields fields(message);
    if (const auto sample = vn100_sample(*line))
      say_sample(fields, *sample);
    else
      for (const std::string& field : line->fields) fields.add("field", field);
    fields.maybe("time_ms", line->time_ms).maybe("status", line->status);
    if (const Fault* fault = vn100_error(*line)) fields.faults(std::array{fault});
    return {};
  }

  static void say_sample(Fields& f, const Vn100Sample& s) {
    f.maybe("startup_ns", s.startup_ns).maybe("sync_in_ns", s.sync_in_ns);
    f.maybe("yaw_pitch_roll_deg", s.yaw_pitch_roll_deg).maybe("quaternion", s.quaternion);
    f.maybe("rate_radps", s.rate_radps).maybe("accel_mps2", s.accel_mps2);
    f.maybe("magnetic_gauss", s.magnetic_gauss).maybe("raw_magnetic_gauss", s.raw_magnetic_gauss);
    f.maybe("raw_accel_mps2", s.raw_accel_mps2).maybe("raw_rate_radps", s.raw_rate_radps);
    f.maybe("temperature_c", s.temperature_c).maybe("pressure_kpa", s.pressure_kpa);
    f.maybe("delta_time_s", s.delta_time_s).maybe("delta_theta_deg", s.delta_theta_deg);
    f.maybe("delta_velocity_mps", s.delta_velocity_mps).maybe("vpe_status", s.vpe_status);
    f.maybe("imu_status", s.imu_status).maybe("saturation", s.saturation);
    f.maybe("sync_in_count", s.sync_in_count).maybe("rotation", s.rotation);
    f.maybe("magnetic_ned_gauss", s.magnetic_ned_gauss).maybe("accel_ned_mps2", s.accel_ned_mps2);
    f.maybe("linear_body_mps2", s.linear_body_mps2).maybe("linear_ned_mps2", s.linear_ned_mps2);
    f.maybe("yaw_pitch_roll_sigma_deg", s.yaw_pitch_roll_sigma_deg);
    if (s.vpe_status) f.faults(vn100_faults(*s.vpe_status));
  }
};

}  // namespace

Eigen::Vector3d vn100_flu(const Vn100Vector& body) {
  return {body[0], -body[1], -body[2]};
}
Eigen::Vector3d vn100_enu(const Vn100Vector& ned) {
  return {ned[1], ned[0], -ned[2]};
}

Eigen::Quaterniond vn100_orientation(const Vn100Vector& yaw_pitch_roll_deg) {
  constexpr double kDegree = std::numbers::pi / 180;
  using Eigen::AngleAxisd, Eigen::Vector3d;
  return to_enu_flu(AngleAxisd(yaw_pitch_roll_deg[0] * kDegree, Vector3d::UnitZ()) *
                    AngleAxisd(yaw_pitch_roll_deg[1] * kDegree, Vector3d::UnitY()) *
                    AngleAxisd(yaw_pitch_roll_deg[2] * kDegree, Vector3d::UnitX()));
}

Eigen::Quaterniond vn100_orientation(const std::array<float, 4>& q) {
  return to_enu_flu(Eigen::Quaterniond(q[3], q[0], q[1], q[2]));
}

double vn100_heading_rad(double yaw_deg) {
  const double heading = std::remainder(90 - yaw_deg, 360.0) * (std::numbers::pi / 180);
  return heading <= -std::numbers::pi ? std::numbers::pi : heading;
}

std::unique_ptr<OfflineDecoder> vn100_offline() {
  return std::make_unique<Offline>();
}

}  // namespace drivers
