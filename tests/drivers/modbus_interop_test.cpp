// Other people's Modbus programs: mbpoll asks our units, pymodbus answers our driver. Real time.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <thread>

#include "drivers/modbus_client.hpp"
#include "drivers/peers.hpp"
#include "drivers/power_io.hpp"
#include "drivers/real_clock.hpp"
#include "sim/modbus_server.hpp"
#include "sim/power_units.hpp"
#include "tests/drivers/drive_bench.hpp"
#include "tests/support/temp_folder.hpp"

namespace {

using namespace drivers_test;
namespace asio = boost::asio;
using drivers::DeviceState;

bool runs(const std::string& command) {
  return std::system((command + " >/dev/null 2>&1").c_str()) == 0;
}

std::string output_of(const std::string& command) {
  FILE* const pipe = popen((command + " 2>&1").c_str(), "r");
  std::string all;
  char text[512];
  while (std::fgets(text, sizeof text, pipe) != nullptr) all += text;
  pclose(pipe);
  return all;
}

// An event loop in real time, beside the test.
struct RealTime {
  asio::io_context io{1};
  drivers::RealClock clock;

  void spawn(hal::Task<void> task) {
    asio::co_spawn(io, std::move(task), [](std::exception_ptr problem) {
      if (problem) std::rethrow_exception(problem);
    });
  }
};

// --- mbpoll and our units.

struct Mbpoll : testing::Test, RealTime {
  sim::UnitFaults board_faults{clock}, battery_faults{clock};
  sim::World world{plain_with_wall(), {}};
  sim::RelayUnit board{clock, board_faults};
  sim::Battery charge{{}, world};
  sim::VictronUnit victron{{}, charge, clock, battery_faults};

  sim::UnitOfNumber units() {
    return [this](std::uint8_t number) {
      return number == 1     ? static_cast<sim::RegisterUnit*>(&board)
             : number == 226 ? &victron
                             : nullptr;
    };
  }

  // The loop on a thread of its own; to be made last, so that it ends before what it runs.
  struct Running {
    explicit Running(asio::io_context& its_io) : io(its_io), thread([this] { io.run(); }) {}
    ~Running() {
      io.stop();
      thread.join();
    }
    asio::io_context& io;
    std::thread thread;
  };

  void SetUp() override {
    if (!runs("command -v mbpoll"))
      GTEST_SKIP() << "mbpoll is not installed (apt-get install mbpoll)";
  }
};

TEST_F(Mbpoll, ReadsAndWritesOurUnitsOverTcp) {
  drivers::TcpPeer line("127.0.0.1", 0, io.get_executor(), clock);
  spawn(sim::serve_modbus(line, sim::ModbusWire::tcp, clock, units()));
  const Running running(io);
  const std::string poll = "mbpoll -m tcp -0 -1 -p " + std::to_string(line.port());
  EXPECT_NE(output_of(poll + " -a 226 -t 4 -r 262 -c 1 127.0.0.1").find("[262]: \t250\n"),
            std::string::npos);
  EXPECT_NE(output_of(poll + " -a 226 -t 3 -r 259 -c 3 127.0.0.1").find("[259]: \t29"),
            std::string::npos);
  EXPECT_NE(output_of(poll + " -a 226 -t 4 -r 300 -c 1 127.0.0.1").find("Illegal data address"),
            std::string::npos);
  EXPECT_NE(output_of(poll + " -a 9 -t 4 -r 259 -c 1 127.0.0.1").find("Connection timed out"),
            std::string::npos)
      << "nobody of that number";
  EXPECT_NE(output_of(poll + " -a 1 -t 0 -r 3 127.0.0.1 1").find("Written 1 reference"),
            std::string::npos);
  EXPECT_NE(output_of(poll + " -a 1 -t 0 -r 0 -c 8 127.0.0.1").find("[3]: \t1\n"),
            std::string::npos);
  EXPECT_NE(output_of(poll + " -a 1 -t 4 -r 4098 127.0.0.1 2").find("Written 1 reference"),
            std::string::npos);
  EXPECT_NE(output_of(poll + " -a 1 -t 4 -r 4096 -c 8 127.0.0.1").find("[4098]: \t2\n"),
            std::string::npos);
}

TEST_F(Mbpoll, ReadsAndWritesOurUnitOnASerialLine) {
  const test::TempFolder folder;
  const std::string path = folder.path() / "board";
  drivers::PtyPeer line(path, io.get_executor(), clock);
  spawn(sim::serve_modbus(line, sim::ModbusWire::rtu, clock, units()));
  while (!std::filesystem::exists(path)) io.run_one_for(10ms);
  const Running running(io);
  const std::string poll = "mbpoll -m rtu -0 -1 -b 9600 -P none ", at = " " + path;
  const std::string inputs = output_of(poll + "-a 1 -t 1 -r 0 -c 8" + at);
  EXPECT_NE(inputs.find("[0]: \t1\n"), std::string::npos) << inputs;
  EXPECT_NE(inputs.find("[1]: \t0\n"), std::string::npos) << inputs;
  EXPECT_NE(output_of(poll + "-a 1 -t 0 -r 5" + at + " 1").find("Written 1 reference"),
            std::string::npos);
  EXPECT_NE(output_of(poll + "-a 1 -t 0 -r 0 -c 8" + at).find("[5]: \t1\n"), std::string::npos);
  EXPECT_NE(output_of(poll + "-a 1 -t 4 -r 500 -c 1" + at).find("Illegal data address"),
            std::string::npos);
  EXPECT_NE(output_of(poll + "-a 2 -t 1 -r 0 -c 8" + at).find("Connection timed out"),
            std::string::npos)
      << "nobody of that number";
}

// --- pymodbus and our driver.

// The servers as a process of their own; ends with the test.
class Peer {
 public:
  Peer(const std::string& python, const std::string& kind, const std::string& where) {
    int out[2];
    if (pipe(out) != 0) std::abort();
    child_ = fork();
    if (child_ == 0) {
      dup2(out[1], 1);
      dup2(open("/dev/null", O_WRONLY), 2);  // It logs what it refuses.
      const std::string script = VANTAGE_SOURCE_DIR "/tests/drivers/pymodbus_peer.py";
      execl(python.c_str(), python.c_str(), script.c_str(), kind.c_str(), where.c_str(), nullptr);
      _exit(127);
    }
    close(out[1]);
    char ready[16]{};
    EXPECT_GT(read(out[0], ready, sizeof ready), 0) << "the peer did not start";
    out_ = out[0];
  }
  ~Peer() {
    kill(child_, SIGTERM);
    waitpid(child_, nullptr, 0);
    close(out_);
  }
  Peer(const Peer&) = delete;
  Peer& operator=(const Peer&) = delete;

