// A Velodyne VLP-16 in the simulated world: real packets of single returns.
#pragma once

#include <numbers>

#include "drivers/velodyne_codec.hpp"
#include "hal/clock.hpp"
#include "sim/links.hpp"
#include "sim/ray_bundle.hpp"
#include "sim/unit_faults.hpp"
#include "sim/world.hpp"

namespace sim {

struct VelodyneUnitConfig {
  double turns_per_s = 10;
  double skew = 20e-6;  // Of its crystal: seconds of its own per ours, less 1.
  std::uint32_t clock_start_us = 0;
  std::uint8_t product = 0x22;
  ScannerModel ranges;  // Of it the ranges, their noise and the losses count.
  std::uint64_t seed = 1;
  // While the robot moves, beams above this elevation tell what they told before: nobody may use a
  // scan taken in motion, and to cast all these beams would cost more than the rest of a mission.
  double in_motion_max_rad = std::numbers::pi / 2;
};

// Stands where World has the scanner, upright, and sends always: 754 packets a second. `wrong`
// sends distances off by that factor, and time stamps that run so much faster.
class VelodyneUnit {
 public:
  VelodyneUnit(VelodyneUnitConfig config, World& world, hal::Clock& clock, DatagramSender& link,
               UnitFaults& faults);
  ~VelodyneUnit();

  hal::Task<void> run();

 private:
  void measure(hal::Time at);

  const VelodyneUnitConfig config_;
  World& world_;
  hal::Clock& clock_;
  UnitFaults& faults_;
  FaultySender link_;
  drivers::VelodynePacket packet_;
  std::vector<BeamRay> rays_;      // Of the beams that are cast:
  std::vector<std::size_t> cast_;  // which these are, as they stand in the packet.
  std::vector<float> ranges_m_;
  double turned_{};  // Turns since the start.
  double own_us_{};
  std::uint64_t number_{};
};

}  // namespace sim
