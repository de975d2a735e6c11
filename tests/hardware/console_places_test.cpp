// Where operators sit, in real time: a serial line on a pseudo terminal, a UNIX socket, and
// `vantage console`.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <pty.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <termios.h>
#include <unistd.h>

#include <boost/asio/bind_cancellation_slot.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <fstream>
#include <memory>

#include "drivers/real_clock.hpp"
#include "drivers/serial_port.hpp"
#include "mission/main_console.hpp"
#include "tests/mission/console_talk.hpp"
#include "tests/support/temp_folder.hpp"

namespace {

using namespace console_test;
using testing::HasSubstr;
using testing::Not;

// The other end of a link: read and written without waiting.
class Peer {
 public:
  explicit Peer(int fd) : fd_(fd) { fcntl(fd_, F_SETFL, O_NONBLOCK); }
  ~Peer() { ::close(fd_); }
  Peer(const Peer&) = delete;
  Peer& operator=(const Peer&) = delete;

  // As much as it takes.
  std::size_t type(std::string_view text) {
    const ssize_t size = ::write(fd_, text.data(), text.size());
    return size > 0 ? static_cast<std::size_t>(size) : 0;
  }
  const std::string& shown() {
    char some[4096];
    for (ssize_t size; (size = ::read(fd_, some, sizeof some)) > 0;)
      shown_.append(some, static_cast<std::size_t>(size));
    return shown_;
  }
  bool sees(std::string_view text) { return shown().find(text) != std::string::npos; }
  bool is_closed() {
    char byte;
    return ::recv(fd_, &byte, 1, MSG_PEEK) == 0;
  }
  int fd() const { return fd_; }

 private:
  int fd_;
  std::string shown_;
};

struct Places : testing::Test {
  boost::asio::io_context io{1};
  drivers::RealClock clock;
  test::TempFolder folder;
  FakeRobot robot;
  hal::ComputeHere compute;
  mission::ConsoleHub hub{
      {.password = folder.path() / "password", .first_number = [] { return 1000; }},
      clock,
      robot,
      compute};
  std::unique_ptr<mission::ConsolePlaces> places;
  boost::asio::cancellation_signal cancel;
  bool over = true;

  std::string socket() const { return folder.path() / "console.sock"; }
  std::string tty() const { return folder.path() / "tty"; }

  void open(mission::ConsoleConfig config) {
    places = std::make_unique<mission::ConsolePlaces>(config, io.get_executor(), clock, hub);
    over = false;
    boost::asio::co_spawn(io, places->run(),
                          boost::asio::bind_cancellation_slot(
                              cancel.slot(), [this](std::exception_ptr) { over = true; }));
  }
  void TearDown() override {
    cancel.emit(boost::asio::cancellation_type::terminal);
    EXPECT_TRUE(until([&] { return over; })) << "it does not end";
    places.reset();
  }
  bool until(const std::function<bool()>& holds, hal::Duration patience = 20s) {
    const hal::Time late = clock.now() + patience;
    while (!holds()) {
      if (clock.now() > late) return false;
      io.restart();
      io.run_one_for(10ms);
    }
    return true;
  }
  // A pseudo terminal whose other end the console opens.
  std::unique_ptr<Peer> plug_in() {
    int master = -1, slave = -1;
    char name[128];
    EXPECT_EQ(openpty(&master, &slave, name, nullptr, nullptr), 0);
    ::close(slave);
    std::filesystem::remove(tty());
    std::filesystem::create_symlink(name, tty());
    return std::make_unique<Peer>(master);
  }
  std::unique_ptr<Peer> connect() {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, socket().c_str(), sizeof address.sun_path - 1);
    const int fd = ::socket(AF_UNIX, SOCK_STREAM, 0);
    EXPECT_TRUE(until([&] {
      return ::connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
    }));
    return std::make_unique<Peer>(fd);
  }
};

TEST_F(Places, ServeASerialLineAt115200) {
  const auto line = plug_in();
  open({.serial = tty(), .socket = {}, .password = {}});
  ASSERT_TRUE(until([&] { return line->sees("vantage> "); })) << line->shown();
  EXPECT_EQ(drivers::speed_of(line->fd()), 115200U);
  line->type("set-password\r");
  EXPECT_TRUE(until([&] { return line->sees("new password: "); })) << "the line may set the first";
  line->type("\rstop\r");
  EXPECT_TRUE(until([&] { return robot.orders.size() == 1; }));
  EXPECT_EQ(robot.ordered(), "stop\n");
}

