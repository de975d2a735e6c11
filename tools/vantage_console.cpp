// vantage console: an operator's terminal on a robot's UNIX socket.
#include <fmt/format.h>
#include <poll.h>
#include <sys/signalfd.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <memory>
#include <optional>

#include "mission/console.hpp"
#include "mission/console_keys.hpp"
#include "tools/vantage_command.hpp"

namespace vantage {
namespace {

constexpr char kLeave = 0x1D;  // Ctrl-]

struct ConsoleOptions {
  std::string socket = "/run/vantage/console.sock";
};

// Closes when it goes out of scope.
class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int get() const { return fd_; }

 private:
  int fd_;
};

// Every key at once, unchanged; as it was again when this goes, whatever the reason.
class RawTerminal {
 public:
  RawTerminal() {
    if (::tcgetattr(STDIN_FILENO, &before_) != 0)
      return;  // No terminal: a pipe is as it should be.
    termios raw = before_;
    ::cfmakeraw(&raw);
    changed_ = ::tcsetattr(STDIN_FILENO, TCSADRAIN, &raw) == 0;
  }
  ~RawTerminal() {
    if (changed_) ::tcsetattr(STDIN_FILENO, TCSANOW, &before_);  // Nothing to wait for.
  }
  RawTerminal(const RawTerminal&) = delete;
  RawTerminal& operator=(const RawTerminal&) = delete;

 private:
  termios before_{};
  bool changed_ = false;
};

int connected(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof address.sun_path)
    throw Refusal(fmt::format("the name of the socket is too long: {}", path));
  std::memcpy(address.sun_path, path.c_str(), path.size() + 1);
  const int fd = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (fd >= 0 && ::connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0)
    return fd;
  const int why = errno;
  if (fd >= 0) ::close(fd);
  throw Refusal(fmt::format(
      "no console at {}: {}; do: see that vantaged runs, that its robot file has this under "
      "[console] socket, and that you are in the socket's group",
      path, std::strerror(why)));
}

// What ends a program reaches it here instead, so that the terminal is restored.
int signals() {
  sigset_t set;
  sigemptyset(&set);
  for (const int number : {SIGINT, SIGTERM, SIGHUP, SIGQUIT}) sigaddset(&set, number);
  ::sigprocmask(SIG_BLOCK, &set, nullptr);
  std::signal(SIGPIPE, SIG_IGN);
  return ::signalfd(-1, &set, SFD_CLOEXEC);
}

bool send_all(int fd, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t sent = ::write(fd, bytes.data(), bytes.size());
    if (sent < 0 && errno == EINTR) continue;
    if (sent < 0) return false;
    bytes.remove_prefix(static_cast<std::size_t>(sent));
  }
  return true;
}

class Console {
 public:
  explicit Console(const std::string& path) : socket_(connected(path)), signals_(signals()) {}

  // Until either side ends it. What is to be said then.
  std::string run() {
    send_all(socket_.get(),
             std::string(1, static_cast<char>(mission::ConsoleSession::kNumbersKeys)));
    std::array<pollfd, 3> waits{
        {{socket_.get(), POLLIN, 0}, {signals_.get(), POLLIN, 0}, {STDIN_FILENO, POLLIN, 0}}};
    for (;;) {
      if (::poll(waits.data(), waits.size(), -1) < 0 && errno != EINTR) return "poll failed";
      if (waits[0].revents != 0 && !show()) return "the robot closed the console";
      if (waits[1].revents != 0) return "ended by a signal";
      if (waits[2].revents != 0 && !send_keys(waits[2])) return "left";
    }
  }

 private:
  bool show() {
    std::array<char, 4096> some{};
    const ssize_t size = ::read(socket_.get(), some.data(), some.size());
    if (size <= 0) return false;
    const std::string_view text(some.data(), static_cast<std::size_t>(size));
    keys_.hear(text);
    return send_all(STDOUT_FILENO, text);
  }

  // At the end of what is typed it waits for the last answer.
  bool send_keys(pollfd& keyboard) {
    std::array<char, 256> some{};
    const ssize_t size = ::read(STDIN_FILENO, some.data(), some.size());
    if (size <= 0) {
      keyboard.fd = -1;
      return ::shutdown(socket_.get(), SHUT_WR) == 0;
    }
    const std::string_view typed(some.data(), static_cast<std::size_t>(size));
    const std::size_t leave = typed.find(kLeave);
    return send_all(socket_.get(), keys_.send(typed.substr(0, leave))) &&
           leave == std::string_view::npos;
  }

  Descriptor socket_, signals_;
  mission::ConsoleKeys keys_;
};

int console_command(const ConsoleOptions& options) {
  Console console(options.socket);
  if (isatty(STDIN_FILENO) != 0)
    fmt::print(stderr, "vantage: connected to {}; Ctrl-] leaves\n", options.socket);
  std::string end;
  {
    const RawTerminal raw;
    end = console.run();
  }
  fmt::print(stderr, "\nvantage: {}\n", end);
  return kFine;
}

}  // namespace

void add_console_command(CLI::App& app, Run& run) {
  const auto options = std::make_shared<ConsoleOptions>();
  auto* command =
      app.add_subcommand("console", "An operator's terminal on the robot that runs here");
  command->footer(
      "Examples:\n"
      "  vantage console\n"
      "  vantage console --socket /run/vantage/console.sock\n"
      "  echo stop | vantage console\n"
      "Ctrl-] leaves. `stop` always stops the robot; what moves it needs `login`.");
  command->add_option("--socket", options->socket, "As the robot file has it, [console] socket")
      ->capture_default_str();
  command->callback([options, &run] {
    run = [options] { return answer(false, [&] { return console_command(*options); }); };
  });
}

}  // namespace vantage
