// A robot in its yard: simulated units, links in memory whose traffic is watched at the drive, and
// the shipped drivers on the other ends.
#pragma once

#include <functional>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "mission/main_robot.hpp"
#include "mission/main_run.hpp"
#include "mission/main_units.hpp"
#include "sim/links.hpp"
#include "sim/scene.hpp"
#include "sim/world.hpp"
#include "tests/dst/rig/scenario.hpp"
#include "tests/support/random_yard.hpp"

namespace dst {

// The yard of a seed, with a robot that has every device there is and a coarse scanner.
support::RandomYard make_yard(std::uint64_t seed);
// The same with nothing in it that the map lacks.
support::RandomYard make_quiet_yard();

// What a mission on it is prepared from.
mission::Prepared prepared(const support::RandomYard& yard);

// The drive unit's end of the bus.
class WatchedBus final : public hal::CanBus {
 public:
  // to_unit: the unit hears it; else it sends it.
  using Watch = std::function<void(const hal::CanFrame& frame, bool to_unit)>;

  explicit WatchedBus(hal::CanBus& bus) : bus_(bus) {}
  void set_watch(Watch watch) { watch_ = std::move(watch); }
  hal::Task<hal::Result<void>> send(hal::CanFrame frame, hal::Time deadline) override;
  hal::Task<hal::Result<hal::ReceivedFrame>> receive() override;

 private:
  hal::CanBus& bus_;
  Watch watch_ = [](const hal::CanFrame&, bool) {};
};

class Rig {
 public:
  // Clock and yard must outlive it. Throws std::runtime_error when the robot cannot stand there.
  Rig(const support::RandomYard& yard, hal::Clock& clock, const hal::Pose2& stands);

  sim::World& world() { return world_; }
  WatchedBus& bus() { return bus_; }
  mission::RobotUnits& units() { return *units_; }
  mission::RobotDrivers& drivers() { return *drivers_; }
  const mission::RobotConfig& config() const { return yard_.config.robot; }

  sim::UnitFaults& faults(std::string_view role) { return *units_->faults(role); }
  void cut_after(std::string_view role, std::uint64_t count);
  void mend(std::string_view role);
  bool is_cut(std::string_view role) const { return cut_.contains(role); }  // Or may be.
  void press(Press what, bool pressed);
  bool pressed() const { return held_down_ != 0; }  // Anything.
  void press_button(bool pressed);

 private:
  void connect(hal::Clock& clock);
  sim::RegisterWire* registers(std::string_view role);

  const support::RandomYard& yard_;
  const sim::Scene scene_;
  sim::World world_;
  sim::CanWire can_;
  sim::StreamWire scanner_, pan_, imu_, gnss_, obstacles_;
  hal::CanBus& drivers_end_;
  WatchedBus bus_;
  std::unique_ptr<mission::RobotUnits> units_;
  std::unique_ptr<sim::RegisterWire> battery_, board_, safety_;
  std::unique_ptr<mission::RobotDrivers> drivers_;
  unsigned held_down_ = 0;  // A bit for each Press.
  std::set<std::string, std::less<>> cut_;
};

}  // namespace dst