TEST_F(Places, ForgetHalfALineWhenTheCableIsPulled) {
  auto line = plug_in();
  open({.serial = tty(), .socket = {}, .password = {}});
  ASSERT_TRUE(until([&] { return line->sees("vantage> "); }));
  line->type("st");
  ASSERT_TRUE(until([&] { return line->sees("> st"); }));
  line = plug_in();
  ASSERT_TRUE(until([&] { return line->sees("vantage> "); })) << "it does not come back";
  line->type("op\r");
  EXPECT_TRUE(until([&] { return line->sees("no command 'op'"); })) << line->shown();
  EXPECT_EQ(robot.ordered(), "");
}

TEST_F(Places, HearAStopBehindAFloodOfGarbage) {
  const auto line = plug_in();
  open({.serial = tty(), .socket = {}, .password = {}});
  ASSERT_TRUE(until([&] { return line->sees("vantage> "); }));
  std::string noise;
  for (std::uint32_t i = 0; i < 30'000; ++i) noise += static_cast<char>((i * 2654435761U) >> 24);
  noise += "\rstop\r";
  std::string_view left = noise;
  ASSERT_TRUE(until([&] {
    left.remove_prefix(line->type(left));
    (void)line->shown();
    return left.empty();
  }));
  EXPECT_TRUE(until([&] { return !robot.orders.empty(); }));
  EXPECT_EQ(robot.orders.back(), "stop");
}

TEST_F(Places, ServeSeveralConnectionsAndSayWhenThereAreTooMany) {
  open({.serial = {}, .socket = socket(), .password = {}});
  std::vector<std::unique_ptr<Peer>> peers;
  for (int i = 0; i < mission::ConsolePlaces::kConnectionsMax; ++i) {
    peers.push_back(connect());
    ASSERT_TRUE(until([&] { return peers.back()->sees("vantage> "); })) << i;
  }
  struct stat status {};
  ASSERT_EQ(stat(socket().c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777, 0660U);
  const auto one_more = connect();
  EXPECT_TRUE(until([&] { return one_more->sees("all consoles are taken"); }));
  peers[3]->type("why\r");
  EXPECT_TRUE(until([&] { return peers[3]->sees("nobody has armed it"); }));
  EXPECT_THAT(peers[4]->shown(), Not(HasSubstr("nobody has armed it")));
  peers[2]->type("quit\r");
  ASSERT_TRUE(until([&] { return hub.sessions() == peers.size() - 1; }));
  EXPECT_TRUE(until([&] { return peers[2]->sees("bye") && peers[2]->is_closed(); }));
  peers[5].reset();
  ASSERT_TRUE(until([&] { return hub.sessions() == peers.size() - 2; }));
  const auto again = connect();
  EXPECT_TRUE(until([&] { return again->sees("vantage> "); }));
}

TEST_F(Places, AreNotHeldUpByWhoDoesNotRead) {
  open({.serial = {}, .socket = socket(), .password = {}});
  const auto deaf = connect(), other = connect();
  ASSERT_TRUE(until([&] { return hub.sessions() == 2; }));
  for (int i = 0; i < 20'000; ++i) {
    hub.tell(std::string(70, 'x'));
    if (i % 100 == 0) until([] { return true; });
  }
  deaf->type("stop\r");
  EXPECT_TRUE(until([&] { return robot.orders.size() == 1; }));
  (void)other->shown();
  other->type("why\r");
  EXPECT_TRUE(until([&] { return other->sees("nobody has armed it"); }));
}

TEST_F(Places, ReplaceASocketThatNobodyServesAndNoOther) {
  {
    const int left_behind = ::socket(AF_UNIX, SOCK_STREAM, 0);
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, socket().c_str(), sizeof address.sun_path - 1);
    ASSERT_EQ(::bind(left_behind, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    ::close(left_behind);
  }
  open({.serial = {}, .socket = socket(), .password = {}});
  const auto person = connect();
  ASSERT_TRUE(until([&] { return person->sees("vantage> "); }));
  mission::ConsolePlaces second({.serial = {}, .socket = socket(), .password = {}},
                                io.get_executor(), clock, hub);
  boost::asio::cancellation_signal stop;
  bool ended = false;
  boost::asio::co_spawn(
      io, second.run(),
      boost::asio::bind_cancellation_slot(stop.slot(), [&](std::exception_ptr) { ended = true; }));
  EXPECT_TRUE(until([&] { return person->sees("no console at "); })) << "it took the other's place";
  stop.emit(boost::asio::cancellation_type::terminal);
  EXPECT_TRUE(until([&] { return ended; }));
  EXPECT_TRUE(std::filesystem::exists(socket()));
}

// --- The client.

struct Client : Places {
  int terminal = -1;  // Its own end.
  std::unique_ptr<Peer> hands;
  pid_t pid = -1;
  termios before{};

  void start(const std::string& path) {
    int master = -1;
    ASSERT_EQ(openpty(&master, &terminal, nullptr, nullptr, nullptr), 0);
    ASSERT_EQ(tcgetattr(terminal, &before), 0);
    hands = std::make_unique<Peer>(master);
    const std::string program = VANTAGE_BINARY_DIR "/vantage";
    pid = fork();
    if (pid == 0) {
      for (const int fd : {0, 1, 2}) dup2(terminal, fd);
      execl(program.c_str(), program.c_str(), "console", "--socket", path.c_str(), nullptr);
      _exit(127);
    }
  }
  // Its exit code.
  int ended() {
    int status = -1;
    EXPECT_TRUE(until([&] {
      (void)hands->shown();
      return waitpid(pid, &status, WNOHANG) == pid;
    })) << hands->shown();
    pid = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
  void expect_restored() {
    termios after{};
    ASSERT_EQ(tcgetattr(terminal, &after), 0);
    EXPECT_EQ(after.c_lflag, before.c_lflag);
    EXPECT_EQ(after.c_iflag, before.c_iflag);
    EXPECT_EQ(after.c_oflag, before.c_oflag);
  }
  void TearDown() override {
    if (pid > 0) {
      kill(pid, SIGKILL);
      waitpid(pid, nullptr, 0);
    }
    if (terminal >= 0) ::close(terminal);
    Places::TearDown();
  }
};

TEST_F(Client, DrivesByNumberedKeysAndRestoresTheTerminal) {
  robot.now.released = true;
  ASSERT_EQ(mission::PasswordFile(folder.path() / "password").set("correct horse"), "");
  mission::ConsoleHub with_password(
      {.password = folder.path() / "password", .first_number = [] { return 1000; }}, clock, robot,
      compute);
  mission::ConsolePlaces there({.serial = {}, .socket = socket(), .password = {}},
                               io.get_executor(), clock, with_password);
  boost::asio::cancellation_signal stop;
  bool closed = false;
  boost::asio::co_spawn(
      io, there.run(),
      boost::asio::bind_cancellation_slot(stop.slot(), [&](std::exception_ptr) { closed = true; }));
  ASSERT_TRUE(until([&] { return std::filesystem::exists(socket()); }));
  start(socket());
  ASSERT_TRUE(until([&] { return hands->sees("vantage> "); })) << hands->shown();
  hands->type("login\r");
  ASSERT_TRUE(until([&] { return hands->sees("password: "); }));
  hands->type("correct horse\r");
  ASSERT_TRUE(until([&] { return hands->sees("logged in"); })) << hands->shown();
  EXPECT_THAT(hands->shown(), Not(HasSubstr("correct horse")));
  hands->type("teleop\r");
  ASSERT_TRUE(until([&] { return hands->sees("numbers after 1000"); })) << hands->shown();
  hands->type("www");
  EXPECT_TRUE(until([&] { return robot.orders.size() == 4; }));
  EXPECT_EQ(robot.ordered(), "take over\ndrive 0.3 0\ndrive 0.3 0\ndrive 0.3 0\n");
  hands->type("q\x1D");
  EXPECT_EQ(ended(), 0);
  expect_restored();
  EXPECT_TRUE(until([&] { return with_password.sessions() == 0; }));
  stop.emit(boost::asio::cancellation_type::terminal);
  EXPECT_TRUE(until([&] { return closed; }));
}

TEST_F(Client, RestoresTheTerminalWhenItIsKilledOrTheRobotGoes) {
  open({.serial = {}, .socket = socket(), .password = {}});
  ASSERT_TRUE(until([&] { return std::filesystem::exists(socket()); }));
  start(socket());
  ASSERT_TRUE(until([&] { return hands->sees("vantage> "); })) << hands->shown();
  kill(pid, SIGTERM);
  EXPECT_EQ(ended(), 0);
  expect_restored();
  ::close(terminal);
  start(socket());
  ASSERT_TRUE(until([&] { return hands->sees("vantage> "); })) << hands->shown();
  cancel.emit(boost::asio::cancellation_type::terminal);
  EXPECT_EQ(ended(), 0);
  EXPECT_THAT(hands->shown(), HasSubstr("the robot closed the console"));
  expect_restored();
}

TEST_F(Client, SaysWhatToDoWhereThereIsNoConsole) {
  start(socket());
  EXPECT_EQ(ended(), 2);
  EXPECT_THAT(hands->shown(), HasSubstr("see that vantaged runs"));
  expect_restored();
}

}  // namespace
