#include "sim/agilex_unit.hpp"

#include <boost/asio/experimental/awaitable_operators.hpp>
#include <cmath>
#include <numbers>

namespace sim {
namespace {

using namespace drivers::agilex;
using namespace std::chrono_literals;

constexpr hal::Duration kCycle = 20ms;
constexpr hal::Duration kCommandMax = 500ms;
constexpr hal::Duration kStallTold = 300ms;
constexpr std::int64_t kStateEvery = 5, kBatteryEvery = 25;  // Cycles.
constexpr double kNominalV = 26.4, kIdleA = 0.4, kRollingAPerMps = 4, kStalledA = 28;
constexpr std::uint8_t kOverCurrent = 0x04;

std::int32_t wrapped(double count) {  // As a 32-bit counter shows it.
  return static_cast<std::int32_t>(static_cast<std::uint32_t>(std::llround(count)));
}

bool is_left(int motor) {
  return motor == 2 || motor == 3;
}

}  // namespace

AgilexUnit::AgilexUnit(const Config& config, World& world, Battery* battery, hal::Clock& clock,
                       hal::CanBus& bus, UnitFaults& faults)
    : config_(config),
      world_(world),
      battery_(battery),
      clock_(clock),
      faults_(faults),
      bus_(bus, clock, faults),
      stops_by_itself_(config.stops_by_itself),
      left_mm_(config.odometry_mm),
      right_mm_(config.odometry_mm) {}

hal::Task<void> AgilexUnit::run() {
  using boost::asio::experimental::awaitable_operators::operator&&;
  co_await (listen() && report());
}

hal::Task<void> AgilexUnit::listen() {
  for (;;) {
    const auto received = co_await bus_.receive();
    if (!received || received->frame.size == 0) continue;
    if (const hal::Duration thinks = faults_.slowed(0ms); thinks > 0ms)
      co_await clock_.sleep_for(thinks);
    const Message message = decode(received->frame, config_.dialect);
    if (const auto* query = std::get_if<VersionQuery>(&message); query != nullptr)
      co_await send(config_.version);
    else
      hear(received->frame);
  }
}

void AgilexUnit::hear(const hal::CanFrame& frame) {
  const Message message = decode(frame, config_.dialect);
  if (const auto* command = std::get_if<MotionCommand>(&message)) obey(*command);
  if (const auto* mode = std::get_if<ControlModeCommand>(&message))
    if (mode_ != ControlMode::rc && !estop_) mode_ = mode->mode;
  if (std::holds_alternative<ResetCommand>(message)) {
    fault_bits_ = 0;
    motor_bits_ = 0;
    exception_ = false;
  }
}

void AgilexUnit::obey(const MotionCommand& command) {
  if (mode_ != ControlMode::can || vehicle() != VehicleState::normal) return;
  const double forward =
      std::clamp(command.forward_mmps, static_cast<std::int16_t>(-config_.limits.forward_mmps),
                 config_.limits.forward_mmps);
  const double turn =
      std::clamp(command.turn_mradps, static_cast<std::int16_t>(-config_.limits.turn_mradps),
                 config_.limits.turn_mradps);
  commanded_at_ = clock_.now();
  world_.advance(commanded_at_);
  obeyed_ = {forward / 1000, turn / 1000};
  const bool free = world_.command(obeyed_).has_value();
  if (free)
    stalled_at_ = hal::Time::max();
  else
    stalled_at_ = std::min(stalled_at_, commanded_at_);
}

void AgilexUnit::stop() {
  world_.advance(clock_.now());
  (void)world_.command({});  // Nothing is in the way of standing.
  commanded_at_ = {};
  stalled_at_ = hal::Time::max();
}

void AgilexUnit::press_estop(bool pressed) {
  estop_ = pressed;
  if (pressed) stop();
}

void AgilexUnit::switch_transmitter(bool commands) {
  mode_ = commands ? ControlMode::rc : ControlMode::standby;
  if (commands) stop();
}

void AgilexUnit::restart() {
  stop();
  mode_ = ControlMode::standby;
  exception_ = false;
  fault_bits_ = 0;
  motor_bits_ = 0;
  count_ = 0;
  left_mm_ = right_mm_ = 0;
  world_.take_travel();
}

hal::Task<void> AgilexUnit::report() {
  hal::Time next = clock_.now();
  for (std::int64_t cycle = 0;; ++cycle) {
    co_await clock_.sleep_until(next);
    next += faults_.slowed(kCycle);
    const hal::Time now = clock_.now();
    roll(now);
    if (config_.dialect == Dialect::v1) {
      co_await report_v1();
      continue;
    }
    co_await report_fast();
    co_await report_slow(cycle);
  }
}

void AgilexUnit::roll(hal::Time now) {
  const bool off = faults_.is(UnitFault::off);
  if (was_off_ != off) restart();
  was_off_ = off;
  world_.advance(now);
  if (battery_ != nullptr) battery_->update(now);
  if (commanded_at_ != hal::Time{} && now - commanded_at_ > kCommandMax) {
    if (stops_by_itself_)
      stop();
    else
      (void)world_.command(obeyed_);
  }
  const hal::WheelTravel travel = world_.take_travel();
  left_mm_ += travel.left_m * 1000 * faults_.wrong_factor();
  right_mm_ += travel.right_m * 1000 * faults_.wrong_factor();
}

hal::Task<void> AgilexUnit::report_fast() {
  const hal::Twist rolling = world_.rolling();
  MotionState motion;
  motion.forward_mmps = static_cast<std::int16_t>(std::lround(rolling.forward_mps * 1000));
  motion.turn_mradps = static_cast<std::int16_t>(std::lround(rolling.turn_radps * 1000));
  co_await send(motion);
  co_await send(LightState{false, {}, {}, count_});
  co_await send(RcState{{Switch::up, Switch::up, Switch::up, Switch::up}, 0, 0, 0, 0, 0, count_});
  const double rim_mps = rolling.turn_radps * world_.config().track_m / 2;
  const double turn_m = 2 * std::numbers::pi * config_.wheel_radius_m;
  for (std::uint8_t motor = 1; motor <= config_.motors; ++motor) {
    const double side_mps = rolling.forward_mps + (is_left(motor) ? -rim_mps : rim_mps);
    const double rolled_m = (is_left(motor) ? left_mm_ : right_mm_) / 1000;
    co_await send(MotorFast{motor, static_cast<std::int16_t>(std::lround(side_mps / turn_m * 60)),
                            motor_current_a(side_mps), wrapped(rolled_m / turn_m * 4096)});
  }
  co_await send(Odometry{wrapped(left_mm_), wrapped(right_mm_)});
}

hal::Task<void> AgilexUnit::report_slow(std::int64_t cycle) {
  if (cycle % std::max<std::int64_t>(1, config_.motor_slow_period / kCycle) == 0) {
    const auto bits = static_cast<std::uint8_t>(motor_bits_ | (stalled() ? kOverCurrent : 0));
    for (std::uint8_t motor = 1; motor <= config_.motors; ++motor)
      co_await send(MotorSlow{motor, battery_v(), 35, 40, bits});
  }
  if (cycle % kStateEvery == 0)
    co_await send(SystemState{vehicle(), mode_, battery_v(), fault_bits_, count_++});
  if (cycle % kBatteryEvery == 0 && battery_ != nullptr) {
    const auto charge = static_cast<std::uint8_t>(std::lround(battery_->charge_percent()));
    co_await send(
        BatteryBasic{charge, 100, battery_v(), -battery_->current_a(), battery_->temperature_c()});
  }
}

hal::Task<void> AgilexUnit::report_v1() {
  const hal::Twist rolling = world_.rolling();
  co_await send(V1Motion{static_cast<std::int16_t>(std::lround(rolling.forward_mps * 1000)),
                         static_cast<std::int16_t>(std::lround(rolling.turn_radps * 1000)),
                         count_});
  co_await send(V1State{vehicle(), 0, battery_v(), 0, count_});
  for (std::uint8_t motor = 1; motor <= config_.motors; ++motor)
    co_await send(V1Motor{motor, kIdleA, 0, 40, count_});
  ++count_;
}

// A frame that finds no way to the bus in time is not sent: the next one says more.
hal::Task<hal::Result<void>> AgilexUnit::send(const Message& message) {
  return bus_.send(encode(message), clock_.now() + kCycle);
}

VehicleState AgilexUnit::vehicle() const {
  if (estop_) return VehicleState::estop_pressed;
  return exception_ ? VehicleState::exception : VehicleState::normal;
}

bool AgilexUnit::stalled() const {
  return stalled_at_ != hal::Time::max() && clock_.now() - stalled_at_ >= kStallTold;
}

double AgilexUnit::battery_v() const {
  return battery_ != nullptr ? battery_->voltage_v() : kNominalV;
}

double AgilexUnit::motor_current_a(double side_mps) const {
  const bool stalls = stalled_at_ != hal::Time::max();
  return stalls ? kStalledA : kIdleA + kRollingAPerMps * std::abs(side_mps);
}

}  // namespace sim
