#include "sim/hokuyo_unit.hpp"

#include <algorithm>
#include <array>
#include <boost/asio/experimental/awaitable_operators.hpp>
#include <cmath>
#include <numbers>

#include "drivers/text.hpp"

namespace sim {

using namespace std::chrono_literals;

namespace {

constexpr hal::Duration kLatency = 1ms;
constexpr hal::Duration kTransfer = 500us;  // From the end of a scan to its sending.
enum Kind { kScan = 1 << 20 };              // Of messages, for the fault `stuck`.

void append_with_sum(std::string& text, std::string_view line) {
  text += line;
  text += drivers::scip_checksum(line);
  text += '\n';
}

std::string with_sum(std::string_view line) {
  std::string text;
  append_with_sum(text, line);
  return text;
}

std::string status(const std::string& command, std::string_view code) {
  return command + '\n' + with_sum(code);
}

// Returns where the next one goes.
char* encode(std::uint32_t value, int characters, char* to) {
  for (int shift = 6 * (characters - 1); shift >= 0; shift -= 6)
    *to++ = static_cast<char>((value >> shift & 63U) + 0x30);
  return to;
}

std::string encoded(std::uint32_t value, int characters) {
  std::string text(static_cast<std::size_t>(characters), '\0');
  encode(value, characters, text.data());
  return text;
}

}  // namespace

HokuyoUnit::HokuyoUnit(HokuyoUnitConfig config, World& world, hal::Clock& clock,
                       hal::ByteStream& link, UnitFaults& faults, const PanTruth& pan)
    : config_(std::move(config)),
      clock_(clock),
      faults_(faults),
      link_(link, clock, faults),
      ahead_({config_.ranges, config_.T_P_L, config_.seed, config_.threads}, world, clock, pan,
             [this](std::uint64_t number) { return turn_start(number); }) {
  restart();
  ready_ = clock.now();  // It was on before the robot.
}

HokuyoUnit::~HokuyoUnit() = default;

hal::Task<void> HokuyoUnit::run() {
  using namespace boost::asio::experimental::awaitable_operators;
  co_await (listen() && measure());
}

void HokuyoUnit::restart() {
  streaming_ = adjusting_ = false;
  powered_ = turning_since_ = clock_.now();
  ready_ = powered_ + hal::from_seconds(config_.boot_s);
  turns_before_ = 0;
}

// Without power, or not yet up after it came back.
bool HokuyoUnit::booting() {
  const bool off = faults_.is(UnitFault::off);
  if (was_off_ && !off) restart();
  was_off_ = off;
  return off || clock_.now() < ready_;
}

hal::Task<void> HokuyoUnit::listen() {
  std::array<std::uint8_t, 1024> buffer;
  std::string half;
  for (;;) {
    const auto got = co_await link_.read_some(buffer);
    if (!got) {
      half.clear();
      streaming_ = false;
      continue;
    }
    if (booting()) continue;
    half += drivers::as_text(drivers::ByteView(buffer).first(*got));
    for (auto end = half.find_first_of("\r\n"); end != std::string::npos;
         end = half.find_first_of("\r\n")) {
      const std::string command = half.substr(0, end);
      half.erase(0, end + 1);
      if (!command.empty()) co_await answer(command);
    }
    if (half.size() > 64) half.clear();
  }
}

hal::Task<void> HokuyoUnit::answer(std::string command) {
  co_await clock_.sleep_for(faults_.slowed(kLatency));
  const std::string text = reply(command) + '\n';
  int kind = 0;
  for (const char letter : command) kind = (kind * 31 + letter) & 0xFFFF;
  const auto sent = co_await link_.write(drivers::as_bytes(text), kind);
  if (!sent) streaming_ = false;
  changed_.notify();
}

std::string HokuyoUnit::reply(const std::string& command) {
  if (command.starts_with("TM")) return set_clock(command);
  if (adjusting_ || command == "SCIP2.0") return status(command, "0E");
  if (command == "QT" || command == "RS") {
    streaming_ = false;
    return status(command, "00");
  }
  if (command == "BM") return status(command, laser_broken_ ? "01" : "00");
  if (command == "VV") return status(command, "00") + versions();
  if (command == "PP") return status(command, "00") + parameters();
  if (command.starts_with("MD") || command.starts_with("ME")) return begin(command);
  return status(command, "0E");
}

std::string HokuyoUnit::set_clock(const std::string& command) {
  if (streaming_) return status(command, "0E");
  if (command == "TM0") adjusting_ = true;
  if (command == "TM2") adjusting_ = false;
  if (command != "TM1") return status(command, "00");
  if (!adjusting_) return status(command, "0E");
  return status(command, "00") + with_sum(encoded(device_ms(clock_.now()), 4));
}

std::string HokuyoUnit::begin(const std::string& command) {
  const auto number = [&](std::size_t at, std::size_t size) {
    return command.size() < at + size
               ? -1
               : drivers::whole_number<int>(command.substr(at, size)).value_or(-1);
  };
  Stream asked;
  asked.command = command;
  asked.intensities = command[1] == 'E';
  asked.first = number(2, 4);
  asked.last = number(6, 4);
  asked.group = std::max(number(10, 2), 1);
  asked.skip = number(12, 1);
  asked.left = number(13, 2);
  asked.endless = asked.left == 0;
  if (command.size() != 15 || asked.skip < 0 || asked.left < 0) return status(command, "0C");
  if (asked.first < 0) return status(command, "01");
  if (asked.last > config_.parameters.step_last) return status(command, "04");
  if (asked.last <= asked.first) return status(command, "05");
  if (laser_broken_) return status(command, "50");
  const double step_rad = 2 * std::numbers::pi / config_.parameters.steps_per_turn * asked.group;
  const auto beams = static_cast<std::uint32_t>((asked.last - asked.first) / asked.group + 1);
  const double first_rad = (asked.first - config_.parameters.step_front) * step_rad / asked.group;
  stream_ = asked;
  turns_before_ += static_cast<std::uint64_t>(
      std::max(0.0, std::ceil(hal::seconds(clock_.now() - turning_since_) / period_s())));
  turning_since_ = clock_.now() + 5ms;
  ahead_.set_arc({beams, first_rad, step_rad},
                 hal::from_seconds(period_s() * beams * step_rad / (2 * std::numbers::pi)));
  streaming_ = true;
  return status(command, "00");
}

std::string HokuyoUnit::versions() const {
  return with_sum("VEND:Hokuyo Automatic Co.,Ltd.;") +
         with_sum("PROD:" + config_.parameters.model + ";") +
         with_sum("FIRM:" + config_.firmware + ";") + with_sum("PROT:SCIP 2.2;") +
         with_sum("SERI:" + config_.serial + ";");
}

std::string HokuyoUnit::parameters() const {
  const drivers::ScipParameters& p = config_.parameters;
  const std::pair<std::string_view, int> numbers[] = {
      {"DMIN", p.range_min_mm}, {"DMAX", p.range_max_mm}, {"ARES", p.steps_per_turn},
      {"AMIN", p.step_first},   {"AMAX", p.step_last},    {"AFRT", p.step_front},
      {"SCAN", p.speed_rpm}};
  std::string text = with_sum("MODL:" + p.model + ";");
  for (const auto& [key, value] : numbers)
    text += with_sum(std::string(key) + ":" + std::to_string(value) + ";");
  return text;
}

double HokuyoUnit::period_s() const {
  return 60.0 / config_.parameters.speed_rpm / (1 + config_.skew) * faults_.slowness();
}

hal::Time HokuyoUnit::turn_start(std::uint64_t number) const {
  // Below 0 for a turn that began before the speed was set.
  const auto turns = static_cast<double>(static_cast<std::int64_t>(number - turns_before_));
  return turning_since_ + hal::from_seconds(turns * period_s());
}

std::uint32_t HokuyoUnit::device_ms(hal::Time time) const {
  const double own_s = hal::seconds(time - powered_) * (1 + config_.skew) * faults_.wrong_factor();
  const auto ms = static_cast<std::uint64_t>(config_.clock_start_ms + std::max(0.0, own_s * 1000));
  return static_cast<std::uint32_t>(ms & 0xFFFFFF);
}

// A scan leaves when its last beam is measured.
hal::Task<void> HokuyoUnit::measure() {
  std::uint64_t number = 0;
  for (;;) {
    if (!streaming_) {
      co_await changed_.wait();
      number = turns_before_;
      continue;
    }
    if (paced_by_ != faults_.generation()) {  // Another speed: turns are counted on from here.
      paced_by_ = faults_.generation();
      turning_since_ = clock_.now();
      turns_before_ = number;
    }
    const double arc =
        static_cast<double>(stream_.last - stream_.first + 1) / config_.parameters.steps_per_turn;
    const std::string command = stream_.command;
    co_await clock_.sleep_until(turn_start(number) + hal::from_seconds(arc * period_s()) +
                                kTransfer);
    if (!streaming_ || command != stream_.command) continue;
    if (!booting() && number % static_cast<std::uint64_t>(stream_.skip + 1) == 0) {
      const std::string text = scan_text(number);
      const auto sent = co_await link_.write(drivers::as_bytes(text), kScan);
      if (!sent || (!stream_.endless && --stream_.left == 0)) streaming_ = false;
    }
    ++number;
  }
}

std::string HokuyoUnit::scan_text(std::uint64_t number) {
  const auto ranges_m = ahead_.of(number, static_cast<std::uint64_t>(stream_.skip + 1));
  std::string data(ranges_m.size() * (stream_.intensities ? 6 : 3), '\0');
  char* to = data.data();
  const double factor = faults_.wrong_factor();
  for (const float range_m : ranges_m) {
    const double mm = range_m * 1000.0 * factor + 0.5;
    const auto distance = static_cast<std::uint32_t>(mm);
    const bool within = scip_is_range(config_.parameters, distance);
    to = encode(within ? distance : 0, 3, to);
    if (stream_.intensities)
      to = encode(within ? static_cast<std::uint32_t>(5000 / (1 + range_m)) : 0, 3, to);
  }
  std::string text = stream_.command + '\n';
  if (!stream_.endless) {
    const int left = stream_.left - 1;
    text[13] = static_cast<char>('0' + left / 10);
    text[14] = static_cast<char>('0' + left % 10);
  }
  text += with_sum("99");
  text += with_sum(encoded(device_ms(turn_start(number)), 4));
  text.reserve(text.size() + data.size() + data.size() / 32 + 3);
  for (std::size_t at = 0; at < data.size(); at += 64)
    append_with_sum(text, std::string_view(data).substr(at, 64));
  text += '\n';
  return text;
}

}  // namespace sim
