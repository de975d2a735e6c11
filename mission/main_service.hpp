// vantaged as a service: what its manager hears of it (sd_notify), what the journal keeps, and what
// the next start must know of this one. Like main.cpp it may know everything.
#pragma once

#include <boost/asio/io_context.hpp>
#include <filesystem>
#include <string>
#include <string_view>
#include <thread>

#include "drivers/real_clock.hpp"
#include "mission/boot_mark.hpp"
#include "mission/heartbeat.hpp"
#include "mission/progress.hpp"
#include "mission/watchdog_feeder.hpp"

namespace mission {

// What must go on in a mission on hardware, each for as long as it may be silent.
struct MissionTasks {
  explicit MissionTasks(Heartbeat& heartbeat);
  Heartbeat::Task event_loop, gate_cycle, survey, computation, products;
};

class Service {
 public:
  // `state` is a folder that outlasts the program ($STATE_DIRECTORY): reads there how the last run
  // ended, and notes that this one goes on. Throws boost::system::system_error when it cannot.
  explicit Service(std::filesystem::path state);
  Service(const Service&) = delete;
  Service& operator=(const Service&) = delete;
  ~Service();

  Boot boot() const { return boot_; }
  // The last run left the robot stopped: starting anew is no release of it.
  bool left_held() const { return left_held_; }
  // This run ended in order; `held`: and the robot stands stopped. Notes what was ordered of the
  // next start. Throws as the constructor does.
  void ended(bool held);

  // As an operator ordered it in the program's last run, or in this one of the next.
  NextStart this_start() const { return this_start_; }
  NextStart next_start() const { return next_start_; }
  void start_again(NextStart next) { next_start_ = next; }  // The program then has to end.

  // To the service manager, if there is one. From any thread.
  void ready();
  void status(std::string_view line);
  void reloading();
  void stopping();
  // For the journal, where standard error leads there, else on standard error; and what the status
  // says until there is something newer. From any thread.
  void log(std::string_view text);

  // Whoever must go on; from watch() on the manager's watchdog is fed only while all do.
  Heartbeat& heartbeat() { return heartbeat_; }
  const MissionTasks& tasks() const { return tasks_; }
  hal::Clock& clock() { return clock_; }
  void watch();

  // What is permitted of it; says what is not, and how much memory there is.
  void prepare_for_real_time();
  void log_memory(std::string_view when);

 private:
  void mark(BootMark::State state);
  void hangs(const Heartbeat::Late& late);

  const std::filesystem::path state_;
  const std::string boot_id_;
  const bool to_journal_;
  Boot boot_ = Boot::power_cut;
  bool left_held_ = false;
  NextStart this_start_ = NextStart::as_usual, next_start_ = NextStart::as_usual;
  drivers::RealClock clock_;
  Heartbeat heartbeat_;
  const MissionTasks tasks_{heartbeat_};
  std::optional<WatchdogFeeder> feeder_;
  boost::asio::io_context feeders_;
  std::thread thread_;
};

// What the survey shows of its progress goes to the service's status and log.
class ServiceProgress final : public ProgressPrinter {
 public:
  explicit ServiceProgress(Service& service);
  void show(const Progress& progress) override;
  void message(std::string_view text) override;

 private:
  Service& service_;
  std::string shown_;
};

// FOLDER/0001, FOLDER/0002, ...: the last that is there (empty: none), and the first after all.
std::filesystem::path last_run_folder(const std::filesystem::path& folder);
std::filesystem::path next_run_folder(const std::filesystem::path& folder);

}  // namespace mission
