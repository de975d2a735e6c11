// What looks ahead while the robot drives, as its file says.
#pragma once

#include "mission/config.hpp"

namespace mission {

// Whether the scanner of the scans looks ahead too.
inline bool looks_with_scanner(const RobotConfig& robot) {
  return robot.obstacles.device == "scanner";
}

// Above the ground, and ahead of the robot's middle.
inline double look_height_m(const RobotConfig& robot) {
  return looks_with_scanner(robot) ? robot.scanner.height_m : robot.obstacles.height_m;
}
inline double look_offset_x_m(const RobotConfig& robot) {
  return looks_with_scanner(robot) ? 0 : robot.obstacles.offset_x_m;
}

}  // namespace mission
