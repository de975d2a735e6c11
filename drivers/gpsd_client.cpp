#include "drivers/gpsd_client.hpp"

#include <algorithm>
#include <boost/asio/experimental/awaitable_operators.hpp>
#include <cmath>

#include "drivers/recognise.hpp"
#include "drivers/text.hpp"

namespace drivers {
namespace {

using namespace std::chrono_literals;
using boost::asio::experimental::awaitable_operators::operator||;
namespace fault = stream_fault;

constexpr hal::Duration kGreeting = 2s;
constexpr hal::Duration kPause = 500ms;
constexpr hal::Duration kGiveUp = 5s;
constexpr std::string_view kAskVersion = "?VERSION;\r\n";
constexpr int kProtocolMajor = 3;
constexpr int kReportsOfInstant = 12;  // One for each sentence of the receiver, at most.

constexpr Fault kOtherProtocol{1, "gpsd of another protocol", "its release is too old or too new",
                               "install gpsd 3.x"};
constexpr Fault kNoReceiver{2, "gpsd has no receiver", "none is plugged in, or gpsd was not told",
                            "plug it in; name its device to gpsd (/etc/default/gpsd)"};
constexpr Fault kError{3, "gpsd refuses", "it says so", "see its message"};

boost::system::error_code timed_out() {
  return boost::system::errc::make_error_code(boost::system::errc::timed_out);
}

}  // namespace

GpsdClient::GpsdClient(const GpsdClientConfig& config, hal::Clock& clock, hal::ByteStream& stream)
    : config_(config),
      clock_(clock),
      stream_(stream),
      reader_(stream, clock, look_gpsd, kGpsdLineMax),
      output_(config.output) {}

hal::Task<void> GpsdClient::run() {
  state_ = DeviceState::starting;
  for (;;) {
    const bool greeted = co_await greet();
    const bool watches = co_await watch_devices(greeted);
    if (watches) co_await listen();
    state_ = was_running_ ? DeviceState::lost : DeviceState::starting;
    if (was_running_) output_.fail(timed_out());
    co_await clock_.sleep_for(kPause);
  }
}

// Nothing at the deadline, and when the connection is lost.
hal::Task<std::optional<GpsdMessage>> GpsdClient::next_message(hal::Time deadline) {
  for (;;) {
    const auto line = co_await reader_.next(deadline);
    output_.troubles().set_if(!line && line.error() != timed_out(), fault::kGone,
                              line ? std::string() : line.error().message());
    if (!line) co_return std::nullopt;
    if (auto message = parse_gpsd(*line)) co_return message;
  }
}

// It greets by itself once; asked, it greets again on a connection that is not new.
hal::Task<bool> GpsdClient::greet() {
  if (output_.troubles().has(fault::kGone)) reader_.forget();  // A new connection.
  const auto sent = co_await stream_.write(as_bytes(kAskVersion));
  if (!sent) {
    output_.troubles().set(fault::kGone, sent.error().message());
    co_return false;
  }
  const hal::Time deadline = clock_.now() + kGreeting;
  for (;;) {
    const auto message = co_await next_message(deadline);
    if (!message) break;
    if (const auto* version = std::get_if<GpsdVersion>(&*message)) co_return accept(*version);
  }
  if (!output_.troubles().has(fault::kGone)) name_silence();
  co_return false;
}

bool GpsdClient::accept(const GpsdVersion& version) {
  output_.troubles().clear(fault::kSilent);
  output_.troubles().clear(fault::kOtherDevice);
  const bool right = version.protocol_major == kProtocolMajor;
  const std::string major =
      version.protocol_major ? std::to_string(*version.protocol_major) : "unknown";
  output_.troubles().set_if(!right, kOtherProtocol,
                            "release " + version.release + ", protocol " + major);
  if (right) identity_ = {"gpsd", "gpsd", {}, version.release};
  return right;
}

void GpsdClient::name_silence() {
  const std::string who = recognise(reader_.heard());
  const bool heard = !reader_.heard().empty();
  output_.troubles().set_if(heard, fault::kOtherDevice,
                            who.empty() ? "what answers on this port is not gpsd" : who);
  output_.troubles().set_if(!heard, fault::kSilent, "connected, but nothing answers");
}

hal::Task<bool> GpsdClient::watch_devices(bool greeted) {
  if (!greeted) co_return false;
  output_.troubles().clear(kError);
  const auto sent = co_await stream_.write(as_bytes(kGpsdWatch));
  if (!sent) {
    output_.troubles().set(fault::kGone, sent.error().message());
    co_return false;
  }
  const hal::Time deadline = clock_.now() + kGreeting;
  for (;;) {
    const auto message = co_await next_message(deadline);
    if (!message) co_return false;
    handle(*message);
    if (std::holds_alternative<GpsdDevices>(*message)) co_return true;
  }
}

void GpsdClient::judge_devices() {
  std::string names;
  for (const GpsdDevice& device : devices_) names += (names.empty() ? "" : ", ") + device.path;
  const bool there =
      config_.device.empty()
          ? !devices_.empty()
          : std::any_of(devices_.begin(), devices_.end(),
                        [&](const GpsdDevice& device) { return device.path == config_.device; });
  output_.troubles().set_if(!there, kNoReceiver,
                            names.empty() ? "it has none at all" : "it has " + names);
}

hal::Task<void> GpsdClient::listen() {
  output_.restart(clock_.now(), reader_);
  pending_.reset();
  report_time_.clear();
  state_ = DeviceState::running;
  was_running_ = true;
  co_await (read_reports() || watch());
}

hal::Task<void> GpsdClient::read_reports() {
  for (;;) {
    const auto line = co_await reader_.next();
    if (!line) {
      output_.troubles().set(fault::kGone, line.error().message());
      co_return;
    }
    if (const auto message = parse_gpsd(*line)) handle(*message);
  }
}

void GpsdClient::handle(const GpsdMessage& message) {
  if (const auto* list = std::get_if<GpsdDevices>(&message)) {
    devices_ = list->devices;
    judge_devices();
  } else if (const auto* error = std::get_if<GpsdError>(&message)) {
    output_.troubles().set(kError, error->message);
  } else if (const auto* tpv = std::get_if<GpsdTpv>(&message)) {
    if (!config_.device.empty() && tpv->device != config_.device) return;
    output_.troubles().clear(fault::kGone);
    output_.troubles().clear(kNoReceiver);
    take(*tpv);
  }
}

// gpsd reports an instant once for each sentence that says more of it: the first that states an
// accuracy is used; where none does, the last.
void GpsdClient::take(const GpsdTpv& tpv) {
  GnssEpoch epoch = epoch_of(tpv);
  // Of gpsd, a circle of 95 %; the radius of 68 % that others state is this much smaller.
  if (epoch.horizontal_accuracy_m) *epoch.horizontal_accuracy_m *= std::sqrt(2.0) / 2.4477;
  if (tpv.time.empty() || tpv.time != report_time_) {
    // A report without a time comes before the receiver's date: the same instant follows with it.
    if (report_time_.empty() && !tpv.time.empty()) pending_.reset();
    give_pending();
    report_time_ = tpv.time;
    reports_ = 0;
    given_ = false;
  }
  if (++reports_ > kReportsOfInstant) output_.repeated();
  if (given_) return;
  pending_ = epoch;
  pending_at_ = reader_.arrival();
  const bool accurate = epoch.horizontal_accuracy_m || (epoch.sigma_east_m && epoch.sigma_north_m);
  if (!epoch.usable() || (accurate && !tpv.time.empty())) give_pending();
}

void GpsdClient::give_pending() {
  if (!pending_) return;
  output_.add(*pending_, pending_at_);
  pending_.reset();
  given_ = true;
}

hal::Task<void> GpsdClient::watch() {
  const hal::Duration pause = hal::from_seconds(4 * output_.period_s());
  for (;;) {
    co_await clock_.sleep_for(pause);
    if (output_.stale(clock_.now(), reader_, kGiveUp)) co_return;
    state_ = output_.flows() ? DeviceState::running : DeviceState::lost;
  }
}

}  // namespace drivers
