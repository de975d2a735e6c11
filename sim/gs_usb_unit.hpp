// A gs_usb adapter (candleLight) with two channels on one CAN bus: it answers by the protocol, and
// stalls where a real one does. Knows nothing of what carries USB.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <utility>

#include "drivers/bytes.hpp"
#include "drivers/gs_usb_codec.hpp"

namespace sim {

class GsUsbUnit {
 public:
  static constexpr std::uint8_t kChannels = 2;
  // Transfers that wait for the host; the newest is lost when they are full.
  static constexpr std::size_t kWaitingMax = 4096;

  // Vendor requests. False, or nothing: it stalls.
  bool put(drivers::gs_usb::Request request, std::uint16_t value, const drivers::Bytes& data);
  std::optional<drivers::Bytes> get(drivers::gs_usb::Request request, std::uint16_t value) const;
  // A frame from the host. One waits in each channel; what comes on top of it is lost, and its echo
  // with it.
  void take(drivers::ByteView frame);
  // The next transfer to the host.
  std::optional<drivers::Bytes> next();
  // Called whenever a transfer waits that did not before.
  void on_ready(std::function<void()> ready) { ready_ = std::move(ready); }

  void power_cycle();     // Forgets everything but how often it was started.
  void silence(bool on);  // Nobody acknowledges: frames wait in their channel.
  void go_bus_off(std::uint8_t channel);
  void go_passive(std::uint8_t channel);
  // From the bus.
  void hear(std::uint8_t channel, const hal::CanFrame& frame, bool overflow);
  int starts(std::uint8_t channel) const { return channels_.at(channel).starts; }

 private:
  struct Channel {
    bool timed{}, started{}, bus_off{};
    int starts{};
    std::optional<std::pair<std::uint32_t, hal::CanFrame>> waiting{};  // Echo id, frame.
  };
  void tell(drivers::Bytes transfer);
  void tell_error(std::uint8_t channel, std::uint32_t classes, std::uint8_t controller);
  void transmit(std::uint8_t channel);
  bool start(std::uint16_t value, const drivers::Bytes& data);

  bool silent_ = false;
  bool little_endian_ = false;
  std::array<Channel, kChannels> channels_;
  std::deque<drivers::Bytes> to_host_;
  std::function<void()> ready_;
};

}  // namespace sim
