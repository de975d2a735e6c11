// A person who carries the scanner: where no robot can drive, it is set up by hand.
#pragma once

#include "hal/clock.hpp"
#include "hal/devices.hpp"
#include "sim/noise.hpp"
#include "sim/world.hpp"

namespace sim {

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

}  // namespace sim
