#include "drivers/hokuyo.hpp"

#include <cmath>
#include <limits>
#include <numbers>

#include "drivers/text.hpp"

namespace drivers {
namespace {

using namespace std::chrono_literals;
using namespace profile_fault;

constexpr Fault kSilent{2, "no answer",
                        "no power, still starting (10 s), a cable, a wrong address or speed, or "
                        "another program that holds its only connection",
                        "check power and cable; it answers on TCP port 10940, or on a serial line "
                        "at 19200 or 115200 baud"};
constexpr Fault kGarbage{3, "not SCIP", "another device, or a serial line at the wrong speed",
                         "check what is connected there; try 19200, 38400 and 115200 baud"};
constexpr Fault kRefused{5, "request refused", "the scanner does not accept it",
                         "see the detail; compare with the model's"};
constexpr Fault kSector{6, "impossible sector", "the robot file asks for steps that it has not",
                        "correct the scanner's sector in the robot file"};
constexpr Fault kDamaged{8, "damaged scans", "bytes change or go missing on the way",
                         "check the cable and its shield"};

constexpr hal::Duration kStartTimeout = 15s;
constexpr hal::Duration kAnswer = 1s;
constexpr hal::Duration kHalfMillisecond = 500us;  // Its clock leaves out what has not passed.
constexpr int kClockQuestions = 5;
constexpr int kCleanAgain = 100;
constexpr float kNoClaim = std::numeric_limits<float>::quiet_NaN();

std::string found(const ScipInfo& info, std::string_view key) {
  for (const auto& [known, value] : info)
    if (known == key) return value;
  return "";
}

}  // namespace

Hokuyo::Hokuyo(HokuyoConfig config, hal::Clock& clock, hal::ByteStream& stream)
    : ProfileLoop({.frame_max = kScipFrameMax,
                   .look = look_scip,
                   .start_max = kStartTimeout,
                   .profiles_max = config.profiles_max,
                   .retry_s = config.retry_s,
                   .silent = &kSilent,
                   .garbage = &kGarbage},
                  clock, stream),
      config_(std::move(config)) {}

Hokuyo::~Hokuyo() = default;

void Hokuyo::begin_session() {
  asked_.clear();
  damaged_ = 0;
}

hal::Task<bool> Hokuyo::set_up() {
  const bool awake = co_await wake_up();
  if (!awake) co_return false;
  co_return co_await identify();
}

void Hokuyo::clear_set_up_troubles() {
  for (const Fault* fault : {&kRefused, &kSector}) troubles_.clear(*fault);
}

// Whatever it was doing, it stops and speaks SCIP 2.
hal::Task<bool> Hokuyo::wake_up() {
  for (int attempt = 0; attempt < 3; ++attempt) {
    const auto quit = co_await ask("QT", kAnswer);
    if (quit && quit->status == "00") co_return true;
    if (quit) {
      (void)co_await ask("TM2", kAnswer);  // It was setting its clock.
    } else {
      (void)co_await ask("SCIP2.0", kAnswer);
    }
  }
  tell_silence("to QT and SCIP2.0");
  co_return false;
}

hal::Task<bool> Hokuyo::identify() {
  const auto version = co_await ask("VV", kAnswer);
  if (version && parse_scip(version->frame, reply_).empty())
    if (const auto info = scip_info(reply_))
      identity_ = {found(*info, "VEND"), found(*info, "PROD"), found(*info, "SERI"),
                   found(*info, "FIRM")};
  const auto said = co_await ask("PP", kAnswer);
  std::string problem = "no answer to PP";
  if (said && parse_scip(said->frame, reply_).empty()) {
    const auto info = scip_info(reply_);
    problem = info ? scip_parameters(*info, parameters_) : "PP cannot be read";
  }
  if (!problem.empty()) {
    troubles_.set(kRefused, problem);
    co_return false;
  }
  identity_.model = parameters_.model;
  if (!parameters_.model.starts_with(config_.model)) {
    troubles_.set(kOtherModel, "it says it is a " + parameters_.model + ", not a " + config_.model);
    co_return false;
  }
  if (step_first() < parameters_.step_first || step_last() > parameters_.step_last ||
      step_first() >= step_last()) {
    troubles_.set(kSector, "steps " + std::to_string(step_first()) + " to " +
                               std::to_string(step_last()) + " of " +
                               std::to_string(parameters_.step_first) + " to " +
                               std::to_string(parameters_.step_last));
    co_return false;
  }
  co_return true;
}

// The fastest of a few answers tells best.
hal::Task<bool> Hokuyo::set_clock() {
  const bool entered = co_await insist("TM0", kAnswer);
  if (!entered) co_return false;
  hal::Duration fastest = hal::Duration::max();
  for (int i = 0; i < kClockQuestions; ++i) {
    const auto said = co_await ask("TM1", kAnswer);
    if (!said || !parse_scip(said->frame, reply_).empty()) continue;
    const auto time = scip_time_ms(reply_);
    const hal::Duration took = said->arrived - said->asked;
    if (!time || took >= fastest) continue;
    fastest = took;
    asked_at_ = said->asked + took / 2 - kHalfMillisecond;
    asked_ms_ = *time;
  }
  const bool left = co_await insist("TM2", kAnswer);
  co_return left&& fastest != hal::Duration::max();
}

hal::Task<bool> Hokuyo::begin() {
  const bool clock_known = co_await set_clock();
  if (!clock_known) {
    troubles_.set(kRefused, "its clock cannot be read");
    co_return false;
  }
  unwrap_ms_ = Unwrap(24);
  asked_ms_ = unwrap_ms_(static_cast<std::uint64_t>(asked_ms_));
  fit_ = ClockFit();
  last_ms_.reset();
  const Bytes request =
      scip_stream_request(config_.intensities, step_first(), step_last(), 0, config_.skip, 0);
  last_scan_ = clock_.now();
  queue_.clear();
  streaming_ = true;
  const bool begun =
      co_await insist(std::string(as_text(request).substr(0, request.size() - 1)), 3s);
  last_scan_ = clock_.now();
  streaming_ = begun;
  switched_.notify();
  co_return begun;
}

hal::Task<bool> Hokuyo::end() {
  const bool ended = co_await insist("QT", kAnswer);
  streaming_ = false;
  switched_.notify();
  co_return ended;
}

hal::Task<bool> Hokuyo::insist(std::string command, hal::Duration timeout) {
  const auto answer = co_await ask(command, timeout);
  if (!answer) {
    if (!troubles_.has(kUnplugged)) troubles_.set(kSilent, "to " + command);
    co_return false;
  }
  if (!parse_scip(answer->frame, reply_).empty()) co_return false;
  const Fault* const fault = scip_fault(reply_);
  if (fault != nullptr)
    troubles_.set(kRefused, command + ": " + std::string(fault->name) + " (" +
                                std::string(fault->cause) + "): " + std::string(fault->remedy));
  co_return fault == nullptr;
}

hal::Task<std::optional<Hokuyo::Answer>> Hokuyo::ask(std::string command, hal::Duration timeout) {
  const hal::Time asked = clock_.now();
  const hal::Time deadline = asked + timeout;
  asked_ = command;
  answer_.reset();
  const Bytes request = scip_request(command);
  co_await write(request, deadline);
  while (!answer_) {
    const bool woken = co_await answered_.wait_until(clock_, deadline);
    if (!woken) break;
  }
  asked_.clear();
  std::optional<Answer> answer = std::exchange(answer_, std::nullopt);
  if (answer) answer->asked = asked;
  co_return answer;
}

hal::Task<bool> Hokuyo::stream(bool on) {
  if (on) co_return co_await begin();
  co_return co_await end();
}

hal::Task<bool> Hokuyo::is_alive() {
  co_return co_await insist("QT", kAnswer);
}

void Hokuyo::take(ByteView frame, hal::Time arrival) {
  if (!parse_scip(frame, reply_).empty()) return;
  if (reply_.status == "99") {
    if (streaming_) take_scan(arrival);
    return;
  }
  if (asked_.empty() || answer_ || reply_.echo != asked_) return;
  answer_ = Answer{std::string(reply_.status), Bytes(frame.begin(), frame.end()), {}, arrival};
  answered_.notify();
}

void Hokuyo::take_scan(hal::Time arrival) {
  const std::uint64_t skipped = bytes_skipped();
  const auto why = decode_scip_scan(reply_, scan_);
  clean_ = why.empty() && skipped == damaged_ ? clean_ + 1 : 0;
  damaged_ = skipped;
  if (clean_ == 0) troubles_.set(kDamaged, why.empty() ? "bytes between scans" : std::string(why));
  if (clean_ == kCleanAgain) troubles_.clear(kDamaged);
  if (!why.empty()) return;
  const std::int64_t time_ms = unwrap_ms_(scan_.time_ms);
  const std::int64_t step_ms = last_ms_ ? time_ms - *last_ms_ : 0;
  if (last_ms_ && step_ms == 0)
    return watch_.repeated("scan of " + std::to_string(time_ms) + " ms");
  if (step_ms < 0) return watch_.out_of_order();
  last_ms_ = time_ms;
  last_scan_ = arrival;
  troubles_.clear(kQuiet);
  fit_.add(time_ms * 1'000'000, arrival);
  // A scan comes when it is over; how long that is, its clock's answer before the start tells.
  const hal::Duration late = *fit_.to_ours(asked_ms_ * 1'000'000) - asked_at_;
  const double steps = static_cast<double>(step_ms) / 1000 / period_s();
  const std::uint64_t lost = steps > 1.5 && std::abs(steps - std::round(steps)) < 0.1
                                 ? static_cast<std::uint64_t>(std::llround(steps)) - 1
                                 : 0;
  lost_scans_ += lost;
  watch_.came(static_cast<double>(step_ms) / 1000, period_s(), fit_.last_excess_s(), lost);
  add_profile(*fit_.to_ours(time_ms * 1'000'000) - late + kHalfMillisecond, lost);
}

void Hokuyo::add_profile(hal::Time stamp, std::uint64_t lost) {
  hal::Profile profile;
  profile.stamp = stamp;
  profile.beam_period_s = turn_s() * scan_.group / parameters_.steps_per_turn;
  profile.angle_first_rad = scip_angle_rad(parameters_, scan_, 0);
  profile.angle_step_rad = 2 * std::numbers::pi * scan_.group / parameters_.steps_per_turn;
  profile.lost_before = lost;
  profile.ranges_m.reserve(scan_.distances_mm.size());
  for (const std::uint32_t mm : scan_.distances_mm) {
    const bool too_far = mm == 0 || mm > static_cast<std::uint32_t>(parameters_.range_max_mm);
    profile.ranges_m.push_back(scip_is_range(parameters_, mm) ? static_cast<float>(mm) / 1000
                               : too_far                      ? 0.0F
                                                              : kNoClaim);
  }
  profile.intensities.assign(scan_.intensities_raw.begin(), scan_.intensities_raw.end());
  queue_.put(std::move(profile));
  ++profiles_;
}

}  // namespace drivers
