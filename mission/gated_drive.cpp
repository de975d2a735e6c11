#include "mission/gated_drive.hpp"

#include <fmt/format.h>

#include <boost/asio/experimental/awaitable_operators.hpp>

#include "hal/together.hpp"

namespace mission {
namespace {

namespace errc = boost::system::errc;

// What each stop is in the table of faults; a remote control is told from other holds.
struct StopCause {
  Condition condition;
  FaultCode fault;
};
constexpr StopCause kStopCauses[] = {
    {Condition::estop, FaultCode::estop_pressed},
    {Condition::bumper, FaultCode::bumper_pressed},
    {Condition::fault, FaultCode::drive_commanded_by_others},
    {Condition::drive_silent, FaultCode::drive_silent},
    {Condition::drive_held, FaultCode::drive_fault},
};

// While the drive's time-out is proven it falls silent or into a fault by itself: that is no stop.
constexpr std::uint16_t kEndsProof = static_cast<std::uint16_t>(Condition::estop) |
                                     static_cast<std::uint16_t>(Condition::bumper) |
                                     static_cast<std::uint16_t>(Condition::fault);

// Reports older than GateConfig::feedback_max stop the robot at once; it is held to be silent,
// which only a person ends, when that lasts: a program that came late looks the same for a moment.
constexpr int kSilentCycles = 10;

constexpr hal::Duration kRollsOut = std::chrono::seconds(1);  // From the creep of a proof.

std::string refusal(boost::system::error_code why) {
  if (why == errc::timed_out) return "it went on although it heard no more commands";
  if (why == errc::io_error) return "it could not be seen to move: free the robot";
  if (why == errc::operation_not_permitted)
    return "an e-stop, a remote control or its own fault holds it";
  if (why == errc::operation_canceled) return "something stopped the robot meanwhile";
  return "it does not obey: " + why.message();
}

}  // namespace

GatedDrive::GatedDrive(Config config, hal::Clock& clock, hal::GuardedDrive& drive)
    : config_(std::move(config)),
      clock_(clock),
      drive_(drive),
      supervisor_(booted(config_.boot)),
      status_(drive.status()) {}

hal::Task<void> GatedDrive::run() {
  using boost::asio::experimental::awaitable_operators::operator&&;
  co_await (cycle() && serve_releases());
}

hal::Task<void> GatedDrive::cycle() {
  for (hal::Time next = clock_.now();; next = std::max(next + kGatePeriod, clock_.now())) {
    co_await clock_.sleep_until(next);
    if (config_.alive) config_.alive();
    const hal::Twist twist = decide(clock_.now());
    (void)co_await drive_.command(twist);  // A drive that does not obey shows in its status.
  }
}

hal::Twist GatedDrive::decide(hal::Time now) {
  const Conditions were = std::exchange(conditions_, look(now));
  stops_ += (conditions_.bits() & latch::kStops) != 0 && (were.bits() & latch::kStops) == 0;
  if ((conditions_.bits() & kEndsProof) != 0) stopped_.notify();
  const Decision decision = supervise(supervisor_, conditions_, std::exchange(event_, Event::none));
  if (decision.mode != mode_ || decision.answer != Answer::none) on_decision(decision, conditions_);
  GateInputs inputs;
  inputs.mode = mode_;
  inputs.range_at = is_.range_at.value_or(now);  // What is not at work is not late.
  if (mode_ != Mode::teleop) inputs.zone_speed_max_mps = is_.zone_speed_max_mps;
  inputs.planned = planned_;
  inputs.planned_at = planned_at_;
  inputs.feedback_at = status_.reported_at;
  const GateCommand command = gate(config_.gate, gate_, inputs, now);
  const GateReason before = std::exchange(reason_, command.reason);
  if (reason_ == GateReason::zone && before != GateReason::zone) tell("the robot holds: " + why());
  return command.twist;
}

// Before the beginning the drive may well be silent or held; a pressed e-stop counts at any time.
Conditions GatedDrive::look(hal::Time now) {
  status_ = drive_.status();
  silent_cycles_ = status_.silent ? std::min(silent_cycles_ + 1, kSilentCycles) : 0;
  const bool silent = begun_ && silent_cycles_ == kSilentCycles;
  if (silent) proven_ = false;  // It may be another one when it is back.
  const auto safety = config_.safety ? config_.safety() : std::nullopt;
  is_ = around_ ? around_() : Surroundings{};
  Conditions is;
  is.set(Condition::estop, status_.estop_pressed || (safety && safety->estop_pressed));
  is.set(Condition::bumper, safety && safety->bumper_pressed);
  is.set(Condition::drive_silent, silent);
  is.set(Condition::drive_held, status_.remote_control || (begun_ && status_.held));
  is.set(Condition::fault, status_.commanded_by_others);
  is.set(Condition::operator_alive, operator_alive(config_.gate, gate_, now));
  is.set(Condition::pose_uncertain, is_.pose_uncertain);
  is.set(Condition::range_stale, is_.range_at && now - *is_.range_at > config_.gate.range_max);
  is.set(Condition::hold_fault, is_.hold_fault.has_value());
  is.set(Condition::battery_reserve, is_.battery_reserve);
  is.set(Condition::mission_loaded, loaded_);
  is.set(Condition::proven, proven_);
  if (safety) look_at_reset(*safety);
  return is;
}

// One press is one release. What is still told of a press when inputs are free again, or heard
// again, came before a person could know that they are.
void GatedDrive::look_at_reset(const hal::SafetyInputs& safety) {
  const bool is_free = !safety.estop_pressed && !safety.bumper_pressed;
  if (is_free && safety.reset_pressed && !reset_was_) ask_release();
  reset_was_ = !is_free || safety.reset_pressed;
}

FaultCode GatedDrive::cause_of(Conditions conditions) const {
  if (conditions.has(Condition::drive_held) && status_.remote_control &&
      !conditions.has(Condition::estop))
    return FaultCode::remote_control;
  for (const StopCause& cause : kStopCauses)
    if (conditions.has(cause.condition)) return cause.fault;
  if ((supervisor_.latched & latch::kWatchdogRestart) != 0) return FaultCode::watchdog_restart;
  return (supervisor_.latched & latch::kCrash) != 0 ? FaultCode::program_fault
                                                    : FaultCode::power_cut;
}

void GatedDrive::on_decision(const Decision& decision, Conditions conditions) {
  const bool stops = decision.mode == Mode::stopped && mode_ != Mode::stopped;
  const bool was_holding = mode_ == Mode::holding;
  mode_ = decision.mode;
  // The range source has to begin anew for every way: that is not worth a word.
  if (const auto by = held_by(); by && by != FaultCode::range_stale && !was_holding)
    tell("the robot holds: " + why());
  if (stops) {
    stopped_by_ = cause_of(conditions);
    tell("the robot is stopped: " + why());
  }
  if (decision.answer == Answer::none) return;
  answer_ = decision.answer;
  if (answer_ == Answer::released) {
    if (stopped_by_)
      tell("the robot was released after " + std::string(entry_of(*stopped_by_).id));
    else if (held_)
      tell("the robot is released");
    held_ = false;
    stopped_by_.reset();
    released_.notify();
  } else if (begun_ && answer_ != Answer::not_enough) {
    tell(fmt::format("not released: {}", name(answer_)));
  }
}

std::optional<FaultCode> GatedDrive::held_by() const {
  if (mode_ != Mode::holding || !supervisor_.released) return std::nullopt;
  if (conditions_.has(Condition::pose_uncertain)) return FaultCode::pose_uncertain;
  return is_.hold_fault ? is_.hold_fault : FaultCode::range_stale;
}

std::string GatedDrive::why() const {
  if (const auto by = held_by()) {
    const FaultEntry& fault = entry_of(*by);
    return fmt::format("{}: {}; do: {}", fault.id, fault.cause, fault.remedy);
  }
  if (reason_ == GateReason::zone)
    return std::string(name(reason_)) +
           ": it believes that it is outside of where it can drive; do: drive it back by hand";
  if (!stopped_by_) return {};
  const FaultEntry& fault = entry_of(*stopped_by_);
  return fmt::format("{}: {}; do: {}; to release it, {}", fault.id, fault.cause, fault.remedy,
                     config_.how_to_release);
}

void GatedDrive::tell(const std::string& what) const {
  if (config_.tell) config_.tell(what);
}

// --- Releases.

void GatedDrive::ask_release() {
  release_asked_ = true;
  asked_.notify();
}

void GatedDrive::ask_hold() {
  ++holds_;
  held_ = true;
  release_asked_ = false;
  event_ = Event::hold;
  stopped_.notify();
}

void GatedDrive::hear(const OperatorPacket& packet) {
  mission::hear(gate_, packet, clock_.now());
  planned_at_ = {};  // When they let go, the robot stands until the mission has looked again.
}

void GatedDrive::finish() {
  begun_ = loaded_ = false;
  ask_hold();
}

bool GatedDrive::creeps() const {
  return proving_ || (proved_at_ != hal::Time{} && clock_.now() - proved_at_ < kRollsOut);
}

bool GatedDrive::held_by_people() const {
  return conditions_.has(Condition::estop) || conditions_.has(Condition::bumper) ||
         status_.remote_control;
}

// A press while another one is being carried out is that one.
hal::Task<void> GatedDrive::serve_releases() {
  for (;;) {
    while (!release_asked_) co_await asked_.wait();
    const std::uint64_t holds = holds_;
    const bool stop_is_there = (conditions_.bits() & latch::kStops) != 0;
    if (!stop_is_there && begun_ && !proven_) co_await prove();
    release_asked_ = false;
    if (holds != holds_) continue;  // They think otherwise now.
    if (!proof_failure_.empty()) tell("the drive's own time-out is not proven: " + proof_failure_);
    event_ = Event::release;
  }
}

hal::Task<Answer> GatedDrive::start() {
  if (config_.starts_held && supervisor_.latched == 0) {
    begun_ = true;
    tell("the robot stands until a person releases it: " + config_.how_to_release);
    co_return Answer::not_enough;
  }
  if (supervisor_.latched == 0) co_await prove();  // Else only after a person's release.
  begun_ = true;
  answer_ = Answer::none;
  while (answer_ == Answer::none) {
    if (event_ == Event::none) event_ = Event::start;  // A hold goes before it.
    co_await clock_.sleep_for(kGatePeriod);
  }
  co_return answer_;
}

// Whatever stops the robot ends the proof, too, and at once.
hal::Task<void> GatedDrive::prove() {
  struct Guard {  // Also when cancelled.
    GatedDrive& of;
    ~Guard() {
      of.proving_ = false;
      of.proved_at_ = of.clock_.now();
    }
  };
  proving_ = true;
  const Guard guard{*this};
  proof_failure_ = refusal(errc::make_error_code(errc::operation_canceled));
  const int first = co_await hal::first_of(try_to_prove(), until_stop(holds_));
  if (first == 0) co_return;
  const hal::Twist stand;
  (void)co_await drive_.command(stand);
}

// What stops the robot while a scan is waited for wants a release of its own.
hal::Task<void> GatedDrive::try_to_prove() {
  const std::uint64_t stops = stops_;
  while (config_.scanning && config_.scanning()) co_await clock_.sleep_for(kGatePeriod);
  if (stops != stops_) co_return;
  const auto took = co_await drive_.prove_timeout();
  proven_ = took.has_value();
  proof_failure_ = proven_ ? "" : refusal(took.error());
}

hal::Task<void> GatedDrive::until_stop(std::uint64_t holds) {
  while ((conditions_.bits() & kEndsProof) == 0 && holds == holds_) co_await stopped_.wait();
}

hal::Task<void> GatedDrive::until_released() {
  while (!supervisor_.released) co_await released_.wait();
}

// --- What the mission sees.

hal::Task<hal::Result<void>> GatedDrive::command(hal::Twist twist) {
  planned_ = twist;
  planned_at_ = mode_ == Mode::teleop ? hal::Time{} : clock_.now();
  const hal::Twist now = decide(clock_.now());
  const auto told = co_await drive_.command(now);
  if (!told) co_return told;
  if (held_by() == FaultCode::range_stale)
    co_return errc::make_error_code(errc::resource_unavailable_try_again);
  if (!moves(mode_) || mode_ == Mode::teleop)
    co_return errc::make_error_code(errc::operation_not_permitted);
  co_return told;
}

hal::Task<hal::Result<hal::WheelTravel>> GatedDrive::next_travel() {
  return drive_.next_travel();
}

}  // namespace mission
