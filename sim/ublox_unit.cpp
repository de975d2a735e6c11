#include "sim/ublox_unit.hpp"

#include <algorithm>
#include <boost/asio/experimental/awaitable_operators.hpp>
#include <cmath>

#include "drivers/gnss_demux.hpp"
#include "drivers/ubx_encode.hpp"
#include "sim/nmea_unit.hpp"

namespace sim {
namespace {

using boost::asio::experimental::awaitable_operators::operator&&;
using namespace drivers;
using namespace drivers::ubx_key;

constexpr std::uint32_t kUsb = 2;  // After UART1's, of the keys of messages.
constexpr hal::Duration kLinkPause = std::chrono::milliseconds(100);

void set_quality(UbxNavPvt& pvt, GnssQuality quality) {
  pvt.fix_type = quality == GnssQuality::none ? 0 : 3;
  pvt.fix_ok = quality != GnssQuality::none;
  pvt.carrier = quality == GnssQuality::rtk_fixed   ? UbxCarrier::fixed
                : quality == GnssQuality::rtk_float ? UbxCarrier::floating
                                                    : UbxCarrier::none;
  pvt.differential = pvt.carrier != UbxCarrier::none || quality == GnssQuality::differential;
}

}  // namespace

UbxNavPvt nav_pvt(const GnssMoment& moment, const GnssSky& sky) {
  constexpr std::int64_t kSecond_ns = 1'000'000'000;
  UbxNavPvt pvt;
  pvt.itow_ms = moment.itow_ms;
  pvt.year = static_cast<std::uint16_t>(moment.date.year);
  pvt.month = static_cast<std::uint8_t>(moment.date.month);
  pvt.day = static_cast<std::uint8_t>(moment.date.day);
  const std::int64_t second = moment.utc_time_of_day_ns / kSecond_ns;
  pvt.hour = static_cast<std::uint8_t>(second / 3600);
  pvt.minute = static_cast<std::uint8_t>(second / 60 % 60);
  pvt.second = static_cast<std::uint8_t>(second % 60);
  pvt.nano = static_cast<std::int32_t>(moment.utc_time_of_day_ns % kSecond_ns);
  pvt.date_valid = pvt.time_valid = pvt.fully_resolved = true;
  set_quality(pvt, sky.quality);
  pvt.satellites = static_cast<std::uint8_t>(sky.satellites);
  pvt.longitude_1e7deg = static_cast<std::int32_t>(std::llround(moment.at.longitude_deg * 1e7));
  pvt.latitude_1e7deg = static_cast<std::int32_t>(std::llround(moment.at.latitude_deg * 1e7));
  pvt.height_mm = static_cast<std::int32_t>(std::llround(moment.at.height_m * 1e3));
  pvt.height_msl_mm = pvt.height_mm;
  const double radius_m = moment.sigma_m * std::sqrt(2.0);
  pvt.horizontal_accuracy_mm = static_cast<std::uint32_t>(std::lround(radius_m * 1e3));
  pvt.vertical_accuracy_mm = pvt.horizontal_accuracy_mm;
  pvt.pdop_centi = 120;
  return pvt;
}

UbxNavHpposllh nav_hpposllh(const GnssMoment& moment) {
  const double radius_m = moment.sigma_m * std::sqrt(2.0);
  const auto accuracy = static_cast<std::uint32_t>(std::lround(radius_m * 1e4));
  const std::int64_t height = std::llround(moment.at.height_m * 1e4);
  return {moment.itow_ms,
          false,
          std::llround(moment.at.longitude_deg * 1e9),
          std::llround(moment.at.latitude_deg * 1e9),
          height,
          height,
          accuracy,
          accuracy};
}

UbloxUnit::UbloxUnit(const UbloxUnitConfig& config, World& world, hal::Clock& clock,
                     hal::ByteStream& end, UnitFaults& faults)
    : config_(config),
      clock_(clock),
      faults_(faults),
      uart_(end, config.baud),
      out_(uart_, clock, faults),
      source_(config.source, world, clock, faults) {
  const auto model = ublox_model({config.software, config.hardware, config.extensions});
  ninth_ = model && model->dialect == UbloxDialect::f9;
  restart();
}

void UbloxUnit::restart() {
  keys_ = {{kRateMeas_ms, 1000}, {kRateNav, 1},      {kDynamicModel, 0}, {kUart1OutNmea, 1},
           {kUsbOutNmea, 1},     {kUart1InRtcm3, 1}, {kUsbInRtcm3, 1}};
  for (const std::uint32_t key :
       {kNavPvtUart1, kNavHpposllhUart1, kNavCovUart1, kNavEoeUart1, kMonRfUart1, kRxmRtcmUart1})
    keys_[key] = keys_[key + kUsb] = 0;
  uart_.set_baud(config_.baud);
}

std::uint64_t UbloxUnit::value(std::uint32_t key) const {
  const auto found = keys_.find(key);
  return found == keys_.end() ? 0 : found->second;
}

// On whichever port we are: one line is simulated.
bool UbloxUnit::sends(std::uint32_t key) const {
  const std::uint64_t every = std::max(value(key), value(key + kUsb));
  return every != 0 && epochs_ % every == 0;
}

hal::Task<void> UbloxUnit::run() {
  co_await (answer_requests() && stream());
}

hal::Task<void> UbloxUnit::answer_requests() {
  Resync resync(kGnssFrameMax);
  std::array<std::uint8_t, 1024> piece;
  for (;;) {
    const auto size = co_await out_.read_some(piece);
    if (!size) {
      co_await clock_.sleep_for(kLinkPause);
      continue;
    }
    resync.feed(ByteView(piece).first(*size));
    while (const auto frame = resync.next(look_gnss)) co_await answer(*frame);
  }
}

hal::Task<void> UbloxUnit::answer(ByteView frame) {
  if (gnss_kind(frame) == GnssKind::rtcm3) co_await take_correction(frame);
  if (gnss_kind(frame) != GnssKind::ubx) co_return;
  const std::vector<Bytes> replies = replies_to(parse_ubx(frame));
  for (const Bytes& reply : replies) co_await send(reply);
}

// Each kind of message apart, as stuck repeats the first of each.
hal::Task<void> UbloxUnit::send(const Bytes& bytes) {
  const int kind = bytes[0] == 0xB5 ? bytes[2] << 8 | bytes[3] : 0;
  (void)co_await out_.write(bytes, kind);
}

hal::Task<void> UbloxUnit::take_correction(ByteView frame) {
  if (value(kUart1InRtcm3) == 0 && value(kUsbInRtcm3) == 0) co_return;
  const std::uint16_t type = rtcm3_type(frame).value_or(0);
  corrections_.push_back(type);
  if (!sends(kRxmRtcmUart1)) co_return;
  const Bytes report = encode_ubx(UbxRxmRtcm{false, 2, 0, 0, type});
  co_await send(report);
}

// What it says to a message, in order.
std::vector<Bytes> UbloxUnit::replies_to(const UbxMessage& message) {
  if (message.cls == 0x0A && message.id == 0x04)
    return {encode_ubx(UbxMonVer{config_.software, config_.hardware, config_.extensions})};
  if (message.cls != 0x06) return {};
  std::vector<Bytes> replies;
  const auto reply = asked(message);
  if (reply) replies.push_back(*reply);
  const bool accepted = reply || apply(message);
  replies.push_back(encode_ubx(UbxAck{accepted, message.cls, message.id}));
  return replies;
}

// The answer to a question about settings.
std::optional<Bytes> UbloxUnit::asked(const UbxMessage& message) {
  if (!ninth_ && message.id == 0x08 && message.payload.empty())
    return ubx_cfg_rate(static_cast<std::uint16_t>(value(kRateMeas_ms)),
                        static_cast<std::uint16_t>(value(kRateNav)), 1);
  const auto keys = ninth_ ? ubx_asked_keys(message) : std::nullopt;
  if (!keys) return std::nullopt;
  std::vector<UbxSetting> settings;
  for (const std::uint32_t key : *keys)
    if (keys_.contains(key)) settings.push_back({key, keys_[key]});
  return ubx_valget_answer(settings);
}

bool UbloxUnit::apply(const UbxMessage& message) {
  if (ninth_) return message.id == 0x8A && apply_keys(message);
  const ByteView p = message.payload;
  if (message.id == 0x00 && p.size() == 20) {
    keys_[kUart1OutNmea] = keys_[kUsbOutNmea] = (p[14] & 2U) != 0;
    return true;
  }
  if (message.id == 0x08 && p.size() == 6) {
    keys_[kRateMeas_ms] = little<std::uint16_t>(p, 0);
    return true;
  }
  if (message.id == 0x01 && p.size() == 3) {
    if (p[0] == 0x01 && p[1] == 0x07) keys_[kNavPvtUart1] = p[2];
    if (p[0] == 0x01 && p[1] == 0x61) keys_[kNavEoeUart1] = p[2];
    return p[0] == 0x01;
  }
  return message.id == 0x24 && p.size() == 36;
}

bool UbloxUnit::apply_keys(const UbxMessage& message) {
  const auto settings = ubx_settings(message);
  if (!settings) return false;
  for (const UbxSetting& setting : *settings)
    if (!keys_.contains(setting.key) || refused_key_ == setting.key) return false;
  for (const UbxSetting& setting : *settings)
    if (forgotten_key_ != setting.key) keys_[setting.key] = setting.value;
  return true;
}

hal::Task<void> UbloxUnit::stream() {
  for (;;) {
    co_await source_.next_due(1000.0 /
                              static_cast<double>(std::max<std::uint64_t>(1, value(kRateMeas_ms))));
    if (faults_.silent()) continue;
    ++epochs_;
    const std::vector<Bytes> messages = messages_of(source_.sample());
    for (const Bytes& message : messages) co_await send(message);
  }
}

std::vector<Bytes> UbloxUnit::messages_of(const GnssMoment& moment) const {
  const GnssSky sky = sky_at(moment, sky_);
  const bool fix = sky.quality != GnssQuality::none;
  std::vector<Bytes> messages;
  if (value(kUart1OutNmea) != 0 && value(kUsbOutNmea) != 0)
    for (const std::string& sentence : nmea_sentences(moment, sky, {}))
      messages.emplace_back(sentence.begin(), sentence.end());
  if (sends(kNavPvtUart1)) messages.push_back(encode_ubx(nav_pvt(moment, sky)));
  if (sends(kNavHpposllhUart1)) {
    UbxNavHpposllh high = nav_hpposllh(moment);
    high.invalid = !fix;
    messages.push_back(encode_ubx(high));
  }
  if (sends(kNavCovUart1)) {
    const auto variance_m2 = static_cast<float>(moment.sigma_m * moment.sigma_m);
    messages.push_back(encode_ubx(UbxNavCov{
        moment.itow_ms, fix, fix, {variance_m2, 0, 0, variance_m2, 0, 4 * variance_m2}, {}}));
  }
  if (sends(kMonRfUart1)) {
    UbxMonRf rf;
    rf.blocks.push_back({0, jamming_, antenna_, 1, 0, 90, 5000, 10});
    messages.push_back(encode_ubx(rf));
  }
  if (sends(kNavEoeUart1)) messages.push_back(encode_ubx(UbxNavEoe{moment.itow_ms}));
  return messages;
}

}  // namespace sim
