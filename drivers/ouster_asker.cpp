#include "drivers/ouster_asker.hpp"

#include <algorithm>
#include <boost/asio/experimental/awaitable_operators.hpp>
#include <cmath>

#include "drivers/http.hpp"
#include "drivers/text.hpp"

namespace drivers {
namespace {

using namespace std::chrono_literals;
using boost::asio::experimental::awaitable_operators::operator||;

constexpr hal::Duration kAnswer = 3s, kRound = 10s, kTryAgain = 1s;
constexpr hal::Duration kConnectAnew = 300ms;  // A link waits 100 ms before it does.
constexpr int kFailuresTold = 3;  // In a row: a sensor that restarts is back sooner or later.
constexpr double kSameAngle_deg = 0.5;

constexpr Fault kUnanswered{1, "settings not answered",
                            "no network to its settings, or it restarts",
                            "check cable and address (api_link in [scanner])"};
constexpr Fault kNotOuster{2, "not an Ouster", "another device answers at that address",
                           "correct api_link in [scanner]"};
constexpr Fault kOldFirmware{3, "firmware too old", "packets of firmware before 2.0 are not read",
                             "update the sensor's firmware from its own page"};
constexpr Fault kFormat{4, "packet format not supported", "see the detail",
                        "set udp_profile_lidar on the sensor's own page"};
constexpr Fault kOtherForm{5, "another sensor than the metadata's",
                           "the file in the robot file is of another sensor or mode",
                           "save http://SENSOR/api/v1/sensor/metadata over the file, or set the "
                           "sensor's lidar_mode back"};
constexpr Fault kOtherPort{6, "sends to another port", "the sensor's udp_port_lidar is another",
                           "set udp_port_lidar on the sensor, or the port in [scanner] link"};
constexpr Fault kOtherComputer{7, "sends to another computer",
                               "the sensor's udp_dest is not this computer's address",
                               "set udp_dest on the sensor to this computer's address"};
constexpr Fault kStandby{8, "sensor in standby", "its operating_mode is STANDBY",
                         "set operating_mode to NORMAL on the sensor's own page"};
constexpr Fault kAlerts{9, "sensor complains", "see the detail",
                        "act on what it says; its own page tells more"};

bool to_many(std::string_view address) {
  const auto first = whole_number<int>(address.substr(0, address.find('.'))).value_or(0);
  return address.ends_with(".255") || (first >= 224 && first <= 239);
}

bool is_address(std::string_view text) {
  return !text.empty() && text.find_first_not_of("0123456789.") == std::string_view::npos;
}

std::string numbers(const OusterMetadata& m) {
  return std::to_string(m.rows) + " rows, " + std::to_string(m.columns_per_frame) + " columns";
}

}  // namespace

OusterAsker::OusterAsker(OusterAskerConfig config, OusterMetadata expected, hal::Clock& clock,
                         hal::ByteStream& link, DropLink drop, Troubles& troubles,
                         std::function<void(OusterMetadata)> adopt)
    : config_(std::move(config)),
      expected_(std::move(expected)),
      clock_(clock),
      link_(link),
      drop_(std::move(drop)),
      troubles_(troubles),
      adopt_(std::move(adopt)) {}

hal::Task<void> OusterAsker::run() {
  for (int failures = 0;;) {
    const bool answered = co_await look();
    failures = answered ? 0 : failures + 1;
    if (answered) {
      troubles_.clear(kUnanswered);
      if (refused_.empty()) troubles_.clear(kNotOuster);
    } else if (failures >= kFailuresTold) {
      troubles_.set(*unanswered_, unanswered_detail_);
    }
    const hal::Duration pause = answered ? kRound : kTryAgain;
    co_await (discard() || clock_.sleep_for(pause));
    known_ = known_ && answered && !lost_;
    // A connection that was not there yet is not ended as soon as it is.
    if (answered || lost_ || !asked_ || !drop_) continue;
    drop_();
    co_await (discard() || clock_.sleep_for(kConnectAnew));
  }
}

// One round. True when all was answered, whatever it says.
hal::Task<bool> OusterAsker::look() {
  lost_ = asked_ = false;
  if (!known_) {
    const auto metadata = co_await ask(kOusterMetadataPath);
    if (!metadata) co_return false;
    known_ = judge_metadata(*metadata);
  }
  const auto said = co_await ask(kOusterSettingsPath);
  if (!said) co_return false;
  OusterSettings settings;
  if (parse_ouster_settings(*said, settings).empty()) judge_settings(settings);
  const auto complaints = co_await ask(kOusterAlertsPath);
  if (!complaints) co_return false;
  std::vector<OusterAlert> alerts;
  if (parse_ouster_alerts(*complaints, alerts).empty()) judge_alerts(alerts);
  co_return true;
}

hal::Result<std::string> OusterAsker::failed(const Fault& why, std::string detail) {
  unanswered_ = &why;
  unanswered_detail_ = std::move(detail);
  return boost::system::errc::make_error_code(boost::system::errc::bad_message);
}

hal::Task<hal::Result<std::string>> OusterAsker::ask(std::string_view path) {
  const std::string request = http_get(config_.host, path),
                    place = config_.host + std::string(path);
  const auto sent = co_await link_.write(as_bytes(request));
  if (!sent) co_return failed(kUnanswered, sent.error().message());
  asked_ = true;
  HttpAnswer answer;
  const hal::Time late = clock_.now() + kAnswer;
  while (!answer.whole() && !answer.broken()) {
    got_ = 0;
    co_await (fill() || clock_.sleep_until(late));
    if (got_ == 0) co_return failed(kUnanswered, "no answer at " + place);
    answer.feed(ByteView(piece_).first(got_));
  }
  if (answer.broken()) co_return failed(kNotOuster, "no HTTP at " + place);
  if (answer.status() == 404 && path == kOusterMetadataPath)
    co_return failed(kOldFirmware, "there is no " + place);
  if (answer.status() != 200)
    co_return failed(kUnanswered, place + ": status " + std::to_string(answer.status()));
  co_return answer.take_body();
}

hal::Task<void> OusterAsker::fill() {
  const auto size = co_await link_.read_some(piece_);
  lost_ = lost_ || !size;
  got_ = size ? *size : 0;
}

hal::Task<void> OusterAsker::discard() {
  for (;;) {
    const auto size = co_await link_.read_some(piece_);
    if (size) continue;
    lost_ = true;
    co_await clock_.sleep_for(100ms);
  }
}

// True when they can be used.
bool OusterAsker::judge_metadata(const std::string& json) {
  OusterMetadata said;
  const std::string problem = parse_ouster_metadata(json, said);
  const auto version = ouster_version(said.firmware);
  const bool old = version && *version < kOusterVersionLeast;
  const bool format = !old && problem.find("udp_profile_lidar") != std::string::npos;
  const std::string other = problem.empty() ? other_form(said) : "";
  troubles_.set_if(old, kOldFirmware, said.firmware);
  troubles_.set_if(format, kFormat, problem);
  troubles_.set_if(!old && !format && !problem.empty(), kNotOuster, problem);
  troubles_.set_if(!old && !other.empty(), kOtherForm, other);
  refused_ = old ? "its firmware is too old" : !problem.empty() ? problem : other;
  if (refused_.empty()) adopt_(std::move(said));
  return refused_.empty();
}

// What a mission was planned with must stay true; the calibration is the sensor's own.
std::string OusterAsker::other_form(const OusterMetadata& said) const {
  if (said.rows != expected_.rows || said.columns_per_frame != expected_.columns_per_frame)
    return "it has " + numbers(said) + "; the file says " + numbers(expected_);
  const auto differ = [](double a, double b) { return std::abs(a - b) > kSameAngle_deg; };
  const auto& is = said.beam_altitude_deg;
  const auto& was = expected_.beam_altitude_deg;
  if (differ(is.front(), was.front()) || differ(is.back(), was.back()))
    return "its beams go to other heights than the file's";
  return {};
}

void OusterAsker::judge_settings(const OusterSettings& settings) {
  const auto port = settings.udp_port_lidar;
  troubles_.set_if(
      port && *port != config_.port, kOtherPort,
      "to " + std::to_string(port.value_or(0)) + ", expected at " + std::to_string(config_.port));
  const std::string own = config_.own_address ? config_.own_address() : std::string();
  const std::string& to = settings.udp_dest;
  const bool elsewhere = is_address(to) && is_address(own) && to != own && !to_many(to);
  troubles_.set_if(elsewhere, kOtherComputer, "to " + to + "; this one is " + own);
  troubles_.set_if(settings.operating_mode == "STANDBY", kStandby);
}

void OusterAsker::judge_alerts(const std::vector<OusterAlert>& alerts) {
  std::string text;
  for (const OusterAlert& alert : alerts)
    text += (text.empty() ? "" : "; ") + alert.id + " " + alert.level + " " + alert.category +
            ": " + alert.text;
  troubles_.set_if(!alerts.empty(), kAlerts, text);
}

}  // namespace drivers
