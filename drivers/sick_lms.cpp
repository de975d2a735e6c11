#include "drivers/sick_lms.hpp"

#include <cmath>
#include <numbers>

namespace drivers {
namespace {

using namespace std::chrono_literals;
using namespace profile_fault;

constexpr Fault kImpossible{0, "impossible settings",
                            "the robot file asks for what no such model has",
                            "correct the scanner's settings in the robot file"};
constexpr Fault kSilent{
    2, "no answer", "no power, still starting (up to 90 s), a cable, or a wrong address or speed",
    "check power and cable; CoLa answers on TCP port 2111 or 2112, or on a "
    "serial line at 57600 baud"};
constexpr Fault kGarbage{3, "not CoLa", "another device, or a serial line at the wrong speed",
                         "check what is connected there; set the serial line to 57600 baud"};
constexpr Fault kRefused{5, "setting refused", "the scanner does not accept a setting",
                         "see the detail; compare the settings with the model's"};
constexpr Fault kReadBack{6, "settings differ", "the scanner is not set as it was told to be",
                          "let no other program set it; if it stays, restart the scanner"};
constexpr Fault kDamaged{8, "damaged telegrams", "bytes change or go missing on the way",
                         "check the cable and its shield"};

constexpr hal::Duration kStartTimeout = 10s;
constexpr hal::Duration kForgetClock = 60s;  // Without scans the wraps cannot be told any more.
constexpr int kCleanAgain = 100;
constexpr std::uint32_t kJustStarted = 0x0100;

}  // namespace

SickLms::SickLms(SickLmsConfig config, hal::Clock& clock, hal::ByteStream& stream)
    : ProfileLoop({.frame_max = kColaFrameMax,
                   .look = look_cola,
                   .start_max = kStartTimeout,
                   .profiles_max = config.profiles_max,
                   .retry_s = config.retry_s,
                   .silent = &kSilent,
                   .garbage = &kGarbage},
                  clock, stream),
      config_(config) {}

SickLms::~SickLms() = default;

std::string_view SickLms::model() const {
  return config_.settings.lms5xx ? "sick-lms5xx" : "sick-lms1xx";
}

SickLms::Counts SickLms::counts() const {
  Counts counts = counts_;
  counts.lost += queue_.dropped();
  counts.repeated = watch_.repetitions();
  counts.out_of_order = watch_.disorders();
  return counts;
}

double SickLms::period_s() const {
  return 100.0 * config_.settings.every_nth_scan / config_.settings.frequency_centihz;
}

hal::Task<void> SickLms::run() {
  if (const auto problem = lms_settings_problem(config_.settings); !problem.empty()) {
    troubles_.set(kImpossible, problem);
    for (;;) co_await clock_.sleep_for(kForgetClock);
  }
  co_await ProfileLoop::run();
}

void SickLms::begin_session() {
  ++counts_.sessions;
  asked_ = nullptr;
  forget_clock();  // It may have been without power, for however long.
  set_up_lost_ = false;
  damaged_ = 0;
}

hal::Task<bool> SickLms::set_up() {
  const bool talks = co_await find_dialect();
  if (!talks) co_return false;
  const bool known = co_await identify();
  if (!known) co_return false;
  co_return co_await apply_settings();
}

void SickLms::clear_set_up_troubles() {
  for (const Fault* fault : {&kRefused, &kReadBack}) troubles_.clear(*fault);
}

// The last dialect first.
hal::Task<bool> SickLms::find_dialect() {
  for (int attempt = 0; attempt < 2; ++attempt) {
    if (const auto answer = co_await ask(lms_hello(dialect_))) {
      dialect_ = answer->message().dialect;
      co_return true;
    }
    dialect_ = dialect_ == ColaDialect::binary ? ColaDialect::ascii : ColaDialect::binary;
  }
  tell_silence("to the question for its state, in CoLa B and in CoLa A");
  co_return false;
}

hal::Task<bool> SickLms::identify() {
  identity_ = {};
  identity_.maker = "SICK";
  const auto model = co_await ask(lms_model(dialect_));
  if (model && model->accepted) identity_.model = lms_text(model->message());
  const std::string_view family = config_.settings.lms5xx ? "LMS5" : "LMS1";
  if (identity_.model.empty() || identity_.model.starts_with(family)) co_return true;
  troubles_.set(kOtherModel,
                "it says it is a " + identity_.model + ", not of " + std::string(family) + "xx");
  co_return false;
}

hal::Task<bool> SickLms::apply_settings() {
  for (const LmsStep& step : lms_startup(dialect_, config_.settings)) {
    if (step.command == "sEA") continue;  // Scans come between start() and stop() only.
    if (!step.may_fail) {
      if (!co_await insist(step)) co_return false;
      continue;
    }
    const auto answer = co_await ask(step);
    if (answer && answer->accepted && step.name == "FirmwareVersion")
      identity_.firmware = lms_text(answer->message());
  }
  co_return co_await read_back();
}

hal::Task<bool> SickLms::read_back() {
  for (const LmsStep& step : lms_read_back(dialect_)) {
    const auto answer = co_await ask(step);
    if (!answer || !answer->accepted) continue;  // The scans themselves will tell.
    const auto problem = lms_read_back_problem(config_.settings, answer->message());
    if (problem.empty()) continue;
    troubles_.set(kReadBack, problem);
    co_return false;
  }
  co_return true;
}

// An accepted answer, or a trouble.
hal::Task<bool> SickLms::insist(const LmsStep& step) {
  const auto answer = co_await ask(step);
  if (answer && answer->accepted) co_return true;
  if (answer)
    troubles_.set(kRefused, answer->refusal);
  else if (!troubles_.has(kUnplugged))
    troubles_.set(kSilent, "when asked to " + std::string(step.purpose));
  co_return false;
}

hal::Task<std::optional<SickLms::Answer>> SickLms::ask(const LmsStep& step) {
  const hal::Time deadline = clock_.now() + hal::from_seconds(step.timeout_s);
  asked_ = &step;
  answer_.reset();
  co_await write(step.request, deadline);
  while (!answer_ && co_await answered_.wait_until(clock_, deadline)) {
  }
  asked_ = nullptr;
  co_return std::exchange(answer_, std::nullopt);
}

hal::Task<bool> SickLms::is_alive() {
  const LmsStep hello = lms_hello(dialect_);
  co_return co_await insist(hello);
}

hal::Task<bool> SickLms::revive() {
  co_return co_await stream(true);
}

hal::Task<bool> SickLms::stream(bool on) {
  const bool again = on && streaming_;
  if (!again && (interrupted_ || clock_.now() - last_scan_ > kForgetClock)) forget_clock();
  if (!again && !interrupted_) {  // What was not asked for is not lost.
    sequence_ = LmsSequence();
    last_start_us_.reset();
    queue_.clear();
  }
  if (!again) last_scan_ = clock_.now();
  const auto steps = on ? lms_startup(dialect_, config_.settings) : lms_stop(dialect_);
  if (!co_await insist(steps.back())) co_return false;
  streaming_ = on;
  interrupted_ = false;
  switched_.notify();
  co_return true;
}

void SickLms::forget_clock() {
  fit_ = ClockFit();
  unwrap_us_ = Unwrap();
  last_start_us_.reset();
}

hal::Task<hal::Result<void>> SickLms::stop() {
  interrupted_ = false;
  co_return co_await ProfileLoop::stop();
}

void SickLms::take(ByteView frame, hal::Time arrival) {
  const auto message = parse_cola(frame);
  if (!message) return;
  if (message->name == "LMDscandata" && message->command == "sSN") {
    if (streaming_ || wanted_) take_scan(*message, arrival);
    return;
  }
  if (asked_ == nullptr || answer_) return;
  const LmsAnswer verdict = lms_judge(*asked_, *message);
  if (verdict == LmsAnswer::unrelated) return;
  const bool accepted = verdict == LmsAnswer::accepted;
  answer_ = Answer{accepted,
                   {frame.begin(), frame.end()},
                   accepted ? std::string() : lms_refusal(*asked_, *message)};
  answered_.notify();
}

void SickLms::take_scan(const ColaMessage& message, hal::Time arrival) {
  if (const auto why = decode_lms_scan(message, scan_); !why.empty()) {
    ++counts_.unreadable;
    clean_ = 0;
    troubles_.set(kDamaged, std::string(why));
    return;
  }
  const LmsChannel* const channel = scan_.distances();
  if (channel == nullptr || !as_set_up(*channel)) {
    troubles_.set(kReadBack, "the scans are not as they were asked for");
    set_up_lost_ = true;
    changed_.notify();
    return;
  }
  const std::uint64_t lost_before = sequence_.lost();
  const std::optional<std::uint32_t> previous_us = last_start_us_;
  if (!is_new(arrival)) return;
  const std::uint64_t lost = sequence_.lost() - lost_before;
  const auto step_us = previous_us ? scan_.scan_start_us - *previous_us : 0U;
  counts_.lost += lost;
  judge_damage();
  judge_status();
  const std::int64_t sent_us = unwrap_us_(scan_.transmit_us);
  fit_.add(sent_us * 1000, arrival);
  watch_.came(step_us / 1e6, period_s(), fit_.last_excess_s(), lost);
  const std::uint32_t before_sending_us = scan_.transmit_us - scan_.scan_start_us;
  add_profile(*channel, *fit_.to_ours((sent_us - before_sending_us) * 1000), lost);
}

// Neither a repetition nor older than one that was taken.
bool SickLms::is_new(hal::Time arrival) {
  const auto later_us = static_cast<std::int32_t>(scan_.scan_start_us - last_start_us_.value_or(0));
  if (last_start_us_ && later_us < 0 && later_us > -1'000'000) {
    watch_.out_of_order();
    return false;
  }
  const auto seen = sequence_.see(scan_);
  if (seen == LmsSequence::Seen::repeated) {
    watch_.repeated("scan " + std::to_string(scan_.scan_counter));
    return false;
  }
  if (seen == LmsSequence::Seen::restarted) forget_clock();
  troubles_.clear(kQuiet);
  last_start_us_ = scan_.scan_start_us;
  last_scan_ = arrival;
  return true;
}

void SickLms::judge_damage() {
  const std::uint64_t damaged = bytes_skipped();
  clean_ = damaged == damaged_ ? clean_ + 1 : 0;
  damaged_ = damaged;
  if (clean_ == 0) troubles_.set(kDamaged, std::to_string(damaged) + " bytes of no telegram");
  if (clean_ == kCleanAgain) troubles_.clear(kDamaged);
}

void SickLms::judge_status() {
  if (scan_.status == status_) return;
  status_ = scan_.status;
  for (const Fault* fault : status_faults_) troubles_.clear(*fault);
  status_faults_ = lms_faults(scan_);
  std::erase_if(status_faults_, [](const Fault* fault) { return fault->value == kJustStarted; });
  for (const Fault* fault : status_faults_) troubles_.set(*fault, "as its status says");
}

bool SickLms::as_set_up(const LmsChannel& channel) const {
  const LmsSettings& s = config_.settings;
  const auto beams = (s.stop_1e4deg - s.start_1e4deg) / s.resolution_1e4deg + 1;
  return scan_.scan_frequency_centihz == static_cast<std::uint32_t>(s.frequency_centihz) &&
         std::abs(channel.step_1e4deg - s.resolution_1e4deg) <= 1 &&
         std::abs(channel.start_1e4deg - s.start_1e4deg) <= 10 &&
         std::abs(static_cast<std::int32_t>(channel.raw.size()) - beams) <= 1;
}

void SickLms::add_profile(const LmsChannel& channel, hal::Time stamp, std::uint64_t lost) {
  hal::Profile profile;
  profile.stamp = stamp;
  profile.beam_period_s = beam_delay_s(scan_, channel, 1);
  profile.angle_first_rad = beam_angle_rad(channel, 0);
  profile.angle_step_rad = beam_angle_rad(channel, 1) - profile.angle_first_rad;
  profile.ranges_m = lms_ranges_m(channel, config_.settings.lms5xx);
  for (const auto& rssi : scan_.channels16)
    if (rssi.label() == "RSSI1") profile.intensities.assign(rssi.raw.begin(), rssi.raw.end());
  profile.lost_before = lost;
  queue_.put(std::move(profile));
  ++counts_.profiles;
}

}  // namespace drivers
