#include "sim/cia402_unit.hpp"

#include <boost/asio/experimental/awaitable_operators.hpp>
#include <cmath>

namespace sim {
namespace {

using namespace drivers::canopen;
using namespace std::chrono_literals;
using drivers::Bytes;
using drivers::ByteView;
using drivers::cia402::State;
namespace cia402 = drivers::cia402;

constexpr hal::Duration kLife = 20ms;  // Between two looks at what has to be done.
constexpr hal::Duration kBoot = 300ms;
constexpr hal::Duration kAnswer = 1ms;       // Until an SDO is answered.
constexpr hal::Duration kQuickStop = 200ms;  // Then its power stage is off.
constexpr hal::Duration kStalledMax = 2s;    // Then it fails.
constexpr hal::Duration kSendMax = 20ms;
constexpr std::uint16_t kBlocked = 0x7121, kMasterLost = 0x8130;
constexpr std::uint32_t kNoObject = 0x06020000, kNoSub = 0x06090011, kReadOnly = 0x06010002,
                        kLength = 0x06070010, kState = 0x08000022, kRange = 0x06090030,
                        kNotMappable = 0x06040041;
constexpr std::int64_t kIdleTorque = 20, kRollingTorque = 150, kStalledTorque = 1200;

constexpr std::uint32_t key(std::uint16_t index, std::uint8_t sub) {
  return std::uint32_t{index} << 8 | sub;
}
constexpr std::uint32_t key(Address at) {
  return key(at.index, at.sub);
}

Bytes bytes(std::uint32_t value, std::uint8_t size) {
  Bytes all;
  for (unsigned i = 0; i < size; ++i) all.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
  return all;
}

bool in(std::uint32_t at, std::uint16_t first, std::uint16_t last) {
  return at >> 8 >= first && at >> 8 <= last;
}

std::int32_t wrapped(double count) {
  return static_cast<std::int32_t>(static_cast<std::uint32_t>(std::llround(count)));
}

}  // namespace

Cia402Node::Cia402Node(const Cia402NodeConfig& config, Wheel wheel, hal::Clock& clock,
                       hal::CanBus& bus, UnitFaults& faults)
    : config_(config),
      wheel_(std::move(wheel)),
      clock_(clock),
      faults_(faults),
      bus_(bus, clock, faults),
      server_(
          config.node, [this](Address at) { return read(at); },
          [this](Address at, ByteView data) { return write(at, data); }) {}

hal::Task<void> Cia402Node::run() {
  using boost::asio::experimental::awaitable_operators::operator&&;
  co_await (listen() && live());
}

// --- Power, heart, watchdogs.

hal::Task<void> Cia402Node::live() {
  co_await power_up();
  for (;;) {
    co_await clock_.sleep_for(kLife);
    const hal::Time now = clock_.now();
    const bool off = faults_.is(UnitFault::off);
    if (off) enter(State::switch_on_disabled);
    if (was_off_ && !off) co_await power_up();
    was_off_ = off;
    if (off) booted_ = false;
    if (!booted_) continue;
    roll();
    if (state_ == State::quick_stop_active && now - stopping_at_ > kQuickStop)
      enter(State::switch_on_disabled);
    if (stalled_ && now - stalled_at_ > kStalledMax) fail(kBlocked);
    const std::uint32_t watch = object(0x1016, 1) & 0xFFFF;
    if (config_.watches_master && watch != 0 && hears_master_ && now - master_at_ > watch * 1ms) {
      hears_master_ = false;
      error_code_ = kMasterLost;
      error_untold_ = true;
      if (state_ == State::operation_enabled) enter(State::quick_stop_active);
      nmt_ = NodeState::pre_operational;
    }
    if (std::exchange(error_untold_, false)) co_await tell_emergency();
    const std::uint32_t period = object(0x1017, 0);
    if (period == 0 || now < next_heartbeat_) continue;
    next_heartbeat_ = now + faults_.slowed(period * 1ms);
    co_await send(Heartbeat{config_.node, nmt_});
  }
}

hal::Task<void> Cia402Node::power_up() {
  booted_ = false;
  reset_objects();
  co_await clock_.sleep_for(faults_.slowed(kBoot));
  (void)wheel_.rolled_m();
  position_ = config_.position;
  error_code_ = 0;
  error_untold_ = stalled_ = hears_master_ = false;
  nmt_ = NodeState::pre_operational;
  enter(State::switch_on_disabled);
  booted_ = true;
  co_await send(Heartbeat{config_.node, NodeState::boot_up});
}

void Cia402Node::reset_objects() {
  objects_ = {{key(0x1000, 0), {config_.device_type, 4, false}},
              {key(0x1001, 0), {0, 1, false}},
              {key(0x1016, 0), {1, 1, false}},
              {key(0x1016, 1), {0, 4}},
              {key(0x1017, 0), {0, 2}},
              {key(0x1018, 0), {4, 1, false}},
              {key(0x1018, 1), {config_.vendor, 4, false}},
              {key(0x1018, 2), {config_.product, 4, false}},
              {key(0x1018, 3), {1, 4, false}},
              {key(0x1018, 4), {config_.serial, 4, false}},
              {key(cia402::kAbortConnection), {1, 2}},
              {key(cia402::kErrorCode), {0, 2, false}},
              {key(cia402::kControlword), {0, 2}},
              {key(cia402::kStatusword), {0, 2, false}},
              {key(cia402::kQuickStopOption), {2, 2}},
              {key(cia402::kModes), {0, 1}},
              {key(cia402::kModesDisplay), {0, 1, false}},
              {key(cia402::kPosition), {0, 4, false}},
              {key(cia402::kVelocityActual), {0, 4, false}},
              {key(cia402::kTorqueActual), {0, 2, false}},
              {key(cia402::kAcceleration), {1000, 4}},
              {key(cia402::kDeceleration), {1000, 4}},
              {key(cia402::kQuickStopDeceleration), {3000, 4}},
              {key(cia402::kVelocityTarget), {0, 4}},
              {key(cia402::kSupportedModes), {config_.modes, 4, false}}};
  for (std::uint16_t i = 0; i < kPdos; ++i) {
    add_pdo(static_cast<std::uint16_t>(0x1400 + i), static_cast<std::uint16_t>(0x1600 + i),
            0x200U + 0x100U * i + config_.node);
    add_pdo(static_cast<std::uint16_t>(0x1800 + i), static_cast<std::uint16_t>(0x1A00 + i),
            0x180U + 0x100U * i + config_.node);
  }
  for (const auto& pdo : config_.fixed_mapping) {
    const auto map = static_cast<std::uint16_t>((pdo.from_node ? 0x1A00 : 0x1600) + pdo.number - 1);
    objects_[key(map, 0)].value = static_cast<std::uint32_t>(pdo.mapping.size());
    for (std::size_t i = 0; i < pdo.mapping.size(); ++i)
      objects_[key(map, static_cast<std::uint8_t>(i + 1))].value =
          drivers::canopen::mapping_word(pdo.mapping[i]);
  }
  map_pdos();
}

// Off at first, as drives without stored settings are.
void Cia402Node::add_pdo(std::uint16_t parameters, std::uint16_t map, std::uint32_t cob_id) {
  objects_[key(parameters, 1)] = {0xC0000000 | cob_id, 4};
  objects_[key(parameters, 2)] = {255, 1};
  objects_[key(parameters, 3)] = {0, 2};
  objects_[key(parameters, 5)] = {0, 2};
  objects_[key(map, 0)] = {0, 1};
  for (std::uint8_t i = 1; i <= 4; ++i) objects_[key(map, i)] = {0, 4};
}

std::uint32_t Cia402Node::object(std::uint16_t index, std::uint8_t sub) const {
  const auto found = objects_.find(key(index, sub));
  return found == objects_.end() ? 0 : found->second.value;
}

// --- What it hears.

hal::Task<void> Cia402Node::listen() {
  for (;;) {
    const auto received = co_await bus_.receive();
    if (received && booted_) co_await hear(received->frame);
  }
}

hal::Task<void> Cia402Node::hear(const hal::CanFrame& frame) {
  const Message message = decode(frame);
  if (const auto* nmt = std::get_if<Nmt>(&message)) {
    if (nmt->node == 0 || nmt->node == config_.node) co_await on_nmt(nmt->command);
  } else if (std::holds_alternative<Sync>(message)) {
    co_await on_sync();
  } else if (const auto* heartbeat = std::get_if<Heartbeat>(&message)) {
    if (heartbeat->node != (object(0x1016, 1) >> 16 & 0x7F)) co_return;
    master_at_ = clock_.now();
    if (!std::exchange(hears_master_, true) && error_code_ == kMasterLost) {
      error_code_ = 0;
      error_untold_ = true;
    }
  } else if (const auto* pdo = std::get_if<Pdo>(&message)) {
    if (!pdo->from_node && pdo->node == config_.node) heard_[pdo->number - 1U] = *pdo;
  } else if (nmt_ != NodeState::stopped) {
    const auto reply = server_.step(frame);
    if (!reply) co_return;
    co_await clock_.sleep_for(faults_.slowed(kAnswer));
    co_await send_frame(*reply);
  }
}

hal::Task<void> Cia402Node::on_nmt(NmtCommand command) {
  switch (command) {
    case NmtCommand::start:
      nmt_ = NodeState::operational;
      break;
    case NmtCommand::stop:
      nmt_ = NodeState::stopped;
      break;
    case NmtCommand::pre_operational:
      nmt_ = NodeState::pre_operational;
      break;
    case NmtCommand::reset_node:
    case NmtCommand::reset_communication:
      co_await power_up();
      co_return;
  }
  if (nmt_ != NodeState::operational && state_ == State::operation_enabled)
    enter(State::quick_stop_active);
  if (object(0x1017, 0) != 0) co_await send(Heartbeat{config_.node, nmt_});
}

// A slow one answers only some.
hal::Task<void> Cia402Node::on_sync() {
  if (nmt_ != NodeState::operational) co_return;
  if (++syncs_ < std::lround(faults_.slowness())) co_return;
  syncs_ = 0;
  roll();
  for (std::size_t i = 0; i < kPdos; ++i) take_rpdo(i);
  for (std::size_t i = 0; i < kPdos; ++i)
    co_await send_tpdo(static_cast<std::uint8_t>(i + 1), tpdos_[i]);
}

// --- Its objects.

std::variant<Bytes, std::uint32_t> Cia402Node::read(Address at) {
  if (at == Address{0x1008, 0}) return Bytes(config_.name.begin(), config_.name.end());
  if (at == Address{0x100A, 0}) return Bytes(config_.software.begin(), config_.software.end());
  const auto found = objects_.find(key(at));
  if (found != objects_.end())
    return bytes(live_value(found->first, found->second.value), found->second.size);
  const auto next = objects_.lower_bound(key(at.index, 0));
  return next != objects_.end() && next->first >> 8 == at.index ? kNoSub : kNoObject;
}

std::uint32_t Cia402Node::live_value(Key at, std::uint32_t stored) const {
  if (at == key(0x1001, 0))
    return error_code_ == 0 ? 0 : (error_code_ == kMasterLost ? 0x11 : 0x01);
  if (at == key(cia402::kErrorCode)) return error_code_;
  if (at == key(cia402::kStatusword)) return statusword();
  if (at == key(cia402::kModesDisplay)) return object(0x6060, 0);
  if (at == key(cia402::kPosition)) return static_cast<std::uint32_t>(wrapped(position_));
  if (at == key(cia402::kVelocityActual))
    return static_cast<std::uint32_t>(std::lround(wheel_.speed_mps() * config_.units_per_mps));
  if (at == key(cia402::kTorqueActual)) {
    const bool rolls = wheel_.speed_mps() != 0;
    return static_cast<std::uint32_t>(stalled_ ? kStalledTorque
                                               : (rolls ? kRollingTorque : kIdleTorque));
  }
  return stored;
}

std::uint32_t Cia402Node::write(Address at, ByteView data) {
  const auto found = objects_.find(key(at));
  if (found == objects_.end())
    return std::holds_alternative<std::uint32_t>(read(at)) ? std::get<std::uint32_t>(read(at))
                                                           : kReadOnly;
  Object& object = found->second;
  if (!object.writable) return kReadOnly;
  if (data.size() != object.size) return kLength;
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < data.size(); ++i)
    value |= static_cast<std::uint32_t>(data[i]) << (8 * i);
  if (const std::uint32_t code = refuses(found->first, object, value)) return code;
  object.value = value;
  if (at.index >= 0x1400 && at.index < 0x1C00) map_pdos();
  if (at == cia402::kControlword) obey(static_cast<std::uint16_t>(value));
  return 0;
}

