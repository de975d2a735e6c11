// What a mission knows and the gate cannot see by itself. Values only.
#pragma once

#include <limits>
#include <optional>

#include "hal/values.hpp"
#include "mission/faults.hpp"

namespace mission {

struct Surroundings {
  bool pose_uncertain = false;          // Worse than the mission's limit.
  bool battery_reserve = false;         // What is left is for the way home; or it must do so now.
  std::optional<FaultCode> hold_fault;  // One of a device whose action is Action::hold.
  // When the range source at work spoke last, or was set to work; nothing: none is at work.
  std::optional<hal::Time> range_at;
  // How fast one may be where the robot stands; not a number: nobody knows. Of missions only: an
  // operator sees where they drive.
  double zone_speed_max_mps = std::numeric_limits<double>::infinity();
};

}  // namespace mission
