// Devices without drivers, links and units between them and the simulated world: for tests of what
// is above the devices.
#pragma once

#include "hal/clock.hpp"
#include "hal/devices.hpp"
#include "sim/placement.hpp"
#include "sim/world.hpp"

namespace direct {

inline hal::Time next_multiple(hal::Time now, hal::Duration period) {
  return hal::Time((now.time_since_epoch() / period + 1) * period);
}

class Drive final : public hal::Drive {
 public:
  Drive(sim::World& world, hal::Clock& clock) : world_(world), clock_(clock) {}

  hal::Task<hal::Result<void>> command(hal::Twist twist) override {
    world_.advance(clock_.now());
    co_return world_.command(twist);
  }
  hal::Task<hal::Result<hal::WheelTravel>> next_travel() override {
    co_await clock_.sleep_until(next_multiple(clock_.now(), std::chrono::milliseconds(20)));
    world_.advance(clock_.now());
    co_return world_.take_travel();
  }

 private:
  sim::World& world_;
  hal::Clock& clock_;
};

class Imu final : public hal::Imu {
 public:
  Imu(sim::World& world, hal::Clock& clock) : world_(world), clock_(clock) {}

  hal::Task<hal::Result<hal::ImuSample>> next_sample() override {
    co_await clock_.sleep_until(next_multiple(clock_.now(), std::chrono::milliseconds(20)));
    world_.advance(clock_.now());
    co_return world_.sample_imu();
  }

 private:
  sim::World& world_;
  hal::Clock& clock_;
};

class Gnss final : public hal::Gnss {
 public:
  Gnss(sim::World& world, hal::Clock& clock) : world_(world), clock_(clock) {}

  hal::Task<hal::Result<hal::GnssFix>> next_fix() override {
    co_await clock_.sleep_until(next_multiple(clock_.now(), std::chrono::milliseconds(200)));
    world_.advance(clock_.now());
    co_return world_.sample_gnss();
  }

 private:
  sim::World& world_;
  hal::Clock& clock_;
};

// Casts the whole pattern at once, where the scanner stands when the time of a scan is over.
class Scanner final : public hal::Scanner {
 public:
  Scanner(sim::World& world, hal::Clock& clock)
      : world_(world), clock_(clock), pattern_(sim::make_pattern(world.config().scanner)) {}

  hal::Task<hal::Result<hal::ScanCloud>> scan() override {
    const sim::WorldConfig& config = world_.config();
    co_await clock_.sleep_for(hal::from_seconds(config.scanner.scan_s));
    world_.advance(clock_.now());
    const sim::StandingPose at = world_.placed_scanner().value_or(world_.robot());
    hal::ScanCloud cloud{clock_.now(), pattern_, {}};
    cloud.ranges_m =
        sim::cast_scan(world_.scene(), at.T_W_S(config.scanner.height_m), pattern_, config.scanner,
                       config.seed, world_.next_scan_number(), config.threads);
    co_return cloud;
  }

 private:
  sim::World& world_;
  hal::Clock& clock_;
  const hal::ScanPattern pattern_;
};

// Looks level all round but for a quarter behind, ten times a second.
class Obstacles final : public hal::ProfileScanner {
 public:
  Obstacles(sim::World& world, hal::Clock& clock) : world_(world), clock_(clock) {}

  hal::Task<hal::Result<void>> start() override {
    on_ = !broken;
    co_return hal::Result<void>{};
  }
  hal::Task<hal::Result<void>> stop() override {
    on_ = false;
    co_return hal::Result<void>{};
  }
  hal::Task<hal::Result<hal::Profile>> next_profile() override {
    co_await clock_.sleep_until(next_multiple(clock_.now(), std::chrono::milliseconds(100)));
    if (!on_ || broken)
      co_return boost::system::errc::make_error_code(boost::system::errc::operation_not_permitted);
    world_.advance(clock_.now());
    co_return look();
  }
  bool broken = false;

 private:
  static constexpr int kBeams = 271;
  static constexpr double kHeightM = 0.3, kReachM = 10;

  hal::Profile look() const;

  sim::World& world_;
  hal::Clock& clock_;
  bool on_ = false;
};

struct Robot {
  Robot(sim::World& world, hal::Clock& clock)
      : drive(world, clock),
        imu(world, clock),
        gnss(world, clock),
        scanner(world, clock),
        placement(world, clock),
        obstacles(world, clock) {}

  hal::Devices devices() { return {drive, imu, gnss, scanner, placement}; }
  // The same for a robot that sees what is in its way.
  hal::Devices seeing_devices() { return {drive, imu, gnss, scanner, placement, {}, &obstacles}; }

  Drive drive;
  Imu imu;
  Gnss gnss;
  Scanner scanner;
  sim::SimPlacement placement;
  Obstacles obstacles;
};

}  // namespace direct
