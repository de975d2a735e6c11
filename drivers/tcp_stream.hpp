// A TCP connection to a device, made again whenever it was lost.
#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <memory>

#include "drivers/link_address.hpp"
#include "drivers/link_trouble.hpp"
#include "hal/clock.hpp"
#include "hal/links.hpp"

namespace drivers {

// Without delay for small messages. A peer that falls silent without a farewell (power cut) is
// noticed after about 11 s. Several may write, in turns; one reads.
class TcpStream final : public hal::ByteStream, public Link {
 public:
  static constexpr std::chrono::seconds kConnectTimeout{3};

  // Begins to connect at once. `clock` must outlive the event loop's last turn.
  TcpStream(TcpAddress address, const boost::asio::any_io_executor& executor, hal::Clock& clock);
  ~TcpStream() override;

  hal::Task<hal::Result<void>> write(std::span<const std::uint8_t> bytes) override;
  hal::Task<hal::Result<std::size_t>> read_some(std::span<std::uint8_t> into) override;

  std::string address() const override { return to_text(LinkAddress(address_)); }
  std::vector<Trouble> troubles() const override;
  bool connected() const;
  std::string own_address() const;  // This side's IP address, as the peer sees it; empty: lost.
  void drop();  // Ends the connection, to be made anew; whoever reads is told of the loss.

 private:
  struct State;
  TcpAddress address_;
  std::shared_ptr<State> state_;
};

}  // namespace drivers
