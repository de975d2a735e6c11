#include "drivers/power_io.hpp"

#include <boost/asio/experimental/awaitable_operators.hpp>
#include <cassert>
#include <cmath>

namespace drivers {
namespace {

using namespace std::chrono_literals;
using boost::system::errc::make_error_code;
namespace errc = boost::system::errc;

constexpr hal::Duration kInputsPeriod = 50ms, kInputsMax = 200ms, kRelaysPeriod = 500ms;
constexpr hal::Duration kBatteryPeriod = 1s, kBatteryMax = 5s, kBatteryLate = 100ms;
constexpr hal::Duration kLampsPeriod = 500ms;
constexpr hal::Duration kRetry = 1s;
constexpr hal::Duration kListening = 1s;   // Before silence at the start is trouble.
constexpr hal::Duration kRemembered = 2s;  // Troubles that come and go are shown for so long.
constexpr hal::Duration kResetShown = 500ms;
constexpr hal::Duration kTenth = 100ms;
constexpr hal::Duration kRelaySettles = 200ms;
constexpr int kTenthsMax = 0x7FFF;
constexpr hal::RegisterRange kSerial{800, 6}, kModes{waveshare::kModes, waveshare::kChannels},
    kBoardVersion{waveshare::kVersion, 1};
constexpr double kPowerShareMax = 0.25, kPowerMin_w = 40;

constexpr Fault kFaults[] = {
    {1, "no answer", "switched off, cable loose, or a wrong address",
     "check its supply and cable, and the address in the robot file"},
    {2, "not connected", "its network address does not answer, or the adapter is unplugged",
     "check the network or serial cable and the address in the robot file"},
    {3, "damaged replies", "wrong baud rate or parity, two units of one address, or a bad line",
     "compare baud rate and parity; look for a second unit of that address; terminate the line"},
    {4, "answers late", "a slow gateway or too many clients", "give it a line of its own"},
    {5, "gateway does not know this unit", "the battery's unit number is another one",
     "read the unit numbers in the gateway's menu: Settings, Services, Modbus TCP"},
    {6, "refuses a request", "another device or firmware than expected",
     "check what hangs on this address, and its firmware"},
    {7, "not a board with eight inputs", "another device has this address",
     "check what hangs on this address"},
    {8, "channel does not stay in normal mode", "the board refuses to be set",
     "set its channels to normal mode with the maker's program"},
    {9, "e-stop contacts contradict each other", "a broken or loose wire, or a welded contact",
     "check both contacts' wires; then press and release the e-stop"},
    {10, "bumper contacts contradict each other", "a broken or loose wire, or a welded contact",
     "check both contacts' wires; then press and release the bumper"},
    {11, "reset button stuck", "it has been pressed for longer than 3 s",
     "let it go; check the button and its wire"},
    {12, "no e-stop input", "the robot file names none", "name the e-stop's inputs there"},
    {13, "relay does not follow", "the board restarted, or something else switches it",
     "check the board's supply and who else writes to it"},
    {14, "battery values disagree", "voltage times current is not the power that it says",
     "check the shunt's wiring and its settings"},
};
enum Which {
  kSilent,
  kNotConnected,
  kDamaged,
  kLate,
  kNoService,
  kRefused,
  kOtherBoard,
  kMode,
  kEstopWires,
  kBumperWires,
  kResetStuck,
  kNoEstop,
  kStrays,
  kDisagree
};

bool is_input(int channel) {
  return channel >= 0 && channel < waveshare::kChannels;
}

// Two letters a register.
std::string text_of(const std::vector<std::uint16_t>& registers) {
  std::string text;
  for (const std::uint16_t each : registers)
    for (const int byte : {each >> 8, each & 0xFF})
      if (byte >= 0x20 && byte < 0x7F) text += static_cast<char>(byte);
  return text;
}

Which which(const boost::system::error_code& failure) {
  if (failure == errc::timed_out) return kSilent;
  if (failure == errc::not_connected) return kNotConnected;
  if (failure == errc::bad_message) return kDamaged;
  if (failure == errc::network_unreachable || failure == errc::host_unreachable) return kNoService;
  return kRefused;
}

}  // namespace

PowerIo::PowerIo(const Config& config, hal::Clock& clock, Links links)
    : config_(config),
      clock_(clock),
      battery_peer_{"battery", links.battery, kBatteryMax, {}, {}, {}, false, {}, {}},
      board_peer_{"relay board", links.board, kInputsMax, {}, {}, {}, false, {}, {}},
      safety_peer_{"safety controller", links.safety, kInputsMax, {}, {}, {}, false, {}, {}},
      gateway_(links.gateway) {
  assert(!config.reset_input || is_input(*config.reset_input));
}

std::span<const Fault> PowerIo::faults() const {
  return kFaults;
}

hal::Task<void> PowerIo::run() {
  using boost::asio::experimental::awaitable_operators::operator&&;
  started_ = true;
  started_at_ = clock_.now();
  co_await (watch_battery() && watch_board() && watch_safety());
}

// Every request goes through here. A refusal was an answer too.
template <class T>
hal::Task<hal::Result<T>> PowerIo::ask(Peer& peer, hal::Task<hal::Result<T>> request,
                                       hal::Duration late) {
  const hal::Time asked = clock_.now();
  auto reply = co_await std::move(request);
  const hal::Time now = clock_.now();
  if (reply) {
    peer.heard = true;
    peer.heard_at = now;
    peer.took += (now - asked - peer.took) / 4;  // One slow reply is no trouble.
    if (peer.took > late) peer.late_at = now;
  } else {
    peer.failure = reply.error();
    peer.failed_at = now;
  }
  co_return reply;
}

// --- The battery.

hal::Task<void> PowerIo::watch_battery() {
  if (battery_peer_.link == nullptr) co_return;
  for (hal::Time next = clock_.now();; next = std::max(next + kBatteryPeriod, clock_.now())) {
    co_await clock_.sleep_until(next);
    if (gateway_ != nullptr && identity_.serial.empty())
      if (const auto serial = co_await gateway_->read_holding(kSerial))
        identity_.serial = text_of(*serial);
    if (!co_await read_battery()) continue;
    identity_.maker = "Victron Energy";
    identity_.model = "battery monitor";
  }
}

// What the service does not have is not asked for again, until it was lost.
hal::Task<bool> PowerIo::read_battery() {
  std::vector<victron::Alarm> alarms;
  if (!fresh(battery_peer_, clock_.now())) ranges_missing_.reset();
  const auto ranges = victron::battery_ranges();
  for (std::size_t i = 0; i < ranges.size(); ++i) {
    if (ranges_missing_.test(i)) continue;
    const auto image =
        co_await ask(battery_peer_, battery_peer_.link->read_holding(ranges[i]), kBatteryLate);
    if (!image) {
      if (i == 0 || image.error() != errc::bad_address) co_return false;
      ranges_missing_.set(i);
      battery_peer_.failed_at = {};
      continue;
    }
    if (image->size() != ranges[i].count) co_return false;
    victron::take(battery_, *image, ranges[i].first);
    const auto found = victron::alarms_in(*image, ranges[i].first);
    alarms.insert(alarms.end(), found.begin(), found.end());
  }
  alarms_ = std::move(alarms);
  if (battery_.voltage_v && battery_.current_a && battery_.power_w) {
    const double product_w = *battery_.voltage_v * *battery_.current_a;
    const double most_w = std::max(std::abs(product_w), std::abs(*battery_.power_w));
    battery_disagrees_ =
        most_w > kPowerMin_w && std::abs(product_w - *battery_.power_w) > kPowerShareMax * most_w;
  }
  co_return true;
}

hal::Task<hal::Result<hal::BatteryState>> PowerIo::battery() {
  if (!fresh(battery_peer_, clock_.now())) co_return make_error_code(errc::not_connected);
  co_return hal::BatteryState{battery_peer_.heard_at, battery_.voltage_v,
                              battery_.current_a,     battery_.charge_percent,
                              battery_.temperature_c, battery_.time_to_go_s};
}

// --- The board.

hal::Task<void> PowerIo::watch_board() {
  if (board_peer_.link == nullptr) co_return;
  hal::Time relays_due{};
  for (hal::Time next = clock_.now();; next = std::max(next + kInputsPeriod, clock_.now())) {
    co_await clock_.sleep_until(next);
    if (!board_ready_ && !co_await set_up_board()) {
      next = clock_.now() + kRetry - kInputsPeriod;
      continue;
    }
    co_await read_inputs();
    if (!fresh(board_peer_, clock_.now())) board_ready_ = false;  // It may have been exchanged.
    if (clock_.now() < relays_due) continue;
    relays_due = clock_.now() + kRelaysPeriod;
    co_await read_relays();
  }
}

// Who it is, and every channel under our command alone, read back.
hal::Task<bool> PowerIo::set_up_board() {
  hal::Registers& board = *board_peer_.link;
  const auto inputs =
      co_await ask(board_peer_, board.read_discrete(waveshare::kInputs), kInputsPeriod);
  if (!inputs) co_return false;
  other_board_ = !waveshare::channels_of(*inputs);
  if (other_board_) co_return false;
  // Boards without these registers have only the normal mode.
  const auto modes = co_await board.read_holding(kModes);
  mode_refused_ = false;
  for (std::size_t i = 0; modes && i < modes->size(); ++i) {
    if ((*modes)[i] == 0) continue;
    const auto at = static_cast<std::uint16_t>(kModes.first + i);
    co_await board.write_register(at, 0);
    const auto back = co_await board.read_holding({at, 1});
    mode_refused_ = mode_refused_ || !back || back->size() != 1 || back->front() != 0;
  }
  const auto version = co_await board.read_holding(kBoardVersion);
  if (version && version->size() == 1) {
    const auto hundredths = std::to_string(version->front() % 100);
    identity_.firmware = "relay board " + std::to_string(version->front() / 100) + "." +
                         (hundredths.size() < 2 ? "0" : "") + hundredths;
  }
  co_return board_ready_ = !mode_refused_;
}

hal::Task<void> PowerIo::read_inputs() {
  const auto bits =
      co_await ask(board_peer_, board_peer_.link->read_discrete(waveshare::kInputs), kInputsPeriod);
  if (!bits) co_return;
  const auto inputs = waveshare::channels_of(*bits);
  other_board_ = !inputs;
  if (inputs) take_inputs(*inputs, clock_.now());
}

void PowerIo::take_inputs(waveshare::Channels inputs, hal::Time now) {
  inputs_taken_ = true;
  const auto at = [&](int channel) { return inputs.test(static_cast<std::size_t>(channel)); };
  if (config_.estop)
    estop_.update(at(config_.estop->normally_closed), at(config_.estop->normally_open), now);
  if (config_.bumper)
    bumper_.update(at(config_.bumper->normally_closed), at(config_.bumper->normally_open), now);
  if (!config_.reset_input) return;
  if (reset_.update(at(*config_.reset_input), now)) reset_at_ = now;
  reset_stuck_ = reset_.stuck(now);
}

hal::Task<void> PowerIo::read_relays() {
  const auto bits =
      co_await ask(board_peer_, board_peer_.link->read_coils(waveshare::kRelays), kInputsPeriod);
  if (!bits) co_return;
  const auto on = waveshare::channels_of(*bits);
  const hal::Time now = clock_.now();
  for (std::size_t i = 0; on && i < relays_.size(); ++i) {
    Relay& relay = relays_[i];
    const bool settled = now - relay.set_at > kRelaySettles &&
                         (now < relay.off_at - kRelaySettles || now > relay.off_at + kRelaySettles);
    if (relay.set_at != hal::Time{} && settled) relay.strays = on->test(i) != (now < relay.off_at);
  }
}

hal::Task<hal::Result<void>> PowerIo::set_relay(int channel, bool on, hal::Duration hold) {
  if (!is_input(channel) || hold < kTenth || hold > kTenthsMax * kTenth)
    co_return make_error_code(errc::argument_out_of_domain);
  if (!board_ready_) co_return make_error_code(errc::not_connected);
  const auto tenths = static_cast<std::uint16_t>((hold + kTenth - 1ns) / kTenth);
  const modbus::WriteOne write =
      on ? waveshare::pulse_on(channel, tenths) : waveshare::set_relay(channel, waveshare::kOff);
  const auto written = co_await board_peer_.link->write_coil_raw(write.at, write.value);
  if (!written) co_return written.error();
  Relay& relay = relays_[static_cast<std::size_t>(channel)];
  const hal::Time now = clock_.now();
  if (on != (now < relay.off_at) || relay.set_at == hal::Time{}) relay.set_at = now;
  relay.off_at = on ? now + tenths * kTenth : now;
  co_return hal::Result<void>{};
}

// --- The safety controller.

hal::Task<void> PowerIo::watch_safety() {
  if (safety_peer_.link == nullptr) co_return;
  hal::Registers& safety = *safety_peer_.link;
  hal::Time lamps_due{};
  for (hal::Time next = clock_.now();; next = std::max(next + kInputsPeriod, clock_.now())) {
    co_await clock_.sleep_until(next);
    const auto bits =
        co_await ask(safety_peer_, safety.read_discrete(safety::kPilzStatus), kInputsPeriod);
    safety_ = bits ? safety::pilz_status(*bits) : safety_;
    if (clock_.now() < lamps_due) continue;
    lamps_due = clock_.now() + kLampsPeriod;
    const auto lamps =
        co_await ask(safety_peer_, safety.read_input(safety::kPilzLeds), kInputsPeriod);
    if (lamps && lamps->size() == 1) safety_faults_ = safety::pilz_faults(lamps->front());
  }
}

hal::Task<hal::Result<hal::SafetyInputs>> PowerIo::inputs() {
  co_return read_inputs_at(clock_.now());
}

std::optional<hal::SafetyInputs> PowerIo::inputs_now() const {
  if (board_peer_.link == nullptr && safety_peer_.link == nullptr) return std::nullopt;
  if (board_peer_.link != nullptr && !inputs_taken_) return std::nullopt;
  if (safety_peer_.link != nullptr && !safety_) return std::nullopt;
  return read_inputs_at(clock_.now());
}

hal::SafetyInputs PowerIo::read_inputs_at(hal::Time now) const {
  hal::SafetyInputs inputs;
  inputs.stamp = std::max(board_peer_.heard_at, safety_peer_.heard_at);
  inputs.estop_pressed = estop_pressed(now);
  inputs.bumper_pressed = bumper_pressed(now);
  inputs.reset_pressed =
      fresh(board_peer_, now) && reset_at_ != hal::Time{} && now - reset_at_ <= kResetShown;
  return inputs;
}

bool PowerIo::estop_pressed(hal::Time now) const {
  const bool by_contacts = board_peer_.link != nullptr && config_.estop.has_value();
  if (!by_contacts && safety_peer_.link == nullptr) return true;
  if (by_contacts && estop_.loop(now) != safety::Loop::released) return true;
  return safety_peer_.link != nullptr &&
         !(fresh(safety_peer_, now) && safety_ && safety_->estop_released);
}

bool PowerIo::bumper_pressed(hal::Time now) const {
  const bool by_contacts = board_peer_.link != nullptr && config_.bumper.has_value();
  if (by_contacts && bumper_.loop(now) != safety::Loop::released) return true;
  return safety_peer_.link != nullptr && config_.safety_has_bumper &&
         !(fresh(safety_peer_, now) && safety_ && safety_->bumper_ok);
}

// --- How they are.

bool PowerIo::fresh(const Peer& peer, hal::Time now) const {
  return peer.heard && now - peer.heard_at <= peer.silence_max;
}

DeviceState PowerIo::state() const {
  if (!started_) return DeviceState::off;
  const hal::Time now = clock_.now();
  bool all = true, once = true;
  for (const Peer* peer : {&battery_peer_, &board_peer_, &safety_peer_}) {
    if (peer->link == nullptr) continue;
    all = all && fresh(*peer, now);
    once = once && peer->heard;
  }
  if (all && (board_ready_ || board_peer_.link == nullptr)) return DeviceState::running;
  return once && !all ? DeviceState::lost : DeviceState::starting;
}

std::vector<Trouble> PowerIo::troubles() const {
  std::vector<Trouble> all;
  if (!started_) return all;
  const hal::Time now = clock_.now();
  for (const Peer* peer : {&battery_peer_, &board_peer_, &safety_peer_})
    if (peer->link != nullptr) add_peer_troubles(all, *peer, now);
  add_battery_troubles(all, now);
  add_input_troubles(all, now);
  return all;
}

void PowerIo::add_peer_troubles(std::vector<Trouble>& all, const Peer& peer, hal::Time now) const {
  const auto detail = [&](const std::string& more) {
    return std::string(peer.name) + (more.empty() ? "" : ": " + more);
  };
  const bool failed = peer.failed_at != hal::Time{} && now - peer.failed_at <= kRemembered;
  if (failed)
    all.push_back({&kFaults[which(peer.failure)], detail(peer.failure.message())});
  else if (!fresh(peer, now) && now - started_at_ > kListening)
    all.push_back({&kFaults[kSilent], detail("")});
  if (peer.late_at == peer.heard_at && fresh(peer, now))
    all.push_back({&kFaults[kLate], detail(std::to_string(peer.took / 1ms) + " ms")});
}

void PowerIo::add_battery_troubles(std::vector<Trouble>& all, hal::Time now) const {
  if (!fresh(battery_peer_, now)) return;
  for (const victron::Alarm& alarm : alarms_)
    all.push_back({alarm.fault, alarm.severe ? "alarm" : "warning"});
  if (battery_disagrees_) all.push_back({&kFaults[kDisagree], {}});
}

void PowerIo::add_input_troubles(std::vector<Trouble>& all, hal::Time now) const {
  const bool has_board = board_peer_.link != nullptr;
  if (other_board_) all.push_back({&kFaults[kOtherBoard], {}});
  if (mode_refused_) all.push_back({&kFaults[kMode], {}});
  if (has_board && config_.estop && estop_.loop(now) == safety::Loop::fault)
    all.push_back({&kFaults[kEstopWires], {}});
  if (has_board && config_.bumper && bumper_.loop(now) == safety::Loop::fault)
    all.push_back({&kFaults[kBumperWires], {}});
  if (reset_stuck_) all.push_back({&kFaults[kResetStuck], {}});
  if (!(has_board && config_.estop) && safety_peer_.link == nullptr)
    all.push_back({&kFaults[kNoEstop], {}});
  for (std::size_t i = 0; i < relays_.size(); ++i)
    if (relays_[i].strays) all.push_back({&kFaults[kStrays], "channel " + std::to_string(i)});
  if (fresh(safety_peer_, now))
    for (const Fault* fault : safety_faults_) all.push_back({fault, {}});
}

}  // namespace drivers
