#include "tools/served_links.hpp"

#include <fcntl.h>
#include <stdlib.h>
#include <unistd.h>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ip/udp.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/asio/write.hpp>
#include <optional>
#include <system_error>

#include "drivers/serial_port.hpp"
#include "hal/wake.hpp"
#include "sim/uart.hpp"

namespace vantage {

namespace asio = boost::asio;
using asio::ip::tcp;

struct ServedTcp::State {
  State(const asio::any_io_executor& executor, std::uint16_t port)
      : acceptor(executor, {asio::ip::address_v4::loopback(), port}) {}

  tcp::acceptor acceptor;
  std::shared_ptr<tcp::socket> client;
  hal::Wake came;
  bool closed = false;

  static asio::awaitable<void> accept(std::shared_ptr<State> self) {
    for (;;) {
      boost::system::error_code error;
      tcp::socket socket =
          co_await self->acceptor.async_accept(asio::redirect_error(asio::use_awaitable, error));
      if (self->closed || error == asio::error::operation_aborted) co_return;
      if (error) continue;
      if (self->client) self->client->close(error);
      self->client = std::make_shared<tcp::socket>(std::move(socket));
      self->client->set_option(tcp::no_delay(true), error);
      self->came.notify();
    }
  }
};

ServedTcp::ServedTcp(const asio::any_io_executor& executor, std::uint16_t port)
    : state_(std::make_shared<State>(executor, port)) {
  asio::co_spawn(executor, State::accept(state_), [](std::exception_ptr error) {
    if (error) std::rethrow_exception(error);
  });
}

ServedTcp::~ServedTcp() {
  state_->closed = true;
  boost::system::error_code ignored;
  state_->acceptor.close(ignored);
}

std::uint16_t ServedTcp::port() const {
  return state_->acceptor.local_endpoint().port();
}

hal::Task<hal::Result<void>> ServedTcp::write(std::span<const std::uint8_t> bytes) {
  const auto client = state_->client;
  if (!client) co_return hal::Result<void>{};
  boost::system::error_code error;
  co_await asio::async_write(*client, asio::buffer(bytes.data(), bytes.size()),
                             asio::redirect_error(asio::use_awaitable, error));
  if (error && state_->client == client) state_->client.reset();
  co_return hal::Result<void>{};
}

hal::Task<hal::Result<std::size_t>> ServedTcp::read_some(std::span<std::uint8_t> into) {
  for (;;) {
    const auto client = state_->client;
    if (!client) {
      co_await state_->came.wait();
      continue;
    }
    boost::system::error_code error;
    const std::size_t count = co_await client->async_read_some(
        asio::buffer(into.data(), into.size()), asio::redirect_error(asio::use_awaitable, error));
    if (!error) co_return count;
    if (state_->client == client) state_->client.reset();
  }
}

struct ServedPty::State final : hal::ByteStream {
  asio::posix::stream_descriptor master;
  int slave = -1;  // Kept open, so that a client's leaving is no end.
  sim::Uart uart;

  State(const asio::any_io_executor& executor, int baud) : master(executor), uart(*this, baud) {}
  ~State() override {
    if (slave >= 0) ::close(slave);
  }

  hal::Task<hal::Result<void>> write(std::span<const std::uint8_t> bytes) override {
    boost::system::error_code error;
    // All that fits at once: nobody may be reading at the other end.
    master.write_some(asio::buffer(bytes.data(), bytes.size()), error);
    co_return hal::Result<void>{};
  }
  hal::Task<hal::Result<std::size_t>> read_some(std::span<std::uint8_t> into) override {
    boost::system::error_code error;
    const std::size_t count = co_await master.async_read_some(
        asio::buffer(into.data(), into.size()), asio::redirect_error(asio::use_awaitable, error));
    uart.set_host_baud(static_cast<int>(drivers::speed_of(slave)));
    if (error) co_return error;
    co_return count;
  }
};

ServedPty::ServedPty(const asio::any_io_executor& executor, std::filesystem::path link, int baud)
    : link_(std::move(link)), state_(std::make_unique<State>(executor, baud)) {
  const auto check = [](bool fine, const char* what) {
    if (!fine) throw std::system_error(errno, std::generic_category(), what);
  };
  const int master = ::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC);
  check(master >= 0, "opening a pseudo terminal");
  state_->master.assign(master);
  state_->master.non_blocking(true);
  check(::grantpt(master) == 0 && ::unlockpt(master) == 0, "opening a pseudo terminal");
  char name[64];
  check(::ptsname_r(master, name, sizeof name) == 0, "naming a pseudo terminal");
  state_->slave = ::open(name, O_RDWR | O_NOCTTY | O_CLOEXEC);
  check(state_->slave >= 0, "opening a pseudo terminal's far end");
  const drivers::SerialLine line{name, static_cast<std::uint32_t>(baud)};
  if (const auto error = drivers::apply_settings(state_->slave, line))
    throw std::system_error(error.value(), std::system_category(), "setting a pseudo terminal");
  std::filesystem::remove(link_);
  std::filesystem::create_symlink(name, link_);
}

ServedPty::~ServedPty() {
  std::error_code ignored;
  std::filesystem::remove(link_, ignored);
}

hal::Task<hal::Result<void>> ServedPty::write(std::span<const std::uint8_t> bytes) {
  state_->uart.set_host_baud(static_cast<int>(drivers::speed_of(state_->slave)));
  co_return co_await state_->uart.write(bytes);
}

hal::Task<hal::Result<std::size_t>> ServedPty::read_some(std::span<std::uint8_t> into) {
  co_return co_await state_->uart.read_some(into);
}

struct ServedUdp::State {
  asio::ip::udp::socket socket;
  asio::ip::udp::endpoint to;

  explicit State(const asio::any_io_executor& executor) : socket(executor, asio::ip::udp::v4()) {
    asio::ip::udp::socket finder(executor, {asio::ip::address_v4::loopback(), 0});
    to = finder.local_endpoint();
    socket.non_blocking(true);
  }
};

ServedUdp::ServedUdp(const asio::any_io_executor& executor)
    : state_(std::make_unique<State>(executor)) {}

ServedUdp::~ServedUdp() = default;

std::uint16_t ServedUdp::port() const {
  return state_->to.port();
}

// What nobody takes is lost, as on a network.
hal::Task<void> ServedUdp::send(std::span<const std::uint8_t> datagram) {
  boost::system::error_code ignored;
  state_->socket.send_to(asio::buffer(datagram.data(), datagram.size()), state_->to, 0, ignored);
  co_return;
}

}  // namespace vantage
