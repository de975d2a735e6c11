// The simulated units of a robot on a world, one for each device of its file. Like main.cpp it may
// know everything.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/site_frame.hpp"
#include "hal/clock.hpp"
#include "mission/config.hpp"
#include "mission/main_robot.hpp"
#include "sim/agilex_unit.hpp"
#include "sim/battery.hpp"
#include "sim/cia402_unit.hpp"
#include "sim/flir_ptu_unit.hpp"
#include "sim/gpsd_unit.hpp"
#include "sim/hokuyo_unit.hpp"
#include "sim/links.hpp"
#include "sim/nmea_unit.hpp"
#include "sim/ntrip_unit.hpp"
#include "sim/ouster_unit.hpp"
#include "sim/power_units.hpp"
#include "sim/sick_lms_unit.hpp"
#include "sim/ublox_unit.hpp"
#include "sim/unit_faults.hpp"
#include "sim/velodyne_unit.hpp"
#include "sim/vn100_unit.hpp"
#include "sim/world.hpp"

namespace mission {

// Where simulated sites lie on the earth: somewhere, as long as all agree.
inline constexpr drivers::GeoAnchor kSimAnchor{48.0, 11.0, 500, 0};

// The units' own ends of the links. A link that is null has no unit on it.
struct UnitLinks {
  // An AgileX base uses the first end of the bus, two CiA 402 drives one each.
  hal::CanBus *drive{}, *second_drive{};
  hal::ByteStream *scanner{}, *pan{}, *imu{}, *gnss{}, *obstacles{}, *corrections{};
  sim::DatagramSender* packets{};  // Of a scanner that turns by itself.
  hal::ByteStream* scanner_api{};  // Where that serves its settings.
  std::uint16_t packets_port{};    // Where it says that it sends to; 0: as in the robot file.
};

// Which faults the units have, by role: "drive", "drive2" (the right one of two), "scanner", "pan",
// "obstacles", "imu", "gnss", "battery", "board", "safety", "corrections".
class RobotUnits {
 public:
  RobotUnits(const RobotConfig& config, const drivers::GeoAnchor& anchor, std::uint64_t seed,
             int threads, sim::World& world, hal::Clock& clock, const UnitLinks& links);
  ~RobotUnits();

  // Null for a role that is not there.
  sim::UnitFaults* faults(std::string_view role);
  // Modbus units; null where the robot has none.
  // The drive's; the other one is null.
  sim::AgilexUnit* agilex() { return agilex_ ? &*agilex_ : nullptr; }
  sim::Cia402Unit* cia402() { return cia402_ ? &*cia402_ : nullptr; }
  sim::RegisterUnit* battery() { return victron_ ? &*victron_ : nullptr; }
  sim::RegisterUnit* board() { return board_ ? &*board_ : nullptr; }
  sim::RegisterUnit* safety() { return pilz_ ? &*pilz_ : nullptr; }

  hal::Task<void> run();  // Ends only by cancellation.

 private:
  struct Faulty {
    std::string role;
    std::unique_ptr<sim::UnitFaults> faults;
  };
  sim::UnitFaults& add_faults(std::string role);
  void add_drive(const RobotConfig& config, const UnitLinks& links);
  void add_sweep(const RobotConfig& config, int threads, const UnitLinks& links);
  void add_obstacles(const RobotConfig& config, int threads, const UnitLinks& links);
  void add_turning(const RobotConfig& robot, const UnitLinks& links);
  void add_gnss(const RobotConfig& config, const drivers::GeoAnchor& anchor,
                const UnitLinks& links);
  void add_power(const PowerConfig& config);
  void add_corrections(const CorrectionsConfig& config, const drivers::GeoAnchor& anchor,
                       hal::ByteStream& end);

  const std::uint64_t seed_;
  sim::World& world_;
  hal::Clock& clock_;
  std::vector<Faulty> faults_;
  sim::Battery supply_;
  std::optional<sim::AgilexUnit> agilex_;
  std::optional<sim::Cia402Unit> cia402_;
  const sim::FixedPan level_;
  std::optional<sim::FlirPtuUnit> ptu_;
  std::optional<sim::SickLmsUnit> lms_;
  std::optional<sim::HokuyoUnit> hokuyo_, obstacles_;
  std::optional<sim::VelodyneUnit> velodyne_;
  std::optional<sim::OusterUnit> ouster_;
  std::optional<sim::Vn100Unit> imu_;
  std::optional<sim::UbloxUnit> ublox_;
  std::optional<sim::NmeaUnit> nmea_;
  std::optional<sim::GpsdUnit> gpsd_;
  std::optional<sim::VictronUnit> victron_;
  std::optional<sim::RelayUnit> board_;
  std::optional<sim::PilzUnit> pilz_;
  std::optional<sim::NtripUnit> caster_;
};

// The same on links in memory, with the other ends for the drivers.
class SimulatedRobot {
 public:
  SimulatedRobot(const RobotConfig& config, const drivers::GeoAnchor& anchor, std::uint64_t seed,
                 int threads, sim::World& world, hal::Clock& clock);
  ~SimulatedRobot();

  RobotDrivers& drivers() { return *drivers_; }
  RobotUnits& units() { return *units_; }
  sim::CanWire& can() { return can_; }
  hal::Task<void> run();  // Units and drivers. Ends only by cancellation.

 private:
  sim::CanWire can_;
  sim::StreamWire scanner_, pan_, imu_, gnss_, obstacles_, corrections_, scanner_api_;
  sim::DatagramWire packets_;
  std::unique_ptr<RobotUnits> units_;
  std::vector<std::unique_ptr<sim::RegisterWire>> registers_;
  std::unique_ptr<RobotDrivers> drivers_;
};

}  // namespace mission
