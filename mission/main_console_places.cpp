// Where operators sit: a serial line, and a UNIX socket with a bounded number of connections.
#include <fmt/format.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <boost/asio/experimental/awaitable_operators.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <filesystem>
#include <optional>

#include "drivers/kept_stream.hpp"
#include "drivers/serial_port.hpp"
#include "hal/together.hpp"
#include "hal/wake.hpp"
#include "mission/main_console.hpp"

namespace mission {
namespace {

namespace asio = boost::asio;
using asio::local::stream_protocol;
using boost::system::error_code;
using drivers::kUseTuple;

constexpr std::uint32_t kBaud = 115200;
constexpr hal::Duration kPlaceAgain = std::chrono::seconds(5);
constexpr hal::Duration kAcceptPause = std::chrono::seconds(1);
constexpr mode_t kMask = 0117;  // Leaves 0660.

// One connection.
class LocalStream final : public hal::ByteStream {
 public:
  explicit LocalStream(stream_protocol::socket& socket) : socket_(socket) {}

  hal::Task<hal::Result<void>> write(std::span<const std::uint8_t> bytes) override {
    const auto [error, size] =
        co_await asio::async_write(socket_, asio::buffer(bytes.data(), bytes.size()), kUseTuple);
    if (error) co_return failed(error);
    co_return hal::Result<void>{};
  }
  hal::Task<hal::Result<std::size_t>> read_some(std::span<std::uint8_t> into) override {
    const auto [error, size] =
        co_await socket_.async_read_some(asio::buffer(into.data(), into.size()), kUseTuple);
    if (error) co_return failed(error);
    co_return size;
  }

 private:
  static error_code failed(error_code error) {
    if (error == asio::error::operation_aborted) throw boost::system::system_error(error);
    return boost::system::errc::make_error_code(boost::system::errc::not_connected);
  }
  stream_protocol::socket& socket_;
};

// Root, or whoever runs this program, who could write the file of the password as well.
bool may_set_first_password(stream_protocol::socket& socket) {
  ucred peer{};
  socklen_t size = sizeof peer;
  if (::getsockopt(socket.native_handle(), SOL_SOCKET, SO_PEERCRED, &peer, &size) != 0)
    return false;
  return peer.uid == 0 || peer.uid == ::geteuid();
}

// Nobody listens any more on what a program left behind that was killed.
bool is_left_behind(const std::string& path) {
  asio::io_context io;
  stream_protocol::socket probe(io);
  error_code error;
  probe.connect(path, error);
  return error == asio::error::connection_refused;
}

error_code listen(stream_protocol::acceptor& acceptor, const std::string& path) {
  error_code error;
  std::error_code ignored;
  if (std::filesystem::is_socket(path, ignored) && is_left_behind(path)) ::unlink(path.c_str());
  acceptor.open(stream_protocol(), error);
  if (error) return error;
  const mode_t before = ::umask(kMask);
  acceptor.bind(path, error);
  ::umask(before);
  if (!error) acceptor.listen(ConsolePlaces::kConnectionsMax, error);
  if (error) acceptor.close();
  return error;
}

}  // namespace

struct ConsolePlaces::Socket {
  // Serves one connection at a time.
  struct Slot {
    std::optional<stream_protocol::socket> socket;
    hal::Wake taken;
  };
  struct Closing {
    Slot& slot;
    ~Closing() { slot.socket.reset(); }
  };

  Socket(const boost::asio::any_io_executor& executor, std::string its_path)
      : path(std::move(its_path)), acceptor(executor) {}
  ~Socket() {
    if (acceptor.is_open()) ::unlink(path.c_str());
  }

  Slot* free_slot() {
    for (Slot& slot : slots)
      if (!slot.socket) return &slot;
    return nullptr;
  }

  const std::string path;
  stream_protocol::acceptor acceptor;
  std::array<Slot, kConnectionsMax> slots;
};

namespace {

hal::Task<void> open(stream_protocol::acceptor& acceptor, const std::string& path,
                     hal::Clock& clock, ConsoleHub& hub) {
  std::string told;
  for (;;) {
    const error_code error = listen(acceptor, path);
    if (!error) co_return;
    if (told != error.message())
      hub.tell(
          fmt::format("no console at {}: {}; do: see that its folder is there and may be "
                      "written, and that no other program serves it",
                      path, error.message()));
    told = error.message();
    co_await clock.sleep_for(kPlaceAgain);
  }
}

void refuse(stream_protocol::socket& socket) {
  static constexpr std::string_view kBusy = "all consoles are taken: close another one\r\n";
  error_code ignored;
  socket.non_blocking(true, ignored);
  socket.write_some(asio::buffer(kBusy), ignored);
}

}  // namespace

ConsolePlaces::ConsolePlaces(ConsoleConfig config, const boost::asio::any_io_executor& executor,
                             hal::Clock& clock, ConsoleHub& hub)
    : config_(std::move(config)),
      executor_(executor),
      clock_(clock),
      hub_(hub),
      socket_(config_.socket.empty() ? nullptr
                                     : std::make_unique<Socket>(executor, config_.socket)) {}

ConsolePlaces::~ConsolePlaces() = default;

hal::Task<void> ConsolePlaces::run() {
  std::vector<hal::Task<void>> places;
  if (!config_.serial.empty()) places.push_back(serve_line());
  if (socket_) places.push_back(serve_socket());
  co_await hal::together(std::move(places));
}

hal::Task<void> ConsolePlaces::serve_line() {
  const drivers::SerialLine line{.path = config_.serial, .baud = kBaud};
  drivers::SerialPort port(line, executor_, clock_);
  const ConsoleHub::Who who{ConsoleHub::Link::line, true};
  co_await hub_.serve(port, who);
}

hal::Task<void> ConsolePlaces::serve_socket() {
  const auto serve = [](Socket::Slot& slot, ConsoleHub& hub) -> hal::Task<void> {
    for (;;) {
      while (!slot.socket) co_await slot.taken.wait();
      {
        const Socket::Closing closing{slot};  // Also when cancelled.
        LocalStream stream(*slot.socket);
        const ConsoleHub::Who who{ConsoleHub::Link::connection,
                                  may_set_first_password(*slot.socket)};
        co_await hub.serve(stream, who);
      }
    }
  };
  const auto accept = [](Socket& place, hal::Clock& clock, ConsoleHub& hub) -> hal::Task<void> {
    co_await open(place.acceptor, place.path, clock, hub);
    for (;;) {
      auto [error, socket] = co_await place.acceptor.async_accept(kUseTuple);
      if (error == asio::error::operation_aborted) throw boost::system::system_error(error);
      if (error) {
        co_await clock.sleep_for(kAcceptPause);
        continue;
      }
      Socket::Slot* const slot = place.free_slot();
      if (slot == nullptr) {
        refuse(socket);
        continue;
      }
      slot->socket = std::move(socket);
      slot->taken.notify();
    }
  };
  std::vector<hal::Task<void>> all;
  all.push_back(accept(*socket_, clock_, hub_));
  for (Socket::Slot& slot : socket_->slots) all.push_back(serve(slot, hub_));
  co_await hal::together(std::move(all));
}

}  // namespace mission
