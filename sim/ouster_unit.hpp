// An Ouster OS in the simulated world: real packets of whatever profile its metadata name.
#pragma once

#include <string>

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
  // While the robot moves, beams tell what they told before: nobody may use a scan taken in motion,
  // and to cast all these beams would cost more than the rest of a mission.
  bool blind_in_motion{};
};

// The metadata of an OS-1-32 at 1024 columns, as the sensor serves them.
std::string sample_ouster_metadata();

// Stands where World has the scanner, upright, and sends always. `wrong` sends ranges off by that
// factor, and time stamps that run so much faster.
class OusterUnit {
 public:
  OusterUnit(OusterUnitConfig config, World& world, hal::Clock& clock, DatagramSender& link,
             UnitFaults& faults);
  ~OusterUnit();

  hal::Task<void> run();
  void set_thermal_shutdown(bool on) { packet_.thermal_shutdown = on; }

 private:
  void measure(hal::Time at);

  const OusterUnitConfig config_;
  World& world_;
  hal::Clock& clock_;
  UnitFaults& faults_;
  FaultySender link_;
  drivers::OusterPacket packet_;
  std::vector<Eigen::Vector3d> S_origins_m_, S_directions_;  // Row by row, by measurement.
  std::vector<BeamRay> rays_;
  std::vector<float> ranges_m_;
  double own_ns_ = 1e9;
  std::uint64_t number_{};  // Of packets.
};

}  // namespace sim
