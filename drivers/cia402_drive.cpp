// What is done every 20 ms; the dialogue before that is in cia402_bring_up.cpp.
#include "drivers/cia402_drive.hpp"

#include <boost/asio/experimental/awaitable_operators.hpp>
#include <cmath>

#include "drivers/cia402_times.hpp"

namespace drivers {

using namespace cia402_times;
using boost::system::errc::make_error_code;
namespace errc = boost::system::errc;

Cia402Drive::Cia402Drive(const Config& config, hal::Clock& clock, hal::CanBus& bus)
    : config_(config),
      clock_(clock),
      bus_(bus),
      objects_(cia402::velocity_objects(config.mode)),
      left_(config.left, "left"),
      right_(config.right, "right"),
      odometer_({std::abs(config.left.counts_per_m), config.speed_max_mps}) {
  left_.watch.stall = right_.watch.stall = StallWatch(config.stall);
}

hal::Task<void> Cia402Drive::run() {
  using boost::asio::experimental::awaitable_operators::operator&&;
  started_ = true;
  started_at_ = clock_.now();
  co_await (listen() && cycle() && serve(left_) && serve(right_));
}

// --- What the drives say.

hal::Task<void> Cia402Drive::listen() {
  for (;;) {
    const auto received = co_await bus_.receive();
    if (received) {
      receive_error_ = {};
      hear(*received);
    } else {
      receive_error_ = received.error();
    }
  }
}

Cia402Drive::Node* Cia402Drive::node_of(std::uint8_t id) {
  heard_nodes_.set(id & 0x7F);
  if (id == left_.side.node) return &left_;
  return id == right_.side.node ? &right_ : nullptr;
}

void Cia402Drive::hear(const hal::ReceivedFrame& received) {
  const canopen::Message message = canopen::decode(received.frame);
  bool known = false;
  std::visit(
      [&](const auto& each) {
        if constexpr (requires { on(each, received.stamp); }) {
          if constexpr (requires { each.from_node; })
            known = each.from_node;
          else
            known = true;
          if (known) on(each, received.stamp);
        }
      },
      message);
  if (known) return;
  const auto* unread = std::get_if<Unread>(&message);
  Node* const node = unread != nullptr && !received.frame.extended && received.frame.id >= 0x80
                         ? node_of(received.frame.id & 0x7F)
                         : nullptr;
  if (node != nullptr) {
    node->heard.unread_at = received.stamp;
    node->heard.unread_why = unread->why;
    return;
  }
  // Only a second master, or no CANopen device at all, says anything else.
  ++strangers_;
  stranger_at_ = received.stamp;
  stranger_id_ = received.frame.id;
}

void Cia402Drive::on(const canopen::Heartbeat& heartbeat, hal::Time at) {
  Node* const node = node_of(heartbeat.node);
  if (node == nullptr) return;
  node->heard.heartbeat_at = at;
  node->heard.nmt = heartbeat.state;
  // It restarted, or fell out of operation: all that it was told is gone.
  const bool restarted = heartbeat.state == canopen::NodeState::boot_up;
  if (restarted) {
    node->heard.position_before_restart = node->heard.position;
    node->resets = 0;
    ++node->boots;
  }
  if (restarted || heartbeat.state != canopen::NodeState::operational) {
    if (node->configured) node->heard.statusword.reset();
    node->configured = false;
    node->replied.notify();
  }
}

void Cia402Drive::on(const canopen::Emergency& emergency, hal::Time) {
  Node* const node = node_of(emergency.node);
  if (node == nullptr) return;
  node->heard.emergency = emergency.code;
  node->heard.error_register = emergency.error_register;
}

void Cia402Drive::on(const canopen::Sdo& sdo, hal::Time) {
  Node* const node = node_of(sdo.node);
  if (node == nullptr) return;
  node->replies.push_back(canopen::encode(sdo));
  if (node->replies.size() > kRepliesMax) node->replies.pop_front();
  node->replied.notify();
}

void Cia402Drive::on(const canopen::Pdo& pdo, hal::Time at) {
  Node* const node = node_of(pdo.node);
  if (node == nullptr || !node->configured || pdo.asked) return;
  if (pdo.number == node->layout.status.number) on_status(*node, pdo, at);
  if (pdo.number == node->layout.position.number) on_position(*node, pdo, at);
}

void Cia402Drive::on_status(Node& node, const canopen::Pdo& pdo, hal::Time at) {
  const auto& mapping = node.layout.status.mapping;
  const auto statusword = cia402::value_in(mapping, pdo, cia402::kStatusword);
  const auto velocity = cia402::value_in(mapping, pdo, objects_.actual.at);
  if (!statusword || !velocity) {
    node.heard.unread_at = at;
    node.heard.unread_why = "PDO too short";
    return;
  }
  node.heard.statusword = static_cast<std::uint16_t>(*statusword);
  node.heard.velocity = *velocity;
  node.heard.status_at = at;
  if (++node.heard.since_sync > 1) node.heard.doubled_at = at;
}

void Cia402Drive::on_position(Node& node, const canopen::Pdo& pdo, hal::Time at) {
  const auto& mapping = node.layout.position.mapping;
  const auto position = cia402::value_in(mapping, pdo, cia402::kPosition);
  if (!position) return;
  Reports& heard = node.heard;
  const auto raw = static_cast<std::uint32_t>(*position);
  const std::uint32_t forward = node.side.counts_per_m < 0 ? 0U - raw : raw;
  if (heard.position_before_restart) {  // How far it rolled without power nobody knows.
    heard.position_offset = static_cast<std::uint32_t>(*heard.position_before_restart) - forward;
    heard.position_before_restart.reset();
  }
  heard.position = static_cast<std::int32_t>(forward + heard.position_offset);
  heard.torque_permille = cia402::value_in(mapping, pdo, cia402::kTorqueActual).value_or(0);
  heard.position_at = at;
  (&node == &left_ ? left_fresh_ : right_fresh_) = true;
  if (left_fresh_ && right_fresh_) roll(at);
}

void Cia402Drive::roll(hal::Time at) {
  left_fresh_ = right_fresh_ = false;
  if (!odometer_.update(left_.heard.position, right_.heard.position, at)) return;
  watch_sides();
  odometry_heard_.notify();
}

void Cia402Drive::watch_sides() {
  const auto update = [&](Node& node, double rolled_m) {
    const double speed_mps = static_cast<double>(node.heard.velocity) / node.side.units_per_mps;
    node.watch.update(target_mps(node), speed_mps, rolled_m, odometer_.step());
  };
  update(left_, odometer_.left_m());
  update(right_, odometer_.right_m());
  const hal::Duration late = std::max(left_.answer_took, right_.answer_took);
  const hal::Duration stands =
      std::max(left_.watch.stall.standing(), right_.watch.stall.standing());
  if (stands < config_.stall.after + late) return;  // Late news are no standstill.
  way_.block(told_);
  wanted_ = {};
  left_.watch.stall.reset();
  right_.watch.stall.reset();
}

// --- What they are told.

hal::Task<void> Cia402Drive::cycle() {
  for (hal::Time next = clock_.now();; next = std::max(next + kCycle, clock_.now())) {
    co_await clock_.sleep_until(next);
    const hal::Time now = clock_.now();
    if (now >= next_heartbeat_ && !heart_stopped_) {
      next_heartbeat_ = now + kMasterHeartbeat;
      co_await send(canopen::Heartbeat{config_.master, canopen::NodeState::operational});
    }
    if (!left_.configured && !right_.configured) {
      moving_allowed_ = false;
      continue;
    }
    count_reports(now);
    decide(now);
    for (Node* node : {&left_, &right_})
      if (node->configured) co_await send(target(*node, now));
    co_await send(canopen::Sync{});
  }
}

// Each SYNC is answered once.
void Cia402Drive::count_reports(hal::Time now) {
  for (Node* node : {&left_, &right_}) {
    Reports& heard = node->heard;
    if (node->configured && heard.statusword && heard.since_sync == 0 && beats(*node, now)) {
      heard.missed_at = now;
      ++heard.missed;
    } else {
      heard.missed = 0;
    }
    heard.since_sync = 0;
  }
}

// Motion is allowed while both are enabled; when one drops out, the other stops at once.
void Cia402Drive::decide(hal::Time now) {
  for (Node* node : {&left_, &right_})
    if (node->configured && !beats(*node, now)) {
      node->configured = false;
      node->heard.statusword.reset();
      node->replied.notify();
    }
  const bool both = enabled(left_, now) && enabled(right_, now);
  // In the proof each must stop by itself.
  if (moving_allowed_ && !both && !heart_stopped_) stopping_ = true;
  if (stopping_) {
    const auto rests = [&](const Node& node) {
      const auto state = state_of(node);
      return !reports(node, now) || (state != cia402::State::operation_enabled &&
                                     state != cia402::State::quick_stop_active);
    };
    stopping_ = !(rests(left_) && rests(right_));
  }
  moving_allowed_ = both && !stopping_ && !released_;
  ran_ = ran_ || moving_allowed_;
  told_ = {};
  const bool wanted = now - wanted_at_ <= config_.command_max && !way_.blocked();
  if (moving_allowed_ && wanted) told_ = wanted_;
}

std::uint16_t Cia402Drive::controlword(Node& node, hal::Time now) {
  const auto state = state_of(node);
  if (!state) return cia402::kDisableVoltage;
  if (*state != cia402::State::operation_enabled) node.enabled_since = {};
  if (*state == cia402::State::fault) return reset_word(node, now);
  node.fault_since = {};
  node.resetting = false;
  if (*state == cia402::State::operation_enabled) {
    node.enabling_since = {};
    if (node.enabled_since == hal::Time{}) node.enabled_since = now;
    if (now - node.enabled_since > kWellAgain) node.resets = 0;
  } else if (node.enabling_since == hal::Time{}) {
    node.enabling_since = now;
  }
  const auto goal =
      released_ ? cia402::Goal::off : (stopping_ ? cia402::Goal::stopped : cia402::Goal::enabled);
  return cia402::next_controlword(*state, goal).value_or(cia402::kDisableVoltage);
}

// 0x0000, then 0x0080, once, a while after the fault; not for ever.
std::uint16_t Cia402Drive::reset_word(Node& node, hal::Time now) {
  if (node.fault_since == hal::Time{}) node.fault_since = now;
  const hal::Duration since = now - node.fault_since;
  if (since < kResetPause) return cia402::kDisableVoltage;
  if (!node.resetting && node.resets >= kResetsMax) return cia402::kDisableVoltage;
  if (since >= kResetPause + kResetHold) {  // In vain.
    node.resetting = false;
    node.fault_since = now;
    return cia402::kDisableVoltage;
  }
  if (!std::exchange(node.resetting, true)) ++node.resets;
  return cia402::kFaultReset;
}

double Cia402Drive::target_mps(const Node& node) const {
  const double rim_mps = told_.turn_radps * config_.track_m / 2;
  const double left_mps = told_.forward_mps - rim_mps, right_mps = told_.forward_mps + rim_mps;
  const double fastest_mps = std::max(std::abs(left_mps), std::abs(right_mps));
  const double scale = std::min(1.0, config_.speed_max_mps / std::max(fastest_mps, 1e-9));
  return (&node == &left_ ? left_mps : right_mps) * scale;
}

canopen::Pdo Cia402Drive::target(Node& node, hal::Time now) {
  const auto most = static_cast<std::int32_t>(
      std::min(2e9, std::abs(config_.speed_max_mps * node.side.units_per_mps)));
  const cia402::Scale scale{node.side.units_per_mps};
  const std::int64_t word = controlword(node, now);
  const std::int64_t speed = scale.units(target_mps(node), most);
  const auto& mapping = node.layout.target.mapping;
  std::array<std::int64_t, 8> values{};  // What is neither of these is padding.
  const std::size_t count = std::min(mapping.size(), values.size());
  for (std::size_t i = 0; i < count; ++i)
    values[i] = mapping[i].at == cia402::kControlword ? word
                : mapping[i].at == objects_.target.at ? speed
                : mapping[i].at == cia402::kModes     ? static_cast<int>(config_.mode)
                                                      : 0;
  canopen::Pdo pdo;
  pdo.node = node.side.node;
  pdo.number = node.layout.target.number;
  canopen::pack(mapping, std::span(values).first(count), pdo);
  return pdo;
}

hal::Task<void> Cia402Drive::send(const canopen::Message& message) {
  const auto sent = co_await bus_.send(canopen::encode(message), clock_.now() + kCycle);
  send_error_ = sent ? boost::system::error_code{} : sent.error();
}

hal::Task<hal::Result<void>> Cia402Drive::command(hal::Twist twist) {
  if (!std::isfinite(twist.forward_mps) || !std::isfinite(twist.turn_radps))
    co_return make_error_code(errc::invalid_argument);
  wanted_ = {};
  const bool stands = twist.forward_mps == 0 && twist.turn_radps == 0;
  if (stands && (told_.forward_mps != 0 || told_.turn_radps != 0)) co_await stand_now();
  if (way_.refuses(twist)) co_return make_error_code(errc::io_error);
  if (released_) co_return make_error_code(errc::not_connected);
  if (!moving_allowed_) {
    const hal::Time now = clock_.now();
    const bool held = reports(left_, now) && reports(right_, now);
    co_return make_error_code(held ? errc::operation_not_permitted : errc::not_connected);
  }
  wanted_ = twist;
  wanted_at_ = clock_.now();
  co_return hal::Result<void>{};
}

// Not only in the next cycle.
hal::Task<void> Cia402Drive::stand_now() {
  told_ = {};
  for (Node* node : {&left_, &right_})
    if (node->configured) co_await send(target(*node, clock_.now()));
}

hal::DriveStatus Cia402Drive::status() const {
  const hal::Time now = clock_.now();
  hal::DriveStatus status;
  status.reported_at = std::min(left_.heard.status_at, right_.heard.status_at);
  status.silent = !reports(left_, now) || !reports(right_, now);
  status.held = !moving_allowed_;
  return status;
}

hal::Task<hal::Result<hal::Duration>> Cia402Drive::prove_timeout() {
  struct Guard {  // Also when cancelled.
    bool& stopped;
    ~Guard() { stopped = false; }
  };
  if (!moving_allowed_) co_return make_error_code(errc::not_connected);
  const Guard guard{heart_stopped_};
  const auto took = co_await stop_our_heart();
  heart_stopped_ = false;
  if (!took) co_return took;
  const hal::Time late = clock_.now() + kProofUpMax;
  while (!moving_allowed_) {
    if (clock_.now() >= late) co_return make_error_code(errc::not_connected);
    co_await clock_.sleep_for(kCycle);
  }
  co_return took;
}

hal::Task<hal::Result<hal::Duration>> Cia402Drive::stop_our_heart() {
  wanted_ = {};
  heart_stopped_ = true;
  const hal::Time silent = clock_.now();
  const auto left_by_itself = [this] {
    const hal::Time now = clock_.now();
    return !enabled(left_, now) && !enabled(right_, now);
  };
  while (!left_by_itself()) {
    if (clock_.now() - silent > kProofMax) co_return make_error_code(errc::timed_out);
    co_await clock_.sleep_for(kCycle);
  }
  co_return clock_.now() - silent;
}

hal::Task<hal::Result<hal::WheelTravel>> Cia402Drive::next_travel() {
  while (!odometer_.fresh()) co_await odometry_heard_.wait();
  co_return odometer_.take();
}

hal::Task<void> Cia402Drive::release() {
  wanted_ = {};
  co_await clock_.sleep_for(kStanding);
  released_ = true;
  co_await clock_.sleep_for(kStanding);
}

// --- How they are.

std::optional<cia402::State> Cia402Drive::state_of(const Node& node) const {
  return node.heard.statusword ? cia402::state_of(*node.heard.statusword) : std::nullopt;
}

bool Cia402Drive::beats(const Node& node, hal::Time now) const {
  return node.heard.heartbeat_at != hal::Time{} && now - node.heard.heartbeat_at <= kHeartbeatMax;
}

bool Cia402Drive::reports(const Node& node, hal::Time now) const {
  return node.configured && node.heard.statusword && beats(node, now) &&
         now - node.heard.status_at <= kReportsMax;
}

bool Cia402Drive::enabled(const Node& node, hal::Time now) const {
  return reports(node, now) && state_of(node) == cia402::State::operation_enabled;
}

DeviceState Cia402Drive::state() const {
  if (!started_) return DeviceState::off;
  if (moving_allowed_) return DeviceState::running;
  const hal::Time now = clock_.now();
  return ran_ && !(reports(left_, now) && reports(right_, now)) ? DeviceState::lost
                                                                : DeviceState::starting;
}

}  // namespace drivers
