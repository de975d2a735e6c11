// A UDP port on which a device's datagrams arrive, stamped by the kernel.
#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <cstdint>
#include <memory>

#include "drivers/link_address.hpp"
#include "drivers/link_trouble.hpp"
#include "hal/clock.hpp"
#include "hal/links.hpp"

namespace drivers {

// The kernel keeps up to kReceiveBuffer bytes (or what net.core.rmem_max allows) while we are busy;
// then the newest datagrams are lost, and counted. One coroutine receives.
class UdpPort final : public hal::Datagrams, public Link {
 public:
  static constexpr int kReceiveBuffer = 8 << 20;

  // Opens the port at once; while that fails, receive() tries again.
  UdpPort(UdpAddress address, const boost::asio::any_io_executor& executor, hal::Clock& clock);
  ~UdpPort() override;

  // Datagrams from another host than the address names are passed over, and counted.
  hal::Task<hal::Result<Received>> receive(std::span<std::uint8_t> into) override;

  std::string address() const override { return to_text(LinkAddress(address_)); }
  std::vector<Trouble> troubles() const override;
  std::uint64_t lost_datagrams() const;     // By the kernel, because we were too slow.
  std::uint64_t strange_datagrams() const;  // From elsewhere.

 private:
  struct State;
  UdpAddress address_;
  std::shared_ptr<State> state_;
};

}  // namespace drivers
