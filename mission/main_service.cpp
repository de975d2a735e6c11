#include "mission/main_service.hpp"

#include <fmt/format.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <systemd/sd-daemon.h>
#include <systemd/sd-journal.h>
#include <unistd.h>

#include <boost/asio/co_spawn.hpp>
#include <charconv>
#include <cstdlib>
#include <iostream>

#include "mission/faults.hpp"
#include "mission/files.hpp"
#include "mission/journal_fields.hpp"
#include "mission/main_realtime.hpp"

namespace mission {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

constexpr std::size_t kSmallFile = 4096;
constexpr std::size_t kStatusColumns = 200;  // The journal has the whole line.

std::string variable(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? "" : value;
}

std::string small_file(const fs::path& path) {
  const FileResult<std::string> text = read_file(path, kSmallFile);
  return text ? *text : "";
}

std::string first_line(const std::string& text) {
  return text.substr(0, text.find('\n'));
}

// A sandbox without /proc/sys is told by its unit file.
std::string this_boot() {
  const std::string told = variable("VANTAGE_BOOT_ID");
  if (!told.empty()) return told;
  std::string id = first_line(small_file("/proc/sys/kernel/random/boot_id"));
  std::erase(id, '-');  // As systemd writes it.
  return id.empty() ? "unknown" : id;
}

// As systemd says how to tell: $JOURNAL_STREAM names the file behind standard error.
bool stderr_is_the_journal() {
  struct stat file {};
  if (::fstat(STDERR_FILENO, &file) != 0) return false;
  return variable("JOURNAL_STREAM") == fmt::format("{}:{}", file.st_dev, file.st_ino);
}

void send(const std::vector<std::string>& fields) {
  std::vector<iovec> parts;
  for (const std::string& field : fields)
    parts.push_back({const_cast<char*>(field.data()), field.size()});
  (void)sd_journal_sendv(parts.data(), static_cast<int>(parts.size()));  // Nobody else to tell.
}

}  // namespace

// The gate's cycle takes 10 ms; the rest of the loop serves devices, and computes nothing long.
// Between two steps of a survey (a command to the drive, a scan, a computation) there is at most a
// wait before the next try.
MissionTasks::MissionTasks(Heartbeat& heartbeat)
    : event_loop(heartbeat.add("event loop", 1s)),
      gate_cycle(heartbeat.add("gate cycle", 1s)),
      survey(heartbeat.add("survey", 2min)),
      computation(heartbeat.add("computation", 10min)),
      products(heartbeat.add("writing of the products", 10min)) {}

Service::Service(fs::path state)
    : state_(std::move(state)), boot_id_(this_boot()), to_journal_(stderr_is_the_journal()) {
  const std::optional<BootMark> last = mark_of(small_file(state_ / "last_run"));
  left_held_ = last && last->state == BootMark::State::held;
  boot_ = boot_after(last, boot_id_, first_line(small_file(state_ / "stopped_with")));
  this_start_ = next_start_of(small_file(state_ / "next_start"));
  mark(BootMark::State::running);
  std::error_code none;
  fs::remove(state_ / "stopped_with", none);  // Of the run before; this one's comes when it ends.
  fs::remove(state_ / "next_start", none);    // Counts once.
}

Service::~Service() {
  feeders_.stop();
  if (thread_.joinable()) thread_.join();
}

void Service::mark(BootMark::State state) {
  write_file(state_ / "last_run", {text_of(BootMark{state, boot_id_})}).value();
}

void Service::ended(bool held) {
  if (next_start_ != NextStart::as_usual)
    write_file(state_ / "next_start", {text_of(next_start_)}).value();
  mark(held ? BootMark::State::held : BootMark::State::ended);
}

void Service::ready() {
  (void)sd_notify(0, "READY=1");
}

void Service::status(std::string_view line) {
  (void)sd_notify(0, fmt::format("STATUS={}", shortened(line, kStatusColumns)).c_str());
}

void Service::reloading() {
  (void)sd_notify(0, "RELOADING=1");
}

void Service::stopping() {
  (void)sd_notify(0, "STOPPING=1");
}

void Service::log(std::string_view text) {
  if (to_journal_)
    send(journal_fields(text));
  else
    std::cerr << fmt::format("{}\n", text) << std::flush;
  status(text);
}

// --- The watchdog.

void Service::watch() {
  std::uint64_t limit_us = 0;
  if (sd_watchdog_enabled(0, &limit_us) <= 0) return;
  WatchdogFeeder::Config config;
  config.period = std::chrono::microseconds(limit_us / 4);
  config.feed = [] { (void)sd_notify(0, "WATCHDOG=1"); };
  config.hangs = [this](const Heartbeat::Late& late) { hangs(late); };
  config.goes_on = [this] {
    mark(BootMark::State::running);
    log("all go on again");
  };
  feeder_.emplace(std::move(config), heartbeat_, clock_);
  boost::asio::co_spawn(feeders_, feeder_->run(), [this](std::exception_ptr error) {
    if (error) log("the watchdog is no longer fed");  // And so ends the program.
  });
  thread_ = std::thread([this] { feeders_.run(); });
}

// Said first: nobody knows how much time is left.
void Service::hangs(const Heartbeat::Late& late) {
  const FaultEntry& fault = entry_of(FaultCode::watchdog_restart);
  log(fmt::format("hangs: the {} was due {:.1f} s ago; the watchdog is not fed: {}: {}", late.name,
                  hal::seconds(late.by), fault.id, fault.effect));
  mark(BootMark::State::hung);
}

void Service::prepare_for_real_time() {
  for (const std::string& refusal : {lock_memory(), run_first()})
    if (!refusal.empty()) log(refusal);
}

void Service::log_memory(std::string_view when) {
  if (const auto use = memory_use(getpid())) log(fmt::format("memory {}: {}", when, text_of(*use)));
}

// --- Progress.

ServiceProgress::ServiceProgress(Service& service)
    : ProgressPrinter(std::cerr, false), service_(service) {}

void ServiceProgress::show(const Progress& progress) {
  std::string line = progress_line(progress);
  if (line == shown_) return;
  service_.log(line);
  shown_ = std::move(line);
}

void ServiceProgress::message(std::string_view text) {
  service_.log(text);
}

namespace {

// 0: none.
int last_run(const fs::path& folder) {
  int last = 0;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(folder, none)) {
    const std::string name = entry.path().filename().string();
    int number = 0;
    const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), number);
    if (error == std::errc() && end == name.data() + name.size()) last = std::max(last, number);
  }
  return last;
}

}  // namespace

fs::path last_run_folder(const fs::path& folder) {
  const int last = last_run(folder);
  return last > 0 ? folder / fmt::format("{:04}", last) : fs::path();
}

fs::path next_run_folder(const fs::path& folder) {
  return folder / fmt::format("{:04}", last_run(folder) + 1);
}

}  // namespace mission
