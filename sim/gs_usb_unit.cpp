#include "sim/gs_usb_unit.hpp"

namespace sim {

namespace gs_usb = drivers::gs_usb;
using drivers::Bytes;
using gs_usb::Request;

namespace {

// A candleLight's.
constexpr gs_usb::BitTimingLimits kLimits{
    gs_usb::kListenOnly | gs_usb::kLoopBack, 48'000'000, 1, 16, 1, 8, 4, 1, 1024, 1};

}  // namespace

void GsUsbUnit::tell(Bytes transfer) {
  if (to_host_.size() >= kWaitingMax) return;
  to_host_.push_back(std::move(transfer));
  if (ready_) ready_();
}

void GsUsbUnit::tell_error(std::uint8_t channel, std::uint32_t classes, std::uint8_t controller) {
  hal::CanFrame frame;
  frame.size = 8;
  frame.data[1] = controller;
  const auto raw = gs_usb::encode(frame, channel, gs_usb::kReceived);
  Bytes transfer(raw.begin(), raw.end());
  drivers::put_little<std::uint32_t>(transfer, 4, classes | 1U << 29);
  tell(std::move(transfer));
}

// What the channel has waiting goes, where somebody acknowledges.
void GsUsbUnit::transmit(std::uint8_t number) {
  Channel& channel = channels_[number];
  const Channel& other = channels_[1 - number];
  if (!channel.waiting || silent_ || !channel.started || !other.started || channel.bus_off ||
      other.bus_off)
    return;
  const auto [echo_id, frame] = *channel.waiting;
  channel.waiting.reset();
  tell(gs_usb::encode(gs_usb::Echo{echo_id, number, frame, std::nullopt}));
  tell(gs_usb::encode(
      gs_usb::Received{frame, static_cast<std::uint8_t>(1 - number), false, std::nullopt}));
}

bool GsUsbUnit::put(Request request, std::uint16_t value, const Bytes& data) {
  if (request == Request::host_format) return little_endian_ = data == gs_usb::host_format();
  if (!little_endian_ || value >= kChannels) return false;
  Channel& channel = channels_[value];
  if (request == Request::bit_timing) {
    if (channel.started || !gs_usb::decode_timing(data)) return false;
    return channel.timed = true;
  }
  return request == Request::mode && start(value, data);
}

bool GsUsbUnit::start(std::uint16_t value, const Bytes& data) {
  Channel& channel = channels_[value];
  if (data.size() < 8) return false;
  if (data == gs_usb::reset_mode()) {
    channel = {.starts = channel.starts};
    return true;
  }
  const auto flags = drivers::little<std::uint32_t>(data, 4);
  if (!channel.timed || (flags & ~kLimits.features) != 0) return false;
  channel.started = true;
  ++channel.starts;
  for (std::uint8_t each = 0; each < kChannels; ++each) transmit(each);
  return true;
}

std::optional<Bytes> GsUsbUnit::get(Request request, std::uint16_t value) const {
  if (request == Request::device_config)
    return gs_usb::encode(gs_usb::DeviceConfig{kChannels, 2, 1});
  if (request == Request::bit_timing_limits && value < kChannels) return gs_usb::encode(kLimits);
  return std::nullopt;
}

void GsUsbUnit::take(drivers::ByteView frame) {
  const auto decoded = gs_usb::decode(frame, false);
  const auto* echo = std::get_if<gs_usb::Echo>(&decoded);
  if (echo == nullptr || echo->channel >= kChannels) return;
  Channel& channel = channels_[echo->channel];
  if (!channel.waiting) channel.waiting = {echo->id, echo->frame};
  transmit(echo->channel);
}

std::optional<Bytes> GsUsbUnit::next() {
  if (to_host_.empty()) return std::nullopt;
  Bytes transfer = std::move(to_host_.front());
  to_host_.pop_front();
  return transfer;
}

void GsUsbUnit::power_cycle() {
  little_endian_ = false;
  for (Channel& channel : channels_) channel = {.starts = channel.starts};
  to_host_.clear();
}

void GsUsbUnit::silence(bool on) {
  silent_ = on;
  for (std::uint8_t each = 0; each < kChannels; ++each) transmit(each);
}

void GsUsbUnit::go_bus_off(std::uint8_t channel) {
  channels_.at(channel).bus_off = true;
  tell_error(channel, 0x40, 0);
}

void GsUsbUnit::go_passive(std::uint8_t channel) {
  tell_error(channel, 0x04, 0x20);
}

void GsUsbUnit::hear(std::uint8_t channel, const hal::CanFrame& frame, bool overflow) {
  tell(gs_usb::encode(gs_usb::Received{frame, channel, overflow, std::nullopt}));
}

}  // namespace sim
