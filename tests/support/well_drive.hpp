// A drive that is no device: for what the gate itself does.
#pragma once

#include "hal/clock.hpp"
#include "hal/devices.hpp"

namespace test {

// Always well, and goes nowhere: what is late or allocates is the gate's.
class WellDrive final : public hal::GuardedDrive {
 public:
  explicit WellDrive(hal::Clock& clock) : clock_(clock) {}
  hal::Task<hal::Result<void>> command(hal::Twist) override { co_return hal::Result<void>{}; }
  hal::Task<hal::Result<hal::WheelTravel>> next_travel() override {
    co_await clock_.sleep_for(std::chrono::hours(1));
    co_return hal::WheelTravel{};
  }
  hal::DriveStatus status() const override {
    hal::DriveStatus status;
    status.reported_at = clock_.now();
    status.silent = status.held = false;
    return status;
  }
  hal::Task<hal::Result<hal::Duration>> prove_timeout() override {
    co_return hal::Duration(std::chrono::milliseconds(500));
  }

 private:
  hal::Clock& clock_;
};

}  // namespace test
