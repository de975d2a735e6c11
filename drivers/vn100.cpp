#include "drivers/vn100.hpp"

#include <algorithm>
#include <boost/asio/experimental/awaitable_operators.hpp>
#include <cmath>

#include "drivers/recognise.hpp"

namespace drivers {
namespace {

using namespace std::chrono_literals;
using boost::asio::experimental::awaitable_operators::operator||;
namespace fault = stream_fault;

constexpr hal::Duration kProbe = 200ms;   // For an answer at the right rate.
constexpr hal::Duration kAnswer = 300ms;  // While it streams, answers queue behind packets.
constexpr int kTries = 3;
constexpr hal::Duration kPause = 500ms;   // Between two starts.
constexpr hal::Duration kGiveUp = 1s;     // Without a new sample: it may have been reset.
constexpr double kRateMost_radps = 38.4;  // 2000 degrees/s and a tenth.
constexpr double kGravity_mps2 = 9.81, kGravityOff_mps2 = 1.5;
constexpr std::int64_t kReset_ns =
    1'000'000'000;  // Its clock goes back by so much only at a reset.

Vn100Step ask_model() {
  return {"ask for its model", "VNRRG,1", "VNRRG", {"1"}, 1};
}

boost::system::error_code timed_out() {
  return boost::system::errc::make_error_code(boost::system::errc::timed_out);
}

}  // namespace

Vn100::Vn100(const Vn100Config& config, hal::Clock& clock, hal::ByteStream& stream,
             SetBaud set_baud)
    : config_(config),
      clock_(clock),
      stream_(stream),
      set_baud_(std::move(set_baud)),
      reader_(stream, clock, look_vn100, kVn100FrameMax),
      health_({1.0 / config.settings.rate_hz, 0.1}),
      baud_(config.settings.baud),
      gravity_mps2_(kGravity_mps2) {}

hal::Task<void> Vn100::run() {
  state_ = DeviceState::starting;
  for (;;) {
    co_await serve();
    if (state_ == DeviceState::running) state_ = DeviceState::lost;
    if (state_ == DeviceState::lost) samples_.fail(timed_out());
    co_await clock_.sleep_for(kPause);
  }
}

// From the start to the next loss.
hal::Task<void> Vn100::serve() {
  const bool found = co_await find();
  if (!found) co_return;
  const bool ready = co_await configure();
  if (ready) co_await listen();
}

// At the rate of its last answer first: after a loss it is there most likely.
hal::Task<bool> Vn100::find() {
  const std::vector<int> bauds = rates_to_try(baud_, kVn100Bauds, set_baud_);
  reader_.forget();
  const std::function<hal::Task<Found>(int)> ask_at = [this](int baud) { return find_at(baud); };
  const Found found = co_await search_port(clock_, bauds, ask_at);
  if (found != Found::nothing) co_return found == Found::ours;
  name_silence();
  co_return false;
}

hal::Task<Found> Vn100::find_at(int baud) {
  if (set_baud_ && !set_baud_(baud)) {
    co_await clock_.sleep_for(kProbe);
    co_return Found::nothing;
  }
  const Vn100Step who = ask_model();
  const auto answer = co_await ask(who, kProbe);
  if (answer && identify(who, *answer)) {
    baud_ = baud;
    clear_search();
    co_return Found::ours;
  }
  if (answer) co_return Found::other;  // It answers: another model.
  if (answer.error() == boost::system::errc::timed_out) co_return Found::nothing;
  troubles_.set(fault::kGone, answer.error().message());
  co_return Found::other;
}

void Vn100::clear_search() {
  for (const Fault* over :
       {&fault::kGone, &fault::kSilent, &fault::kWrongBaud, &fault::kOtherDevice})
    troubles_.clear(*over);
}

void Vn100::name_silence() {
  troubles_.clear(fault::kGone);
  const std::string who = recognise(reader_.heard());
  const std::size_t heard = reader_.heard().size();
  const bool vector_nav = who.starts_with("a VectorNav");
  troubles_.set_if(!who.empty() && !vector_nav, fault::kOtherDevice, who);
  troubles_.set_if(who.empty() && heard > 0, fault::kWrongBaud,
                   std::to_string(heard) + " bytes heard, no message of a VN-100, " +
                       (set_baud_ ? "at any bit rate it has" : "at the bit rate of the port"));
  troubles_.set_if(vector_nav || heard == 0, fault::kSilent,
                   vector_nav ? who + " speaks but does not answer: check the line to it"
                              : "no answer at any bit rate");
}

hal::Task<hal::Result<Vn100Line>> Vn100::ask(const Vn100Step& step, hal::Duration patience) {
  const Bytes request = vn100_request(step.request);
  const auto sent = co_await stream_.write(request);
  if (!sent) co_return sent.error();
  const hal::Time deadline = clock_.now() + patience;
  for (;;) {
    const auto frame = co_await reader_.next(deadline);
    if (!frame) co_return frame.error();
    if ((*frame)[0] != '$') continue;
    auto line = parse_vn100_line(*frame);
    if (line && vn100_judge(step, *line) != Vn100Answer::unrelated) co_return std::move(*line);
  }
}

bool Vn100::identify(const Vn100Step& step, const Vn100Line& line) {
  if (vn100_judge(step, line) != Vn100Answer::accepted || line.fields.size() < 2) return true;
  const std::string& said = line.fields[1];
  if (step.identity_register == 3) identity_.serial = said;
  if (step.identity_register == 4) identity_.firmware = said;
  if (step.identity_register != 1) return true;
  const bool right = said.starts_with("VN-100");
  troubles_.set_if(!right, fault::kOtherDevice, "it says that it is a " + said);
  if (right) identity_.maker = "VectorNav", identity_.model = said;
  return right;
}

hal::Task<bool> Vn100::configure() {
  troubles_.clear(fault::kRefused);
  troubles_.clear(fault::kNotKept);
  for (const Vn100Step& step : vn100_steps(config_.settings))
    if (const bool applied = co_await apply(step); !applied) co_return false;
  co_return true;
}

// Asked again when the answer was lost, damaged, or of an older question.
hal::Task<bool> Vn100::apply(const Vn100Step& step) {
  for (int attempt = 1;; ++attempt) {
    const auto answer = co_await ask(step, kAnswer);
    const Vn100Answer judged = answer ? vn100_judge(step, *answer) : Vn100Answer::unrelated;
    if (judged == Vn100Answer::accepted) co_return identify(step, *answer);
    if (attempt < kTries) continue;
    if (judged == Vn100Answer::refused)
      troubles_.set(fault::kRefused, vn100_refusal(step, *answer));
    else if (judged == Vn100Answer::other_value)
      troubles_.set(fault::kNotKept, "to " + std::string(step.purpose));
    else
      troubles_.set(answer.error() == timed_out() ? fault::kSilent : fault::kGone,
                    "when asked to " + std::string(step.purpose));
    co_return false;
  }
}

hal::Task<void> Vn100::listen() {
  fit_ = ClockFit();
  device_ns_.reset();
  line_rate_radps_.reset();
  line_accel_mps2_.reset();
  start_again_ = false;
  gravity_mps2_ = kGravity_mps2;
  new_sample_at_ = clock_.now();
  health_.restart(clock_.now(), reader_);
  co_await (read_samples() || watch());
}

hal::Task<void> Vn100::read_samples() {
  while (!start_again_) {
    const auto frame = co_await reader_.next();
    if (frame) {
      handle(*frame);
      continue;
    }
    troubles_.set(fault::kGone, frame.error().message());
    co_return;
  }
}

// Ends when nothing new came for so long that it must be started again.
hal::Task<void> Vn100::watch() {
  const hal::Duration stale = std::max<hal::Duration>(100ms, 3s / config_.settings.rate_hz);
  const hal::Duration give_up = std::max<hal::Duration>(kGiveUp, 2 * stale);
  for (;;) {
    co_await clock_.sleep_for(stale);
    const hal::Time now = clock_.now();
    const hal::Duration quiet = now - new_sample_at_;
    const bool speaks = reader_.arrival() > new_sample_at_ && now - reader_.arrival() < stale;
    health_.judge(now, reader_, troubles_);
    if (quiet < stale) continue;
    const std::string since = std::to_string(quiet / 1ms) + " ms without a new sample";
    troubles_.set(speaks && troubles_.has(fault::kRepeated) ? fault::kFrozen : fault::kSilent,
                  since);
    if (quiet >= give_up) co_return;
  }
}

void Vn100::handle(ByteView frame) {
  if (frame[0] == '$') return handle_line(frame);
  handle_sample(decode_vn100_binary(frame));
}

void Vn100::handle_line(ByteView frame) {
  const auto line = parse_vn100_line(frame);
  if (!line) return;
  if (const Fault* said = vn100_error(*line)) {
    troubles_.set(*said, "it says so");
    // It has restarted and forgot what it was told.
    if (said->value == 1 || said->value == 10) start_again_ = true;
    return;
  }
  if (const auto sample = vn100_sample(*line)) handle_sample(*sample);
}

// Whether this is not what came before, once more or late. A line has no time, but noise.
bool Vn100::is_new(const Vn100Sample& sample) {
  if (!sample.startup_ns) {
    const bool fresh =
        line_rate_radps_ != sample.rate_radps || line_accel_mps2_ != sample.accel_mps2;
    line_rate_radps_ = sample.rate_radps;
    line_accel_mps2_ = sample.accel_mps2;
    return fresh;
  }
  const auto device_ns = static_cast<std::int64_t>(*sample.startup_ns);
  if (device_ns_ && device_ns < *device_ns_ - kReset_ns) start_again_ = true;
  if (device_ns_ && device_ns <= *device_ns_) return false;
  device_ns_ = device_ns;
  return true;
}

// Gravity is known: a device that feels another one over a second has lost its calibration, and its
// rates are not to be trusted either.
bool Vn100::weighs_wrong(const Vn100Sample& sample) {
  if (!sample.accel_mps2) return false;
  const double kept = std::exp(-1.0 / config_.settings.rate_hz);
  const double felt_mps2 = vn100_flu(*sample.accel_mps2).norm();
  gravity_mps2_ = kept * gravity_mps2_ + (1 - kept) * felt_mps2;
  if (!std::isfinite(gravity_mps2_)) gravity_mps2_ = 0;
  return std::abs(gravity_mps2_ - kGravity_mps2) > kGravityOff_mps2;
}

void Vn100::handle_sample(const Vn100Sample& sample) {
  if (!sample.rate_radps || config_.settings.ascii == sample.startup_ns.has_value()) return;
  if (!is_new(sample)) return health_.repeated();
  new_sample_at_ = reader_.arrival();
  const double rate_radps = vn100_flu(*sample.rate_radps).z();
  if (!(std::abs(rate_radps) <= kRateMost_radps) || weighs_wrong(sample))
    return health_.implausible();
  if (!device_ns_) {
    health_.good();
    return deliver(reader_.arrival(), rate_radps);
  }
  fit_.add(*device_ns_, reader_.arrival());
  health_.good(fit_.last_excess_s());
  if (sample.vpe_status) note_filter(*sample.vpe_status);
  deliver(*fit_.to_ours(*device_ns_), rate_radps);
}

void Vn100::deliver(hal::Time stamp, double yaw_rate_radps) {
  if (state_ != DeviceState::running || troubles_.has(fault::kSilent) ||
      troubles_.has(fault::kFrozen)) {
    state_ = DeviceState::running;
    troubles_.clear(fault::kSilent);
    troubles_.clear(fault::kFrozen);
  }
  samples_.put({stamp, yaw_rate_radps});
}

void Vn100::note_filter(std::uint16_t vpe_status) {
  if (vpe_status_ == vpe_status) return;
  if (vpe_status_)
    for (const Fault* over : vn100_faults(*vpe_status_)) troubles_.clear(*over);
  for (const Fault* found : vn100_faults(vpe_status)) troubles_.set(*found, "its filter says so");
  vpe_status_ = vpe_status;
}

}  // namespace drivers
