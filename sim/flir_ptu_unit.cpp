#include "sim/flir_ptu_unit.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <numbers>

#include "drivers/text.hpp"

namespace sim {

using namespace std::chrono_literals;

namespace {

const std::string kDone = "*";
constexpr std::size_t kHalfMax = 64;

}  // namespace

struct FlirPtuUnit::Known {
  std::string_view name;
  Handler handler;
};

const FlirPtuUnit::Known FlirPtuUnit::kKnown[] = {
    {"PP", &FlirPtuUnit::position},     {"PO", &FlirPtuUnit::offset},
    {"PS", &FlirPtuUnit::speed},        {"PD", &FlirPtuUnit::current_speed},
    {"PA", &FlirPtuUnit::acceleration}, {"PR", &FlirPtuUnit::resolution},
    {"PN", &FlirPtuUnit::limit},        {"PX", &FlirPtuUnit::limit},
    {"PU", &FlirPtuUnit::limit},        {"PL", &FlirPtuUnit::limit},
    {"TP", &FlirPtuUnit::tilt},         {"TR", &FlirPtuUnit::tilt},
    {"TN", &FlirPtuUnit::tilt},         {"TX", &FlirPtuUnit::tilt},
    {"ED", &FlirPtuUnit::talk},         {"EE", &FlirPtuUnit::talk},
    {"FT", &FlirPtuUnit::talk},         {"FV", &FlirPtuUnit::talk},
    {"I", &FlirPtuUnit::talk},          {"CI", &FlirPtuUnit::talk},
    {"H", &FlirPtuUnit::halt},          {"HP", &FlirPtuUnit::halt},
    {"A", &FlirPtuUnit::await},         {"R", &FlirPtuUnit::reset},
    {"RP", &FlirPtuUnit::reset},        {"O", &FlirPtuUnit::tell_health},
    {"V", &FlirPtuUnit::tell_version},
};

FlirPtuUnit::FlirPtuUnit(FlirPtuUnitConfig config, hal::Clock& clock, hal::ByteStream& link,
                         UnitFaults& faults)
    : config_(std::move(config)),
      clock_(clock),
      faults_(faults),
      link_(link, clock, faults),
      dice_(config_.seed) {
  restart();
  ready_ = clock.now();  // It was on before the robot.
  off_ = faults.is(UnitFault::off);
  faults_.on_set([this] { look_at_power(); });
}

FlirPtuUnit::~FlirPtuUnit() {
  faults_.on_set({});
}

// Not when somebody speaks to it: while it is off, that does not reach it.
void FlirPtuUnit::look_at_power() {
  const bool off = faults_.is(UnitFault::off);
  if (off == off_) return;
  off_ = off;
  if (!off) return restart();
  motion_ = PanMotion::standing(motion_.at(clock_.now()));
  ++changes_;
}

double FlirPtuUnit::step_rad() const {
  return config_.arcsec_per_step * std::numbers::pi / 648000;
}

std::int64_t FlirPtuUnit::steps_max() const {
  return static_cast<std::int64_t>(config_.angle_max_rad / step_rad());
}

double FlirPtuUnit::angle_rad(hal::Time time) const {
  const double steps = motion_.at(time) - static_cast<double>(head_offset_);
  return (config_.counter_clockwise ? 1 : -1) * steps * step_rad();
}

void FlirPtuUnit::lose_steps(std::int64_t steps) {
  head_offset_ += steps;
  ++changes_;
}

void FlirPtuUnit::restart() {
  motion_ = PanMotion::standing(0);
  head_offset_ = target_ = 0;
  ++changes_;
  echo_ = verbose_ = true;
  half_.clear();
  speed_ = std::llround(0.3 / step_rad());
  acceleration_ = std::llround(config_.acceleration_radps2 / step_rad());
  ready_ = clock_.now() + config_.reset_time;
}

hal::Task<void> FlirPtuUnit::run() {
  std::array<std::uint8_t, 256> buffer;
  for (;;) {
    const auto got = co_await link_.read_some(buffer);
    if (!got) {
      half_.clear();
      continue;
    }
    if (off_ || clock_.now() < ready_) continue;
    half_ += drivers::as_text(drivers::ByteView(buffer).first(*got));
    for (auto end = half_.find_first_of(" \r\n"); end != std::string::npos;
         end = half_.find_first_of(" \r\n")) {
      const std::string text = half_.substr(0, end);
      half_.erase(0, end + 1);
      if (!text.empty()) co_await answer(text);
    }
    if (half_.size() > kHalfMax) half_.clear();
  }
}

std::optional<FlirPtuUnit::Request> FlirPtuUnit::parse(std::string_view text) const {
  Request request;
  while (!text.empty() && std::isalpha(static_cast<unsigned char>(text.front()))) {
    request.name += static_cast<char>(std::toupper(static_cast<unsigned char>(text.front())));
    text.remove_prefix(1);
  }
  if (text.empty()) return request;
  request.value = drivers::whole_number<std::int64_t>(text);
  if (!request.value) return std::nullopt;
  return request;
}

hal::Task<void> FlirPtuUnit::answer(const std::string& text) {
  const auto request = parse(text);
  const std::string echo = echo_ ? text + " " : "";
  const hal::Duration latency =
      config_.latency + hal::from_seconds(hal::seconds(config_.latency_jitter) * dice_.uniform());
  co_await clock_.sleep_for(faults_.slowed(latency / 2));
  const Answered said = request ? reply(*request) : Answered{"! Illegal Command Entered", {}};
  co_await clock_.sleep_for(faults_.slowed(latency / 2 + said.after));
  const bool reset = said.text.starts_with("!P!P*");
  const std::string line = echo + said.text + (reset ? "" : "\r\n");
  int kind = 0;
  for (const char letter : request ? request->name : text) kind = (kind * 31 + letter) & 0xFFFF;
  co_await link_.write(drivers::as_bytes(line), request && request->value ? kind + 1 : kind);
}

FlirPtuUnit::Answered FlirPtuUnit::reply(const Request& request) {
  for (const Known& known : kKnown)
    if (known.name == request.name) return (this->*known.handler)(request);
  return {"! Illegal Command Entered", {}};
}

FlirPtuUnit::Answered FlirPtuUnit::number(std::int64_t value, std::string_view words) const {
  return {(verbose_ ? "* " + std::string(words) + " is " : "* ") + std::to_string(value), {}};
}

FlirPtuUnit::Answered FlirPtuUnit::position(const Request& request) {
  if (request.value) return go(*request.value);
  const double told = motion_.at(clock_.now() - config_.position_age) * faults_.wrong_factor();
  return number(std::llround(told), "Current Pan position");
}

FlirPtuUnit::Answered FlirPtuUnit::offset(const Request& request) {
  if (request.value) return go(std::llround(motion_.at(clock_.now())) + *request.value);
  return number(target_, "Target Pan position");
}

FlirPtuUnit::Answered FlirPtuUnit::go(std::int64_t steps) {
  const std::int64_t most = steps_max();
  if (steps > most) return {"! Maximum allowable Pan position is " + std::to_string(most), {}};
  if (steps < -most) return {"! Minimum allowable Pan position is " + std::to_string(-most), {}};
  plan(steps);
  return {kDone, {}};
}

void FlirPtuUnit::plan(std::int64_t target) {
  const hal::Time now = clock_.now();
  target_ = target;
  const double slower = faults_.slowness();
  motion_ =
      PanMotion(now, motion_.at(now), motion_.speed(now), static_cast<double>(target),
                static_cast<double>(speed_) / slower, static_cast<double>(acceleration_) / slower);
  ++changes_;
}

FlirPtuUnit::Answered FlirPtuUnit::speed(const Request& request) {
  if (!request.value) return number(speed_, "Desired Pan speed");
  const auto most = std::llround(config_.speed_max_radps / step_rad());
  if (*request.value < 1 || *request.value > most)
    return {"! Maximum allowable Pan speed is " + std::to_string(most), {}};
  const bool moves = clock_.now() < motion_.end();
  speed_ = *request.value;
  if (moves) plan(target_);
  return {kDone, {}};
}

FlirPtuUnit::Answered FlirPtuUnit::current_speed(const Request& request) {
  if (request.value) return {"! Illegal Command Entered", {}};
  return number(std::llround(motion_.speed(clock_.now())), "Current Pan speed");
}

FlirPtuUnit::Answered FlirPtuUnit::acceleration(const Request& request) {
  if (!request.value) return number(acceleration_, "Pan acceleration");
  if (*request.value < 1 || clock_.now() < motion_.end())
    return {"! Pan acceleration cannot be set", {}};
  acceleration_ = *request.value;
  return {kDone, {}};
}

FlirPtuUnit::Answered FlirPtuUnit::limit(const Request& request) {
  if (request.value) return {"! Illegal Command Entered", {}};
  if (request.name == "PN") return number(-steps_max(), "Minimum Pan position");
  if (request.name == "PX") return number(steps_max(), "Maximum Pan position");
  if (request.name == "PL") return number(1, "Minimum Pan speed");
  return number(std::llround(config_.speed_max_radps / step_rad()), "Maximum Pan speed");
}

FlirPtuUnit::Answered FlirPtuUnit::resolution(const Request&) {
  std::string text = std::to_string(config_.arcsec_per_step);
  return {"* " + text + (verbose_ ? " seconds arc per position" : ""), {}};
}

// The tilt axis stands still.
FlirPtuUnit::Answered FlirPtuUnit::tilt(const Request& request) {
  if (request.name == "TR") return resolution(request);
  return number(0, "Current Tilt position");
}

FlirPtuUnit::Answered FlirPtuUnit::talk(const Request& request) {
  if (request.name == "ED" || request.name == "EE") echo_ = request.name == "EE";
  if (request.name == "FT" || request.name == "FV") verbose_ = request.name == "FV";
  return {kDone, {}};
}

FlirPtuUnit::Answered FlirPtuUnit::halt(const Request&) {
  const hal::Time now = clock_.now();
  motion_ = PanMotion::stopping(now, motion_.at(now), motion_.speed(now),
                                static_cast<double>(acceleration_));
  target_ = std::llround(motion_.target());
  motion_ = PanMotion(now, motion_.at(now), motion_.speed(now), static_cast<double>(target_),
                      static_cast<double>(std::max<std::int64_t>(speed_, 1)),
                      static_cast<double>(acceleration_));
  ++changes_;
  return {kDone, {}};
}

FlirPtuUnit::Answered FlirPtuUnit::await(const Request&) {
  return {kDone, std::max(hal::Duration(0), motion_.end() - clock_.now())};
}

// To both ends and back to the middle, where it finds itself again.
FlirPtuUnit::Answered FlirPtuUnit::reset(const Request& request) {
  motion_ = PanMotion::standing(0);
  head_offset_ = target_ = 0;
  ++changes_;
  return {request.name == "RP" ? "!P!P*" : "!T!T!P!P*", config_.reset_time};
}

FlirPtuUnit::Answered FlirPtuUnit::tell_health(const Request&) {
  return {"* 13.2,99," + std::to_string(temperature_f_) + ",104", {}};
}

FlirPtuUnit::Answered FlirPtuUnit::tell_version(const Request&) {
  return {"* " + config_.version, {}};
}

}  // namespace sim
