#include "mission/main_watch.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace mission {
namespace {

using namespace std::chrono_literals;
namespace errc = boost::system::errc;

constexpr hal::Duration kLook = 50ms;
constexpr hal::Duration kTryAgain = 100ms;
constexpr hal::Duration kLossShows = 5s;   // That made a scan fail.
constexpr hal::Duration kSteady = 5s;      // Lost again sooner, it is the same loss.
constexpr hal::Duration kHoldMax = 10min;  // By a fault that a person has to do something about.

bool away(const NamedDevice& named) {
  return named.device->state() != drivers::DeviceState::running;
}

// Until what a device gives is no failure: with a pause, and not while one is missing.
template <class Next>
auto insist(DeviceWatch& watch, hal::Clock& clock, Next next) -> decltype(next()) {
  for (;;) {
    auto result = co_await next();
    if (result) co_return result;
    watch.look();
    co_await clock.sleep_for(kTryAgain);
    co_await watch.until_well();
  }
}

}  // namespace

DeviceWatch::DeviceWatch(Config config, const RobotDrivers& drivers, hal::Clock& clock)
    : config_(std::move(config)), drivers_(drivers), clock_(clock) {}

hal::Task<void> DeviceWatch::run() {
  for (;;) {
    look();
    look_for_holds();
    if (held()) lost_at_ = clock_.now();
    if (!well_ && clock_.now() - lost_at_ > config_.patience) break;
    co_await clock_.sleep_for(kLook);
  }
  given_up_ = fmt::format("waited {:.0f} s in vain for {}", hal::seconds(config_.patience),
                          what_is_missing());
}

// Inputs that are not heard count as pressed, and nobody presses those.
bool DeviceWatch::held() const {
  const bool heard = std::ranges::none_of(drivers_.devices(), [](const NamedDevice& named) {
    return named.role == "power" && away(named);
  });
  return heard && config_.held && config_.held();
}

// A reason that changes is told again.
void DeviceWatch::look() {
  const std::string missing = missing_names();
  if (missing.empty()) {
    if (!std::exchange(well_, true)) {
      note(fmt::format("all devices are back after {:.1f} s: it goes on",
                       hal::seconds(clock_.now() - lost_at_)));
      back_at_ = clock_.now();
      back_.notify();
    }
    told_.clear();
    return;
  }
  const bool anew = !back_at_ || clock_.now() - *back_at_ > kSteady;
  if (std::exchange(well_, false) && anew) lost_at_ = clock_.now();
  if (missing == told_) return;
  told_ = missing;
  note("the robot stands, because it misses " + what_is_missing());
}

void DeviceWatch::step(MissionStep step) const {
  if (config_.step) config_.step(step);
}

// Devices that are away stop the mission by themselves.
void DeviceWatch::look_for_holds() {
  hold_fault_.reset();
  for (const NamedDevice& named : drivers_.devices()) {
    if (away(named)) continue;
    for (const drivers::Trouble& trouble : named.device->troubles()) {
      const FaultCode code = fault_of(fault_role(named.role), trouble.fault->name);
      const bool holds = entry_of(code).action == Action::hold;
      if (holds && (!hold_fault_ || outweighs(code, *hold_fault_))) hold_fault_ = code;
    }
  }
}

hal::Task<void> DeviceWatch::until_well() {
  while (!well_) co_await back_.wait();
}

void DeviceWatch::note(std::string what) {
  if (config_.tell) config_.tell(what);
  if (notes_.size() < kNotesMax) notes_.push_back(std::move(what));
}

// What identifies a reason: details with numbers change all the time.
std::string DeviceWatch::missing_names() const {
  std::string text;
  for (const NamedDevice& named : drivers_.devices()) {
    if (!away(named)) continue;
    text += named.role + ":";
    if (config_.link_troubles)
      for (const drivers::Trouble& trouble : config_.link_troubles(named.role))
        text += std::string(trouble.fault->name) + ",";
  }
  return text;
}