// What a strict drive does not take.
std::uint32_t Cia402Node::refuses(Key at, const Object&, std::uint32_t value) const {
  const bool parameters = in(at, 0x1400, 0x15FF) || in(at, 0x1800, 0x19FF);
  const bool maps = in(at, 0x1600, 0x17FF) || in(at, 0x1A00, 0x1BFF);
  if ((parameters || maps) && nmt_ == NodeState::operational) return kState;
  if (at == key(cia402::kModes) && (value == 0 || (config_.modes >> (value - 1) & 1) == 0))
    return kRange;
  if (!maps) return 0;
  if (!config_.fixed_mapping.empty()) return kReadOnly;
  const auto map = static_cast<std::uint16_t>(at >> 8);
  const auto of = static_cast<std::uint16_t>(map - 0x200);
  if (object(of, 1) >> 31 == 0) return kState;  // Not while the PDO is on,
  if ((at & 0xFF) == 0) return value > 4 ? kRange : 0;
  if (object(map, 0) != 0) return kState;  // nor while the mapping counts.
  return objects_.contains(value >> 8) || value == 0 ? 0 : kNotMappable;
}

void Cia402Node::map_pdos() {
  const auto take = [this](MappedPdo& pdo, std::uint16_t parameters, std::uint16_t map) {
    pdo = {};
    pdo.on = object(parameters, 1) >> 31 == 0;
    for (std::uint8_t i = 1; i <= object(map, 0); ++i) {
      const Mapped each = mapped(object(map, i));
      const auto found = objects_.find(key(each.at));
      if (found == objects_.end()) continue;
      pdo.mapping.push_back(each);
      pdo.objects.push_back(&found->second);
    }
    pdo.values.resize(pdo.mapping.size());
  };
  for (std::uint16_t i = 0; i < kPdos; ++i) {
    take(rpdos_[i], static_cast<std::uint16_t>(0x1400 + i), static_cast<std::uint16_t>(0x1600 + i));
    take(tpdos_[i], static_cast<std::uint16_t>(0x1800 + i), static_cast<std::uint16_t>(0x1A00 + i));
  }
}

