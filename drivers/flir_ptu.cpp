#include "drivers/flir_ptu.hpp"

#include <algorithm>
#include <array>
#include <boost/asio/experimental/awaitable_operators.hpp>
#include <cmath>
#include <utility>

#include "drivers/stream_health.hpp"
#include "drivers/text.hpp"

namespace drivers {
namespace {

using namespace std::chrono_literals;
using namespace boost::asio::experimental::awaitable_operators;
namespace errc = boost::system::errc;
using errc::make_error_code;

constexpr Fault kUnplugged{1, "no connection", "the cable, the network or the unit's power",
                           "check power, cable and address; it comes back by itself"};
constexpr Fault kSilent{2, "no answer",
                        "no power, its own reset after power-up (up to 20 s), a cable, or a wrong "
                        "address or speed",
                        "check power and cable; it answers on TCP port 4000, or on a serial line "
                        "at 9600 baud"};
constexpr Fault kGarbage{3, "no pan-tilt unit's answers",
                         "another device, or a serial line at the wrong speed",
                         "check what is connected there; set the serial line to 9600 baud"};
constexpr Fault kOtherModel{4, "wrong model",
                            "its steps are of another size than the robot file says",
                            "connect the right one, or correct the robot file; step modes change "
                            "the size too"};
constexpr Fault kRefused{5, "setting refused", "the unit does not accept a setting",
                         "see the detail; compare with the unit's limits"};
constexpr Fault kReadBack{6, "settings differ", "the unit is not set as it was told to be",
                          "let no other program set it; if it stays, restart the unit"};
constexpr Fault kStalled{7, "does not get there",
                         "blocked, too heavy a load, or steps that got lost",
                         "clear the way; then reset the unit, so that it finds its zero again"};
constexpr Fault kLate{8, "answers late", "something between unit and computer holds them up",
                      "connect directly; take other traffic off the line"};
constexpr Fault kOutOfStep{9, "answers out of step",
                           "answers come twice or belong to other requests",
                           "let only one program talk to it; check the cable"};
constexpr Fault kLimit{10, "limit hit", "the pan axis ran against its limit",
                       "reset the unit, so that it finds its zero again"};
constexpr Fault kHot{11, "too hot", "motor or head above 60 deg C", "let it rest"};
constexpr Fault kLowVoltage{12, "supply too low", "below 11 V", "check the supply and its cable"};

constexpr const Fault& kWrongBaud = stream_fault::kWrongBaud;

constexpr hal::Duration kComeBack = 10s;
constexpr hal::Duration kAnswer = 1s;
constexpr hal::Duration kResetTime = 60s;
constexpr hal::Duration kPoll = 50ms;
constexpr hal::Duration kWatchEvery = 5s;
constexpr hal::Duration kStill = 1500ms;
constexpr hal::Duration kLateAnswer = 200ms;
// For an answer at another rate, and the time of these bytes: the question, the echo and refusal of
// what stood before it, its own echo, a wordy answer.
constexpr hal::Duration kHail = 250ms;
constexpr int kHailBytes = 120;
constexpr int kInARow = 3;
constexpr int kCleanAgain = 20;

}  // namespace

FlirPtu::FlirPtu(FlirPtuConfig config, hal::Clock& clock, hal::ByteStream& stream,
                 std::optional<SettableLine> line)
    : config_(config), clock_(clock), stream_(stream), line_(std::move(line)) {
  if (!line_) return;
  other_bauds_ = rates_to_try(static_cast<int>(line_->line.baud), kPtuBauds, line_->set_baud);
  other_bauds_.erase(other_bauds_.begin());
}

FlirPtu::~FlirPtu() = default;

double FlirPtu::step_rad() const {
  return learned_ ? std::abs(axis_.angle_rad(1)) : 0;
}

hal::Task<void> FlirPtu::run() {
  for (;;) {
    state_ = DeviceState::starting;
    co_await session();
    state_ = DeviceState::lost;
    changed_.notify();
    const hal::Time again = clock_.now() + hal::from_seconds(config_.retry_s);
    // Whoever answered once has this rate, and may have to be heard again in mid-mission.
    if (unanswered_ && !learned_ && !other_bauds_.empty()) co_await hail_at_other_rates(again);
    co_await clock_.sleep_until(again);
  }
}

// Goes on where it ended the last time, but at a rate at which the unit answered then.
hal::Task<void> FlirPtu::hail_at_other_rates(hal::Time until) {
  bool answers = false;
  for (std::size_t asked = 0; asked < other_bauds_.size() && clock_.now() < until; ++asked) {
    answers = co_await answers_at(other_bauds_.front());
    if (answers) break;
    std::ranges::rotate(other_bauds_, other_bauds_.begin() + 1);
  }
  (void)line_->set_baud(static_cast<int>(line_->line.baud));  // Lost: it is opened at this rate.
  if (!answers) {
    if (!troubles_.has(kWrongBaud)) co_return;
    troubles_.clear(kWrongBaud);
    co_return judge_silence(ptu_hail());
  }
  for (const Fault* fault : {&kSilent, &kGarbage}) troubles_.clear(*fault);
  SerialLine right = line_->line;
  right.baud = static_cast<std::uint32_t>(other_bauds_.front());
  troubles_.set(kWrongBaud, "answers at " + std::to_string(right.baud) + " baud, not at " +
                                std::to_string(line_->line.baud) + ": set link = \"" +
                                to_text(LinkAddress(SerialAddress{right})) + "\"");
}

hal::Task<bool> FlirPtu::answers_at(int baud) {
  if (!line_->set_baud(baud)) co_return false;
  FrameReader reader(stream_, clock_, look_ptu, kPtuLineMax);
  const hal::Time deadline = clock_.now() + kHail + hal::from_seconds(10.0 * kHailBytes / baud);
  const Bytes question = ptu_hail();
  const auto written = co_await (stream_.write(question) || clock_.sleep_until(deadline));
  if (const auto* result = std::get_if<0>(&written); result == nullptr || !*result) co_return false;
  for (;;) {
    const auto frame = co_await reader.next(deadline);
    if (!frame) co_return false;
    if (ptu_hailed(parse_ptu(*frame))) co_return true;
  }
}

// Ends when the unit is lost; the trouble says why.
hal::Task<void> FlirPtu::session() {
  asked_ = lost_ = unanswered_ = false;
  bytes_ = 0;
  resync_ = Resync(kPtuLineMax);
  co_await (receive() || converse());
}

hal::Task<void> FlirPtu::receive() {
  std::array<std::uint8_t, 1024> buffer;
  for (;;) {
    const auto got = co_await stream_.read_some(buffer);
    if (!got) {
      troubles_.set(kUnplugged, got.error().message());
      co_return;
    }
    troubles_.clear(kUnplugged);
    const hal::Time arrival = clock_.now();
    bytes_ += *got;
    resync_.feed(ByteView(buffer).first(*got));
    while (const auto frame = resync_.next(look_ptu)) take(*frame, arrival);
  }
}

void FlirPtu::take(ByteView frame, hal::Time arrival) {
  PtuAnswer answer = parse_ptu(frame);
  if (answer.pan_limits > 0 && !resetting_) troubles_.set(kLimit, "outside a reset");
  if (!asked_ || answer_) {
    if (state_ == DeviceState::running) {
      troubles_.set(kOutOfStep, "\"" + answer.text + "\" without a request");
      in_step_ = 0;
    }
    return;
  }
  answer_ = Exchange{std::move(answer), {}, arrival};
  answered_.notify();
}

hal::Task<void> FlirPtu::converse() {
  if (!co_await bring_up()) co_return;
  for (const Fault* fault : {&kSilent, &kGarbage, &kOtherModel, &kRefused, &kReadBack})
    troubles_.clear(*fault);
  state_ = DeviceState::running;
  changed_.notify();
  co_await watch();
}

hal::Task<bool> FlirPtu::bring_up() {
  identity_ = {};
  if (!co_await set_up_talk() || !co_await learn() || !co_await find_zero()) co_return false;
  const double per_step = std::abs(axis_.angle_rad(1));
  co_return co_await set_and_check("PA", std::llround(config_.acceleration_radps2 / per_step)) &&
      co_await set_and_check("PS", std::llround(config_.speed_radps / per_step));
}

// From whatever state it is in to terse answers without echo.
hal::Task<bool> FlirPtu::set_up_talk() {
  co_await (stream_.write(ptu_query("")) || clock_.sleep_for(kAnswer));  // Ends half a command.
  co_await clock_.sleep_for(600ms);  // What it says at the start is not for us.
  for (const std::string_view command : {"ED", "FT", "I", "CI"}) {
    const auto done = co_await exchange(ptu_query(command), Expect::anything, kAnswer);
    if (done && done->answer.ok) continue;
    if (done) troubles_.set(kRefused, std::string(command) + ": " + done->answer.text);
    co_return false;
  }
  co_return true;
}

hal::Task<bool> FlirPtu::learn() {
  const auto resolution = co_await exchange(ptu_query("PR"), Expect::number, kAnswer);
  const auto arcsec = resolution ? ptu_step_arcsec(resolution->answer) : std::nullopt;
  if (!arcsec) {
    troubles_.set(kGarbage, "it does not say how large its steps are");
    co_return false;
  }
  axis_ = {*arcsec, config_.counter_clockwise};
  if (config_.arcsec_per_step > 0 &&
      std::abs(axis_.arcsec_per_step / config_.arcsec_per_step - 1) > 1e-3) {
    troubles_.set(kOtherModel, "its steps are " + std::to_string(axis_.arcsec_per_step) +
                                   " arc seconds, not " + std::to_string(config_.arcsec_per_step));
    co_return false;
  }
  const std::pair<std::string_view, std::int64_t*> limits[] = {
      {"PN", &least_}, {"PX", &greatest_}, {"PU", &speed_max_}, {"PL", &speed_min_}};
  for (const auto& [command, value] : limits) {
    const auto got = co_await query(command);
    if (!got) co_return false;
    *value = *got;
  }
  learned_ = true;
  troubles_.clear(kWrongBaud);
  identity_.maker = "FLIR";
  identity_.model = "PTU with " + std::to_string(axis_.arcsec_per_step) + " arc seconds a step";
  const auto version = co_await exchange(ptu_query("V"), Expect::anything, kAnswer);
  if (version && version->answer.ok) identity_.firmware = version->answer.text;
  co_return true;
}

hal::Task<bool> FlirPtu::find_zero() {
  const auto position = co_await query("PP");
  if (!position) co_return false;
  target_.reset();
  last_steps_ = *position;
  if (!config_.reset_at_start && *position >= least_ && *position <= greatest_ &&
      !troubles_.has(kStalled) && !troubles_.has(kLimit))
    co_return true;
  resetting_ = true;
  const auto done = co_await exchange(ptu_query("RP"), Expect::anything, kResetTime);
  resetting_ = false;
  if (!done || !done->answer.ok) {
    troubles_.set(kRefused, "reset of the pan axis");
    co_return false;
  }
  troubles_.clear(kStalled);
  troubles_.clear(kLimit);
  co_return true;
}

hal::Task<bool> FlirPtu::set_and_check(std::string_view name, std::int64_t value) {
  const auto set = co_await exchange(ptu_command(name, value), Expect::anything, kAnswer);
  if (!set || !set->answer.ok) {
    troubles_.set(kRefused, std::string(name) + std::to_string(value) + ": " +
                                (set ? set->answer.text : set.error().message()));
    co_return false;
  }
  const auto is = co_await query(name);
  if (!is) co_return false;
  if (*is != value)
    troubles_.set(kReadBack, std::string(name) + " is " + std::to_string(*is) + ", not " +
                                 std::to_string(value));
  co_return *is == value;
}

// Until the unit is lost.
hal::Task<void> FlirPtu::watch() {
  while (!lost_) {
    co_await changed_.wait_until(clock_, clock_.now() + kWatchEvery);
    if (lost_ || clock_.now() - last_exchange_ < kWatchEvery) continue;
    const auto said = co_await exchange(ptu_query("O"), Expect::anything, kAnswer);
    if (said) health_ = ptu_health(said->answer);
    if (!health_) continue;  // Old models do not know.
    const double hottest_c = std::max(health_->head_c, health_->pan_c);
    troubles_.clear(kHot);
    if (hottest_c > 60) troubles_.set(kHot, std::to_string(std::lround(hottest_c)) + " deg C");
    troubles_.clear(kLowVoltage);
    if (health_->supply_v < 11)
      troubles_.set(kLowVoltage, std::to_string(health_->supply_v) + " V");
  }
}

hal::Task<bool> FlirPtu::there() {
  const hal::Time deadline = clock_.now() + kComeBack;
  while (state_ != DeviceState::running)
    if (!co_await changed_.wait_until(clock_, deadline)) co_return false;
  co_return true;
}

hal::Task<hal::Result<FlirPtu::Exchange>> FlirPtu::exchange(Bytes request, Expect expect,
                                                            hal::Duration timeout) {
  const auto turn = co_await turns_.take();
  if (unsure_) {  // An answer may still come that belongs to no one.
    co_await clock_.sleep_for(300ms);
    unsure_ = false;
  }
  auto done = co_await ask_once(request, expect, timeout);
  if (!done) {
    if (done.error() == errc::timed_out) judge_silence(request);
    lost_ = true;
    changed_.notify();
    co_return done.error();
  }
  judge(*done);
  co_return done;
}

hal::Task<hal::Result<FlirPtu::Exchange>> FlirPtu::ask_once(const Bytes& request, Expect expect,
                                                            hal::Duration timeout) {
  const hal::Time asked = clock_.now();
  const hal::Time deadline = asked + timeout;
  answer_.reset();
  unsure_ = asked_ = true;
  const auto written = co_await (stream_.write(request) || clock_.sleep_until(deadline));
  if (const auto* result = std::get_if<0>(&written); result != nullptr && !*result) {
    asked_ = false;
    troubles_.set(kUnplugged, result->error().message());
    co_return result->error();
  }
  troubles_.clear(kUnplugged);
  while (!answer_ && co_await answered_.wait_until(clock_, deadline)) {
  }
  asked_ = false;
  if (!answer_) co_return make_error_code(errc::timed_out);
  unsure_ = false;
  Exchange done = *std::exchange(answer_, std::nullopt);
  done.asked = asked;
  const bool number = !ptu_numbers(done.answer).empty();
  if (done.answer.ok && ((expect == Expect::number && !number) ||
                         (expect == Expect::nothing && !done.answer.text.empty()))) {
    troubles_.set(kOutOfStep, "\"" + done.answer.text + "\" to " + std::string(as_text(request)));
    in_step_ = 0;
    unsure_ = true;
    co_return make_error_code(errc::protocol_error);
  }
  co_return done;
}

void FlirPtu::judge_silence(const Bytes& request) {
  if (troubles_.has(kUnplugged)) return;
  unanswered_ = true;
  if (troubles_.has(kWrongBaud)) return;
  const bool garbage = resync_.skipped().contains("not text");
  troubles_.clear(garbage ? kSilent : kGarbage);
  troubles_.set(garbage ? kGarbage : kSilent,
                garbage ? std::to_string(bytes_) + " bytes came, none of them an answer"
                        : "to \"" + std::string(as_text(request)) + "\"");
}

void FlirPtu::judge(const Exchange& done) {
  last_exchange_ = done.answered;
  if (!done.answer.echo.empty() && state_ == DeviceState::running) {  // It was without power.
    lost_ = true;
    changed_.notify();
  }
  if (++in_step_ == kCleanAgain) troubles_.clear(kOutOfStep);
  const hal::Duration took = done.answered - done.asked;
  late_ = took > kLateAnswer && !resetting_ ? late_ + 1 : 0;
  if (late_ == kInARow)
    troubles_.set(kLate, "after " + std::to_string(took / 1ms) + " ms");
  else if (late_ == 0)
    troubles_.clear(kLate);
}

hal::Task<hal::Result<std::int64_t>> FlirPtu::query(std::string_view name) {
  const auto done = co_await exchange(ptu_query(name), Expect::number, kAnswer);
  if (!done) co_return done.error();
  const auto number = ptu_integer(done->answer);
  if (!number) {
    troubles_.set(kRefused, std::string(name) + ": " + done->answer.text);
    co_return make_error_code(errc::protocol_error);
  }
  co_return *number;
}

hal::Task<hal::Result<void>> FlirPtu::command(std::string_view name, std::int64_t value) {
  const auto done = co_await exchange(ptu_command(name, value), Expect::nothing, kAnswer);
  if (!done) co_return done.error();
  if (done->answer.ok) co_return hal::Result<void>{};
  troubles_.set(kRefused, std::string(name) + std::to_string(value) + ": " + done->answer.text);
  co_return make_error_code(errc::argument_out_of_domain);
}

hal::Result<std::int64_t> FlirPtu::allowed(double angle_rad) const {
  const std::int64_t steps = axis_.steps(angle_rad);
  const bool within = angle_rad >= config_.angle_min_rad && angle_rad <= config_.angle_max_rad &&
                      steps >= least_ && steps <= greatest_;
  if (!within) return make_error_code(errc::argument_out_of_domain);
  return steps;
}

// Stands it although it should turn?
void FlirPtu::note(std::int64_t steps) {
  const bool turns = steps != last_steps_ || !target_ || std::abs(steps - *target_) <= 1;
  last_steps_ = steps;
  if (turns) moved_ = clock_.now();
  if (clock_.now() - moved_ > kStill)
    troubles_.set(kStalled, "stands at " + std::to_string(steps) + " on its way to " +
                                std::to_string(*target_));
}

hal::Task<hal::Result<void>> FlirPtu::turn_to(double angle_rad, double rate_radps) {
  if (!co_await there()) co_return make_error_code(errc::not_connected);
  const auto steps = allowed(angle_rad);
  if (!steps) co_return steps.error();
  const std::int64_t rate = std::llround(rate_radps / step_rad());
  if (rate < std::max<std::int64_t>(speed_min_, 1) || rate > speed_max_)
    co_return make_error_code(errc::argument_out_of_domain);
  if (const auto set = co_await command("PS", rate); !set) co_return set.error();
  if (const auto sent = co_await command("PP", *steps); !sent) co_return sent.error();
  target_ = *steps;
  moved_ = clock_.now();
  co_return hal::Result<void>{};
}

hal::Task<hal::Result<void>> FlirPtu::move_to(double angle_rad) {
  const auto started = co_await turn_to(angle_rad, config_.speed_radps);
  if (!started) co_return started.error();
  const double ramps_s = 2 * config_.speed_radps / config_.acceleration_radps2;
  const double way_rad = std::abs(axis_.angle_rad(*target_) - axis_.angle_rad(last_steps_));
  const hal::Time deadline =
      clock_.now() + hal::from_seconds(1.3 * way_rad / config_.speed_radps + ramps_s + 3);
  while (clock_.now() < deadline) {
    co_await clock_.sleep_for(kPoll);
    const auto position = co_await query("PP");
    if (!position) co_return position.error();
    note(*position);
    if (std::abs(*position - *target_) > 1) continue;
    const auto speed = co_await query("PD");
    if (!speed) co_return speed.error();
    if (*speed != 0) continue;
    troubles_.clear(kStalled);
    co_return hal::Result<void>{};
  }
  troubles_.set(kStalled,
                "at " + std::to_string(last_steps_) + " instead of " + std::to_string(*target_));
  co_return make_error_code(errc::timed_out);
}

hal::Task<hal::Result<void>> FlirPtu::halt() {
  if (!co_await there()) co_return make_error_code(errc::not_connected);
  const auto done = co_await exchange(ptu_query("HP"), Expect::nothing, kAnswer);
  if (!done) co_return done.error();
  target_.reset();
  if (!done->answer.ok) co_return make_error_code(errc::protocol_error);
  co_return hal::Result<void>{};
}

hal::Task<hal::Result<hal::PanReading>> FlirPtu::read() {
  if (!co_await there()) co_return make_error_code(errc::not_connected);
  const Bytes request = ptu_query("PP");
  const auto done = co_await exchange(request, Expect::number, kAnswer);
  if (!done) co_return done.error();
  const auto steps = ptu_integer(done->answer);
  if (!steps) co_return make_error_code(errc::protocol_error);
  note(*steps);
  hal::PanReading reading{done->asked, done->answered, axis_.angle_rad(*steps)};
  if (config_.bytes_per_s > 0) {  // When the request was all there and the answer began.
    const double answer_bytes = static_cast<double>(done->answer.text.size()) + 4;
    reading.asked += hal::from_seconds(static_cast<double>(request.size()) / config_.bytes_per_s);
    reading.answered -= hal::from_seconds(answer_bytes / config_.bytes_per_s);
    reading.answered = std::max(reading.answered, reading.asked);
  }
  co_return reading;
}

}  // namespace drivers
