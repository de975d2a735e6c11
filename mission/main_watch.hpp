// A robot's devices for a mission that outlives their losses: while one of them is not there the
// robot stands, says why, and waits for a while. Like main.cpp it may know everything.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "hal/wake.hpp"
#include "mission/gated_drive.hpp"
#include "mission/main_robot.hpp"

namespace mission {

// What a mission is heard to do: until the next one it may be silent for as long as that takes.
enum class MissionStep {
  goes_on,  // It commanded the drive, or has a scan.
  scans,
  waits,  // For a device, which is bounded, or for a person, who may never come.
};

class DeviceWatch {
 public:
  struct Config {
    // For one loss, or for those that follow each other within 5 s; then run() ends.
    hal::Duration patience = std::chrono::seconds(60);
    // What is wrong with the link of a role (see NamedDevice); it explains what is wrong behind it.
    std::function<std::vector<drivers::Trouble>(std::string_view role)> link_troubles;
    std::function<void(const std::string&)> tell;  // What happens, as it happens.
    std::function<bool()> held;  // A person holds the robot: patience begins when they let it go.
    std::function<void(MissionStep)> step;  // What the mission does with its devices. May be empty.
  };
  // The drivers and the clock must outlive it.
  DeviceWatch(Config config, const RobotDrivers& drivers, hal::Clock& clock);

  // Looks at all devices, often. Ends when one has been away for longer than `patience`;
  // given_up() then says which, and why.
  hal::Task<void> run();
  const std::string& given_up() const { return given_up_; }

  // A fault of a device that runs, and for which the robot stands until it is over; the gravest.
  // Nothing: there is none. Does not allocate.
  std::optional<FaultCode> hold_fault() const { return hold_fault_; }

  // All devices run, as far as was seen; and until they do.
  bool well() const { return well_; }
  hal::Task<void> until_well();
  void look();
  void step(MissionStep step) const;

  // "imu (vn100 at serial:/dev/ttyUSB1@115200): ...; do: ...", one after the other.
  std::string what_is_missing() const;
  // Says it, and keeps it for the report.
  void note(std::string what);
  const std::vector<std::string>& notes() const { return notes_; }  // At most kNotesMax.
  static constexpr std::size_t kNotesMax = 200;                     // Later ones are only said.

 private:
  std::string missing_names() const;
  void look_for_holds();
  bool held() const;

  const Config config_;
  const RobotDrivers& drivers_;
  hal::Clock& clock_;
  hal::Wake back_;
  bool well_ = true;
  hal::Time lost_at_{};
  std::optional<FaultCode> hold_fault_;
  std::optional<hal::Time> back_at_;
  std::string told_, given_up_;
  std::vector<std::string> notes_;
};

// What the mission gets instead of the drivers themselves. No call fails for a device that was
// lost: it waits until all are well again, or is cancelled when the watch gives up.
class WatchedDrive final : public hal::Drive {
 public:
  WatchedDrive(GatedDrive& drive, DeviceWatch& watch, hal::Clock& clock)
      : drive_(drive), watch_(watch), clock_(clock) {}
  // Waits, too, for a person to release a robot that was stopped, however long that takes. After a
  // wait the command counts as given and the robot stands: whoever drives looks again from where it
  // is now. A fault that holds the robot for longer than 10 min fails with
  // errc::operation_not_permitted.
  hal::Task<hal::Result<void>> command(hal::Twist twist) override;
  hal::Task<hal::Result<hal::WheelTravel>> next_travel() override;

 private:
  GatedDrive& drive_;
  DeviceWatch& watch_;
  hal::Clock& clock_;
};

class WatchedImu final : public hal::Imu {
 public:
  WatchedImu(hal::Imu& imu, DeviceWatch& watch, hal::Clock& clock)
      : imu_(imu), watch_(watch), clock_(clock) {}
  hal::Task<hal::Result<hal::ImuSample>> next_sample() override;

 private:
  hal::Imu& imu_;
  DeviceWatch& watch_;
  hal::Clock& clock_;
};

class WatchedGnss final : public hal::Gnss {
 public:
  WatchedGnss(hal::Gnss& gnss, DeviceWatch& watch, hal::Clock& clock)
      : gnss_(gnss), watch_(watch), clock_(clock) {}
  hal::Task<hal::Result<hal::GnssFix>> next_fix() override;

 private:
  hal::Gnss& gnss_;
  DeviceWatch& watch_;
  hal::Clock& clock_;
};

// Scans when every device is there and the robot does not creep for a proof. Says why a scan
// failed, and returns when a loss that made it fail has shown: taking it again is the survey's.
class WatchedScanner final : public hal::Scanner {
 public:
  WatchedScanner(RobotDrivers& drivers, const GatedDrive& gate, DeviceWatch& watch,
                 hal::Clock& clock)
      : drivers_(drivers), gate_(gate), watch_(watch), clock_(clock) {}
  hal::Task<hal::Result<hal::ScanCloud>> scan() override;
  // A scan is being taken just now.
  bool scanning() const { return scanning_; }

 private:
  hal::Task<hal::Result<hal::ScanCloud>> scan_now();

  RobotDrivers& drivers_;
  const GatedDrive& gate_;
  DeviceWatch& watch_;
  hal::Clock& clock_;
  bool scanning_ = false;
};

// A robot on its own has nobody to carry its scanner: errc::operation_not_supported.
class NobodyToPlace final : public hal::Placement {
 public:
  hal::Task<hal::Result<hal::SurveyedPose>> place(std::string_view region,
                                                  hal::Pose2 wanted) override;
};

}  // namespace mission
