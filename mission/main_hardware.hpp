// A mission in real time on real devices. Like main.cpp it may know everything.
#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/cancellation_signal.hpp>
#include <optional>
#include <string>

#include "mission/main_gate.hpp"
#include "mission/main_links.hpp"
#include "mission/main_run.hpp"
#include "mission/main_watch.hpp"

namespace mission {

// A survey from the start of the devices to giving back the drive. Knows nothing of what is behind
// the links: tests put simulated units there.
class GuardedSurvey {
 public:
  struct Config {
    // For all devices to start: some are switched on five minutes after the computer.
    hal::Duration start_patience = std::chrono::seconds(330);
    DeviceWatch::Config watch;
    std::string how_to_release = "press the reset button";
    Boot boot = Boot::clean;
    bool starts_held = false;             // See GatedDrive::Config.
    std::function<void()> gate_is_alive;  // The same.
  };
  struct Parts {
    boost::asio::any_io_executor executor;
    hal::Clock& clock;
    RobotDrivers& drivers;
    RunStore& store;
    ProgressPrinter& progress;
    hal::Compute& compute;
    Journal* journal = nullptr;  // As Survey::Parts.
    const RunHistory* past = nullptr;
    std::vector<std::string> skip = {};
  };
  // Everything must outlive it.
  GuardedSurvey(const Prepared& prepared, int threads, Config config, Parts parts);

  // Begins; the event loop then carries it out until ended(). Once.
  void start();
  // Ends it early: the drive is told to stand at once, what is being computed is waited for, then
  // the drive is given back.
  void stop(std::string reason);
  bool ended() const { return released_ && devices_over_; }

  Survey& survey() { return survey_; }
  DeviceWatch& watch() { return watch_; }
  GatedDrive& gate() { return gate_; }
  bool scanning() const { return scanner_.scanning(); }
  const std::string& failure() const { return failure_; }  // Why it ended early; else empty.
  const std::string& stop_reason() const { return stop_reason_; }  // As given to stop().
  bool left_held() const { return left_held_; }  // It ended while a release was wanted.

 private:
  std::string complaints();
  DeviceWatch::Config watched(DeviceWatch::Config config);
  GatedDrive::Config gated(const RobotConfig& robot);
  hal::Task<void> run();
  hal::Task<void> run_devices();
  hal::Task<void> start_devices();
  hal::Task<void> watch_it();
  void on_run_end(std::exception_ptr error);
  void on_released(std::exception_ptr error);
  void on_devices_end(std::exception_ptr error);

  const Config config_;
  Parts parts_;
  DeviceWatch watch_;
  GatedDrive gate_;
  WatchedDrive drive_;
  WatchedImu imu_;
  WatchedGnss gnss_;
  WatchedScanner scanner_;
  NobodyToPlace placement_;
  hal::Devices devices_;
  Survey survey_;
  boost::asio::cancellation_signal cancel_run_, cancel_devices_;
  bool surveying_ = false, released_ = false, devices_over_ = false, left_held_ = false;
  std::string failure_, stop_reason_;
};

// Runs the whole mission on the devices that the robot file's links lead to, and writes its
// products. SIGUSR1 is a person's release of a robot that was stopped. SIGINT and SIGTERM stop it;
// one more than a second later ends the program at once (the drive then stands by its own
// time-out). Throws boost::system::system_error when the folder cannot be written.
RunOutcome run_on_hardware(Prepared& prepared, const RunOptions& options);

}  // namespace mission
