#include "drivers/agilex_drive.hpp"

#include <boost/asio/experimental/awaitable_operators.hpp>
#include <cmath>
#include <string>

namespace drivers {
namespace {

using namespace std::chrono_literals;
using boost::system::errc::make_error_code;
namespace errc = boost::system::errc;

constexpr hal::Duration kCycle = 20ms;
// Never below three times the longest period that any manual gives.
constexpr hal::Duration kMotionSilence = 200ms;
// So long after a cycle was due we were held up: what came meanwhile waits in the link.
constexpr hal::Duration kHeldUp = 2 * kCycle;
constexpr hal::Duration kHeldUpMax = 1s;     // Longer is trouble of its own.
constexpr hal::Duration kHearing = 1ms;      // Nothing more came for so long: all is heard.
constexpr hal::Duration kHearingMax = 50ms;  // There is no end to it: a bus full of frames.
constexpr hal::Duration kStateSilence = 500ms;
constexpr hal::Duration kMotionGap = 50ms;
constexpr hal::Duration kStateDouble = 50ms;
constexpr hal::Duration kStopping = 1s;     // Zeros go on for so long into a silence.
constexpr hal::Duration kTryPause = 100ms;  // Between two requests for command,
constexpr int kTries = 3;                   // so many of them,
constexpr hal::Duration kTriesPause = 1s;   // and then a while none.
constexpr hal::Duration kQueryPause = 1s;   // Between two questions for the version.
constexpr hal::Duration kQueryMax = 5s;     // No answer will come any more.
constexpr hal::Duration kAnswerLate = 100ms;
constexpr hal::Duration kRemembered = 2s;  // Troubles that come and go are shown for so long.
constexpr hal::Duration kListening = 1s;   // Before silence at the start is trouble.
constexpr hal::Duration kReleaseStand = 200ms;
// The proof of the base's own time-out.
constexpr agilex::MotionCommand kCreep{.forward_mmps = 20};
constexpr int kCreeps_mmps = 10, kStands_mmps = 4;  // What it reports.
constexpr hal::Duration kCreepMax = 1s;             // Until it is seen to move.
// After 500 ms it brakes: by then at half speed, by then it stands.
constexpr hal::Duration kHalfMax = 800ms, kStandsMax = 1200ms;
// 0x000 to 0x22F, 0x260 to 0x7FF, and all extended ids: what a wrong device sends is heard too.
constexpr hal::CanFilter kFilters[] = {{0x000, 0x600}, {0x200, 0x7E0}, {0x220, 0x7F0},
                                       {0x260, 0x7E0}, {0x280, 0x780}, {0x300, 0x700},
                                       {0x400, 0x400}, {0, 0, true}};
constexpr int kStrangers = 3;  // So many strange frames are no accident.

constexpr Fault kFaults[] = {
    {1, "no reports from the base", "switched off, cable loose, or the bus adapter's other end",
     "switch the base on; check its CAN plug (rear) and the adapter"},
    {2, "nobody acknowledges on the bus", "base off, cable loose or not terminated",
     "switch the base on; check CAN-H, CAN-L and the 120 ohm terminations"},
    {3, "CAN bus down", "wrong bit rate, a short circuit, or the adapter was unplugged",
     "set 500 kbit/s; check CAN-H against CAN-L; plug the adapter in"},
    {4, "base speaks protocol version 1", "an older base or firmware (frames 0x131, 0x151, 0x20x)",
     "have the maker update the base to version 2; it is not driven before"},
    {5, "another device on the bus", "wrong CAN channel, or the base is not an AgileX",
     "check which channel the base hangs on and what the robot file calls the drive"},
    {6, "e-stop pressed", "somebody pressed it, or its circuit is open",
     "make sure that it is safe, then release the e-stop"},
    {7, "remote control has command", "the transmitter is switched to manual driving",
     "switch the transmitter to command mode, or off"},
    {8, "base reports an exception", "see its other faults; also an e-stop toggled in RC mode",
     "clear the cause; if it stays, switch the base off and on"},
    {9, "base does not give command", "its firmware refuses CAN mode",
     "switch the transmitter off; switch the base off and on"},
    {10, "base's state is frozen", "its message counter stands still",
     "switch the base off and on; if it comes again, service"},
    {11, "reports are missing", "bus overloaded or disturbed, or the base is slow",
     "check cable and terminations, and what else sends on the bus"},
    {12, "reports doubled or out of order", "two adapters, a bridge or a repeater on the bus",
     "take the bridge out; one program only may drive the base"},
    {13, "unreadable reports", "another device uses the base's ids, or a disturbed bus",
     "check what else sends on the bus, and the cable"},
    {14, "base answers late", "a slow bridge, or a bus that is overloaded",
     "connect the base directly; lower the load on the bus"},
    {15, "odometry jumped", "the base restarted, or another device uses its ids",
     "nothing if the base was restarted; else check what else sends on the bus"},
    {16, "odometry and speed disagree",
     "a wheel sensor counts wrongly, or other wheels are mounted",
     "drive a measured metre; check the wheel sensors; service"},
    {17, "way blocked", "the wheels stand though they are told to turn",
     "free the robot; see whether something blocks its wheels"},
    {18, "another program commands the base", "its commands were seen on the bus",
     "end the other program; take its adapter off the bus"},
};
enum Which {
  kSilent,
  kNoAck,
  kBusDown,
  kVersion1,
  kStranger,
  kEstop,
  kRc,
  kException,
  kRefused,
  kFrozen,
  kGaps,
  kDoubled,
  kUnread,
  kLate,
  kJumped,
  kDisagree,
  kBlocked,
  kForeign
};

Trouble trouble(Which which, std::string detail = {}) {
  return {&kFaults[which], std::move(detail)};
}

std::string milliseconds(hal::Duration span) {
  return std::to_string(span / 1ms) + " ms";
}

std::string hex(std::uint32_t id) {
  constexpr std::string_view kDigits = "0123456789ABCDEF";
  std::string text = "0x";
  for (int shift = id > 0x7FF ? 28 : 8; shift >= 0; shift -= 4) text += kDigits[id >> shift & 0xF];
  return text;
}

std::string number(std::uint16_t version) {
  return std::to_string(version >> 8) + "." + std::to_string(version & 0xFF);
}

bool within(hal::Time at, hal::Time now, hal::Duration span) {
  return at != hal::Time{} && now - at <= span;
}

agilex::Limits limits_of(AgilexDrive::Model model) {
  return model == AgilexDrive::Model::scout2 ? agilex::kScout2 : agilex::kScoutMini;
}

struct Sides {
  double left_mps, right_mps;
};
// Of what was told, or of what is.
template <class T>
Sides sides(const T& motion, double track_m) {
  const double forward = motion.forward_mmps / 1000.0, rim = motion.turn_mradps / 2000.0 * track_m;
  return {forward - rim, forward + rim};
}

}  // namespace

AgilexDrive::AgilexDrive(const Config& config, hal::Clock& clock, hal::CanBus& bus)
    : config_(config),
      limits_(limits_of(config.model)),
      clock_(clock),
      bus_(bus),
      odometer_({1000, limits_of(config.model).forward_mmps / 1000.0}),
      left_{StallWatch(config.stall), {}},
      right_{StallWatch(config.stall), {}} {}

std::span<const Fault> AgilexDrive::faults() const {
  return kFaults;
}

std::span<const hal::CanFilter> AgilexDrive::filters() {
  return kFilters;
}

std::string_view AgilexDrive::model() const {
  static constexpr std::string_view kNames[]{"agilex-scout2", "agilex-scout-mini", "agilex-bunker"};
  return kNames[static_cast<std::size_t>(config_.model)];
}

hal::Task<void> AgilexDrive::run() {
  using boost::asio::experimental::awaitable_operators::operator&&;
  started_ = true;
  started_at_ = clock_.now();
  co_await (listen() && keep());
}

// --- What the base says.

hal::Task<void> AgilexDrive::listen() {
  for (;;) {
    const auto received = co_await bus_.receive();
    if (received) {
      ++frames_heard_;
      receive_error_ = {};
      hear(*received);
    } else {
      receive_error_ = received.error();
    }
  }
}

void AgilexDrive::hear(const hal::ReceivedFrame& received) {
  const agilex::Message message = agilex::decode(received.frame, agilex::Dialect::v2);
  if (const auto* unread = std::get_if<Unread>(&message)) {
    if (unread->why == "unknown id" || received.frame.extended) return hear_other(received);
    heard_.unread_at = received.stamp;
    heard_.unread_why = unread->why;
    return hear_other(received);
  }
  std::visit(
      [&](const auto& known) {
        if constexpr (requires { on(known, received.stamp); }) on(known, received.stamp);
      },
      message);
}

void AgilexDrive::hear_other(const hal::ReceivedFrame& received) {
  if (agilex::dialect_of(received.frame) == agilex::Dialect::v1) {
    ++heard_.v1_frames;
    heard_.v1_at = received.stamp;
    return;
  }
  ++heard_.other_frames;
  heard_.other_at = received.stamp;
  heard_.other_id = received.frame.id;
}

void AgilexDrive::on(const agilex::SystemState& system, hal::Time at) {
  const bool known = heard_.system.has_value();
  const auto step = static_cast<std::uint8_t>(system.count - (known ? heard_.system->count : 0));
  if (known && at - heard_.system_at > kStateSilence) {
    heard_.lost_at = {};  // It was away: that is another trouble than single reports lost.
  } else if (known && step > 1 && step < 128) {
    heard_.lost_at = at;
    heard_.lost_reports = step - 1;
  } else if (known && (step >= 128 || (step == 0 && at - heard_.system_at < kStateDouble))) {
    heard_.doubled_at = at;
  }
  if (!known || step != 0) heard_.count_at = at;
  heard_.system = system;
  heard_.system_at = at;
  if (!silence_over_) on_silence_over();
}

// Standby after a silence: it was switched off in the meantime, and counts from zero.
void AgilexDrive::on_silence_over() {
  silence_over_ = true;
  if (heard_.system->mode != agilex::ControlMode::can) odometer_.restart();
  tries_ = 0;
  cleared_ = answer_due_ = false;
  next_try_ = next_query_ = {};
}

void AgilexDrive::on(const agilex::MotionState& motion, hal::Time at) {
  moves_ = motion;
  const hal::Duration gap = at - heard_.motion_at;
  if (heard_.motion_at != hal::Time{} && gap > kMotionGap && gap <= kMotionSilence) {
    heard_.late_at = at;
    heard_.gap = gap;
  }
  if (heard_.motion_at != hal::Time{} && gap > kMotionSilence) silence_over_ = false;
  heard_.motion_at = at;
}

void AgilexDrive::on(const agilex::Odometry& odometry, hal::Time at) {
  if (!silence_over_ || !within(heard_.system_at, at, kStateSilence)) return;  // Whose is it?
  if (!odometer_.update(odometry.left_mm, odometry.right_mm, at)) return;
  watch_sides(at);
  odometry_heard_.notify();
}

void AgilexDrive::watch_sides(hal::Time now) {
  const Sides told = drives(now) ? sides(told_, config_.track_m) : Sides{};
  const Sides speed = sides(moves_, config_.track_m);
  left_.update(told.left_mps, speed.left_mps, odometer_.left_m(), odometer_.step());
  right_.update(told.right_mps, speed.right_mps, odometer_.right_m(), odometer_.step());
  const hal::Duration stands = std::max(left_.stall.standing(), right_.stall.standing());
  if (stands < config_.stall.after + answer_took_) return;  // Late news are no standstill.
  way_.block({told_.forward_mmps / 1000.0, told_.turn_mradps / 1000.0});
  wanted_ = {};
  left_.stall.reset();
  right_.stall.reset();
}

void AgilexDrive::on(const agilex::MotorSlow& motor, hal::Time) {
  heard_.motor_bits[std::size_t{motor.motor} - 1] = motor.fault_bits;
}

void AgilexDrive::on(const agilex::Version& version, hal::Time at) {
  if (answer_due_) answer_took_ = at - asked_at_;
  answer_due_ = false;
  identity_.maker = "AgileX Robotics";
  identity_.model = model();
  identity_.firmware = "main board " + number(version.board_software) + ", drivers " +
                       number(version.driver_software);
}

// Nobody but us may command it, and what we send does not come back to us.
void AgilexDrive::on(const agilex::MotionCommand&, hal::Time at) {
  heard_.foreign_at = at;
}

// --- What it is told.

hal::Task<void> AgilexDrive::hear_what_waits() {
  const hal::Time late = clock_.now() + kHearingMax;
  for (std::uint64_t before = frames_heard_ + 1; before != frames_heard_ && clock_.now() < late;) {
    before = frames_heard_;
    co_await clock_.sleep_for(kHearing);
  }
}

hal::Task<void> AgilexDrive::keep() {
  attended_at_ = clock_.now();
  for (hal::Time next = clock_.now();; next = std::max(next + kCycle, clock_.now())) {
    co_await clock_.sleep_until(next);
    if (clock_.now() - attended_at_ > kCycle + kHeldUp) co_await hear_what_waits();
    const hal::Time now = attended_at_ = clock_.now();
    if (heard_.system && !talks(now)) silence_over_ = false;
    if (talks(now)) talked_at_ = now;
    ran_ = ran_ || drives(now);
    if (now >= next_query_ && (!answer_due_ || now - asked_at_ > kQueryMax)) {
      next_query_ = now + kQueryPause;
      asked_at_ = now;
      answer_due_ = true;
      co_await send(encode(agilex::VersionQuery{}));
    }
    if (const auto frame = next_frame(now)) co_await send(*frame);
  }
}

hal::Task<void> AgilexDrive::send(const hal::CanFrame& frame) {
  const auto sent = co_await bus_.send(frame, clock_.now() + kCycle);
  send_error_ = sent ? boost::system::error_code{} : sent.error();
}

std::optional<hal::CanFrame> AgilexDrive::next_frame(hal::Time now) {
  const bool rolled = told_.forward_mmps != 0 || told_.turn_mradps != 0;
  told_ = {};
  if (!talks(now))  // It may still hear.
    return within(talked_at_, now, kStopping) ? std::optional(encode(told_)) : std::nullopt;
  const agilex::SystemState& system = *heard_.system;
  if (system.mode == agilex::ControlMode::rc)  // More than one would fight the person.
    return rolled ? std::optional(encode(told_)) : std::nullopt;
  if (released_ && now - released_at_ > kReleaseStand)
    return system.mode == agilex::ControlMode::can
               ? std::optional(encode(agilex::ControlModeCommand{agilex::ControlMode::standby}))
               : std::nullopt;
  if (system.mode != agilex::ControlMode::can) return take_command(now);
  tries_ = 0;
  if (system.vehicle == agilex::VehicleState::exception && !std::exchange(cleared_, true))
    return encode(agilex::ResetCommand{});
  if (system.vehicle == agilex::VehicleState::normal) cleared_ = false;
  if (!drives(now)) return encode(told_);
  told_ = proof_ == Proof::none ? motion(now) : kCreep;
  if (proof_ == Proof::nothing) return std::nullopt;
  return encode(told_);
}

// Clears faults once, then asks for command a few times, then lets the base think.
std::optional<hal::CanFrame> AgilexDrive::take_command(hal::Time now) {
  if (released_ || now < next_try_) return std::nullopt;
  const agilex::SystemState& system = *heard_.system;
  if (system.vehicle == agilex::VehicleState::estop_pressed) return std::nullopt;
  next_try_ = now + kTryPause;
  const bool faulty = system.vehicle == agilex::VehicleState::exception || system.fault_bits != 0;
  if (faulty && !std::exchange(cleared_, true)) return encode(agilex::ResetCommand{});
  if (++tries_ % kTries == 0) next_try_ = now + kTriesPause;
  return encode(agilex::ControlModeCommand{agilex::ControlMode::can});
}

agilex::MotionCommand AgilexDrive::motion(hal::Time now) {
  if (now - wanted_at_ > config_.command_max || way_.blocked() || released_) return {};
  return agilex::motion_command(wanted_, limits_);
}

hal::Task<hal::Result<void>> AgilexDrive::command(hal::Twist twist) {
  if (!std::isfinite(twist.forward_mps) || !std::isfinite(twist.turn_radps))
    co_return make_error_code(errc::invalid_argument);
  const hal::Time now = clock_.now();
  wanted_ = {};
  const bool stands = twist.forward_mps == 0 && twist.turn_radps == 0;
  const bool rolls = told_.forward_mmps != 0 || told_.turn_mradps != 0;
  if (stands && rolls && proof_ == Proof::none && talks(now)) {  // Not only in the next cycle.
    told_ = {};
    co_await send(encode(told_));
  }
  if (way_.refuses(twist)) co_return make_error_code(errc::io_error);
  if (const auto why = disobeys(now)) co_return why;
  wanted_ = twist;
  wanted_at_ = now;
  co_return hal::Result<void>{};
}

boost::system::error_code AgilexDrive::disobeys(hal::Time now) const {
  if (!talks(now) || released_) return make_error_code(errc::not_connected);
  if (held()) return make_error_code(errc::operation_not_permitted);
  return drives(now) ? boost::system::error_code{} : make_error_code(errc::not_connected);
}

hal::DriveStatus AgilexDrive::status() const {
  const hal::Time now = heard_until(clock_.now());
  const bool known = within(heard_.system_at, now, kStateSilence);
  hal::DriveStatus status;
  status.reported_at = heard_.motion_at;
  status.silent = !talks(now);
  status.held = held();
  status.estop_pressed = known && heard_.system->vehicle == agilex::VehicleState::estop_pressed;
  status.remote_control = known && heard_.system->mode == agilex::ControlMode::rc;
  status.commanded_by_others = within(heard_.foreign_at, now, kRemembered);
  return status;
}

hal::Task<hal::Result<hal::Duration>> AgilexDrive::prove_timeout() {
  struct Guard {  // Also when cancelled: the next command makes it stand.
    Proof& proof;
    ~Guard() { proof = Proof::none; }
  };
  if (const auto why = disobeys(clock_.now())) co_return why;
  const Guard guard{proof_};
  auto took = co_await creep_then_say_nothing();
  proof_ = Proof::none;
  const hal::Twist stand;
  (void)co_await command(stand);
  co_return took;
}

hal::Task<hal::Result<hal::Duration>> AgilexDrive::creep_then_say_nothing() {
  proof_ = Proof::creep;
  const hal::Time began = clock_.now();
  while (moves_.forward_mmps < kCreeps_mmps) {
    if (clock_.now() - began > kCreepMax) co_return make_error_code(errc::io_error);
    co_await clock_.sleep_for(kCycle);
    if (const auto why = disobeys(clock_.now())) co_return why;
  }
  proof_ = Proof::nothing;
  const hal::Time silent = clock_.now();
  int fastest_mmps = 0;
  while (moves_.forward_mmps > kStands_mmps) {
    fastest_mmps = std::max<int>(fastest_mmps, moves_.forward_mmps);
    const hal::Duration waited = clock_.now() - silent;
    const bool brakes = waited <= kHalfMax || 2 * moves_.forward_mmps <= fastest_mmps;
    if (!brakes || waited > kStandsMax) co_return make_error_code(errc::timed_out);
    co_await clock_.sleep_for(kCycle);
    if (const auto why = disobeys(clock_.now())) co_return why;
  }
  co_return clock_.now() - silent;
}

hal::Task<hal::Result<hal::WheelTravel>> AgilexDrive::next_travel() {
  while (!odometer_.fresh()) co_await odometry_heard_.wait();
  co_return odometer_.take();
}

hal::Task<void> AgilexDrive::release() {
  released_ = true;
  released_at_ = clock_.now();
  const hal::Time late = released_at_ + kReleaseStand + 1s;
  while (clock_.now() < late &&
         (clock_.now() - released_at_ <= kReleaseStand || drives(clock_.now())))
    co_await clock_.sleep_for(kCycle);
}

// --- How it is.

// Until a cycle shows that we were not held up, we know of no later time whether the base spoke.
hal::Time AgilexDrive::heard_until(hal::Time now) const {
  if (now - attended_at_ > kHeldUpMax) return now;
  return std::min(now, attended_at_ + kCycle + kHeldUp);
}

bool AgilexDrive::frozen(hal::Time now) const {
  now = heard_until(now);
  return within(heard_.system_at, now, kStateSilence) && now - heard_.count_at > kStateSilence;
}

bool AgilexDrive::talks(hal::Time now) const {
  now = heard_until(now);
  return within(heard_.system_at, now, kStateSilence) &&
         within(heard_.motion_at, now, kMotionSilence) && !frozen(now) && silence_over_;
}

bool AgilexDrive::held() const {
  return heard_.system && (heard_.system->vehicle != agilex::VehicleState::normal ||
                           heard_.system->mode == agilex::ControlMode::rc);
}

bool AgilexDrive::drives(hal::Time now) const {
  return talks(now) && !held() && heard_.system->mode == agilex::ControlMode::can;
}

DeviceState AgilexDrive::state() const {
  if (!started_) return DeviceState::off;
  const hal::Time now = clock_.now();
  if (drives(now)) return DeviceState::running;
  return talks(now) || !ran_ ? DeviceState::starting : DeviceState::lost;
}

std::vector<Trouble> AgilexDrive::troubles() const {
  std::vector<Trouble> all;
  if (!started_) return all;
  const hal::Time now = clock_.now();
  add_link_troubles(all, now);
  if (within(heard_.system_at, now, kStateSilence)) add_base_troubles(all, now);
  add_report_troubles(all, now);
  return all;
}

// Why nothing comes: the most telling reason first.
void AgilexDrive::add_link_troubles(std::vector<Trouble>& all, hal::Time now) const {
  const hal::Time heard = std::max(heard_.system_at, heard_.motion_at);
  const bool waited = now - started_at_ > kListening;
  if (talks(now) || frozen(now) || (heard == hal::Time{} && !waited)) return;
  if (receive_error_ || send_error_ == errc::network_down)
    all.push_back(trouble(kBusDown, (receive_error_ ? receive_error_ : send_error_).message()));
  else if (send_error_ == errc::timed_out)
    all.push_back(trouble(kNoAck));
  if (heard_.v1_frames >= kStrangers && within(heard_.v1_at, now, kListening))
    all.push_back(trouble(kVersion1));
  if (heard_.other_frames >= kStrangers && within(heard_.other_at, now, kListening))
    all.push_back(trouble(kStranger, "it sends " + hex(heard_.other_id)));
  if (all.empty())
    all.push_back(trouble(kSilent, heard == hal::Time{} ? "none since the start"
                                                        : "none for " + milliseconds(now - heard)));
}

void AgilexDrive::add_base_troubles(std::vector<Trouble>& all, hal::Time now) const {
  const agilex::SystemState& system = *heard_.system;
  if (system.vehicle == agilex::VehicleState::estop_pressed) all.push_back(trouble(kEstop));
  if (system.vehicle == agilex::VehicleState::exception) all.push_back(trouble(kException));
  if (system.mode == agilex::ControlMode::rc) all.push_back(trouble(kRc));
  if (tries_ >= kTries)
    all.push_back(trouble(kRefused, "asked " + std::to_string(tries_) + " times"));
  if (frozen(now)) all.push_back(trouble(kFrozen, "at " + std::to_string(system.count)));
  for (const Fault* fault : faults_set(agilex::system_faults(), system.fault_bits))
    all.push_back({fault, {}});
  for (std::size_t i = 0; i < heard_.motor_bits.size(); ++i)
    for (const Fault* fault : faults_set(agilex::motor_faults(), heard_.motor_bits[i]))
      all.push_back({fault, "motor " + std::to_string(i + 1)});
  if (way_.blocked()) all.push_back(trouble(kBlocked));
  if (within(heard_.foreign_at, now, kRemembered)) all.push_back(trouble(kForeign));
}

void AgilexDrive::add_report_troubles(std::vector<Trouble>& all, hal::Time now) const {
  if (within(heard_.lost_at, now, kRemembered))
    all.push_back(trouble(kGaps, std::to_string(heard_.lost_reports) + " states lost"));
  else if (within(heard_.late_at, now, kRemembered))
    all.push_back(trouble(kGaps, "none for " + milliseconds(heard_.gap)));
  if (within(heard_.doubled_at, now, kRemembered)) all.push_back(trouble(kDoubled));
  if (within(heard_.unread_at, now, kRemembered))
    all.push_back(trouble(kUnread, std::string(heard_.unread_why)));
  if (answer_took_ > kAnswerLate && talks(now))
    all.push_back(trouble(kLate, "after " + milliseconds(answer_took_)));
  if (odometer_.doubtful()) all.push_back(trouble(kJumped));
  if (left_.agreement.disagree() || right_.agreement.disagree()) all.push_back(trouble(kDisagree));
}

}  // namespace drivers
