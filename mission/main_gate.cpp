#include "mission/main_gate.hpp"

#include <fmt/format.h>

#include <numbers>

namespace mission {

GatedDrive::Config gate_config(const RobotConfig& robot, const RobotDrivers& drivers) {
  GatedDrive::Config config;
  config.gate.speed_max_mps = robot.body.speed_max_mps;
  config.gate.turn_max_radps = robot.body.turn_max_degps * std::numbers::pi / 180;
  config.gate.has_range = robot.obstacles.device != "none";
  config.safety = [&drivers] { return drivers.safety_inputs(); };
  return config;
}

hal::Task<void> arm(GatedDrive& gate) {
  const Answer answer = co_await gate.start();
  if (answer != Answer::not_proven) co_return;
  const FaultEntry& fault = entry_of(FaultCode::drive_no_timeout);
  throw std::runtime_error(
      fmt::format("not armed: {}: {}; do: {}", fault.id, gate.proof(), fault.remedy));
}

}  // namespace mission
