// A serial port: 8 data bits, raw, for us alone; opened again whenever it was unplugged.
#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <memory>
#include <optional>

#include "drivers/link_address.hpp"
#include "drivers/link_trouble.hpp"
#include "hal/clock.hpp"
#include "hal/links.hpp"

namespace drivers {

// What the kernel counted at a port since its driver was loaded.
struct SerialErrors {
  std::uint32_t framing{}, parity{}, breaks{}, overruns{};
};

// Several may write, in turns; one reads.
class SerialPort final : public hal::ByteStream, public Link {
 public:
  // Begins to open at once. `clock` must outlive the event loop's last turn.
  SerialPort(SerialLine line, const boost::asio::any_io_executor& executor, hal::Clock& clock);
  ~SerialPort() override;

  hal::Task<hal::Result<void>> write(std::span<const std::uint8_t> bytes) override;
  hal::Task<hal::Result<std::size_t>> read_some(std::span<std::uint8_t> into) override;

  // Holds until the port is opened again, which is at the line's own rate. What was unread is gone.
  // Fails with errc::not_connected while it is lost, errc::invalid_argument for a rate that it does
  // not take, else as the system does.
  hal::Result<void> set_baud(int baud);

  std::string address() const override { return to_text(LinkAddress(SerialAddress{line_})); }
  std::vector<Trouble> troubles() const override;
  bool connected() const;
  // Nothing while lost, and for ports that do not count (pseudo terminals, some USB adapters).
  std::optional<SerialErrors> errors() const;

 private:
  struct State;
  SerialLine line_;
  std::shared_ptr<State> state_;
};

// Applies the line's settings to an open port and reads them back.
boost::system::error_code apply_settings(int port, const SerialLine& line);
// The speed that a port is set to, in baud; of a pseudo terminal also from its master's end. 0: it
// is no port.
std::uint32_t speed_of(int port);
// So that nobody else opens it or talks in between. Closing it is not enough to end that: the
// kernel keeps a port for one alone until everybody has closed it, and of a pseudo terminal its
// other end may hold it open for ever.
boost::system::error_code lock_port(int port);
// Before a port is closed that lock_port() has locked.
void unlock_port(int port);

}  // namespace drivers
