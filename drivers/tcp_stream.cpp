#include "drivers/tcp_stream.hpp"

#include <netinet/tcp.h>
#include <sys/socket.h>

#include <boost/asio/connect.hpp>
#include <boost/asio/experimental/awaitable_operators.hpp>
#include <boost/asio/ip/tcp.hpp>

#include "drivers/kept_stream.hpp"

namespace drivers {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;
using namespace asio::experimental::awaitable_operators;

struct Option {
  int level, name, value;
};
constexpr Option kOptions[] = {
    {IPPROTO_TCP, TCP_NODELAY, 1},  {SOL_SOCKET, SO_KEEPALIVE, 1},
    {IPPROTO_TCP, TCP_KEEPIDLE, 5}, {IPPROTO_TCP, TCP_KEEPINTVL, 2},
    {IPPROTO_TCP, TCP_KEEPCNT, 3},  {IPPROTO_TCP, TCP_USER_TIMEOUT, 11'000},
};

void apply_options(tcp::socket& socket) {
  for (const Option& option : kOptions)  // All are known to every kernel since 2.6.37.
    setsockopt(socket.native_handle(), option.level, option.name, &option.value,
               sizeof option.value);
}

hal::Task<error_code> connect(tcp::socket& socket, const TcpAddress& address) {
  tcp::resolver resolver(socket.get_executor());
  const auto [unresolved, endpoints] =
      co_await resolver.async_resolve(address.host, std::to_string(address.port), kUseTuple);
  if (unresolved) co_return unresolved;
  const auto [refused, endpoint] = co_await asio::async_connect(socket, endpoints, kUseTuple);
  if (refused) co_return refused;
  // A port of this machine that nobody listens on can be given to our own end.
  error_code ignored;
  if (socket.local_endpoint(ignored) == socket.remote_endpoint(ignored))
    co_return asio::error::connection_refused;
  co_return error_code{};
}

hal::Task<KeptStream<tcp::socket>::Opened> open(TcpAddress address, hal::Clock& clock) {
  const auto executor = co_await asio::this_coro::executor;
  auto socket = std::make_shared<tcp::socket>(executor);
  const auto ended =
      co_await (connect(*socket, address) || clock.sleep_for(TcpStream::kConnectTimeout));
  const error_code error =
      ended.index() == 0 ? std::get<0>(ended) : make_error_code(asio::error::timed_out);
  if (error) co_return trouble_of(error, to_text(LinkAddress(address)));
  apply_options(*socket);
  co_return socket;
}

}  // namespace

struct TcpStream::State : KeptStream<tcp::socket> {
  using KeptStream::KeptStream;
};

TcpStream::TcpStream(TcpAddress address, const asio::any_io_executor& executor, hal::Clock& clock)
    : address_(std::move(address)),
      state_(std::make_shared<State>(
          clock, [address = address_, &clock] { return open(address, clock); })) {
  State::start(state_, executor);
}

TcpStream::~TcpStream() {
  state_->stop();
}

hal::Task<hal::Result<void>> TcpStream::write(std::span<const std::uint8_t> bytes) {
  return State::write(state_, bytes);
}
hal::Task<hal::Result<std::size_t>> TcpStream::read_some(std::span<std::uint8_t> into) {
  return State::read_some(state_, into);
}

std::vector<Trouble> TcpStream::troubles() const {
  const auto& trouble = state_->trouble();
  return trouble ? std::vector{*trouble} : std::vector<Trouble>{};
}

std::string TcpStream::own_address() const {
  if (!connected()) return {};
  error_code error;
  const auto end = state_->stream()->local_endpoint(error);
  return error ? std::string() : end.address().to_string();
}

void TcpStream::drop() {
  state_->drop();
}

bool TcpStream::connected() const {
  return state_->stream() != nullptr;
}

}  // namespace drivers
