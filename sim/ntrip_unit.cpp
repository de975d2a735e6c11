#include "sim/ntrip_unit.hpp"

#include <GeographicLib/Geocentric.hpp>
#include <array>
#include <boost/asio/experimental/awaitable_operators.hpp>
#include <cstdio>
#include <utility>

#include "drivers/gnss_demux.hpp"
#include "drivers/rtcm3.hpp"
#include "drivers/text.hpp"

namespace sim {
namespace {

using boost::asio::experimental::awaitable_operators::operator&&;
using drivers::NtripVersion;

constexpr hal::Duration kLinkPause = std::chrono::milliseconds(100);
constexpr std::size_t kHeardMax = 8192, kPositionsMax = 1000;
constexpr std::uint16_t kStation = 1;
constexpr std::uint32_t kWeek_ms = 604'800'000, kDay_ms = 86'400'000;
constexpr std::uint32_t kMoscowAheadOfGps_ms = 3 * 3'600'000 - 18'000;  // GLONASS; leap seconds.
constexpr std::uint32_t kGpsAheadOfBeidou_ms = 14'000;
constexpr int kPlacePeriod_s = 10;

enum Kind { kAnswerKind = 1 };

// As each system counts, at that second of the GPS week.
std::uint32_t epoch_raw(std::uint16_t type, std::uint32_t tow_ms) {
  if (type == 1127) return (tow_ms + kWeek_ms - kGpsAheadOfBeidou_ms) % kWeek_ms;
  if (type != 1087) return tow_ms;
  const std::uint32_t moscow_ms = (tow_ms + kMoscowAheadOfGps_ms) % kWeek_ms;
  return moscow_ms / kDay_ms << 27 | moscow_ms % kDay_ms;
}

}  // namespace

NtripUnit::NtripUnit(NtripUnitConfig config, hal::Clock& clock, hal::ByteStream& end,
                     UnitFaults& faults)
    : config_(std::move(config)), clock_(clock), faults_(faults), out_(end, clock, faults) {}

hal::Task<void> NtripUnit::run() {
  co_await (answer_requests() && stream());
}

hal::Task<void> NtripUnit::answer_requests() {
  std::array<std::uint8_t, 1024> piece;
  for (;;) {
    const auto size = co_await out_.read_some(piece);
    if (!size) {
      streaming_ = false;
      heard_.clear();
      co_await clock_.sleep_for(kLinkPause);
      continue;
    }
    heard_ += drivers::as_text(drivers::ByteView(piece).first(*size));
    if (heard_.size() > kHeardMax) heard_.clear();
    if (const auto asked = drivers::parse_ntrip_request(heard_)) {
      heard_.erase(0, asked->size);
      co_await answer(*asked);
    }
    for (auto end = heard_.find('\n'); heard_.starts_with('$') && end != std::string::npos;
         end = heard_.find('\n')) {
      if (positions_.size() < kPositionsMax) positions_.push_back(heard_.substr(0, end + 1));
      heard_.erase(0, end + 1);
    }
  }
}

hal::Task<void> NtripUnit::answer(const drivers::NtripAsked& asked) {
  ++asked_;
  if (!asked.gga.empty()) positions_.push_back(asked.gga + "\r\n");
  streaming_ = false;
  const std::string text = answer_to(asked);
  co_await say(text, kAnswerKind);
  streaming_ = text.starts_with("ICY 200") || text.find("gnss/data") != std::string::npos;
  first_ = second_now();
}

std::string NtripUnit::table() const {
  std::string text = "CAS;rtk.example.org;2101;Example;;0;DEU;48.00;11.00;;\r\n";
  for (const std::string& name : {config_.mountpoint, std::string("OTHER1")})
    text += "STR;" + name + ";Here;RTCM 3.2;1005(10),1077(1),1087(1),1097(1),1127(1);2;" +
            "GPS+GLO+GAL+BDS;Example;DEU;48.00;11.00;" + (config_.wants_position ? "1" : "0") +
            ";0;Example;none;B;N;4000;\r\n";
  return text + "ENDSOURCETABLE\r\n";
}

std::string NtripUnit::answer_to(const drivers::NtripAsked& asked) {
  if (!answer_.empty()) return answer_;
  const bool second = config_.version == NtripVersion::v2 && asked.version == NtripVersion::v2;
  const std::string head = second ? "HTTP/1.1 " : "HTTP/1.0 ";
  if (asked.mountpoint != config_.mountpoint) {
    const std::string all = table();
    if (!second)
      return "SOURCETABLE 200 OK\r\nContent-Type: text/plain\r\nContent-Length: " +
             std::to_string(all.size()) + "\r\n\r\n" + all;
    return head + "404 Not Found\r\nNtrip-Version: Ntrip/2.0\r\nConnection: close\r\n\r\n";
  }
  const bool known = asked.user == config_.user && asked.password == config_.password;
  if (!config_.user.empty() && !known)
    return head + "401 Unauthorized\r\nWWW-Authenticate: Basic realm=\"/" + asked.mountpoint +
           "\"\r\n\r\n";
  if (!second) return "ICY 200 OK\r\n\r\n";
  return head + "200 OK\r\nNtrip-Version: Ntrip/2.0\r\nContent-Type: gnss/data\r\n" +
         (config_.chunked ? "Transfer-Encoding: chunked\r\n" : "") + "Connection: close\r\n\r\n";
}

hal::Task<void> NtripUnit::say(std::string text, int kind) {
  (void)co_await out_.write(drivers::as_bytes(text), kind);
}

std::int64_t NtripUnit::second_now() const {
  return clock_.now().time_since_epoch() / std::chrono::seconds(1);
}

hal::Task<void> NtripUnit::stream() {
  for (;;) {
    const auto period = faults_.slowed(std::chrono::seconds(1));
    const auto periods = clock_.now().time_since_epoch() / period + 1;
    co_await clock_.sleep_until(hal::Time(periods * period));
    if (!streaming_ || faults_.silent()) continue;
    if (std::exchange(hang_up_, false)) {
      streaming_ = false;
      co_await say("0\r\n\r\n", 0);
      continue;
    }
    const bool told = !config_.wants_position || !positions_.empty();
    if (mute_ || !told) continue;
    const std::vector<drivers::Bytes> all = frames(second_now());
    for (const drivers::Bytes& frame : all)
      co_await send(frame, drivers::rtcm3_type(frame).value_or(0));
  }
}

hal::Task<void> NtripUnit::send(const drivers::Bytes& frame, int kind) {
  drivers::Bytes bytes = frame;
  if (config_.version == NtripVersion::v2 && config_.chunked) {
    char size[16];
    const int length = std::snprintf(size, sizeof size, "%zx\r\n", frame.size());
    bytes.insert(bytes.begin(), size, size + length);
    bytes.insert(bytes.end(), {'\r', '\n'});
  }
  (void)co_await out_.write(bytes, kind);
}

Eigen::Vector3d NtripUnit::base_ecef_m() const {
  Eigen::Vector3d at;
  GeographicLib::Geocentric::WGS84().Forward(config_.base.latitude_deg, config_.base.longitude_deg,
                                             config_.base.height_m, at.x(), at.y(), at.z());
  return at * faults_.wrong_factor();
}

std::vector<drivers::Bytes> NtripUnit::frames(std::int64_t second) {
  std::vector<drivers::Bytes> all;
  if (rtcm2_) return {drivers::Bytes(200, 0x66)};  // The preamble of version 2, again and again.
  if ((second - first_ - 1) % kPlacePeriod_s == 0)
    all.push_back(drivers::encode_rtcm3_base(kStation, base_ecef_m()));
  const auto tow_ms =
      static_cast<std::uint32_t>((config_.itow_ms + second * 1000) % std::int64_t{kWeek_ms});
  for (const std::uint16_t type : {1077, 1087, 1097, 1127}) {
    drivers::Bytes content(120 + dice_.below(120));
    for (auto& byte : content) byte = static_cast<std::uint8_t>(dice_.next());
    all.push_back(drivers::encode_rtcm3_msm(type, kStation, epoch_raw(type, tow_ms), content));
  }
  return all;
}

}  // namespace sim
