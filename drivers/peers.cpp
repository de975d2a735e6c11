#include "drivers/peers.hpp"

#include <fcntl.h>
#include <stdlib.h>
#include <termios.h>
#include <unistd.h>

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ip/udp.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <cerrno>

#include "drivers/kept_stream.hpp"

namespace drivers {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using asio::ip::udp;
using asio::posix::stream_descriptor;
using boost::system::error_code;

// Whoever waits for others to come needs no pause.
const BackOff kAtOnce(std::chrono::milliseconds(1), std::chrono::milliseconds(10));

}  // namespace

// --- TCP.

struct TcpPeer::State : KeptStream<tcp::socket> {
  State(const std::string& address, std::uint16_t port, const asio::any_io_executor& executor,
        hal::Clock& clock)
      : KeptStream(
            clock, [this] { return accept(*this); }, kAtOnce),
        endpoint(asio::ip::make_address(address), port),
        acceptor(executor) {
    listen();
  }

  void listen() {
    error_code error;
    acceptor.open(endpoint.protocol(), error);
    acceptor.set_option(tcp::acceptor::reuse_address(true), error);
    acceptor.bind(endpoint, error);
    if (!error) acceptor.listen(1, error);
    if (error) listen_trouble = trouble_of(error, "listening");
    if (!error) endpoint = acceptor.local_endpoint();
  }

  // Each caller is the loop that keeps `self` alive.
  static hal::Task<Opened> accept(State& self) {
    while (!self.acceptor.is_open()) co_await self.plugged.wait();
    const auto socket = std::make_shared<tcp::socket>(self.acceptor.get_executor());
    const auto [error] = co_await self.acceptor.async_accept(*socket, kUseTuple);
    if (error) co_return trouble_of(error, "accepting");
    error_code ignored;
    socket->set_option(tcp::no_delay(true), ignored);
    co_return socket;
  }

  tcp::endpoint endpoint;
  tcp::acceptor acceptor;
  hal::Wake plugged;
  std::optional<Trouble> listen_trouble;
};

TcpPeer::TcpPeer(const std::string& address, std::uint16_t port,
                 const asio::any_io_executor& executor, hal::Clock& clock)
    : state_(std::make_shared<State>(address, port, executor, clock)) {
  State::start(state_, executor);
}
TcpPeer::~TcpPeer() {
  state_->stop();
  state_->plugged.drop();
}

hal::Task<hal::Result<void>> TcpPeer::write(std::span<const std::uint8_t> bytes) {
  return State::write(state_, bytes);
}
hal::Task<hal::Result<std::size_t>> TcpPeer::read_some(std::span<std::uint8_t> into) {
  return State::read_some(state_, into);
}
std::uint16_t TcpPeer::port() const {
  return state_->listen_trouble ? 0 : state_->endpoint.port();
}

void TcpPeer::unplug() {
  error_code ignored;
  state_->acceptor.close(ignored);
  state_->drop();
}
void TcpPeer::plug_in() {
  if (!state_->acceptor.is_open()) state_->listen();
  state_->plugged.notify();
}

// --- Pseudo terminals.

struct PtyPeer::State : KeptStream<stream_descriptor> {
  State(std::string its_path, hal::Clock& clock)
      : KeptStream(
            clock, [this] { return open_pty(*this); }, kAtOnce),
        path(std::move(its_path)) {}

  static hal::Task<Opened> open_pty(State& self) {
    while (!self.plugged_in) co_await self.plugged.wait();
    const auto executor = co_await asio::this_coro::executor;
    const int master = posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    if (master < 0) co_return trouble_of({errno, boost::system::system_category()}, self.path);
    const auto stream = std::make_shared<stream_descriptor>(executor, master);
    if (const int error = self.publish(master); error != 0)
      co_return trouble_of({error, boost::system::system_category()}, self.path);
    co_return stream;
  }

  // errno, or 0.
  int publish(int master) {
    char name[64];
    if (grantpt(master) != 0 || unlockpt(master) != 0 || ptsname_r(master, name, sizeof name) != 0)
      return errno;
    // Held open, so that we are not hung up on while nobody uses the port.
    slave = ::open(name, O_RDWR | O_NOCTTY | O_CLOEXEC);
    if (slave < 0) return errno;
    termios raw{};
    tcgetattr(slave, &raw);
    cfmakeraw(&raw);
    tcsetattr(slave, TCSANOW, &raw);
    unlink(path.c_str());
    return symlink(name, path.c_str()) == 0 ? 0 : errno;
  }

  void pull() {
    unlink(path.c_str());
    if (slave >= 0) close(std::exchange(slave, -1));
    drop();
  }

  std::string path;
  int slave = -1;
  bool plugged_in = true;
  hal::Wake plugged;
};

PtyPeer::PtyPeer(std::string path, const asio::any_io_executor& executor, hal::Clock& clock)
    : state_(std::make_shared<State>(std::move(path), clock)) {
  State::start(state_, executor);
}
PtyPeer::~PtyPeer() {
  state_->pull();
  state_->stop();
  state_->plugged.drop();
}

hal::Task<hal::Result<void>> PtyPeer::write(std::span<const std::uint8_t> bytes) {
  return State::write(state_, bytes);
}
hal::Task<hal::Result<std::size_t>> PtyPeer::read_some(std::span<std::uint8_t> into) {
  return State::read_some(state_, into);
}

void PtyPeer::unplug() {
  state_->plugged_in = false;
  state_->pull();
}
void PtyPeer::plug_in() {
  state_->plugged_in = true;
  state_->plugged.notify();
}

// --- UDP.

struct UdpSender::State {
  udp::endpoint to;
  udp::socket socket;
};

UdpSender::UdpSender(const std::string& host_ipv4, std::uint16_t port,
                     const asio::any_io_executor& executor)
    : state_(std::make_unique<State>(
          State{{asio::ip::make_address_v4(host_ipv4), port}, udp::socket(executor, udp::v4())})) {
  error_code ignored;
  state_->socket.non_blocking(true, ignored);
}
UdpSender::~UdpSender() = default;

void UdpSender::send(std::span<const std::uint8_t> datagram) {
  error_code ignored;
  state_->socket.send_to(asio::buffer(datagram.data(), datagram.size()), state_->to, 0, ignored);
}

}  // namespace drivers
