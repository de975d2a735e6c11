#include "mission/main_serving.hpp"

#include <fmt/format.h>

#include <boost/asio/co_spawn.hpp>
#include <csignal>

#include "mission/config_changes.hpp"

namespace mission {
namespace {

using namespace std::chrono_literals;

constexpr hal::Duration kTick = 100ms;
constexpr hal::Duration kComputationMax = 10min;

// Devices have time-outs of their own for each step of a scan; this is for what has none.
hal::Duration scan_bound(double scan_s) {
  return hal::from_seconds(4 * scan_s) + 10min;
}

}  // namespace

Serving::Serving(Service& service, const Prepared& prepared,
                 std::function<Prepared()> prepare_again, boost::asio::io_context& io)
    : service_(service),
      prepared_(prepared),
      prepare_again_(std::move(prepare_again)),
      io_(io),
      scan_bound_(scan_bound(prepared.config.robot.scanner.scan_s)),
      reload_(io, SIGHUP) {}

void Serving::configure(GuardedSurvey::Config& config) const {
  Service& service = service_;
  config.boot = service.boot();
  config.starts_held = prepared_.config.start != "on-boot" || service.left_held();
  config.gate_is_alive = [&service] {
    service.heartbeat().tick(service.tasks().gate_cycle, service.clock().now());
  };
  config.watch.step = [this](MissionStep next) { step(next); };
}

void Serving::step(MissionStep step) const {
  Heartbeat& heartbeat = service_.heartbeat();
  const Heartbeat::Task survey = service_.tasks().survey;
  if (step == MissionStep::waits) heartbeat.rest(survey);
  if (step == MissionStep::goes_on) heartbeat.tick(survey, service_.clock().now());
  if (step == MissionStep::scans) heartbeat.expect(survey, service_.clock().now(), scan_bound_);
}

// While it computes the computation is waited for, not the survey.
Worker::Config Serving::worker() const {
  Service& service = service_;
  Worker::Config config;
  config.begins = [&service] {
    service.heartbeat().rest(service.tasks().survey);
    service.heartbeat().expect(service.tasks().computation, service.clock().now(), kComputationMax);
  };
  config.ends = [&service] {
    service.heartbeat().rest(service.tasks().computation);
    service.heartbeat().tick(service.tasks().survey, service.clock().now());
  };
  return config;
}

void Serving::begin() {
  const auto rethrow = [](std::exception_ptr error) {
    if (error) std::rethrow_exception(error);
  };
  boost::asio::co_spawn(io_, tick(), rethrow);
  wait_for_reload();
  service_.log(fmt::format("serves {}: looks for its devices", prepared_.config.name));
  service_.log_memory("at the start");
  service_.prepare_for_real_time();
  // It is due from now on, also if it never begins.
  service_.heartbeat().tick(service_.tasks().event_loop, service_.clock().now());
  service_.watch();
  service_.ready();
}

void Serving::end() {
  service_.stopping();
  Heartbeat& heartbeat = service_.heartbeat();
  const MissionTasks& tasks = service_.tasks();
  for (const Heartbeat::Task task :
       {tasks.event_loop, tasks.gate_cycle, tasks.survey, tasks.computation})
    heartbeat.rest(task);
  heartbeat.tick(tasks.products, service_.clock().now());
  service_.log_memory("at the end");
}

hal::Task<void> Serving::tick() {
  for (;;) {
    service_.heartbeat().tick(service_.tasks().event_loop, service_.clock().now());
    co_await service_.clock().sleep_for(kTick);
  }
}

// --- Reload: the mission goes on as it is; what is wrong with its files is known before the next.

void Serving::wait_for_reload() {
  reload_.async_wait([this](boost::system::error_code error, int) {
    if (error) return;
    boost::asio::co_spawn(io_, reload(), [this](std::exception_ptr problem) {
      if (problem) service_.log("the config could not be checked");
      service_.ready();
      wait_for_reload();
    });
  });
}

hal::Task<void> Serving::reload() {
  service_.reloading();
  Prepared next;
  const std::function<void()> check = [&] { next = prepare_again_(); };
  co_await checks_.run(check);
  for (const ConfigError& error : next.errors) service_.log("config: " + error.text());
  if (!next.errors.empty()) {
    service_.log(fmt::format("config: {} errors: with these files it would not start again",
                             next.errors.size()));
    co_return;
  }
  const std::vector<std::string> changes = config_changes(prepared_.config, next.config);
  for (const std::string& change : changes) service_.log("at the next start: " + change);
  if (changes.empty()) service_.log("config: in order; no value changes at the next start");
}

}  // namespace mission
