#include "sim/gpsd_unit.hpp"

#include <algorithm>
#include <array>
#include <boost/asio/experimental/awaitable_operators.hpp>
#include <cmath>
#include <cstdio>

#include "drivers/text.hpp"

namespace sim {
namespace {

using boost::asio::experimental::awaitable_operators::operator&&;
using drivers::GnssQuality;

constexpr std::size_t kRequestMost = 1024;
constexpr hal::Duration kLinkPause = std::chrono::milliseconds(100);
enum Kind { kVersion = 1, kDevices, kWatch, kTpv };

template <class... Values>
std::string formatted(const char* format, Values... values) {
  char text[640];
  std::snprintf(text, sizeof text, format, values...);
  return text;
}

int status_of(GnssQuality quality) {
  if (quality == GnssQuality::rtk_fixed) return 3;
  if (quality == GnssQuality::rtk_float) return 4;
  return quality == GnssQuality::differential ? 2 : 1;
}

std::string iso_time(const GnssMoment& moment) {
  const auto ms = static_cast<int>(moment.utc_time_of_day_ns / 1'000'000);
  return formatted("%04d-%02d-%02dT%02d:%02d:%02d.%03dZ", moment.date.year, moment.date.month,
                   moment.date.day, ms / 3'600'000, ms / 60'000 % 60, ms / 1000 % 60, ms % 1000);
}

}  // namespace

GpsdUnit::GpsdUnit(const GpsdUnitConfig& config, World& world, hal::Clock& clock,
                   hal::ByteStream& end, UnitFaults& faults)
    : config_(config),
      clock_(clock),
      faults_(faults),
      out_(end, clock, faults),
      source_(config.source, world, clock, faults) {}

hal::Task<void> GpsdUnit::run() {
  co_await (answer_requests() && stream());
}

hal::Task<void> GpsdUnit::say(const std::string& line, int kind) {
  const std::string whole = line + "\r\n";
  const auto sent = co_await out_.write(drivers::as_bytes(whole), kind);
  if (!sent) co_await clock_.sleep_for(kLinkPause);
}

hal::Task<void> GpsdUnit::answer_requests() {
  std::array<std::uint8_t, 256> piece;
  std::string waiting;
  for (;;) {
    const auto size = co_await out_.read_some(piece);
    if (!size) {
      watched_ = false;  // The client is gone.
      waiting.clear();
      continue;
    }
    waiting += drivers::as_text(drivers::ByteView(piece).first(*size));
    for (auto end = waiting.find(';'); end != std::string::npos; end = waiting.find(';')) {
      co_await answer(std::string_view(waiting).substr(0, end));
      waiting.erase(0, end + 1);
    }
    if (waiting.size() > kRequestMost) waiting.clear();
  }
}

std::string GpsdUnit::version() const {
  return formatted(R"({"class":"VERSION","release":"%s","rev":"%s","proto_major":%d,)"
                   R"("proto_minor":14})",
                   config_.release.c_str(), config_.release.c_str(), config_.protocol_major);
}

hal::Task<void> GpsdUnit::answer(std::string_view request) {
  const std::string greeting = version(), list = devices();
  const std::string watch = R"({"class":"WATCH","enable":true,"json":true})";
  if (request.find("?VERSION") != std::string_view::npos) co_await say(greeting, kVersion);
  if (request.find("?WATCH=") == std::string_view::npos) co_return;
  co_await say(list, kDevices);
  co_await say(watch, kWatch);
  watched_ = request.find("\"enable\":true") != std::string_view::npos;
}

std::string GpsdUnit::devices() const {
  if (unplugged_) return R"({"class":"DEVICES","devices":[]})";
  return formatted(R"({"class":"DEVICES","devices":[{"class":"DEVICE","path":"%s",)"
                   R"("driver":"u-blox","activated":"2026-06-03T12:00:00.000Z"}]})",
                   config_.device.c_str());
}

hal::Task<void> GpsdUnit::stream() {
  for (;;) {
    co_await source_.next_due(config_.source.rate_hz);
    if (!watched_ || unplugged_ || faults_.silent()) continue;
    const std::string line = report(source_.sample());
    for (int time = 0; time < 2; ++time) co_await say(line, kTpv);
  }
}

std::string GpsdUnit::report(const GnssMoment& moment) const {
  const std::string head = R"({"class":"TPV","device":")" + config_.device + "\"";
  const GnssSky sky = sky_at(moment, sky_);
  if (sky.quality == GnssQuality::none) return head + R"(,"mode":1})";
  constexpr double k95 = 1.96;
  return head +
         formatted(R"(,"status":%d,"mode":3,"time":"%s","lat":%.9f,"lon":%.9f,"altHAE":%.4f,)"
                   R"("epx":%.4f,"epy":%.4f,"epv":%.4f})",
                   status_of(sky.quality), iso_time(moment).c_str(), moment.at.latitude_deg,
                   moment.at.longitude_deg, moment.at.height_m, k95 * moment.sigma_m,
                   k95 * moment.sigma_m, k95 * 2 * moment.sigma_m);
}

}  // namespace sim