void Cia402Node::take_rpdo(std::size_t index) {
  MappedPdo& rpdo = rpdos_[index];
  const auto pdo = std::exchange(heard_[index], std::nullopt);
  if (!pdo || !rpdo.on || !unpack(rpdo.mapping, *pdo, rpdo.values)) return;
  for (std::size_t i = 0; i < rpdo.mapping.size(); ++i) {
    rpdo.objects[i]->value = static_cast<std::uint32_t>(rpdo.values[i]);
    if (rpdo.mapping[i].at == cia402::kControlword)
      obey(static_cast<std::uint16_t>(rpdo.values[i]));
  }
  wheel_.told();
}

hal::Task<void> Cia402Node::send_tpdo(std::uint8_t number, MappedPdo& mapped_pdo) {
  if (!mapped_pdo.on) co_return;
  for (std::size_t i = 0; i < mapped_pdo.mapping.size(); ++i)
    mapped_pdo.values[i] = live_value(key(mapped_pdo.mapping[i].at), mapped_pdo.objects[i]->value);
  Pdo pdo;
  pdo.node = config_.node;
  pdo.number = number;
  pdo.from_node = true;
  pack(mapped_pdo.mapping, mapped_pdo.values, pdo);
  co_await send(pdo);
}

// --- Its state.

