// gs_usb adapters over libusb: found by serial number, claimed, and followed through unplugging,
// without CAN in the kernel.
#pragma once

#include <memory>

#include "drivers/gs_usb_adapter.hpp"
#include "drivers/link_address.hpp"

namespace drivers {

// Joins libusb to the event loop. One for all adapters; destroy it after them. Nothing blocks but
// closing an adapter, for up to kCloseMax while its transfers end.
class GsUsbBus {
 public:
  static constexpr std::chrono::milliseconds kCloseMax{100};

  GsUsbBus(const boost::asio::any_io_executor& executor, hal::Clock& clock);
  ~GsUsbBus();
  GsUsbBus(const GsUsbBus&) = delete;
  GsUsbBus& operator=(const GsUsbBus&) = delete;

  // Channels with the same serial number are of one adapter, which takes all that are asked for
  // before the event loop runs. Lives as long as the bus.
  GsUsbAdapter::Channel& channel(const GsUsbAddress& address);

 private:
  struct State;
  std::shared_ptr<State> state_;
};

}  // namespace drivers
