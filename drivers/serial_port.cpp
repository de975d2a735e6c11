#include "drivers/serial_port.hpp"

#include <fcntl.h>
#include <linux/serial.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/this_coro.hpp>
#include <cerrno>

#include "drivers/kept_stream.hpp"

namespace drivers {
namespace {

using boost::asio::posix::stream_descriptor;
using boost::system::error_code;

std::optional<SerialErrors> count_errors(int port) {
  serial_icounter_struct counted{};
  if (ioctl(port, TIOCGICOUNT, &counted) != 0) return std::nullopt;
  return SerialErrors{static_cast<std::uint32_t>(counted.frame),
                      static_cast<std::uint32_t>(counted.parity),
                      static_cast<std::uint32_t>(counted.brk),
                      static_cast<std::uint32_t>(counted.overrun + counted.buf_overrun)};
}

// USB adapters gather bytes for 16 ms unless told not to. Whoever cannot do that is as fast as can
// be.
void ask_for_low_latency(int port) {
  serial_struct serial{};
  if (ioctl(port, TIOCGSERIAL, &serial) != 0) return;
  serial.flags |= ASYNC_LOW_LATENCY;
  ioctl(port, TIOCSSERIAL, &serial);
}

// Locked for us alone as long as it is open.
class LockedPort : public stream_descriptor {
 public:
  using stream_descriptor::stream_descriptor;
  ~LockedPort() { unlock(); }

  error_code lock() {
    const error_code error = lock_port(native_handle());
    locked_ = !error;
    return error;
  }
  void close(error_code& error) {
    unlock();
    stream_descriptor::close(error);
  }

 private:
  void unlock() {
    if (std::exchange(locked_, false)) unlock_port(native_handle());
  }

  bool locked_ = false;  // Who did not lock it leaves it to whoever did.
};

error_code prepare(LockedPort& port, const SerialLine& line) {
  if (const error_code error = port.lock()) return error;
  if (const error_code error = apply_settings(port.native_handle(), line)) return error;
  ask_for_low_latency(port.native_handle());
  return {};
}

}  // namespace

struct SerialPort::State : KeptStream<LockedPort> {
  using KeptStream::KeptStream;
};

namespace {

hal::Task<KeptStream<LockedPort>::Opened> open_port(SerialLine line, std::string address) {
  const auto executor = co_await boost::asio::this_coro::executor;
  const int port = ::open(line.path.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (port < 0) co_return trouble_of({errno, boost::system::system_category()}, address, line.path);
  auto stream = std::make_shared<LockedPort>(executor, port);
  if (const error_code error = prepare(*stream, line))
    co_return trouble_of(error, address, line.path);
  co_return stream;
}

}  // namespace

SerialPort::SerialPort(SerialLine line, const boost::asio::any_io_executor& executor,
                       hal::Clock& clock)
    : line_(std::move(line)),
      state_(std::make_shared<State>(clock, [line = line_, address = SerialPort::address()] {
        return open_port(line, address);
      })) {
  State::start(state_, executor);
}

SerialPort::~SerialPort() {
  state_->stop();
}

hal::Task<hal::Result<void>> SerialPort::write(std::span<const std::uint8_t> bytes) {
  return State::write(state_, bytes);
}
hal::Task<hal::Result<std::size_t>> SerialPort::read_some(std::span<std::uint8_t> into) {
  return State::read_some(state_, into);
}

hal::Result<void> SerialPort::set_baud(int baud) {
  const auto& port = state_->stream();
  if (!port) return boost::system::errc::make_error_code(boost::system::errc::not_connected);
  SerialLine line = line_;
  line.baud = static_cast<std::uint32_t>(baud);
  if (const error_code error = apply_settings(port->native_handle(), line)) return error;
  return {};
}

std::vector<Trouble> SerialPort::troubles() const {
  const auto& trouble = state_->trouble();
  return trouble ? std::vector{*trouble} : std::vector<Trouble>{};
}

bool SerialPort::connected() const {
  return state_->stream() != nullptr;
}

std::optional<SerialErrors> SerialPort::errors() const {
  const auto& port = state_->stream();
  return port ? count_errors(port->native_handle()) : std::nullopt;
}

}  // namespace drivers
