// can_talk LINK [--agilex]: a CAN link of ours as lines of text, for tests against programs that we
// did not write; with what the AgileX driver needs to hear, or with everything. Says "frame
// 123#DEADBEEF" for what it hears, "lost" and "back", "trouble NAME" or "trouble none" when that
// changes; sends what stands on standard input, one frame a line, as cansend takes it, and says
// "sent FRAME" or "failed FRAME: WHY". Ends with its input.
#include <fmt/format.h>
#include <unistd.h>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/experimental/awaitable_operators.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/read_until.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <charconv>
#include <cstdio>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "drivers/agilex_drive.hpp"
#include "drivers/gs_usb.hpp"
#include "drivers/real_clock.hpp"
#include "drivers/socketcan.hpp"
#include "hal/together.hpp"

namespace {

namespace asio = boost::asio;
using namespace std::chrono_literals;

constexpr hal::Duration kDeadline = 200ms;  // For a frame to be acknowledged.

void say(const std::string& line) {
  fmt::print("{}\n", line);
  std::fflush(stdout);
}

// As candump -L writes it, and cansend reads it.
std::string text_of(const hal::CanFrame& frame) {
  std::string text =
      frame.extended ? fmt::format("{:08X}#", frame.id) : fmt::format("{:03X}#", frame.id);
  if (frame.remote) return text + "R" + (frame.size > 0 ? fmt::format("{}", frame.size) : "");
  for (std::uint8_t i = 0; i < frame.size; ++i) text += fmt::format("{:02X}", frame.data[i]);
  return text;
}

std::uint32_t hex(std::string_view text) {
  std::uint32_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, 16);
  if (error != std::errc() || end != text.data() + text.size() || text.empty())
    throw std::invalid_argument("not hexadecimal: " + std::string(text));
  return value;
}

hal::CanFrame frame_of(const std::string& text) {
  const auto mark = text.find('#');
  if (mark == std::string::npos) throw std::invalid_argument("not ID#DATA: " + text);
  hal::CanFrame frame;
  frame.extended = mark > 3;
  frame.id = hex(text.substr(0, mark));
  std::string data = text.substr(mark + 1);
  if (data.starts_with('R')) {
    frame.remote = true;
    frame.size = data.size() > 1 ? static_cast<std::uint8_t>(hex(data.substr(1))) : 0;
    return frame;
  }
  for (; data.size() >= 2 && frame.size < 8; data.erase(0, 2))
    frame.data[frame.size++] = static_cast<std::uint8_t>(hex(data.substr(0, 2)));
  return frame;
}

struct Talk {
  hal::CanBus& bus;
  const drivers::Link& link;
  hal::Clock& clock;
  asio::io_context& io;

  hal::Task<void> hear() {
    for (bool lost = false;;) {
      const auto received = co_await bus.receive();
      if (!received) {
        lost = true;
        say("lost");
        continue;
      }
      if (std::exchange(lost, false)) say("back");
      say("frame " + text_of(received->frame));
    }
  }
  hal::Task<void> watch() {
    for (std::string told;; co_await clock.sleep_for(20ms)) {
      const auto troubles = link.troubles();
      const std::string now(troubles.empty() ? "none" : troubles.front().fault->name);
      if (now == told) continue;
      say("trouble " + now);
      told = now;
    }
  }
  hal::Task<void> speak() {
    asio::posix::stream_descriptor input(io, ::dup(STDIN_FILENO));
    std::string buffer;
    for (;;) {
      boost::system::error_code error;
      const std::size_t size =
          co_await asio::async_read_until(input, asio::dynamic_buffer(buffer, 1024), '\n',
                                          asio::redirect_error(asio::use_awaitable, error));
      if (error) co_return;
      const std::string line = buffer.substr(0, size - 1);
      buffer.erase(0, size);
      const auto sent = co_await bus.send(frame_of(line), clock.now() + kDeadline);
      say(sent ? "sent " + line : "failed " + line + ": " + sent.error().message());
    }
  }
  hal::Task<void> hear_and_watch() { co_await hal::first_of(hear(), watch()); }
  hal::Task<void> all() { co_await hal::first_of(speak(), hear_and_watch()); }
};

int run(const std::string& text, std::span<const hal::CanFilter> filters) {
  const auto parsed = drivers::parse_link_address(text);
  if (const auto* error = std::get_if<drivers::AddressError>(&parsed))
    throw std::invalid_argument(error->what);
  const auto& address = std::get<drivers::LinkAddress>(parsed);
  asio::io_context io{1};
  drivers::RealClock clock;
  std::unique_ptr<drivers::SocketCan> can;
  std::unique_ptr<drivers::GsUsbBus> usb;
  std::unique_ptr<Talk> talk;
  if (const auto* interface = std::get_if<drivers::CanAddress>(&address)) {
    can = std::make_unique<drivers::SocketCan>(
        *interface, io.get_executor(), clock,
        std::vector<hal::CanFilter>(filters.begin(), filters.end()));
    talk = std::make_unique<Talk>(*can, *can, clock, io);
  } else if (const auto* adapter = std::get_if<drivers::GsUsbAddress>(&address)) {
    if (!filters.empty()) throw std::invalid_argument(text + " does not filter");
    usb = std::make_unique<drivers::GsUsbBus>(io.get_executor(), clock);
    auto& channel = usb->channel(*adapter);
    talk = std::make_unique<Talk>(channel, channel, clock, io);
  } else {
    throw std::invalid_argument(text + " is no CAN bus");
  }
  int code = 0;
  asio::co_spawn(io, talk->all(), [&](std::exception_ptr error) {
    io.stop();
    try {
      if (error) std::rethrow_exception(error);
    } catch (const std::exception& e) {
      fmt::print(stderr, "can_talk: {}\n", e.what());
      code = 1;
    }
  });
  io.run();
  return code;
}

}  // namespace

int main(int argc, char** argv) {
  const bool agilex = argc == 3 && std::string_view(argv[2]) == "--agilex";
  if (argc != (agilex ? 3 : 2)) {
    fmt::print(stderr, "can_talk LINK [--agilex]: such as can:vcan0\n");
    return 2;
  }
  try {
    return run(argv[1],
               agilex ? drivers::AgilexDrive::filters() : std::span<const hal::CanFilter>());
  } catch (const std::exception& error) {
    fmt::print(stderr, "can_talk: {}\n", error.what());
    return 2;
  }
}
