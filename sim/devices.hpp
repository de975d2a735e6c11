// The robot's devices on the simulated world, and their clockwork: 50 Hz travel and yaw rate, 5 Hz
// satellite fixes, scans and set-ups that take their time.
#pragma once

#include "hal/clock.hpp"
#include "hal/devices.hpp"
#include "sim/noise.hpp"
#include "sim/world.hpp"

namespace sim {

// Each waits for the next multiple of its period. Travel is never lost between reports; a sample
// that nobody waited for is never made.
class SimDrive final : public hal::Drive {
 public:
  SimDrive(World& world, hal::Clock& clock) : world_(world), clock_(clock) {}
  hal::Task<hal::Result<void>> command(hal::Twist twist) override;
  hal::Task<hal::Result<hal::WheelTravel>> next_travel() override;

 private:
  World& world_;
  hal::Clock& clock_;
};

class SimImu final : public hal::Imu {
 public:
  SimImu(World& world, hal::Clock& clock) : world_(world), clock_(clock) {}
  hal::Task<hal::Result<hal::ImuSample>> next_sample() override;

 private:
  World& world_;
  hal::Clock& clock_;
};

class SimGnss final : public hal::Gnss {
 public:
  SimGnss(World& world, hal::Clock& clock) : world_(world), clock_(clock) {}
  hal::Task<hal::Result<hal::GnssFix>> next_fix() override;

 private:
  World& world_;
  hal::Clock& clock_;
};

// On the robot, or where it was placed by hand until the robot is commanded to move. Stamps a scan
// with its end. Fails with errc::device_or_resource_busy when the robot moves at the start or moved
// during the scan; World::scans() then has no entry for it.
class SimScanner final : public hal::Scanner {
 public:
  SimScanner(World& world, hal::Clock& clock)
      : world_(world), clock_(clock), pattern_(make_pattern(world.config().scanner)) {}
  hal::Task<hal::Result<hal::ScanCloud>> scan() override;

 private:
  World& world_;
  hal::Clock& clock_;
  const hal::ScanPattern pattern_;
};

// Also fails with errc::invalid_argument for a region that region_ground_z_m does not know (when
// that names any). The time is spent in any case.
class SimPlacement final : public hal::Placement {
 public:
  SimPlacement(World& world, hal::Clock& clock);
  hal::Task<hal::Result<hal::SurveyedPose>> place(std::string_view region,
                                                  hal::Pose2 wanted) override;

 private:
  hal::Result<hal::SurveyedPose> set_up(const std::string& region, const hal::Pose2& wanted);

  World& world_;
  hal::Clock& clock_;
  NoiseStream offset_, survey_;
};

// All of them on one world.
struct Robot {
  Robot(World& world, hal::Clock& clock)
      : drive(world, clock),
        imu(world, clock),
        gnss(world, clock),
        scanner(world, clock),
        placement(world, clock) {}

  hal::Devices devices() { return {drive, imu, gnss, scanner, placement}; }

  SimDrive drive;
  SimImu imu;
  SimGnss gnss;
  SimScanner scanner;
  SimPlacement placement;
};

}  // namespace sim
