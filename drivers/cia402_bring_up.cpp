// The dialogue with each of two CiA 402 drives: who it is, its settings, its start.
#include <boost/asio/experimental/awaitable_operators.hpp>

#include "drivers/cia402_drive.hpp"
#include "drivers/cia402_times.hpp"

namespace drivers {

using namespace cia402_times;

namespace {

using namespace std::chrono_literals;

constexpr canopen::SdoTimes kSdoTimes{600ms, 2};
constexpr canopen::Address kDeviceType{0x1000, 0}, kErrorRegister{0x1001, 0}, kName{0x1008, 0},
    kSoftware{0x100A, 0}, kVendor{0x1018, 1}, kProduct{0x1018, 2}, kSerial{0x1018, 4};
constexpr std::uint32_t kCia402 = 0x0192;  // The low half of the device type.

std::string hex(std::uint32_t value, int digits) {
  constexpr std::string_view kDigits = "0123456789ABCDEF";
  std::string text = "0x";
  for (int shift = 4 * (digits - 1); shift >= 0; shift -= 4) text += kDigits[value >> shift & 0xF];
  return text;
}

std::string at(canopen::Address address) {
  return hex(address.index, 4) + ":" + std::to_string(address.sub);
}

}  // namespace

// Brings a drive up, and again whenever it was lost or restarted.
hal::Task<void> Cia402Drive::serve(Node& node) {
  for (;;) {
    auto failure = co_await bring_up(node);
    if (failure) {
      node.failure = std::move(failure);
      co_await clock_.sleep_for(kRetry);
      continue;
    }
    node.failure.reset();
    co_await look_after(node);
  }
}

hal::Task<std::optional<Trouble>> Cia402Drive::bring_up(Node& node) {
  const int boots = node.boots;
  co_await send(canopen::Nmt{canopen::NmtCommand::pre_operational, node.side.node});
  if (auto failure = co_await identify(node)) co_return failure;
  const cia402::VelocityConfig wanted = velocity_config(node);
  node.layout = cia402::own_layout(config_.mode);
  auto failure = co_await apply_all(node, cia402::velocity_settings(wanted));
  if (failure && node.refused_mapping) failure = co_await use_fixed_mapping(node, wanted);
  if (failure) co_return failure;
  if (node.boots != boots)
    co_return Trouble{&faults()[kNotOperational], who(node, "it restarted meanwhile")};
  co_return co_await start(node);
}

cia402::VelocityConfig Cia402Drive::velocity_config(const Node& node) const {
  cia402::VelocityConfig wanted;
  wanted.node = node.side.node;
  wanted.master = config_.master;
  wanted.mode = config_.mode;
  wanted.heartbeat_ms = kHeartbeatMs;
  wanted.master_heartbeat_max_ms = kMasterHeartbeatMaxMs;
  wanted.acceleration = config_.acceleration;
  wanted.deceleration = config_.deceleration;
  wanted.quick_stop_deceleration = config_.quick_stop_deceleration;
  return wanted;
}

// Where the drive will not be mapped: by what it has.
hal::Task<std::optional<Trouble>> Cia402Drive::use_fixed_mapping(
    Node& node, const cia402::VelocityConfig& wanted) {
  cia402::FixedPdos has;
  for (std::uint16_t i = 0; i < 4; ++i) {
    has.to_node[i] = co_await read_mapping(node, static_cast<std::uint16_t>(0x1600 + i));
    has.from_node[i] = co_await read_mapping(node, static_cast<std::uint16_t>(0x1A00 + i));
  }
  const std::string lacks = cia402::find_layout(has, config_.mode, node.layout);
  if (!lacks.empty()) co_return Trouble{&faults()[kFixedMapping], who(node, lacks)};
  co_return co_await apply_all(node, cia402::velocity_settings(wanted, node.layout));
}

// As cia402::FixedPdos has it.
hal::Task<std::vector<canopen::Mapped>> Cia402Drive::read_mapping(Node& node, std::uint16_t index) {
  std::vector<canopen::Mapped> mapping;
  const std::uint32_t entries = co_await number(node, {index, 0});
  for (std::uint32_t i = 1; entries <= 8 && i <= entries; ++i) {
    const std::uint32_t word = co_await number(node, {index, static_cast<std::uint8_t>(i)});
    mapping.push_back(canopen::mapped(word));
  }
  co_return mapping;
}

hal::Task<std::optional<Trouble>> Cia402Drive::apply_all(Node& node,
                                                         std::vector<canopen::Setting> settings) {
  node.refused_mapping = false;
  for (const canopen::Setting& setting : settings)
    if (auto failure = against_eds(node, setting)) co_return failure;
  for (const canopen::Setting& setting : settings) {
    auto failure = co_await apply(node, setting);
    if (!failure) continue;
    node.refused_mapping = cia402::is_mapping(setting.at) && failure->fault != &faults()[kSilent];
    co_return failure;
  }
  co_return std::nullopt;
}

hal::Task<std::optional<Trouble>> Cia402Drive::identify(Node& node) {
  const Outcome type = co_await read(node, kDeviceType);
  if (type.failure && !type.failure->by_node)
    co_return Trouble{&faults()[kSilent], who(node, others())};
  if (type.failure) co_return sdo_trouble(node, *type.failure, "device type");
  if (type.data.size() < 2 || little<std::uint16_t>(type.data, 0) != kCia402)
    co_return Trouble{&faults()[kNotADrive], who(node)};
  const std::uint32_t vendor = co_await number(node, kVendor);
  const std::uint32_t product = co_await number(node, kProduct);
  const auto differs = [](std::uint32_t wanted, std::uint32_t is) {
    return wanted != 0 && wanted != is;
  };
  const auto eds_vendor = config_.eds ? config_.eds->vendor_number.value_or(0) : 0;
  const auto eds_product = config_.eds ? config_.eds->product_number.value_or(0) : 0;
  if (differs(config_.vendor, vendor) || differs(config_.product, product) ||
      differs(eds_vendor, vendor) || differs(eds_product, product))
    co_return Trouble{&faults()[kWrongDrive],
                      who(node, "vendor " + hex(vendor, 8) + " product " + hex(product, 8))};
  const std::uint32_t modes = co_await number(node, cia402::kSupportedModes);
  if (modes != 0 && (modes & cia402::mode_bit(config_.mode)) == 0)
    co_return Trouble{&faults()[kNoMode], who(node, "it has " + hex(modes, 8))};
  node.serial = std::to_string(co_await number(node, kSerial));
  node.type = co_await text(node, kName);
  node.version = co_await text(node, kSoftware);
  if (&node == &left_)
    identity_ = {"vendor " + hex(vendor, 8), node.type.empty() ? hex(product, 8) : node.type,
                 node.serial, node.version};
  co_return std::nullopt;
}

std::optional<Trouble> Cia402Drive::against_eds(const Node& node,
                                                const canopen::Setting& setting) const {
  if (!config_.eds || setting.optional) return std::nullopt;
  const eds::Entry* entry = config_.eds->find(setting.at);
  const auto trouble = [&](const std::string& why) {
    return Trouble{&faults()[kNotInEds],
                   who(node, at(setting.at) + " " + std::string(setting.what) + ": " + why)};
  };
  if (entry == nullptr) return trouble("not there");
  if (eds::bits_of(entry->data_type) != 8U * setting.size) return trouble("of another size");
  const bool locked =
      entry->access == eds::Access::read_only || entry->access == eds::Access::constant;
  if (locked && !cia402::is_mapping(setting.at)) return trouble("read-only");
  return std::nullopt;
}

// Writes one setting and reads it back.
hal::Task<std::optional<Trouble>> Cia402Drive::apply(Node& node, const canopen::Setting& setting) {
  const Outcome written = co_await transfer(
      node,
      canopen::SdoClient::write(node.side.node, setting.at, canopen::bytes_of(setting), kSdoTimes));
  if (written.failure) {
    if (setting.optional && written.failure->by_node) co_return std::nullopt;
    co_return sdo_trouble(node, *written.failure, setting.what);
  }
  if (setting.compare_mask == 0) co_return std::nullopt;
  const hal::Time late = clock_.now() + (setting.read_at ? kModeMax : 0ms);
  for (;;) {
    const Outcome back = co_await read(node, setting.read_at.value_or(setting.at));
    if (back.failure) co_return sdo_trouble(node, *back.failure, setting.what);
    if (canopen::reads_back(setting, back.data)) co_return std::nullopt;
    if (clock_.now() >= late) break;
    co_await clock_.sleep_for(kCycle);
  }
  co_return Trouble{&faults()[kNotKept],
                    who(node, at(setting.at) + " " + std::string(setting.what))};
}

hal::Task<std::optional<Trouble>> Cia402Drive::start(Node& node) {
  using namespace boost::asio::experimental::awaitable_operators;
  const hal::Time late = clock_.now() + kStartMax;
  co_await send(canopen::Nmt{canopen::NmtCommand::start, node.side.node});
  while (clock_.now() < late) {
    co_await clock_.sleep_for(kCycle);
    if (node.heard.nmt != canopen::NodeState::operational || !beats(node, clock_.now())) continue;
    node.heard.statusword.reset();
    node.heard.since_sync = 1;  // Nothing is due yet.
    node.enabling_since = {};
    node.configured = true;
    co_return std::nullopt;
  }
  co_return Trouble{&faults()[kNotOperational], who(node)};
}

// Asks for its error register every second, which also shows how long it takes to answer.
hal::Task<void> Cia402Drive::look_after(Node& node) {
  while (node.configured) {
    const hal::Time next = clock_.now() + kAskPause;
    const Outcome errors = co_await read(node, kErrorRegister);
    node.deaf = errors.failure && !errors.failure->by_node;
    if (!errors.failure && !errors.data.empty()) node.heard.error_register = errors.data[0];
    using namespace boost::asio::experimental::awaitable_operators;
    while (node.configured && clock_.now() < next)
      co_await (clock_.sleep_until(next) || node.replied.wait());
  }
}

hal::Task<Cia402Drive::Outcome> Cia402Drive::transfer(Node& node, canopen::SdoClient client) {
  using namespace boost::asio::experimental::awaitable_operators;
  node.replies.clear();
  std::optional<hal::CanFrame> reply;
  hal::Time asked = clock_.now();
  for (;;) {
    const auto request = client.step(reply ? &*reply : nullptr, clock_.now());
    if (reply && (request || client.done())) node.answer_took = clock_.now() - asked;
    reply.reset();
    if (request) {  // One that cannot be sent is asked again, as one that was not answered.
      asked = clock_.now();
      const auto sent = co_await bus_.send(*request, asked + kCycle);
      send_error_ = sent ? boost::system::error_code{} : sent.error();
    }
    if (client.done()) break;
    while (node.replies.empty() && clock_.now() < client.wake_up())
      co_await (clock_.sleep_until(client.wake_up()) || node.replied.wait());
    if (node.replies.empty()) continue;
    reply = node.replies.front();
    node.replies.pop_front();
  }
  if (client.failure()) co_return Outcome{{}, client.failure()};
  co_return Outcome{client.data(), std::nullopt};
}

hal::Task<Cia402Drive::Outcome> Cia402Drive::read(Node& node, canopen::Address address) {
  co_return co_await transfer(node, canopen::SdoClient::read(node.side.node, address, kSdoTimes));
}

// 0 where the drive does not have it.
hal::Task<std::uint32_t> Cia402Drive::number(Node& node, canopen::Address address) {
  const Outcome got = co_await read(node, address);
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < std::min<std::size_t>(4, got.data.size()); ++i)
    value |= static_cast<std::uint32_t>(got.data[i]) << (8 * i);
  co_return value;
}

hal::Task<std::string> Cia402Drive::text(Node& node, canopen::Address address) {
  const Outcome got = co_await read(node, address);
  std::string text;
  for (const std::uint8_t byte : got.data)
    if (byte >= 0x20 && byte < 0x7F) text += static_cast<char>(byte);
  co_return text;
}

Trouble Cia402Drive::sdo_trouble(const Node& node, const canopen::SdoFailure& failure,
                                 std::string_view what) const {
  if (!failure.by_node) return {&faults()[kSilent], who(node, "asked for " + std::string(what))};
  const Fault& entry = canopen::abort_entry(failure.abort_code);
  return {&entry, who(node, std::string(what) + ", " + hex(failure.abort_code, 8))};
}

}  // namespace drivers