std::string DeviceWatch::what_is_missing() const {
  std::string text;
  const auto add = [&](const drivers::Trouble& trouble) {
    text += fmt::format(": {}{}{}; do: {}", trouble.fault->name, trouble.detail.empty() ? "" : ", ",
                        trouble.detail, trouble.fault->remedy);
  };
  for (const NamedDevice& named : drivers_.devices()) {
    if (!away(named)) continue;
    text += fmt::format("{}{} ({} at {})", text.empty() ? "" : "; ", named.role,
                        named.device->model(), named.link);
    if (config_.link_troubles)
      for (const drivers::Trouble& trouble : config_.link_troubles(named.role)) add(trouble);
    for (const drivers::Trouble& trouble : named.device->troubles()) add(trouble);
  }
  return text;
}

hal::Task<hal::Result<void>> WatchedDrive::command(hal::Twist twist) {
  watch_.step(MissionStep::goes_on);
  watch_.look();
  if (watch_.well()) {
    auto done = co_await drive_.command(twist);
    const bool lost = done.has_error() && (done.error() == errc::not_connected ||
                                           done.error() == errc::operation_not_permitted);
    if (!lost) co_return done;
    co_await clock_.sleep_for(kTryAgain);  // It will show.
    watch_.look();
  } else {
    const hal::Twist stand;
    (void)co_await drive_.command(stand);  // Gone or not.
  }
  watch_.step(MissionStep::waits);
  co_await watch_.until_well();
  co_await drive_.until_released();
  // Driven by a person, or held by what the mission can do nothing about.
  const auto holds = [this] {
    const auto by = drive_.held_by();
    return by && *by != FaultCode::range_stale;
  };
  for (hal::Time late = clock_.now() + kHoldMax; drive_.mode() == Mode::teleop || holds();) {
    if (drive_.mode() == Mode::teleop) late = clock_.now() + kHoldMax;
    if (clock_.now() >= late) co_return errc::make_error_code(errc::operation_not_permitted);
    co_await clock_.sleep_for(kTryAgain);
  }
  watch_.step(MissionStep::goes_on);
  co_return hal::Result<void>{};
}

hal::Task<hal::Result<hal::WheelTravel>> WatchedDrive::next_travel() {
  const auto next = [this] { return drive_.next_travel(); };
  co_return co_await insist(watch_, clock_, next);
}

hal::Task<hal::Result<hal::ImuSample>> WatchedImu::next_sample() {
  const auto next = [this] { return imu_.next_sample(); };
  co_return co_await insist(watch_, clock_, next);
}

hal::Task<hal::Result<hal::GnssFix>> WatchedGnss::next_fix() {
  const auto next = [this] { return gnss_.next_fix(); };
  co_return co_await insist(watch_, clock_, next);
}

hal::Task<hal::Result<hal::ScanCloud>> WatchedScanner::scan_now() {
  struct Guard {  // Also when cancelled.
    bool& scanning;
    ~Guard() { scanning = false; }
  };
  scanning_ = true;
  const Guard guard{scanning_};
  co_return co_await drivers_.scanner().scan();
}

hal::Task<hal::Result<hal::ScanCloud>> WatchedScanner::scan() {
  watch_.step(MissionStep::waits);
  co_await watch_.until_well();
  while (gate_.creeps()) co_await clock_.sleep_for(kTryAgain);
  watch_.step(MissionStep::scans);
  auto cloud = co_await scan_now();
  watch_.step(MissionStep::goes_on);
  if (cloud) co_return cloud;
  const std::string& problem = drivers_.scan_problem();
  watch_.note("scan failed: " + (problem.empty() ? cloud.error().message() : problem));
  co_await clock_.sleep_for(kLossShows);
  watch_.look();
  co_return cloud;
}

hal::Task<hal::Result<hal::SurveyedPose>> NobodyToPlace::place(std::string_view, hal::Pose2) {
  co_return errc::make_error_code(errc::operation_not_supported);
}

}  // namespace mission
