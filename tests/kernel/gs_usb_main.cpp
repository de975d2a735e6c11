// gs_usb_on_vhci [PORT]: plugs a simulated gs_usb adapter with two channels on one CAN bus into
// this machine's vhci_hcd. Killing it unplugs the adapter. SIGUSR1: nobody acknowledges any more;
// SIGUSR2: somebody does again; SIGHUP: channel 0 goes bus off.
#include <fmt/format.h>
#include <sys/socket.h>
#include <unistd.h>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/asio/write.hpp>
#include <csignal>
#include <cstdio>
#include <fstream>
#include <string>
#include <system_error>

#include "sim/usbip_server.hpp"

namespace {

namespace asio = boost::asio;
using Socket = asio::local::stream_protocol::socket;

class HostStream final : public hal::ByteStream {
 public:
  HostStream(asio::io_context& io, int handle)
      : socket_(io, asio::local::stream_protocol(), handle) {}

  hal::Task<hal::Result<void>> write(std::span<const std::uint8_t> bytes) override {
    boost::system::error_code error;
    co_await asio::async_write(socket_, asio::buffer(bytes.data(), bytes.size()),
                               asio::redirect_error(asio::use_awaitable, error));
    if (error) co_return error;
    co_return hal::Result<void>{};
  }
  hal::Task<hal::Result<std::size_t>> read_some(std::span<std::uint8_t> into) override {
    boost::system::error_code error;
    const std::size_t got = co_await socket_.async_read_some(
        asio::buffer(into.data(), into.size()), asio::redirect_error(asio::use_awaitable, error));
    if (error) co_return error;
    co_return got;
  }

 private:
  Socket socket_;
};

// Our end of a socket pair whose other end the kernel has.
int plug_in(int port) {
  constexpr unsigned kBusAndDevice = 1U << 16 | 2U, kHighSpeed = 3;
  int ends[2];
  if (::socketpair(AF_UNIX, SOCK_STREAM, 0, ends) != 0)
    throw std::system_error(errno, std::generic_category(), "socketpair");
  std::ofstream attach("/sys/devices/platform/vhci_hcd.0/attach");
  attach << fmt::format("{} {} {} {}", port, ends[1], kBusAndDevice, kHighSpeed) << std::flush;
  if (!attach) throw std::runtime_error("vhci_hcd does not take it: is the module loaded?");
  ::close(ends[1]);
  return ends[0];
}

class Orders {
 public:
  Orders(asio::io_context& io, sim::GsUsbUnit& unit)
      : unit_(unit), signals_(io, SIGUSR1, SIGUSR2, SIGHUP) {
    wait();
  }

 private:
  void wait() {
    signals_.async_wait([this](boost::system::error_code error, int number) {
      if (error) return;
      if (number == SIGHUP)
        unit_.go_bus_off(0);
      else
        unit_.silence(number == SIGUSR1);
      wait();
    });
  }
  sim::GsUsbUnit& unit_;
  asio::signal_set signals_;
};

int run(int port) {
  asio::io_context io{1};
  sim::GsUsbUnit unit;
  HostStream host(io, plug_in(port));
  sim::UsbipServer server(unit, host);
  const Orders orders(io, unit);
  asio::co_spawn(io, server.run(), [&](std::exception_ptr error) {
    io.stop();
    if (error) std::rethrow_exception(error);
  });
  io.run();
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc > 1 ? std::stoi(argv[1]) : 0);
  } catch (const std::exception& error) {
    fmt::print(stderr, "gs_usb_on_vhci: {}\n", error.what());
    return 1;
  }
}