 private:
  pid_t child_ = -1;
  int out_ = -1;
};

hal::Task<void> pump(hal::ByteStream& from, hal::ByteStream& to) {
  std::array<std::uint8_t, 512> bytes{};
  for (;;) {
    const auto size = co_await from.read_some(bytes);
    if (!size) continue;  // Nobody has that end open yet.
    (void)co_await to.write(std::span(bytes).first(*size));
  }
}

std::uint16_t free_tcp_port() {
  asio::io_context io;
  asio::ip::tcp::acceptor acceptor(io, {asio::ip::address_v4::loopback(), 0});
  return acceptor.local_endpoint().port();
}

TEST(Pymodbus, AnswersOurDriverOverTcpAndASerialLine) {
  std::string python;
  for (const std::string candidate : {"/usr/bin/python3", "/usr/local/bin/python3"})
    if (python.empty() && runs(candidate + " -c 'import pymodbus, serial_asyncio'"))
      python = candidate;
  if (python.empty())
    GTEST_SKIP() << "pymodbus is not installed (apt-get install python3-pymodbus "
                    "python3-serial-asyncio)";
  RealTime time;
  const std::uint16_t port = free_tcp_port();
  // A serial cable: two ends, joined in the middle.
  const test::TempFolder folder;
  const std::string our_path = folder.path() / "ours", their_path = folder.path() / "theirs";
  drivers::PtyPeer ours(our_path, time.io.get_executor(), time.clock);
  drivers::PtyPeer theirs(their_path, time.io.get_executor(), time.clock);
  time.spawn(pump(ours, theirs));
  time.spawn(pump(theirs, ours));
  while (!std::filesystem::exists(their_path)) time.io.run_one_for(10ms);
  const Peer gateway(python, "tcp", std::to_string(port)), board(python, "rtu", their_path);

  drivers::ModbusBus tcp(drivers::ModbusTcpAddress{"127.0.0.1", port, 226}, time.io.get_executor(),
                         time.clock);
  drivers::ModbusRtuAddress serial;
  serial.line = {our_path, 9600};
  drivers::ModbusBus rtu(serial, time.io.get_executor(), time.clock);
  drivers::PowerIo power({}, time.clock, {&tcp.unit(226), &tcp.unit(100), &rtu.unit(1), nullptr});
  std::optional<hal::Result<hal::BatteryState>> battery;
  hal::SafetyInputs inputs;
  hal::Result<void> pulse, off = boost::system::errc::make_error_code(errc::timed_out);
  time.spawn(power.run());
  const auto ask = [&]() -> hal::Task<void> {  // Outlives its coroutine.
    for (int i = 0; i < 100 && power.state() != DeviceState::running; ++i)
      co_await time.clock.sleep_for(100ms);
    co_await time.clock.sleep_for(500ms);
    battery = co_await power.battery();
    inputs = *co_await power.inputs();
    pulse = co_await power.set_relay(0, true, 700ms);
    off = co_await power.set_relay(0, false, 700ms);
    time.io.stop();
  };
  time.spawn(ask());
  time.io.run();

  ASSERT_EQ(power.state(), DeviceState::running) << text(power.troubles());
  EXPECT_TRUE(names(power.troubles(), "battery voltage low (warning)"));
  EXPECT_EQ(power.identity().serial, "HQ1234");
  EXPECT_EQ(power.identity().firmware, "relay board 2.00");
  ASSERT_TRUE(battery && *battery);
  EXPECT_DOUBLE_EQ(*(*battery)->voltage_v, 26.4);
  EXPECT_DOUBLE_EQ(*(*battery)->current_a, -1.2);
  EXPECT_DOUBLE_EQ(*(*battery)->charge_percent, 87.3);
  EXPECT_DOUBLE_EQ(*(*battery)->temperature_c, 21.5);
  EXPECT_DOUBLE_EQ(*(*battery)->time_to_go_s, 72000);
  EXPECT_FALSE(inputs.estop_pressed);
  EXPECT_FALSE(inputs.reset_pressed);
  EXPECT_TRUE(off);
  ASSERT_FALSE(pulse);
  EXPECT_EQ(pulse.error(), errc::bad_message)
      << "the standard knows on and off alone: it answers as if off had been asked for";
}

}  // namespace