void Cia402Node::obey(std::uint16_t controlword) {
  const bool reset = (controlword & 0x80) != 0 && (controlword_ & 0x80) == 0;
  controlword_ = controlword;
  const unsigned bits = controlword & 0x0F;
  if (state_ == State::fault) {
    if (!reset) return;
    error_code_ = 0;
    error_untold_ = true;
    return enter(State::switch_on_disabled);
  }
  if ((bits & 0x2) == 0) return enter(State::switch_on_disabled);
  if ((bits & 0x4) == 0)
    return enter(state_ == State::operation_enabled || state_ == State::quick_stop_active
                     ? State::quick_stop_active
                     : State::switch_on_disabled);
  if (sto_open_ || state_ == State::quick_stop_active) return;
  const bool ready = state_ == State::ready_to_switch_on, on = state_ == State::switched_on,
             runs = state_ == State::operation_enabled;
  if ((bits & 0x7) == 0x6) return enter(State::ready_to_switch_on);
  if (bits == 0x7 && (ready || on || runs)) return enter(State::switched_on);
  if (bits == 0xF && (on || runs)) return enter(State::operation_enabled);
}

void Cia402Node::enter(State state) {
  if (state == State::quick_stop_active && state_ != state) stopping_at_ = clock_.now();
  const bool changed = state != state_;
  state_ = state;
  if (changed) wheel_.told();
}

