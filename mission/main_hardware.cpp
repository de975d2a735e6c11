#include "mission/main_hardware.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <boost/asio/bind_cancellation_slot.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <csignal>
#include <ostream>

#include "drivers/real_clock.hpp"
#include "hal/together.hpp"
#include "mission/main_console.hpp"
#include "mission/main_serving.hpp"
#include "mission/main_worker.hpp"

namespace mission {
namespace {

namespace asio = boost::asio;

constexpr hal::Duration kSayWaiting = std::chrono::seconds(5);
constexpr hal::Duration kSettle = std::chrono::seconds(1);
constexpr hal::Duration kRelease = std::chrono::seconds(3);  // For a drive that may be gone.
constexpr hal::Duration kMeantOnce = std::chrono::seconds(1);

std::string text_of(std::exception_ptr error) {
  try {
    if (error) std::rethrow_exception(error);
  } catch (const std::exception& e) {
    return e.what();
  }
  return "";
}

hal::Task<void> release_within(RobotDrivers& drivers, hal::Clock& clock) {
  co_await hal::first_of(drivers.release(), clock.sleep_for(kRelease));
}

std::string placed_by_hand(const SiteTasks& tasks) {
  std::string areas;
  for (const AreaTask& task : tasks.tasks)
    if (task.mode == AreaMode::manual) areas += (areas.empty() ? "" : ", ") + task.area.name;
  return areas;
}

// The record's own notes come first.
void note_run(RunRecord& record, const Prepared& prepared, const DeviceWatch& watch) {
  record.repairs = prepared.site.repairs;
  record.notes.insert(record.notes.begin(), prepared.notes.begin(), prepared.notes.end());
  if (const std::string areas = placed_by_hand(prepared.tasks); !areas.empty())
    record.notes.push_back("nobody was there to set up the scanner by hand in: " + areas);
  record.notes.insert(record.notes.end(), watch.notes().begin(), watch.notes().end());
}

// Tells whoever looks at the program, and stops it when told to by a signal.
// One that comes twice at once is meant once: `timeout`, a shell or a service manager signals both
// the program and its group.
class Signals {
 public:
  Signals(asio::io_context& io, GuardedSurvey& survey, Service* service)
      : set_(io, SIGINT, SIGTERM), release_(io, SIGUSR1), meant_once_(io), gate_(survey.gate()) {
    wait_for_release();
    set_.async_wait([this, &survey, service](boost::system::error_code error, int number) {
      if (error) return;
      if (service != nullptr) service->stopping();
      release_.cancel();
      survey.stop(fmt::format("stopped by {}", number == SIGINT ? "SIGINT" : "SIGTERM"));
      meant_once_.expires_after(kMeantOnce);
      meant_once_.async_wait([this](boost::system::error_code over) {
        if (!over) set_.clear();  // The next one ends the program.
      });
    });
  }

 private:
  // Only who runs the program, or root, can send it, on purpose and from this machine: as good as a
  // key. Nothing sends it by itself.
  void wait_for_release() {
    release_.async_wait([this](boost::system::error_code error, int) {
      if (error) return;
      gate_.ask_release();
      wait_for_release();
    });
  }

