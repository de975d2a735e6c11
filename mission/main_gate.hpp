// The gate of a robot, as its file describes it. Like main.cpp it may know everything.
#pragma once

#include "mission/gated_drive.hpp"
#include "mission/main_robot.hpp"

namespace mission {

// `drivers` must outlive the gate that gets this.
GatedDrive::Config gate_config(const RobotConfig& robot, const RobotDrivers& drivers);

// Begins: may throw std::runtime_error, because the robot must not be driven as it is. When
// something stopped it before, it waits for a person's release, and so will whoever drives.
hal::Task<void> arm(GatedDrive& gate);

}  // namespace mission
