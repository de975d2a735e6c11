#include "sim/vn100_unit.hpp"

#include <algorithm>
#include <boost/asio/experimental/awaitable_operators.hpp>
#include <cmath>
#include <numbers>

#include "drivers/text.hpp"

namespace sim {
namespace {

using boost::asio::experimental::awaitable_operators::operator&&;
using drivers::whole_number;

constexpr double kGravity_mps2 = 9.81, kAccelSigma_mps2 = 0.02;
constexpr std::uint64_t kNoiseSource = 201;
constexpr int kSampleKind = 1, kAnswerKind = 2;
constexpr hal::Duration kLinkPause = std::chrono::milliseconds(100);

std::string joined(const std::vector<std::string>& fields, std::size_t first) {
  std::string text;
  for (std::size_t i = first; i < fields.size(); ++i) text += (i > first ? "," : "") + fields[i];
  return text;
}

}  // namespace

Vn100Unit::Vn100Unit(const Vn100UnitConfig& config, World& world, hal::Clock& clock,
                     hal::ByteStream& end, UnitFaults& faults)
    : config_(config),
      world_(world),
      clock_(clock),
      faults_(faults),
      uart_(end, config.baud),
      out_(uart_, clock, faults),
      noise_(world.config().seed, kNoiseSource) {
  restart();
  started_at_ = hal::Time() - config.running_since_before;
}

// As it leaves the factory.
void Vn100Unit::restart() {
  registers_ = {{1, config_.model},
                {3, config_.serial},
                {4, config_.firmware},
                {5, std::to_string(config_.baud)},
                {6, "14"},  // VNYMR
                {7, "40"},
                {75, "0,0,00"}};
  read_registers();
  uart_.set_baud(config_.baud);
  paused_ = false;
  started_at_ = clock_.now();
}

hal::Task<void> Vn100Unit::run() {
  co_await (answer_requests() && stream());
}

hal::Task<void> Vn100Unit::answer_requests() {
  drivers::Resync resync(drivers::kVn100FrameMax);
  std::array<std::uint8_t, 256> piece;
  for (;;) {
    const auto size = co_await out_.read_some(piece);
    if (!size) {
      co_await clock_.sleep_for(kLinkPause);
      continue;
    }
    resync.feed(drivers::ByteView(piece).first(*size));
    while (const auto frame = resync.next(drivers::look_vn100)) {
      if ((*frame)[0] != '$') continue;
      if (const auto request = drivers::parse_vn100_line(*frame)) co_await answer(*request);
    }
  }
}

hal::Task<hal::Result<void>> Vn100Unit::answer(const drivers::Vn100Line& request) {
  const std::string reply = reply_to(request);
  const auto reg = request.fields.empty() ? std::nullopt : whole_number<int>(request.fields[0]);
  co_return co_await out_.write(drivers::vn100_request(reply), kAnswerKind + reg.value_or(0));
}

std::string Vn100Unit::reply_to(const drivers::Vn100Line& request) {
  if (request.fields.empty()) return "VNERR,05";
  const auto number = whole_number<int>(request.fields[0]);
  if (!number) return "VNERR,07";
  if (request.type == "VNASY") {
    paused_ = *number == 0;
    return "VNASY," + request.fields[0];
  }
  if (!registers_.contains(*number)) return "VNERR,08";
  if (request.type == "VNRRG") return "VNRRG," + request.fields[0] + "," + registers_[*number];
  return request.type == "VNWRG" ? write_register(request, *number) : "VNERR,04";
}

std::string Vn100Unit::write_register(const drivers::Vn100Line& request, int reg) {
  const std::string values = joined(request.fields, 1);
  if (reg < 5) return "VNERR,09";
  if (values.empty()) return "VNERR,05";
  if (refuse_code_ != 0) {
    const int code = std::exchange(refuse_code_, 0);
    return std::string("VNERR,") + (code < 10 ? "0" : "") + std::to_string(code);
  }
  registers_[reg] = values;
  read_registers();
  return "VNWRG," + request.fields[0] + "," + values;
}

int Vn100Unit::value_of(int reg, std::size_t field, int base) const {
  const auto found = registers_.find(reg);
  if (found == registers_.end()) return 0;
  std::string_view rest = found->second;
  for (std::size_t i = 0; i < field; ++i) drivers::take_field(rest, ',');
  return whole_number<int>(drivers::take_field(rest, ','), base).value_or(0);
}

void Vn100Unit::read_registers() {
  output_ = {value_of(75, 0) != 0, value_of(6, 0) == 14, value_of(75, 1), value_of(7, 0),
             static_cast<std::uint16_t>(value_of(75, 3, 16))};
}

hal::Duration Vn100Unit::period() const {
  using std::chrono::seconds;
  if (output_.binary && output_.divisor > 0)
    return hal::Duration(seconds(1)) * output_.divisor / 800;
  return hal::Duration(seconds(1)) / std::max(1, output_.lines_hz);
}

hal::Task<void> Vn100Unit::stream() {
  for (;;) {
    const hal::Duration every = faults_.slowed(period());
    co_await clock_.sleep_until(hal::Time((clock_.now().time_since_epoch() / every + 1) * every));
    const bool speaks = output_.binary || output_.lines;
    if (paused_ || !speaks || faults_.silent()) continue;
    const drivers::Bytes message = measure();
    const auto sent = co_await out_.write(message, kSampleKind);
    if (!sent) co_await clock_.sleep_for(kLinkPause);
  }
}

drivers::Bytes Vn100Unit::measure() {
  world_.advance(clock_.now());
  const hal::ImuSample truth = world_.sample_imu();
  const auto factor = static_cast<float>(faults_.wrong_factor());
  const double heading_deg = world_.robot().pose.heading_rad * 180 / std::numbers::pi;
  drivers::Vn100Sample sample;
  const hal::Duration age = clock_.now() - started_at_;
  sample.startup_ns = static_cast<std::uint64_t>(
      std::llround(static_cast<double>(age.count()) * (1 + config_.clock_skew)));
  sample.yaw_pitch_roll_deg = {static_cast<float>(std::remainder(90 - heading_deg, 360)), 0, 0};
  const auto noisy = [&](double value, double sigma) {
    return static_cast<float>(value + noise_.normal(sigma)) * factor;
  };
  const double gyro_sigma_radps = world_.config().gyro_sigma_radps;
  sample.rate_radps = {noisy(0, gyro_sigma_radps), noisy(0, gyro_sigma_radps),
                       static_cast<float>(-truth.yaw_rate_radps) * factor};
  sample.accel_mps2 = {noisy(0, kAccelSigma_mps2), noisy(0, kAccelSigma_mps2),
                       noisy(-kGravity_mps2, kAccelSigma_mps2)};
  sample.magnetic_gauss = {0.2F, 0, 0.4F};
  sample.vpe_status = config_.vpe_status;
  return output_.binary ? drivers::encode_vn100_binary(output_.common, sample)
                        : drivers::encode_vn100_line(sample);
}

}  // namespace sim
