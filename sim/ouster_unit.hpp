// An Ouster OS in the simulated world: real packets of whatever profile its metadata name.
#pragma once

#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "drivers/ouster_api.hpp"
#include "drivers/ouster_codec.hpp"
#include "hal/clock.hpp"
#include "sim/links.hpp"
#include "sim/ray_bundle.hpp"
#include "sim/unit_faults.hpp"
#include "sim/world.hpp"

namespace sim {

struct OusterUnitConfig {
  drivers::OusterMetadata metadata;
  double turns_per_s = 10;
  double skew = 20e-6;  // Of its crystal: seconds of its own per ours, less 1.
  ScannerModel ranges;  // Of it the ranges, their noise and the losses count.
  std::uint64_t seed = 1;
  // While the robot moves, beams above this elevation tell what they told before: nobody may use a
  // scan taken in motion, and to cast all these beams would cost more than the rest of a mission.
  double in_motion_max_rad = std::numbers::pi / 2;
  // What it serves over HTTP; metadata_text empty: sample_ouster_metadata().
  std::string metadata_text;
  drivers::OusterSettings settings{"255.255.255.255", 7502, "NORMAL"};
};

// The metadata of an OS-1-32 at 1024 columns, as the sensor serves them.
std::string sample_ouster_metadata();

// Stands where World has the scanner, upright, and sends always. `wrong` sends ranges off by that
// factor, and time stamps that run so much faster.
class OusterUnit {
 public:
  // `http`: where it is asked for its settings; null: nowhere.
  OusterUnit(OusterUnitConfig config, World& world, hal::Clock& clock, DatagramSender& link,
             UnitFaults& faults, hal::ByteStream* http = nullptr);
  ~OusterUnit();

  hal::Task<void> run();
  void set_thermal_shutdown(bool on) { packet_.thermal_shutdown = on; }
  drivers::OusterSettings& settings() { return settings_; }
  std::vector<drivers::OusterAlert>& alerts() { return alerts_; }
  void serve_metadata(std::string text) { metadata_text_ = std::move(text); }  // Empty: 404.

 private:
  void measure(hal::Time at);
  hal::Task<void> send_packets();
  hal::Task<void> serve();
  std::string answer_to(const std::string& path) const;

  const OusterUnitConfig config_;
  World& world_;
  hal::Clock& clock_;
  UnitFaults& faults_;
  FaultySender link_;
  std::optional<FaultyStream> http_;
  std::string metadata_text_;
  drivers::OusterSettings settings_;
  std::vector<drivers::OusterAlert> alerts_;
  drivers::OusterPacket packet_;
  std::vector<Eigen::Vector3d> S_origins_m_, S_directions_;  // Row by row, by measurement.
  std::vector<BeamRay> rays_;                                // Of the beams that are cast:
  std::vector<std::size_t> cast_;  // which these are, as they stand in the packet.
  std::vector<float> ranges_m_;
  double own_ns_ = 1e9;
  std::uint64_t number_{};  // Of packets.
};

}  // namespace sim
