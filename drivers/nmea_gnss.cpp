#include "drivers/nmea_gnss.hpp"

#include <algorithm>
#include <boost/asio/experimental/awaitable_operators.hpp>

#include "drivers/gnss_demux.hpp"
#include "drivers/port_search.hpp"
#include "drivers/recognise.hpp"

namespace drivers {
namespace {

using namespace std::chrono_literals;
using boost::asio::experimental::awaitable_operators::operator||;
namespace fault = stream_fault;

constexpr hal::Duration kListen = 1200ms;  // A receiver at 1 Hz is heard.
constexpr hal::Duration kEpochGap = 150ms;
constexpr hal::Duration kPause = 500ms;
constexpr hal::Duration kGiveUp = 5s;

constexpr Fault kNoPosition{1, "no position sentences", "the receiver does not send GGA or RMC",
                            "let it send GGA, RMC and GST"};

boost::system::error_code timed_out() {
  return boost::system::errc::make_error_code(boost::system::errc::timed_out);
}

bool has_position(const NmeaSentence& sentence) {
  return std::holds_alternative<NmeaGga>(sentence.value) ||
         std::holds_alternative<NmeaRmc>(sentence.value);
}

std::string maker_of(std::string_view talker) {
  if (talker == "GN") return "several systems";
  if (talker == "GP") return "GPS";
  if (talker == "GL") return "GLONASS";
  return std::string(talker);
}

}  // namespace

NmeaGnss::NmeaGnss(const NmeaGnssConfig& config, hal::Clock& clock, hal::ByteStream& stream,
                   SetBaud set_baud)
    : config_(config),
      clock_(clock),
      set_baud_(std::move(set_baud)),
      reader_(stream, clock, look_gnss, kGnssFrameMax),
      output_(config.output),
      baud_(config.baud) {}

hal::Task<void> NmeaGnss::run() {
  state_ = DeviceState::starting;
  for (;;) {
    const bool found = co_await find();
    if (found) co_await listen();
    state_ = was_running_ ? DeviceState::lost : DeviceState::starting;
    if (was_running_) output_.fail(timed_out());
    co_await clock_.sleep_for(kPause);
  }
}

hal::Task<bool> NmeaGnss::find() {
  const std::vector<int> bauds = rates_to_try(baud_, kNmeaBauds, set_baud_);
  reader_.forget();
  for (const int baud : bauds) {
    if (set_baud_ && !set_baud_(baud)) continue;
    const bool heard = co_await hears_position(clock_.now() + kListen);
    if (heard) {
      baud_ = baud;
      co_return true;
    }
  }
  name_silence();
  co_return false;
}

hal::Task<bool> NmeaGnss::hears_position(hal::Time deadline) {
  Troubles& troubles = output_.troubles();
  for (;;) {
    const auto frame = co_await reader_.next(deadline);
    // A lost line is told once; then it is silent until it is back.
    if (!frame && frame.error() != timed_out()) troubles.set(fault::kGone, frame.error().message());
    if (!frame) co_return false;
    troubles.clear(fault::kGone);
    if (gnss_kind(*frame) != GnssKind::nmea) continue;
    const auto sentence = parse_nmea(*frame);
    if (!sentence || !has_position(*sentence)) continue;
    identify(*sentence);
    co_return true;
  }
}

void NmeaGnss::identify(const NmeaSentence& sentence) {
  for (const Fault* over :
       {&fault::kSilent, &fault::kWrongBaud, &fault::kOtherDevice, &kNoPosition})
    output_.troubles().clear(*over);
  identity_ = {maker_of(sentence.talker), "NMEA 0183", {}, {}};
}

void NmeaGnss::name_silence() {
  Troubles& troubles = output_.troubles();
  const std::string who = recognise(reader_.heard());
  const std::size_t heard = reader_.heard().size();
  const bool nmea = who.starts_with("a satellite receiver");
  troubles.set_if(nmea, kNoPosition, who);
  troubles.set_if(!who.empty() && !nmea, fault::kOtherDevice, who);
  troubles.set_if(who.empty() && heard > 0, fault::kWrongBaud,
                  std::to_string(heard) + " bytes heard, no sentence, " +
                      (set_baud_ ? "at any bit rate" : "at the bit rate of the port"));
  troubles.set_if(heard == 0 && !troubles.has(fault::kGone), fault::kSilent, "nothing heard");
}

hal::Task<void> NmeaGnss::listen() {
  epochs_ = NmeaEpochs();
  output_.restart(clock_.now(), reader_);
  state_ = DeviceState::running;
  was_running_ = true;
  co_await (read_sentences() || watch());
}

// The end of an epoch is known by its last sentence, or by silence after it.
hal::Task<void> NmeaGnss::read_sentences() {
  bool open = false;
  for (;;) {
    const hal::Time deadline = open ? reader_.arrival() + kEpochGap : hal::Time::max();
    const auto frame = co_await reader_.next(deadline);
    if (!frame && frame.error() == timed_out()) {
      open = false;
      if (const auto epoch = epochs_.flush()) output_.add(*epoch, reader_.arrival());
      continue;
    }
    if (!frame) {
      output_.troubles().set(fault::kGone, frame.error().message());
      co_return;
    }
    if (gnss_kind(*frame) != GnssKind::nmea) continue;
    const auto sentence = parse_nmea(*frame);
    if (!sentence) continue;
    const auto done = epochs_.add(*sentence);
    take(done);
    open = done.empty();
  }
}

void NmeaGnss::take(const std::vector<GnssEpoch>& epochs) {
  for (const GnssEpoch& epoch : epochs) output_.add(epoch, reader_.arrival());
}

hal::Task<void> NmeaGnss::watch() {
  const hal::Duration pause = hal::from_seconds(4 * output_.period_s());
  for (;;) {
    co_await clock_.sleep_for(pause);
    if (output_.stale(clock_.now(), reader_, kGiveUp)) co_return;
    state_ = output_.flows() ? DeviceState::running : DeviceState::lost;
  }
}

}  // namespace drivers
