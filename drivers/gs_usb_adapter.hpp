// CAN channels of one gs_usb adapter (candleLight and kin), run from user space.
#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <functional>
#include <memory>
#include <variant>

#include "drivers/link_trouble.hpp"
#include "drivers/usb_pipe.hpp"
#include "hal/clock.hpp"
#include "hal/links.hpp"

namespace drivers {

// Starts the adapter's channels from a reset, follows it through unplugging, and restarts a channel
// that went bus off after 100 ms, at most five times a minute.
class GsUsbAdapter {
 public:
  using Opened = std::variant<std::shared_ptr<UsbPipe>, Trouble>;
  using Open = std::function<hal::Task<Opened>()>;

  static constexpr std::size_t kReceivedMax = 1024;

  // A frame of which the deadline passes before somebody acknowledged it is recalled by restarting
  // the channel. Up to kReceivedMax received frames wait; then the newest is lost, and counted.
  class Channel : public hal::CanBus, public Link {
   public:
    virtual std::uint64_t lost_frames() const = 0;  // Here, and whenever the adapter tells of it.
    virtual std::uint64_t restarts() const = 0;
  };

  // `open` finds the adapter and claims it, or says what is wrong; it is asked again after a pause,
  // and at once when look_again() is called.
  GsUsbAdapter(Open open, const boost::asio::any_io_executor& executor, hal::Clock& clock);
  ~GsUsbAdapter();
  GsUsbAdapter(const GsUsbAdapter&) = delete;
  GsUsbAdapter& operator=(const GsUsbAdapter&) = delete;

  // For each channel once, before the event loop runs; lives as long as the adapter. `address` is
  // how the channel calls itself.
  Channel& channel(std::uint8_t number, std::uint32_t bit_rate_bps, std::string address);
  void look_again();

 private:
  struct State;
  class AChannel;
  std::shared_ptr<State> state_;
};

}  // namespace drivers
