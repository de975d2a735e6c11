#include "drivers/ublox.hpp"

#include <algorithm>
#include <boost/asio/experimental/awaitable_operators.hpp>
#include <cmath>

#include "drivers/gnss_demux.hpp"
#include "drivers/recognise.hpp"

namespace drivers {
namespace {

using namespace std::chrono_literals;
using boost::asio::experimental::awaitable_operators::operator||;
using boost::asio::experimental::awaitable_operators::operator&&;
namespace fault = stream_fault;

constexpr hal::Duration kProbe = 500ms;  // MON-VER takes a quarter of a second at 9600 baud.
constexpr hal::Duration kAck = 1s;
constexpr int kTries = 3;
constexpr hal::Duration kPause = 500ms;
constexpr hal::Duration kGiveUp = 5s;
constexpr hal::Duration kCorrectionsOld = 60s;  // Then a fix falls back to float.

constexpr Fault kOldProtocol{1, "protocol too old", "the receiver's firmware has no NAV-PVT",
                             "update the firmware, or use model \"nmea\""};
constexpr Fault kNoCorrections{2, "no corrections", "their source or the way from it is gone",
                               "check the source of corrections and its connection"};

boost::system::error_code timed_out() {
  return boost::system::errc::make_error_code(boost::system::errc::timed_out);
}

GnssOutputConfig with_rate(GnssOutputConfig output, int rate_hz) {
  output.rate_hz = rate_hz;
  return output;
}

}  // namespace

Ublox::Ublox(const UbloxConfig& config, hal::Clock& clock, hal::ByteStream& stream,
             SetBaud set_baud, hal::ByteStream* corrections)
    : config_(config),
      clock_(clock),
      stream_(stream),
      set_baud_(std::move(set_baud)),
      corrections_(corrections),
      reader_(stream, clock, look_gnss, kGnssFrameMax),
      output_(with_rate(config.output, config.settings.rate_hz)),
      baud_(config.settings.baud) {
  config_.settings.corrections = corrections != nullptr;
}

hal::Task<void> Ublox::run() {
  if (corrections_ == nullptr)
    co_await serve();
  else
    co_await (serve() && pass_corrections());
}

hal::Task<void> Ublox::serve() {
  state_ = DeviceState::starting;
  for (;;) {
    const bool found = co_await find();
    const bool ready = co_await configure(found);
    if (ready) co_await listen();
    state_ = was_running_ ? DeviceState::lost : DeviceState::starting;
    if (was_running_) output_.fail(timed_out());
    co_await clock_.sleep_for(kPause);
  }
}

hal::Task<bool> Ublox::find() {
  const std::vector<int> bauds = rates_to_try(baud_, kUbloxBauds, set_baud_);
  reader_.forget();
  const std::function<hal::Task<Found>(int)> ask_at = [this](int baud) { return find_at(baud); };
  const Found found = co_await search_port(clock_, bauds, ask_at);
  if (found != Found::nothing) co_return found == Found::ours;
  if (!output_.troubles().has(fault::kGone)) name_silence();
  co_return false;
}

hal::Task<Found> Ublox::find_at(int baud) {
  if (set_baud_ && !set_baud_(baud)) {
    co_await clock_.sleep_for(kProbe);
    co_return Found::nothing;
  }
  const Bytes question = encode_ubx(0x0A, 0x04);
  const auto sent = co_await send(question);
  if (!sent) {
    output_.troubles().set(fault::kGone, sent.error().message());
    co_return Found::other;
  }
  const bool said = co_await ask_version(clock_.now() + kProbe);
  if (output_.troubles().has(fault::kGone)) co_return Found::other;
  if (!said) co_return Found::nothing;
  baud_ = baud;
  co_return model_ ? Found::ours : Found::other;
}

// Whether it said who it is; then model_ is set if it is one that this driver can use.
hal::Task<bool> Ublox::ask_version(hal::Time deadline) {
  for (;;) {
    const auto frame = co_await reader_.next(deadline);
    output_.troubles().set_if(!frame && frame.error() != timed_out(), fault::kGone,
                              frame ? std::string() : frame.error().message());
    if (!frame) co_return false;
    if (gnss_kind(*frame) != GnssKind::ubx) continue;
    const auto version = ubx_mon_ver(parse_ubx(*frame));
    if (!version) continue;
    if (!identify(*version)) model_.reset();
    co_return true;
  }
}

bool Ublox::identify(const UbxMonVer& version) {
  for (const Fault* over : {&fault::kSilent, &fault::kWrongBaud, &fault::kOtherDevice})
    output_.troubles().clear(*over);
  model_ = ublox_model(version);
  const bool usable = model_ && model_->protocol >= kUbloxProtocolLeast;
  output_.troubles().set_if(!usable, kOldProtocol, version.software + ", " + version.hardware);
  if (!usable) return false;
  identity_ = {
      "u-blox", model_->model.empty() ? model_->hardware : model_->model, {}, model_->firmware};
  return true;
}

void Ublox::name_silence() {
  Troubles& troubles = output_.troubles();
  const std::string who = recognise(reader_.heard());
  const std::size_t heard = reader_.heard().size();
  const bool ublox = who.starts_with("a u-blox");
  troubles.set_if(!who.empty() && !ublox, fault::kOtherDevice, who + ", no answer to UBX");
  troubles.set_if(who.empty() && heard > 0, fault::kWrongBaud,
                  std::to_string(heard) + " bytes heard, no message of a receiver, " +
                      (set_baud_ ? "at any bit rate it has" : "at the bit rate of the port"));
  troubles.set_if(ublox || heard == 0, fault::kSilent,
                  ublox ? who + " speaks but does not answer: check the line to it"
                        : "no answer at any bit rate");
}

hal::Task<bool> Ublox::configure(bool found) {
  if (!found) co_return false;
  output_.troubles().clear(fault::kRefused);
  output_.troubles().clear(fault::kNotKept);
  for (const UbloxStep& step : ublox_steps(model_->dialect, config_.settings))
    if (const bool applied = co_await apply(step); !applied) co_return false;
  co_return true;
}

hal::Task<bool> Ublox::apply(const UbloxStep& step) {
  UbloxAnswer judged = UbloxAnswer::unrelated;
  const std::string what = "to " + std::string(step.purpose);
  for (int attempt = 0; attempt < kTries && judged == UbloxAnswer::unrelated; ++attempt) {
    hal::Result<ByteView> frame = ByteView();
    const auto sent = co_await send(step.request);
    if (!sent) frame = sent.error();
    const hal::Time deadline = clock_.now() + kAck;
    while (frame && judged == UbloxAnswer::unrelated) {
      frame = co_await reader_.next(deadline);
      if (frame && gnss_kind(*frame) == GnssKind::ubx)
        judged = ublox_judge(step, parse_ubx(*frame));
    }
    output_.troubles().set_if(!frame && frame.error() != timed_out(), fault::kGone, what);
    if (output_.troubles().has(fault::kGone)) co_return false;
  }
  output_.troubles().set_if(judged == UbloxAnswer::refused, fault::kRefused, what);
  output_.troubles().set_if(judged == UbloxAnswer::other_value, fault::kNotKept, what);
  output_.troubles().set_if(judged == UbloxAnswer::unrelated, fault::kSilent,
                            "no answer when asked " + what);
  co_return judged == UbloxAnswer::accepted;
}

hal::Task<void> Ublox::listen() {
  epochs_ = UbxEpochs();
  itow_ms_.reset();
  output_.restart(clock_.now(), reader_);
  correction_at_ = clock_.now();
  state_ = DeviceState::running;
  was_running_ = true;
  co_await (read_epochs() || watch());
}

hal::Task<void> Ublox::read_epochs() {
  for (;;) {
    const auto frame = co_await reader_.next();
    if (!frame) {
      output_.troubles().set(fault::kGone, frame.error().message());
      co_return;
    }
    if (gnss_kind(*frame) == GnssKind::ubx) handle(parse_ubx(*frame));
  }
}

hal::Task<void> Ublox::watch() {
  const hal::Duration pause = hal::from_seconds(4 * output_.period_s());
  for (;;) {
    co_await clock_.sleep_for(pause);
    judge_corrections(clock_.now());
    if (output_.stale(clock_.now(), reader_, kGiveUp)) co_return;
    state_ = output_.flows() ? DeviceState::running : DeviceState::lost;
  }
}

void Ublox::handle(const UbxMessage& message) {
  if (const auto pvt = ubx_nav_pvt(message)) {
    note(ubx_faults(*pvt), navigation_faults_, "NAV-PVT says so");
    output_.troubles().clear(fault::kGone);
    if (itow_ms_ == pvt->itow_ms) output_.repeated();
    itow_ms_ = pvt->itow_ms;
  }
  if (const auto rf = ubx_mon_rf(message)) {
    std::vector<const Fault*> found;
    for (const auto& block : rf->blocks)
      for (const Fault* one : ubx_faults(block)) found.push_back(one);
    note(found, radio_faults_, "MON-RF says so");
  }
  if (const auto rtcm = ubx_rxm_rtcm(message))
    note(ubx_faults(*rtcm), correction_faults_, "RTCM " + std::to_string(rtcm->type));
  for (const GnssEpoch& epoch : epochs_.add(message)) output_.add(epoch, reader_.arrival());
}

void Ublox::note(const std::vector<const Fault*>& present, std::vector<const Fault*>& before,
                 const std::string& detail) {
  if (present == before) return;
  for (const Fault* over : before) output_.troubles().clear(*over);
  for (const Fault* found : present) output_.troubles().set(*found, detail);
  before = present;
}

void Ublox::judge_corrections(hal::Time now) {
  if (corrections_ == nullptr) return;
  output_.troubles().set_if(now - correction_at_ > kCorrectionsOld, kNoCorrections,
                            std::to_string((now - correction_at_) / 1s) + " s without");
}

std::optional<double> Ublox::since_correction_s() const {
  if (passed_ == 0) return std::nullopt;
  return hal::seconds(clock_.now() - correction_at_);
}

std::string Ublox::condition() const {
  const GnssEpoch& last = output_.last();
  std::string text;
  if (last.quality == GnssQuality::rtk_fixed) text = "RTK, fixed";
  if (last.quality == GnssQuality::rtk_float) text = "RTK, float";
  const auto add = [&text](double age_s, const char* what) {
    text += (text.empty() ? "" : ", ") + std::to_string(std::llround(age_s)) + what;
  };
  if (last.correction_age_s) add(*last.correction_age_s, " s old corrections at most in use");
  if (const auto since_s = since_correction_s()) add(*since_s, " s since the last came");
  return text;
}

// A request never parts a correction that is still being written.
hal::Task<hal::Result<void>> Ublox::send(ByteView request) {
  while (passing_) co_await clock_.sleep_for(10ms);
  co_return co_await stream_.write(request);
}

// Only while it runs: a frame in the middle of the start-up dialogue would part it.
hal::Task<void> Ublox::pass_corrections() {
  FrameReader frames(*corrections_, clock_, look_gnss, kGnssFrameMax);
  for (;;) {
    const auto frame = co_await frames.next();
    if (!frame) {
      co_await clock_.sleep_for(1s);
      continue;
    }
    if (gnss_kind(*frame) != GnssKind::rtcm3) continue;
    passing_ = state_ == DeviceState::running;
    bool passed = false;
    if (passing_) {
      const auto sent = co_await stream_.write(*frame);
      passed = sent.has_value();
    }
    passing_ = false;
    ++(passed ? passed_ : dropped_);
    if (passed) correction_at_ = clock_.now();
  }
}

}  // namespace drivers
