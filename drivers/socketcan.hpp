// A CAN interface of the kernel: SocketCAN with raw frames.
#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <memory>
#include <vector>

#include "drivers/link_address.hpp"
#include "drivers/link_trouble.hpp"
#include "drivers/rtnetlink_codec.hpp"
#include "hal/clock.hpp"
#include "hal/links.hpp"

namespace drivers {

// Follows its interface: found again when it was removed and came back, usable while it is up and
// not bus off. Whoever starts the interface sets the bit rate.
//
// The kernel gets one frame at a time: the next only when the controller confirmed that one. A
// frame given to the controller cannot be recalled: when send() fails with errc::timed_out because
// nobody acknowledged in time, that one frame may still go when somebody does; later ones that
// timed out never go. Where the interface's driver does not say when (`ip link` shows no ECHO), a
// frame counts as confirmed once the kernel has it. Up to kReceivedMax received frames wait; then
// the newest is lost, and counted.
class SocketCan final : public hal::CanBus, public Link {
 public:
  static constexpr std::size_t kReceivedMax = 1024;

  // Receives what passes the filters (hal::passes), which the kernel applies.
  SocketCan(CanAddress address, const boost::asio::any_io_executor& executor, hal::Clock& clock,
            std::vector<hal::CanFilter> filters = {});
  ~SocketCan() override;

  hal::Task<hal::Result<void>> send(hal::CanFrame frame, hal::Time deadline) override;
  hal::Task<hal::Result<hal::ReceivedFrame>> receive() override;

  std::string address() const override { return to_text(LinkAddress(address_)); }
  std::vector<Trouble> troubles() const override;
  // What the kernel says of it: bit rate, error counters. Empty name: it is not there.
  const rtnetlink::Interface& interface() const;
  std::uint64_t lost_frames() const;

 private:
  struct State;
  CanAddress address_;
  std::shared_ptr<State> state_;
};

}  // namespace drivers
