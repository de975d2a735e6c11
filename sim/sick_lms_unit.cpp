#include "sim/sick_lms_unit.hpp"

#include <algorithm>
#include <boost/asio/experimental/awaitable_operators.hpp>
#include <cmath>
#include <numbers>
#include <utility>

namespace sim {

using namespace std::chrono_literals;
using drivers::Bytes;
using drivers::ColaReader;
using drivers::ColaValue;
using As = drivers::ColaValue::As;

namespace {

constexpr hal::Duration kLatency = 1200us;  // As recorded of an LMS111.
constexpr hal::Duration kStartLatency = 14ms;
enum Kind { kAnswerAfter, kScan = 1 << 20 };  // Of messages, for the fault `stuck`.

double uniform(std::uint64_t seed, std::uint64_t number) {
  return static_cast<double>(mix(mix(seed) ^ ~number) >> 11) * 0x1p-53;
}

}  // namespace

struct SickLmsUnit::Known {
  std::string_view command, name;
  Handler handler;
  bool log_in_needed{};
};

const SickLmsUnit::Known SickLmsUnit::kKnown[] = {
    {"sMN", "SetAccessMode", &SickLmsUnit::log_in},
    {"sWN", "EIHstCola", &SickLmsUnit::choose_dialect},
    {"sRN", "DeviceIdent", &SickLmsUnit::identify},
    {"sRN", "FirmwareVersion", &SickLmsUnit::firmware},
    {"sRN", "SCdevicestate", &SickLmsUnit::state},
    {"sRN", "ODoprh", &SickLmsUnit::hours},
    {"sRN", "ODpwrc", &SickLmsUnit::hours},
    {"sRN", "LocationName", &SickLmsUnit::location},
    {"sMN", "LMCstopmeas", &SickLmsUnit::stop_measuring, true},
    {"sMN", "LMCstartmeas", &SickLmsUnit::start_measuring, true},
    {"sMN", "mLMPsetscancfg", &SickLmsUnit::set_scan, true},
    {"sRN", "LMPscancfg", &SickLmsUnit::tell_scan},
    {"sWN", "LMPoutputRange", &SickLmsUnit::set_sector, true},
    {"sRN", "LMPoutputRange", &SickLmsUnit::tell_sector},
    {"sWN", "LMDscandatacfg", &SickLmsUnit::set_data, true},
    {"sRN", "LMDscandatacfg", &SickLmsUnit::tell_data},
    {"sWN", "FREchoFilter", &SickLmsUnit::set_echo, true},
    {"sMN", "Run", &SickLmsUnit::run_mode},
    {"sEN", "LMDscandata", &SickLmsUnit::subscribe},
};

SickLmsUnit::SickLmsUnit(SickLmsUnitConfig config, World& world, hal::Clock& clock,
                         hal::ByteStream& link, UnitFaults& faults, const PanTruth& pan)
    : config_(std::move(config)),
      clock_(clock),
      faults_(faults),
      link_(link, clock, faults),
      ahead_({config_.ranges, config_.T_P_L, config_.seed, config_.threads}, world, clock, pan,
             [this](std::uint64_t number) { return turn_start(number); }) {
  settings_.lms5xx = config_.lms5xx;
  restart();
  ready_ = clock.now();  // It was on before the robot.
}

SickLmsUnit::~SickLmsUnit() = default;

hal::Task<void> SickLmsUnit::run() {
  using namespace boost::asio::experimental::awaitable_operators;
  co_await (listen() && stream());
}

void SickLmsUnit::restart() {
  const bool lms5xx = config_.lms5xx;
  settings_ = {};
  settings_.lms5xx = lms5xx;
  if (lms5xx) settings_.frequency_centihz = 2500, settings_.resolution_1e4deg = 5000;
  if (lms5xx) settings_.start_1e4deg = -50000, settings_.stop_1e4deg = 1850000;
  logged_in_ = streaming_ = false;
  measuring_ = true;
  powered_ = clock_.now();
  ready_ = powered_ + hal::from_seconds(config_.boot_s);
  turning_since_ = powered_;
  turns_before_ = since_start_ = 0;
  telegram_counter_ = 0;
  cast_anew_ = true;
}

// Without power, or not yet up after it came back.
bool SickLmsUnit::booting() {
  const bool off = faults_.is(UnitFault::off);
  if (was_off_ && !off) restart();
  was_off_ = off;
  return off || clock_.now() < ready_;
}

hal::Task<void> SickLmsUnit::listen() {
  drivers::Resync resync(drivers::kColaFrameMax);
  std::array<std::uint8_t, 4096> buffer;
  for (;;) {
    const auto got = co_await link_.read_some(buffer);
    if (!got) {  // The connection is gone, and the subscription with it.
      streaming_ = logged_in_ = false;
      continue;
    }
    if (booting()) continue;
    resync.feed(drivers::ByteView(buffer).first(*got));
    while (const auto frame = resync.next(drivers::look_cola))
      if (const auto message = drivers::parse_cola(*frame)) co_await answer(*message);
  }
}

hal::Task<void> SickLmsUnit::answer(const Message& message) {
  if (config_.only && message.dialect != *config_.only) co_return;
  dialect_ = message.dialect;
  int kind = kAnswerAfter;
  for (const char letter : message.name) kind = (kind * 31 + letter) & 0xFFFF;
  const bool starts = message.name == "LMCstartmeas";
  const Bytes bytes = reply(message);
  co_await clock_.sleep_for(faults_.slowed(starts ? kStartLatency : kLatency));
  if (!co_await link_.write(bytes, kind)) streaming_ = false;
  changed_.notify();
}

Bytes SickLmsUnit::reply(const Message& message) {
  const auto known = std::find_if(std::begin(kKnown), std::end(kKnown), [&](const Known& k) {
    return k.command == message.command && k.name == message.name;
  });
  if (known == std::end(kKnown)) return refuse(message.command == "sMN" ? 2 : 3);
  if (known->log_in_needed && !logged_in_) return refuse(1);
  return (this->*known->handler)(message);
}

Bytes SickLmsUnit::refuse(std::uint16_t code) const {
  std::string text = "sFA";
  if (dialect_ == drivers::ColaDialect::ascii) {
    constexpr std::string_view kHex = "0123456789ABCDEF";
    text += ' ';
    if (code >= 16) text += kHex[code >> 4];
    text += kHex[code & 15U];
  } else {
    text += static_cast<char>(code >> 8);
    text += static_cast<char>(code);
  }
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(text.data());
  return drivers::frame_cola(dialect_, {bytes, text.size()});
}

Bytes SickLmsUnit::say(const Message& to, std::span<const ColaValue> values) const {
  const std::string_view command = to.command == "sMN"   ? "sAN"
                                   : to.command == "sWN" ? "sWA"
                                   : to.command == "sEN" ? "sEA"
                                                         : "sRA";
  if (!values.empty()) return drivers::encode_cola(dialect_, command, to.name, values);
  Bytes payload(command.begin(), command.end());  // A blank follows the name in every answer.
  payload.push_back(' ');
  payload.insert(payload.end(), to.name.begin(), to.name.end());
  if (dialect_ == drivers::ColaDialect::binary) payload.push_back(' ');
  return drivers::frame_cola(dialect_, payload);
}

Bytes SickLmsUnit::say_text(const Message& to, std::span<const std::string> texts) const {
  Bytes payload{'s', 'R', 'A', ' '};
  payload.insert(payload.end(), to.name.begin(), to.name.end());
  for (const std::string& text : texts) {
    payload.push_back(' ');
    if (dialect_ == drivers::ColaDialect::ascii) {
      for (const int shift : {4, 0})
        if (shift == 0 || text.size() >= 16)
          payload.push_back(
              static_cast<std::uint8_t>("0123456789ABCDEF"[text.size() >> shift & 15U]));
      payload.push_back(' ');
    } else {
      if (&text != texts.data()) payload.pop_back();  // One blank, after the name.
      drivers::append_big<std::uint16_t>(payload, static_cast<std::uint16_t>(text.size()));
    }
    payload.insert(payload.end(), text.begin(), text.end());
  }
  return drivers::frame_cola(dialect_, payload);
}

Bytes SickLmsUnit::log_in(const Message& message) {
  ColaReader in(message);
  const auto level = in.u8();
  const auto password = in.u32();
  logged_in_ = in.ok() && level == 3 && password == drivers::LmsSettings{}.password;
  const ColaValue answer[] = {{As::u8, logged_in_}};
  return say(message, answer);
}

Bytes SickLmsUnit::choose_dialect(const Message& message) {
  const bool binary = ColaReader(message).u8() != 0;
  return binary == (dialect_ == drivers::ColaDialect::binary) ? say(message) : refuse(4);
}

Bytes SickLmsUnit::identify(const Message& message) {
  const std::string model = config_.lms5xx ? "LMS511_PRO" : "LMS11x_FieldEval";
  const std::string texts[] = {config_.ident.empty() ? model : config_.ident, config_.firmware};
  return say_text(message, texts);
}

Bytes SickLmsUnit::firmware(const Message& message) {
  return say_text(message, {&config_.firmware, 1});
}

Bytes SickLmsUnit::state(const Message& message) {
  const ColaValue answer[] = {{As::u8, measuring_ ? 0 : 3}};  // As recorded: busy while it works.
  return say(message, answer);
}

Bytes SickLmsUnit::hours(const Message& message) {
  const auto tenths = (clock_.now() - powered_) / 360s;
  const ColaValue answer[] = {{As::u32, message.name == "ODoprh" ? 1110 + tenths : 63}};
  return say(message, answer);
}

Bytes SickLmsUnit::location(const Message& message) {
  const std::string text = "not defined";
  return say_text(message, {&text, 1});
}

Bytes SickLmsUnit::stop_measuring(const Message& message) {
  turns_before_ += static_cast<std::uint64_t>(
      std::max(0.0, hal::seconds(clock_.now() - turning_since_) / period_s()));
  turning_since_ = clock_.now();
  measuring_ = false;
  const ColaValue answer[] = {{As::u8, 0}};
  return say(message, answer);
}

Bytes SickLmsUnit::start_measuring(const Message& message) {
  if (!measuring_) turning_since_ = clock_.now() + kStartLatency;
  measuring_ = true;
  since_start_ = 0;
  cast_anew_ = true;
  const ColaValue answer[] = {{As::u8, 0}};
  return say(message, answer);
}

Bytes SickLmsUnit::set_scan(const Message& message) {
  if (measuring_) return refuse(4);
  ColaReader in(message);
  drivers::LmsSettings asked = settings_;
  asked.frequency_centihz = in.i32();
  in.i16();
  asked.resolution_1e4deg = static_cast<std::int32_t>(in.u32());
  const auto start = in.i32(), stop = in.i32();
  if (!in.ok()) return refuse(5);
  int status = drivers::lms_settings_problem(asked).empty() ? 0 : 3;
  if (status == 0) settings_ = asked;
  asked.start_1e4deg = start;
  asked.stop_1e4deg = stop;
  if (status == 0 && !drivers::lms_settings_problem(asked).empty()) status = 4;
  const ColaValue answer[] = {{As::u8, status},
                              {As::u32, settings_.frequency_centihz},
                              {As::i16, 1},
                              {As::u32, settings_.resolution_1e4deg},
                              {As::i32, settings_.start_1e4deg},
                              {As::i32, settings_.stop_1e4deg}};
  return say(message, answer);
}

Bytes SickLmsUnit::tell_scan(const Message& message) {
  const ColaValue answer[] = {{As::u32, settings_.frequency_centihz},
                              {As::i16, 1},
                              {As::u32, settings_.resolution_1e4deg},
                              {As::i32, settings_.start_1e4deg},
                              {As::i32, settings_.stop_1e4deg}};
  return say(message, answer);
}

Bytes SickLmsUnit::set_sector(const Message& message) {
  ColaReader in(message);
  drivers::LmsSettings asked = settings_;
  in.u16();
  asked.resolution_1e4deg = static_cast<std::int32_t>(in.u32());
  asked.start_1e4deg = in.i32();
  asked.stop_1e4deg = in.i32();
  if (!in.ok() || !drivers::lms_settings_problem(asked).empty()) return refuse(5);
  settings_ = asked;
  return say(message);
}

Bytes SickLmsUnit::tell_sector(const Message& message) {
  const ColaValue answer[] = {{As::u16, 1},
                              {As::u32, settings_.resolution_1e4deg},
                              {As::hex32, static_cast<std::uint32_t>(settings_.start_1e4deg)},
                              {As::hex32, static_cast<std::uint32_t>(settings_.stop_1e4deg)}};
  return say(message, answer);
}

Bytes SickLmsUnit::set_data(const Message& message) {
  ColaReader in(message);
  const auto channels = in.u8();
  in.u8();
  const auto remission = in.u8();
  for (int i = 0; i < 8; ++i) in.u8();
  const auto every = in.u16();
  if (!in.ok() || channels != 1 || every == 0) return refuse(5);
  settings_.remission = remission != 0;
  settings_.every_nth_scan = every;
  return say(message);
}

Bytes SickLmsUnit::tell_data(const Message& message) {
  const ColaValue answer[] = {{As::hex2, 1},
                              {As::hex2, 0},
                              {As::u8, settings_.remission},
                              {As::u8, settings_.remission},
                              {As::u8, 0},
                              {As::hex2, 0},
                              {As::hex2, 0},
                              {As::u8, 0},
                              {As::u8, 0},
                              {As::u8, 0},
                              {As::u8, 1},
                              {As::u16, settings_.every_nth_scan}};
  return say(message, answer);
}

Bytes SickLmsUnit::set_echo(const Message& message) {
  if (!config_.lms5xx) return refuse(3);
  return ColaReader(message).u8() <= 2 ? say(message) : refuse(5);
}

Bytes SickLmsUnit::run_mode(const Message& message) {
  logged_in_ = false;
  const ColaValue answer[] = {{As::u8, 1}};
  return say(message, answer);
}

Bytes SickLmsUnit::subscribe(const Message& message) {
  const bool on = ColaReader(message).u8() != 0;
  streaming_ = on;
  const ColaValue answer[] = {{As::u8, on}};
  return say(message, answer);
}

double SickLmsUnit::period_s() const {
  return 100.0 / settings_.frequency_centihz / (1 + config_.skew) * faults_.slowness();
}

std::uint32_t SickLmsUnit::device_us(hal::Time time) const {
  const double since_us = hal::seconds(time - powered_) * (1 + config_.skew) * 1e6;
  return static_cast<std::uint32_t>(config_.clock_start_us + std::llround(since_us));
}

// The mirror's speed wavers: by 0.2 ms at most on an LMS1xx, 0.36 ms on an LMS5xx.
hal::Time SickLmsUnit::turn_start(std::uint64_t number) const {
  const double jitter_s = config_.lms5xx ? 0.36e-3 : 0.18e-3;
  const double turns = static_cast<double>(number - turns_before_);
  return turning_since_ +
         hal::from_seconds(turns * period_s() + jitter_s * uniform(config_.seed, number));
}

MirrorArc SickLmsUnit::arc() const {
  constexpr double kUnit_rad = std::numbers::pi / 1800000;
  const double resolution = settings_.resolution_1e4deg;
  const auto beams = (settings_.stop_1e4deg - settings_.start_1e4deg) / settings_.resolution_1e4deg;
  return {static_cast<std::uint32_t>(beams) + 1, (settings_.start_1e4deg - 900000) * kUnit_rad,
          resolution * kUnit_rad};
}

hal::Task<void> SickLmsUnit::stream() {
  std::uint64_t number = 0;
  for (;;) {
    if (!streaming_ || !measuring_) {
      co_await changed_.wait();
      const double turned = hal::seconds(clock_.now() - turning_since_) / period_s();
      number = turns_before_ + static_cast<std::uint64_t>(std::max(0.0, std::ceil(turned)));
      continue;
    }
    keep_pace(number);
    const hal::Time sent = turn_start(number) + transmission(number);
    co_await clock_.sleep_until(sent);
    if (!streaming_ || !measuring_) continue;
    if (!booting() && number % settings_.every_nth_scan == 0) co_await send(number, sent);
    ++number;
  }
}

// At another speed, turns are counted on from here.
void SickLmsUnit::keep_pace(std::uint64_t number) {
  if (paced_by_ == faults_.generation()) return;
  paced_by_ = faults_.generation();
  turning_since_ = clock_.now();
  turns_before_ = number;
  cast_anew_ = true;
}

// From a turn's start to its sending, as recorded.
hal::Duration SickLmsUnit::transmission(std::uint64_t number) const {
  const double jitter = uniform(config_.seed + 1, number);
  return config_.lms5xx ? 40200us + hal::from_seconds(0.8e-3 * jitter)
                        : 3070us + hal::from_seconds(0.2e-3 * jitter);
}

hal::Task<void> SickLmsUnit::send(std::uint64_t number, hal::Time sent) {
  if (std::exchange(cast_anew_, false)) {
    const MirrorArc beams = arc();
    const double turns = beams.beams * beams.angle_step_rad / (2 * std::numbers::pi);
    ahead_.set_arc(beams, hal::from_seconds(period_s() * turns));
  }
  fill_header(number, sent);
  fill_channels(ahead_.of(number));
  const Bytes bytes = drivers::encode_lms_scan(dialect_, "sSN", scan_);
  const bool twice = !config_.lms5xx && since_start_ == 17;  // As recorded now and then.
  for (int i = 0; i <= twice; ++i) {
    const auto written = co_await link_.write(bytes, kScan);
    if (!written) streaming_ = false;
  }
  ++scans_sent_;
  ++since_start_;
}

void SickLmsUnit::fill_header(std::uint64_t number, hal::Time sent) {
  scan_.version = config_.lms5xx ? 0 : 1;
  scan_.device_number = 1;
  scan_.serial_number = config_.serial_number;
  const std::uint64_t settling = config_.lms5xx ? 1 : 8;
  scan_.status = {static_cast<std::uint8_t>(since_start_ < settling), status_};
  scan_.telegram_counter = telegram_counter_++;
  scan_.scan_counter = static_cast<std::uint16_t>(number);
  scan_.scan_start_us = device_us(turn_start(number));
  scan_.transmit_us = device_us(sent);
  scan_.scan_frequency_centihz =
      static_cast<std::uint32_t>(std::lround(settings_.frequency_centihz * faults_.wrong_factor()));
  const double beams_per_s =
      3600000.0 / settings_.resolution_1e4deg * (settings_.frequency_centihz / 100.0);
  scan_.measurement_frequency_100hz = static_cast<std::uint32_t>(std::lround(beams_per_s / 100));
}

void SickLmsUnit::fill_channels(std::span<const float> ranges_m) {
  const double step_mm = config_.long_range ? 2 : 1;
  const double steps_per_m = 1000 * faults_.wrong_factor() / step_mm;
  scan_.channels16.resize(settings_.remission ? 2 : 1);
  for (auto& channel : scan_.channels16) {
    channel.start_1e4deg = settings_.start_1e4deg;
    channel.step_1e4deg = static_cast<std::uint16_t>(settings_.resolution_1e4deg);
    channel.raw.resize(ranges_m.size());
  }
  auto& distances = scan_.channels16.front();
  distances.name = {'D', 'I', 'S', 'T', '1'};
  distances.scale = static_cast<float>(step_mm);
  for (std::size_t i = 0; i < ranges_m.size(); ++i) {
    const double steps = ranges_m[i] * steps_per_m + 0.5;
    distances.raw[i] = steps < 65536 ? static_cast<std::uint16_t>(steps) : 0;
  }
  if (!settings_.remission) return;
  auto& remission = scan_.channels16.back();
  remission.name = {'R', 'S', 'S', 'I', '1'};
  for (std::size_t i = 0; i < ranges_m.size(); ++i)
    remission.raw[i] =
        ranges_m[i] > 0 ? static_cast<std::uint16_t>(20000 / (1 + ranges_m[i])) : std::uint16_t{0};
}

}  // namespace sim
