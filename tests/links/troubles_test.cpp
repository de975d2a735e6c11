// Wrong wiring, settings and permissions are told apart and named with what to do.
#include <asm/ioctls.h>
#include <asm/termbits.h>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <filesystem>
#include <fstream>

#include "drivers/modbus_client.hpp"
#include "drivers/modbus_errors.hpp"
#include "drivers/peers.hpp"
#include "drivers/serial_port.hpp"
#include "drivers/socketcan.hpp"
#include "drivers/tcp_stream.hpp"
#include "drivers/udp_port.hpp"
#include "tests/links/promises/promises.hpp"

namespace links_test {
namespace {

namespace errc = boost::system::errc;
using drivers::LinkFault;

struct Troubles : testing::Test {
  RealLoop loop;
  boost::asio::any_io_executor executor = loop.io().get_executor();
  std::string path =
      std::filesystem::temp_directory_path() / ("vantage-port-" + std::to_string(getpid()));

  void TearDown() override { std::filesystem::remove(path); }
  void pass(hal::Duration span) { loop.run(loop.clock().sleep_for(span)); }
  // What is wrong with a link after a moment; its detail says `detail`.
  void expect(const drivers::Link& link, LinkFault fault, const std::string& detail) {
    pass(200ms);
    const auto troubles = link.troubles();
    ASSERT_EQ(troubles.size(), 1U) << link.address();
    EXPECT_EQ(troubles[0].fault->value, static_cast<std::uint32_t>(fault))
        << troubles[0].fault->name << ": " << troubles[0].detail;
    EXPECT_NE(troubles[0].detail.find(detail), std::string::npos) << troubles[0].detail;
    EXPECT_NE(troubles[0].detail.find(link.address()), std::string::npos) << troubles[0].detail;
    EXPECT_FALSE(troubles[0].fault->remedy.empty());
  }
};

TEST(LinkFaults, AreAllListedOnce) {
  const auto faults = drivers::link_faults();
  EXPECT_EQ(faults.size(), static_cast<std::size_t>(LinkFault::other));
  for (std::uint32_t value = 1; value <= static_cast<std::uint32_t>(LinkFault::other); ++value)
    EXPECT_NE(drivers::fault_of(faults, value), nullptr) << value;
}

TEST_F(Troubles, APortThatIsNotThere) {
  drivers::SerialPort port({"/dev/no-such-port", 9600}, executor, loop.clock());
  expect(port, LinkFault::absent, "No such file");
}

TEST_F(Troubles, APathThatIsNoPort) {
  std::ofstream(path) << "text";
  drivers::SerialPort port({path, 9600}, executor, loop.clock());
  expect(port, LinkFault::other_device, "ioctl");
}

TEST_F(Troubles, APortThatAnotherProgramHolds) {
  drivers::PtyPeer peer(path, executor, loop.clock());
  pass(50ms);
  drivers::SerialPort first({path, 9600}, executor, loop.clock());
  pass(50ms);
  ASSERT_TRUE(first.connected());
  drivers::SerialPort second({path, 9600}, executor, loop.clock());
  expect(second, LinkFault::busy, "held by this program itself");
}

// Whether nobody but root may open the port.
bool is_for_one_alone(const std::string& path) {
  const int look = open(path.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK);
  if (look < 0) return errno == EBUSY;
  int exclusive = 0;
  EXPECT_EQ(ioctl(look, TIOCGEXCL, &exclusive), 0);
  close(look);
  return exclusive != 0;
}

// A pseudo terminal's other end holds it open for longer than anybody who uses it.
TEST_F(Troubles, APortThatWasClosedIsThereForOthers) {
  drivers::PtyPeer peer(path, executor, loop.clock());
  pass(50ms);
  ASSERT_FALSE(is_for_one_alone(path));
  {
    drivers::SerialPort port({path, 9600}, executor, loop.clock());
    pass(50ms);
    ASSERT_TRUE(port.connected());
    EXPECT_TRUE(is_for_one_alone(path));
    // Who could not have it does not open it to others either.
    {
      drivers::SerialPort second({path, 9600}, executor, loop.clock());
      pass(50ms);
    }
    EXPECT_TRUE(is_for_one_alone(path));
  }
  pass(50ms);
  EXPECT_FALSE(is_for_one_alone(path));
}

TEST_F(Troubles, APortThatDidNotTakeItsSettingsIsThereForOthers) {
  drivers::PtyPeer peer(path, executor, loop.clock());
  pass(50ms);
  drivers::SerialPort port({path, 9600, 'E', 1}, executor, loop.clock());
  expect(port, LinkFault::bad_settings, "@9600E");
  EXPECT_FALSE(is_for_one_alone(path));
}

TEST_F(Troubles, APortOfAModbusIsThereForOthersWhenItWasClosed) {
  drivers::PtyPeer peer(path, executor, loop.clock());
  pass(50ms);
  {
    drivers::ModbusBus bus(drivers::ModbusRtuAddress{{path, 9600}, 1}, executor, loop.clock());
    const auto ask = [&]() -> hal::Task<void> {
      EXPECT_FALSE(co_await bus.unit(1).read_coils({0, 1})) << "nobody answers";
    };
    loop.run(ask());
    EXPECT_TRUE(is_for_one_alone(path));
  }
  pass(50ms);
  EXPECT_FALSE(is_for_one_alone(path));
}

TEST_F(Troubles, ANewHolderIsNamedByItsProcess) {
  drivers::PtyPeer peer(path, executor, loop.clock());
  pass(50ms);
  int ready[2];
  ASSERT_EQ(pipe(ready), 0);
  const pid_t child = fork();
  if (child == 0) {  // Holds the lock until it is killed. Only async-signal-safe calls.
    const int port = open(path.c_str(), O_RDWR | O_NOCTTY);
    drivers::lock_port(port);
    static_cast<void>(write(ready[1], "x", 1));
    for (;;) pause();
  }
  char byte = 0;
  ASSERT_EQ(read(ready[0], &byte, 1), 1);
  drivers::SerialPort port({path, 9600}, executor, loop.clock());
  pass(200ms);
  const auto troubles = port.troubles();
  kill(child, SIGKILL);
  ASSERT_EQ(troubles.size(), 1U);
  EXPECT_EQ(troubles[0].fault->name, "in use");
  EXPECT_NE(troubles[0].detail.find("process " + std::to_string(child)), std::string::npos)
      << troubles[0].detail;
  pass(2s);
  EXPECT_TRUE(port.connected()) << "the other one ended";
  close(ready[0]);
  close(ready[1]);
}

TEST_F(Troubles, WhoMayOpenAPortIsNamed) {
  std::ofstream(path) << "";
  const auto trouble =
      drivers::trouble_of(errc::make_error_code(errc::permission_denied), "serial:" + path, path);
  EXPECT_EQ(trouble.fault->name, "not permitted");
  struct stat status {};
  ASSERT_EQ(stat(path.c_str(), &status), 0);
  EXPECT_NE(trouble.detail.find("; group "), std::string::npos) << trouble.detail;
}

TEST_F(Troubles, SettingsArriveAtThePort) {
  drivers::PtyPeer peer(path, executor, loop.clock());
  pass(50ms);
  drivers::SerialPort port({path, 115200, 'N', 2}, executor, loop.clock());
  pass(50ms);
  ASSERT_TRUE(port.connected()) << (port.troubles().empty() ? "" : port.troubles()[0].detail);
  // Root may open a port that is for one alone.
  const int look = open(path.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK);
  if (look < 0) GTEST_SKIP() << "the port is locked, as it should be, and we are not root";
  termios2 settings{};
  ASSERT_EQ(ioctl(look, TCGETS2, &settings), 0);
  close(look);
  EXPECT_EQ(settings.c_ospeed, 115200U);
  EXPECT_EQ(settings.c_cflag & PARENB, 0U);
  EXPECT_NE(settings.c_cflag & CSTOPB, 0U);
  EXPECT_EQ(settings.c_lflag & (ICANON | ECHO | ISIG), 0U);
  EXPECT_FALSE(port.errors().has_value()) << "a pseudo terminal does not count";
}

// A pseudo terminal under `path`: its master's end.
int make_terminal(const std::string& path) {
  const int master = posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC);
  EXPECT_EQ(grantpt(master) + unlockpt(master), 0);
  char name[64];
  EXPECT_EQ(ptsname_r(master, name, sizeof name), 0);
  std::filesystem::remove(path);
  std::filesystem::create_symlink(name, path);
  return master;
}

TEST_F(Troubles, ARateThatIsSetHoldsUntilThePortIsOpenedAgain) {
  int master = make_terminal(path);
  drivers::SerialPort port({path, 9600}, executor, loop.clock());
  pass(50ms);
  EXPECT_EQ(drivers::speed_of(master), 9600U);
  EXPECT_TRUE(port.set_baud(19200));
  EXPECT_EQ(drivers::speed_of(master), 19200U);
  close(master);
  loop.run([](drivers::SerialPort& lost) -> hal::Task<void> {
    std::array<std::uint8_t, 8> buffer;
    EXPECT_FALSE(co_await lost.read_some(buffer));
  }(port));
  const auto set = port.set_baud(38400);
  ASSERT_TRUE(set.has_error());
  EXPECT_EQ(set.error(), errc::not_connected);
  master = make_terminal(path);
  pass(2s);
  ASSERT_TRUE(port.connected());
  EXPECT_EQ(drivers::speed_of(master), 9600U);
  close(master);
}

// A pseudo terminal has no parity.
TEST_F(Troubles, SettingsThatAPortDoesNotTake) {
  drivers::PtyPeer peer(path, executor, loop.clock());
  pass(50ms);
  drivers::SerialPort port({path, 9600, 'E', 1}, executor, loop.clock());
  expect(port, LinkFault::bad_settings, "@9600E");
}

TEST_F(Troubles, AHostThatRefuses) {
  std::uint16_t port = 0;
  {
    drivers::TcpPeer peer("127.0.0.1", 0, executor, loop.clock());
    port = peer.port();
    pass(20ms);
  }
  pass(20ms);
  drivers::TcpStream stream({"127.0.0.1", port}, executor, loop.clock());
  expect(stream, LinkFault::refused, "refused");
  drivers::TcpPeer peer("127.0.0.1", port, executor, loop.clock());
  pass(2s);
  EXPECT_TRUE(stream.connected()) << "it listens now";
  EXPECT_TRUE(stream.troubles().empty());
}

TEST_F(Troubles, AHostThatDoesNotExist) {
  drivers::TcpStream stream({"no-such-host.invalid", 80}, executor, loop.clock());
  pass(3500ms);  // Name servers take their time.
  const auto troubles = stream.troubles();
  ASSERT_EQ(troubles.size(), 1U);
  const std::string_view name = troubles[0].fault->name;
  EXPECT_TRUE(name == "unknown host name" || name == "no answer") << name;
}

TEST_F(Troubles, APortThatAnotherProgramListensOn) {
  drivers::UdpPort first({0, ""}, executor, loop.clock());
  EXPECT_TRUE(first.troubles().empty());
  const int other = socket(AF_INET, SOCK_DGRAM, 0);
  sockaddr address{AF_INET, {}};
  socklen_t size = sizeof address;
  ASSERT_EQ(bind(other, &address, size), 0);
  ASSERT_EQ(getsockname(other, &address, &size), 0);
  const auto number =
      static_cast<std::uint16_t>(static_cast<std::uint8_t>(address.sa_data[0]) << 8 |
                                 static_cast<std::uint8_t>(address.sa_data[1]));
  drivers::UdpPort port({number, ""}, executor, loop.clock());
  expect(port, LinkFault::address_in_use, "in use");
  close(other);
  const auto receive = [&]() -> hal::Task<void> {
    drivers::UdpSender sender("127.0.0.1", number, executor);
    Bytes buffer(10);
    const auto send = [&]() -> hal::Task<void> {
      for (;;) {
        co_await loop.clock().sleep_for(100ms);
        sender.send(buffer);
      }
    };
    const auto got = co_await (port.receive(buffer) || send() || loop.clock().sleep_for(8s));
    EXPECT_EQ(got.index(), 0U) << "it is tried again";
  };
  loop.run(receive());
  EXPECT_TRUE(port.troubles().empty());
}

TEST_F(Troubles, DatagramsFromElsewhereArePassedOver) {
  const std::uint16_t number = 47110;
  drivers::UdpPort port({number, "127.0.0.2"}, executor, loop.clock());
  ASSERT_TRUE(port.troubles().empty());
  drivers::UdpSender sender("127.0.0.1", number, executor);
  sender.send(Bytes(3, 1));
  const auto receive = [&]() -> hal::Task<void> {
    Bytes buffer(10);
    EXPECT_FALSE(co_await patiently(loop, 100ms, port.receive(buffer)));
  };
  loop.run(receive());
  EXPECT_EQ(port.strange_datagrams(), 1U);
}

TEST_F(Troubles, CanIsNamedWhereTheKernelHasNoneOrNoSuchInterface) {
  drivers::SocketCan bus({"nocan0"}, executor, loop.clock());
  expect(bus, LinkFault::absent, "no such interface");
  const auto send = [&]() -> hal::Task<void> {
    EXPECT_EQ(co_await bus.send({1, 0}, loop.clock().now() + 1s),
              errc::make_error_code(errc::network_down));
  };
  loop.run(send());
  loop.run(rest(loop, "an interface that is not there"));
}

TEST_F(Troubles, AModbusUnitThatIsNotThere) {
  drivers::ModbusBus tcp(drivers::ModbusTcpAddress{"127.0.0.1", 1, 0}, executor, loop.clock());
  drivers::ModbusBus rtu(drivers::ModbusRtuAddress{{"/dev/no-such-port", 9600}, 0}, executor,
                         loop.clock());
  const auto ask = [&]() -> hal::Task<void> {
    EXPECT_EQ((co_await tcp.unit(5).read_input({0, 1})).error(),
              errc::make_error_code(errc::not_connected));
    EXPECT_EQ((co_await rtu.unit(6).read_input({0, 1})).error(),
              errc::make_error_code(errc::not_connected));
  };
  loop.run(ask());
  expect(tcp.unit(5), LinkFault::refused, "refused");
  expect(rtu.unit(6), LinkFault::absent, "No such file");
  EXPECT_EQ(rtu.unit(6).address(), "modbus-rtu:/dev/no-such-port@9600N/6");
}

TEST(ModbusErrors, AreTheSameBothWays) {
  for (const std::uint8_t exception : std::array<std::uint8_t, 8>{1, 2, 3, 4, 5, 6, 10, 11})
    EXPECT_EQ(drivers::modbus::exception_of(drivers::modbus::error_of(exception)), exception);
  EXPECT_EQ(drivers::modbus::error_of(99), errc::make_error_code(errc::protocol_error));
  EXPECT_EQ(drivers::modbus::exception_of(errc::make_error_code(errc::broken_pipe)), 4);
}

}  // namespace
}  // namespace links_test
