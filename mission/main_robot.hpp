// The drivers of a robot, as its file names them, on links that somebody else opens. Like main.cpp
// it may know everything.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/device.hpp"
#include "drivers/gnss_output.hpp"
#include "drivers/ouster.hpp"
#include "drivers/port_search.hpp"
#include "drivers/power_io.hpp"
#include "drivers/site_frame.hpp"
#include "drivers/sweep_scanner.hpp"
#include "hal/clock.hpp"
#include "hal/devices.hpp"
#include "mission/account.hpp"
#include "mission/config.hpp"

namespace mission {

// One device of the robot file.
struct NamedDevice {
  std::string role;  // The table of the robot file: "drive", "scanner".
  std::string link;  // As written there.
  drivers::Device* device{};
};

// What the table of faults calls that role.
constexpr std::string_view fault_role(std::string_view named) {
  if (named == "corrections") return "gnss";
  return named == "obstacles" ? "scanner" : named;
}

// What is wrong with the robot file that only the drivers can tell: settings that no such device
// has. Empty: nothing.
std::vector<ConfigError> robot_problems(const MissionConfig& config);

// What the drive's driver needs to hear of its bus (hal::passes).
std::vector<hal::CanFilter> drive_filters(const DriveConfig& drive);

class RobotDrivers {
 public:
  struct Links {
    hal::CanBus* drive{};
    hal::ByteStream *scanner{}, *pan{}, *imu{}, *gnss{};
    // Of a pan unit on a serial port.
    std::optional<drivers::SettableLine> pan_line{};
    hal::ByteStream* obstacles{};    // Null where the robot has none.
    hal::ByteStream* scanner_api{};  // Where an Ouster serves its settings; null: nowhere.
    std::function<void()> drop_scanner_api{};
    std::function<std::string()> own_address{};  // As it sees this computer.
    hal::ByteStream* corrections{};              // Likewise.
    std::function<void()> drop_corrections{};    // Ends that connection, to be made anew.
    Account account{};                           // Of their caster.
    hal::Datagrams* packets{};      // Of a scanner that sends them: then no other scanner and pan.
    drivers::PowerIo::Links power;  // Null where the robot has none.
  };

  // The configuration must have no problems; clock and links must outlive it. Without an anchor no
  // fix is too far away.
  RobotDrivers(const RobotConfig& config, const std::optional<drivers::GeoAnchor>& anchor,
               hal::Clock& clock, const Links& links);
  ~RobotDrivers();

  hal::GuardedDrive& drive() { return *drive_; }
  hal::Imu& imu() { return *imu_; }
  hal::Gnss& gnss() { return *gnss_; }
  hal::Scanner& scanner() { return *scanner_; }
  hal::ProfileScanner* obstacles() { return obstacles_; }  // Null: none.

  // See drivers::PowerIo::inputs_now(); nothing where the robot has none.
  std::optional<hal::SafetyInputs> safety_inputs() const;

  const std::vector<NamedDevice>& devices() const { return devices_; }

  // All loops. Ends only by cancellation.
  hal::Task<void> run();
  // Ends when every device runs; fails with errc::timed_out when one does not after that long:
  // not_running() says which, and why.
  hal::Task<hal::Result<void>> started(hal::Duration patience);
  std::string not_running() const;
  // Before the program ends: the robot stands, and the drive is given back.
  hal::Task<void> release() { return release_drive_(); }
  // All that is wrong now, with the remedies; empty: nothing.
  std::string complaints() const;
  // Why the last scan was not good enough; empty: it was, or there was none.
  const std::string& scan_problem() const { return scan_problem_(); }

 private:
  void add_drive(const RobotConfig& config, const Links& links);
  void add_scanner(const RobotConfig& config, const Links& links);
  static drivers::OusterApi ouster_api(const RobotConfig& config, const Links& links);
  void add_sweep(const RobotConfig& config, const Links& links, hal::ProfileScanner& profiles,
                 std::function<double()> clock_jitter_s);
  template <class T>
  void add_turning(const RobotConfig& config, std::unique_ptr<T> scanner);
  void add_gnss(const RobotConfig& config, const std::optional<drivers::GeoAnchor>& anchor,
                const Links& links);
  void add_ublox(const RobotConfig& config, const drivers::GnssOutputConfig& output,
                 const Links& links);
  void add_obstacles(const RobotConfig& config, const Links& links);
  void add_power(const RobotConfig& config, const Links& links);
  template <class T>
  T& own(std::string role, std::string link, std::unique_ptr<T> device);
  std::string told(const std::function<bool(const drivers::Device&)>& of) const;

  hal::Clock& clock_;
  std::vector<std::unique_ptr<drivers::Device>> owned_;
  std::vector<NamedDevice> devices_;
  hal::GuardedDrive* drive_{};
  drivers::PowerIo* power_{};
  std::function<hal::Task<void>()> release_drive_;
  hal::Imu* imu_{};
  hal::Gnss* gnss_{};
  std::unique_ptr<drivers::SweepScanner> sweep_;
  hal::Scanner* scanner_{};
  hal::ProfileScanner* obstacles_{};
  std::function<const std::string&()> scan_problem_;
};

}  // namespace mission
