// Keeps the truth about scans of a simulated mission: where each one really was taken.
#pragma once

#include "hal/clock.hpp"
#include "hal/devices.hpp"
#include "sim/world.hpp"

namespace sim {

// Passes scans through and records the true pose of each that succeeds in World::scans(). Fails
// with errc::device_or_resource_busy, recording nothing, when the robot moves at the start or moved
// during the scan: such a scan would be a lie.
class WitnessedScanner final : public hal::Scanner {
 public:
  WitnessedScanner(hal::Scanner& scanner, World& world, hal::Clock& clock)
      : scanner_(scanner), world_(world), clock_(clock) {}
  hal::Task<hal::Result<hal::ScanCloud>> scan() override;

 private:
  hal::Scanner& scanner_;
  World& world_;
  hal::Clock& clock_;
};

}  // namespace sim