std::uint16_t Cia402Node::statusword() const {
  static constexpr std::uint16_t kWords[]{0x0000, 0x0040, 0x0021, 0x0023,
                                          0x0027, 0x0007, 0x000F, 0x0008};
  const auto voltage = static_cast<std::uint16_t>(sto_open_ ? 0 : 0x10);
  const auto standing = static_cast<std::uint16_t>(wheel_.speed_mps() == 0 ? 0x1000 : 0);
  const auto limit = static_cast<std::uint16_t>(stalled_ ? 0x0800 : 0);
  return static_cast<std::uint16_t>(kWords[static_cast<std::size_t>(state_)] | 0x0200 | voltage |
                                    standing | limit);
}

double Cia402Node::target_mps() const {
  if (state_ != State::operation_enabled || !booted_) return 0;
  return static_cast<std::int32_t>(object(cia402::kVelocityTarget.index, 0)) /
         config_.units_per_mps;
}

void Cia402Node::set_stalled(bool stalled) {
  if (stalled && !stalled_) stalled_at_ = clock_.now();
  stalled_ = stalled;
}

void Cia402Node::open_sto(bool open) {
  sto_open_ = open;
  if (open && state_ != State::fault) enter(State::switch_on_disabled);
}

void Cia402Node::fail(std::uint16_t code) {
  if (code == 0 || state_ == State::fault) return;
  stalled_ = false;
  error_code_ = code;
  error_untold_ = true;
  enter(State::fault);
}

hal::Task<void> Cia402Node::tell_emergency() {
  const auto error_register = static_cast<std::uint8_t>(live_value(key(0x1001, 0), 0));
  co_await send(Emergency{config_.node, error_code_, error_register, {}});
}

void Cia402Node::roll() {
  const double rolled = wheel_.rolled_m() * config_.counts_per_m;
  position_ += rolled * faults_.wrong_factor();
}

hal::Task<void> Cia402Node::send(const Message& message) {
  co_await send_frame(encode(message));
}

// A frame that finds no way to the bus in time is not sent.
hal::Task<void> Cia402Node::send_frame(const hal::CanFrame& frame) {
  (void)co_await bus_.send(frame, clock_.now() + kSendMax);
}

// --- Both.

Cia402Unit::Cia402Unit(const Cia402NodeConfig& left, const Cia402NodeConfig& right, World& world,
                       hal::Clock& clock, hal::CanBus& left_bus, hal::CanBus& right_bus,
                       UnitFaults& left_faults, UnitFaults& right_faults)
    : world_(world),
      clock_(clock),
      left_(left, wheel(true), clock, left_bus, left_faults),
      right_(right, wheel(false), clock, right_bus, right_faults) {}

hal::Task<void> Cia402Unit::run() {
  using boost::asio::experimental::awaitable_operators::operator&&;
  co_await (left_.run() && right_.run());
}

Cia402Node::Wheel Cia402Unit::wheel(bool is_left) {
  return {[this, is_left] { return rolled_m(is_left); },
          [this, is_left] {
            const hal::Twist rolling = world_.rolling();
            const double rim_mps = rolling.turn_radps * world_.config().track_m / 2;
            return rolling.forward_mps + (is_left ? -rim_mps : rim_mps);
          },
          [this] { drive(); }};
}

double Cia402Unit::rolled_m(bool is_left) {
  world_.advance(clock_.now());
  const hal::WheelTravel travel = world_.take_travel();
  left_m_ += travel.left_m;
  right_m_ += travel.right_m;
  return std::exchange(is_left ? left_m_ : right_m_, 0);
}

// Against something both wheels stall.
void Cia402Unit::drive() {
  world_.advance(clock_.now());
  const double left = left_.target_mps(), right = right_.target_mps();
  const bool free =
      world_.command({(left + right) / 2, (right - left) / world_.config().track_m}).has_value();
  left_.set_stalled(!free && left != 0);
  right_.set_stalled(!free && right != 0);
}

}  // namespace sim
