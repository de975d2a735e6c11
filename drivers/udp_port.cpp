#include "drivers/udp_port.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/ip/udp.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <cerrno>
#include <cstring>
#include <optional>

#include "drivers/kept_stream.hpp"
#include "drivers/kernel_stamp.hpp"

namespace drivers {
namespace {

namespace asio = boost::asio;
namespace errc = boost::system::errc;
using asio::ip::udp;
using boost::system::error_code;

bool set(int socket, int name, int value) {
  return setsockopt(socket, SOL_SOCKET, name, &value, sizeof value) == 0;
}

}  // namespace

struct UdpPort::State {
  State(const asio::any_io_executor& executor, hal::Clock& its_clock)
      : socket(executor), clock(its_clock) {}

  void open(const UdpAddress& address);
  // Nothing while none is there.
  std::optional<hal::Result<Received>> take(std::span<std::uint8_t> into);

  udp::socket socket;
  hal::Clock& clock;
  std::optional<Trouble> trouble;
  BackOff pause{std::chrono::milliseconds(200), std::chrono::seconds(5)};
  in_addr_t from = INADDR_ANY;
  std::uint64_t lost{}, strange{};
  std::uint32_t lost_counted{};  // The kernel's counter, which wraps.
};

void UdpPort::State::open(const UdpAddress& address) {
  error_code error;
  socket.close(error);
  socket.open(udp::v4(), error);
  if (!error) {
    const int handle = socket.native_handle();
    if (!set(handle, SO_RCVBUFFORCE, kReceiveBuffer)) set(handle, SO_RCVBUF, kReceiveBuffer);
    set(handle, SO_TIMESTAMPNS, 1);
    set(handle, SO_RXQ_OVFL, 1);
    socket.non_blocking(true, error);
  }
  if (!error) socket.bind(udp::endpoint(udp::v4(), address.port), error);
  trouble.reset();
  lost_counted = 0;
  if (!address.from.empty()) from = inet_addr(address.from.c_str());
  if (!error) return;
  trouble = trouble_of(error, to_text(LinkAddress(address)));
  error_code ignored;
  socket.close(ignored);
}

std::optional<hal::Result<hal::Datagrams::Received>> UdpPort::State::take(
    std::span<std::uint8_t> into) {
  sockaddr_in sender{};
  alignas(cmsghdr) char control[128];
  iovec part{into.data(), into.size()};
  msghdr message{};
  message.msg_name = &sender;
  message.msg_namelen = sizeof sender;
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  message.msg_control = control;
  message.msg_controllen = sizeof control;
  const auto size = recvmsg(socket.native_handle(), &message, 0);
  if (size < 0 && (errno == EAGAIN || errno == EINTR)) return std::nullopt;
  if (size < 0) return hal::Result<Received>(error_code(errno, boost::system::system_category()));
  const KernelNotes notes = read_notes(message);
  if (notes.dropped) {
    lost += *notes.dropped - lost_counted;
    lost_counted = *notes.dropped;
  }
  if (from != INADDR_ANY && sender.sin_addr.s_addr != from) {
    ++strange;
    return std::nullopt;
  }
  if ((message.msg_flags & MSG_TRUNC) != 0)
    return hal::Result<Received>(errc::make_error_code(errc::message_size));
  return hal::Result<Received>(Received{clock.now() - notes.age, static_cast<std::size_t>(size)});
}

UdpPort::UdpPort(UdpAddress address, const asio::any_io_executor& executor, hal::Clock& clock)
    : address_(std::move(address)), state_(std::make_shared<State>(executor, clock)) {
  state_->open(address_);
}

UdpPort::~UdpPort() {
  error_code ignored;
  state_->socket.close(ignored);
}

hal::Task<hal::Result<hal::Datagrams::Received>> UdpPort::receive(std::span<std::uint8_t> into) {
  const auto state = state_;
  for (;;) {
    if (!state->socket.is_open()) {
      co_await state->clock.sleep_for(state->pause.next());
      state->open(address_);
      continue;
    }
    if (auto taken = state->take(into)) co_return std::move(*taken);
    // Whoever floods us from elsewhere must not keep the loop to itself: this waits each time.
    const auto [error] = co_await state->socket.async_wait(udp::socket::wait_read, kUseTuple);
    if (error) throw boost::system::system_error(error);
  }
}

std::vector<Trouble> UdpPort::troubles() const {
  return state_->trouble ? std::vector{*state_->trouble} : std::vector<Trouble>{};
}
std::uint64_t UdpPort::lost_datagrams() const {
  return state_->lost;
}
std::uint64_t UdpPort::strange_datagrams() const {
  return state_->strange;
}

}  // namespace drivers