  asio::signal_set set_, release_;
  asio::steady_timer meant_once_;
  GatedDrive& gate_;
};

}  // namespace

GuardedSurvey::GuardedSurvey(const Prepared& prepared, int threads, Config config, Parts parts)
    : config_(std::move(config)),
      parts_(parts),
      watch_(watched(config_.watch), parts.drivers, parts.clock),
      gate_(gated(prepared.config.robot), parts.clock, parts.drivers.drive()),
      drive_(gate_, watch_, parts.clock),
      imu_(parts.drivers.imu(), watch_, parts.clock),
      gnss_(parts.drivers.gnss(), watch_, parts.clock),
      scanner_(parts.drivers, gate_, watch_, parts.clock),
      devices_{drive_,
               imu_,
               gnss_,
               scanner_,
               placement_,
               [this] { return complaints(); },
               parts.drivers.obstacles()},
      survey_(prepared.config, prepared.site.map, prepared.tasks, threads,
              {parts.clock, devices_, parts.store, parts.progress, parts.compute, parts.journal,
               parts.past, parts.skip}) {
  gate_.watch_surroundings([this] {
    Surroundings around = survey_.surroundings();
    for (const auto fault : {watch_.hold_fault(), survey_.disk_fault()})
      if (fault && (!around.hold_fault || outweighs(*fault, *around.hold_fault)))
        around.hold_fault = fault;
    return around;
  });
}

std::string GuardedSurvey::complaints() {
  const std::string gate = gate_.why(), all = parts_.drivers.complaints();
  return gate + (gate.empty() || all.empty() ? "" : "; ") + all;
}

DeviceWatch::Config GuardedSurvey::watched(DeviceWatch::Config config) {
  config.held = [this] { return gate_.held_by_people(); };
  return config;
}

GatedDrive::Config GuardedSurvey::gated(const RobotConfig& robot) {
  GatedDrive::Config config = gate_config(robot, parts_.drivers);
  config.tell = [this](const std::string& what) {
    watch_.note(what);
    if (parts_.journal == nullptr) return;
    EventText event = stopped_event(what);
    parts_.journal->tell(std::move(event.kind), std::move(event.text));
  };
  config.scanning = [this] { return scanning(); };
  config.how_to_release = config_.how_to_release;
  config.boot = config_.boot;
  config.starts_held = config_.starts_held;
  config.alive = config_.gate_is_alive;
  return config;
}

// The gate commands the drive for as long as there is one.
hal::Task<void> GuardedSurvey::run_devices() {
  std::vector<hal::Task<void>> both;
  both.push_back(parts_.drivers.run());
  both.push_back(gate_.run());
  co_await hal::together(std::move(both));
}

void GuardedSurvey::start() {
  const auto devices_ended = [this](std::exception_ptr error) { on_devices_end(error); };
  asio::co_spawn(parts_.executor, run_devices(),
                 asio::bind_cancellation_slot(cancel_devices_.slot(), devices_ended));
  const auto run_ended = [this](std::exception_ptr error) { on_run_end(error); };
  asio::co_spawn(parts_.executor, run(),
                 asio::bind_cancellation_slot(cancel_run_.slot(), run_ended));
}

hal::Task<void> GuardedSurvey::run() {
  co_await start_devices();
  co_await arm(gate_);
  surveying_ = true;
  co_await hal::first_of(survey_.run(), watch_it());
  if (!watch_.given_up().empty()) throw std::runtime_error(watch_.given_up());
}

// Twice: what has just started may fall back once before it runs for good.
hal::Task<void> GuardedSurvey::start_devices() {
  const hal::Time late = parts_.clock.now() + config_.start_patience;
  for (int starts = 0; starts < 2;) {
    const hal::Duration pause = std::min(kSayWaiting, late - parts_.clock.now());
    const hal::Result<void> started = co_await parts_.drivers.started(pause);
    if (started) {
      ++starts;
      co_await parts_.clock.sleep_for(kSettle);
    } else if (parts_.clock.now() < late) {
      watch_.note("waits for " + watch_.what_is_missing());
    } else {
      throw std::runtime_error("not every device started: " + watch_.what_is_missing());
    }
  }
}

// The survey is cancelled when this ends.
hal::Task<void> GuardedSurvey::watch_it() {
  co_await watch_.run();
  survey_.stop_because(watch_.given_up());
}

void GuardedSurvey::stop(std::string reason) {
  if (released_ || !stop_reason_.empty()) return;
  stop_reason_ = std::move(reason);
  survey_.stop_because(stop_reason_);
  cancel_run_.emit(asio::cancellation_type::terminal);
}

// Whatever ended it, the robot stands before the program goes on.
void GuardedSurvey::on_run_end(std::exception_ptr error) {
  const bool wants_release = gate_.begun() || config_.starts_held;  // Begun or not, it stays due.
  left_held_ = gate_.stopped_by() || (wants_release && !gate_.released());
  gate_.finish();
  if (failure_.empty()) failure_ = stop_reason_.empty() ? text_of(error) : stop_reason_;
  if (!surveying_) survey_.record().end = failure_;
  asio::co_spawn(parts_.executor, release_within(parts_.drivers, parts_.clock),
                 [this](std::exception_ptr release_error) { on_released(release_error); });
}

void GuardedSurvey::on_released(std::exception_ptr error) {
  if (error) watch_.note("the drive was not given back: " + text_of(error));
  released_ = true;
  cancel_devices_.emit(asio::cancellation_type::terminal);
}

void GuardedSurvey::on_devices_end(std::exception_ptr error) {
  devices_over_ = true;
  if (released_) return;  // As it should.
  failure_ = "the device loops ended: " + text_of(error);
  survey_.stop_because(failure_);
  cancel_run_.emit(asio::cancellation_type::terminal);
}

RunOutcome run_on_hardware(Prepared& prepared, const RunOptions& options) {
  OpenedRun run = open_run(prepared, options);
  RunStore& store = run.store;
  std::ostream none(nullptr);
  std::ostream& out = options.progress ? *options.progress : none;
  const std::unique_ptr<ProgressPrinter> printer =
      options.service != nullptr
          ? std::make_unique<ServiceProgress>(*options.service)
          : std::make_unique<ProgressPrinter>(out, options.progress && options.terminal);
  ProgressPrinter& progress = *printer;
  asio::io_context io{1};
  drivers::RealClock clock;
  const RobotConfig& robot = prepared.config.robot;
  HardwareLinks links(robot, io.get_executor(), clock);
  const drivers::GeoAnchor anchor{prepared.origin->lat_deg, prepared.origin->lon_deg,
                                  prepared.origin->h_m, 0};
  RobotDrivers drivers(robot, anchor, clock, links.ends());
  std::optional<Serving> serving;
  if (options.service != nullptr)
    serving.emplace(*options.service, prepared, options.prepare_again, io);
  Worker worker(serving ? serving->worker() : Worker::Config{});
  Journal journal(std::move(run.journal), clock, worker);
  GuardedSurvey::Config config;
  if (serving) serving->configure(config);
  config.watch.link_troubles = [&links](std::string_view role) { return links.troubles(role); };
  config.how_to_release =
      fmt::format("{}run `{}`", robot.power.board_link.empty() ? "" : "press its reset button or ",
                  serving ? "systemctl kill --kill-whom=main -s USR1 vantage"
                          : fmt::format("kill -USR1 {}", getpid()));
  const bool has_console = !robot.console.serial.empty() || !robot.console.socket.empty();
  if (has_console) config.how_to_release += ", or type `arm` at its console";
  std::unique_ptr<Consoles> consoles;
  config.watch.tell = [&](const std::string& what) {
    progress.message(what);
    if (consoles) consoles->hub().tell(what);
  };
  GuardedSurvey guarded(prepared, options.threads, config,
                        {io.get_executor(), clock, drivers, store, progress, worker, &journal,
                         run.past ? &*run.past : nullptr, options.skip});
  const Signals signals(io, guarded, options.service);
  Worker passwords;  // Planning must not keep anybody from logging in.
  if (has_console) {
    RobotConsole::Parts parts{guarded.gate(), guarded.survey(), drivers,
                              config.watch.link_troubles};
    if (options.service != nullptr)
      parts.start_again = [&guarded, service = options.service](NextStart next) {
        service->start_again(next);
        guarded.stop("an operator ordered at the console that it starts again");
      };
    consoles = std::make_unique<Consoles>(robot.console, parts, io, clock, passwords);
  }
  guarded.start();
  if (serving) serving->begin();
  while (!guarded.ended()) io.run_one();
  if (consoles) consoles->end();
  if (serving) serving->end();
  progress.finish();
  RunRecord& record = guarded.survey().record();
  note_run(record, prepared, guarded.watch());
  std::string failure = guarded.failure();
  if (std::string unsaved = save_products(store, guarded.survey(), journal); !unsaved.empty())
    failure += (failure.empty() ? "" : "; ") + unsaved;
  return {std::move(record), store.report_path(), std::move(failure),
          !guarded.stop_reason().empty(), guarded.left_held()};
}

}  // namespace mission
