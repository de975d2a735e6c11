// vantage-units: the simulated units of a robot as a process of their own, in real time, on pseudo
// terminals, TCP ports and a CAN interface, so that any program can talk to them.
#include <fmt/format.h>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/read_until.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <memory>

#include "drivers/real_clock.hpp"
#include "drivers/socketcan.hpp"
#include "hal/together.hpp"
#include "mission/main_command_line.hpp"
#include "mission/main_corrections.hpp"
#include "mission/main_run.hpp"
#include "mission/main_scanner.hpp"
#include "mission/main_units.hpp"
#include "sim/modbus_server.hpp"
#include "tools/served_links.hpp"

namespace {

namespace asio = boost::asio;

constexpr int kDone = 0, kFailed = 1, kRefused = 2;

struct Options {
  std::filesystem::path mission, robot, site, folder = "/tmp/vantage-units";
  std::string can;
  int threads = 0;
};

// Where a client finds the units: what goes into the robot file's `link` keys.
struct Served {
  std::unique_ptr<drivers::SocketCan> can, second_can;
  std::unique_ptr<vantage::ServedTcp> scanner, obstacles, battery, safety;
  std::unique_ptr<vantage::ServedPty> scanner_line, pan, imu, gnss, board;
  std::unique_ptr<vantage::ServedUdp> packets;
  std::unique_ptr<vantage::ServedTcp> gpsd, corrections, scanner_api;
};

constexpr std::string_view kSerial = "serial:";
// As the devices come from the factory.
constexpr int kScannerBaud = 115200, kPanBaud = 9600, kImuBaud = 115200, kGnssBaud = 38400,
              kBoardBaud = 9600;

Served serve(const Options& options, const mission::RobotConfig& robot, asio::io_context& io,
             hal::Clock& clock) {
  const auto executor = io.get_executor();
  std::filesystem::create_directories(options.folder);
  Served served;
  const auto pty = [&](const char* name, int baud) {
    return std::make_unique<vantage::ServedPty>(executor, options.folder / name, baud);
  };
  const auto port = [&] { return std::make_unique<vantage::ServedTcp>(executor, 0); };
  if (!options.can.empty()) {
    const drivers::CanAddress at{options.can};
    served.can = std::make_unique<drivers::SocketCan>(at, executor, clock);
    if (robot.drive.device == "cia402")
      served.second_can = std::make_unique<drivers::SocketCan>(at, executor, clock);
  }
  if (!mission::needs_pan(robot.scanner))
    served.packets = std::make_unique<vantage::ServedUdp>(executor);
  else if (robot.scanner.link.starts_with(kSerial))
    served.scanner_line = pty("scanner", kScannerBaud);
  else
    served.scanner = port();
  if (mission::needs_pan(robot.scanner)) served.pan = pty("pan", kPanBaud);
  if (robot.obstacles.device == "hokuyo") served.obstacles = port();
  served.imu = pty("imu", kImuBaud);
  if (robot.gnss.device == "gpsd")
    served.gpsd = port();
  else
    served.gnss = pty("gnss", kGnssBaud);
  if (mission::asks_ouster(robot.scanner)) served.scanner_api = port();
  if (mission::has_corrections(robot)) served.corrections = port();
  if (!robot.power.battery_link.empty()) served.battery = port();
  if (!robot.power.board_link.empty()) served.board = pty("board", kBoardBaud);
  if (!robot.power.safety_link.empty()) served.safety = port();
  return served;
}

std::string serial(const vantage::ServedPty& pty, int baud) {
  return fmt::format("{}{}@{}", kSerial, pty.path().string(), baud);
}

std::string scanner_link(const Served& served) {
  if (served.packets) return fmt::format("udp:{}", served.packets->port());
  return served.scanner_line ? serial(*served.scanner_line, kScannerBaud)
                             : fmt::format("tcp:127.0.0.1:{}", served.scanner->port());
}

// The robot file's tables with the links as they are served, to be pasted over the originals.
void print_links(const Options& options, const mission::RobotConfig& robot, const Served& served) {
  const auto tcp = [](const vantage::ServedTcp& at) {
    return fmt::format("tcp:127.0.0.1:{}", at.port());
  };
  if (served.can)
    fmt::print("[drive]\ndevice = \"{}\"\nlink = \"can:{}\"\n", robot.drive.device, options.can);
  fmt::print("[scanner]\ndevice = \"{}\"\nlink = \"{}\"\n", robot.scanner.device,
             scanner_link(served));
  if (served.scanner_api) fmt::print("api_link = \"{}\"\n", tcp(*served.scanner_api));
  if (served.pan) fmt::print("[pan]\nlink = \"{}\"\n", serial(*served.pan, kPanBaud));
  if (served.obstacles)
    fmt::print("[obstacles]\ndevice = \"{}\"\nlink = \"{}\"\n", robot.obstacles.device,
               tcp(*served.obstacles));
  fmt::print("[imu]\nlink = \"{}\"\n[gnss]\ndevice = \"{}\"\nlink = \"{}\"\n",
             serial(*served.imu, kImuBaud), robot.gnss.device,
             served.gpsd ? tcp(*served.gpsd) : serial(*served.gnss, kGnssBaud));
  if (served.corrections) fmt::print("[corrections]\nlink = \"{}\"\n", tcp(*served.corrections));
  if (served.battery || served.board || served.safety) fmt::print("[power]\n");
  if (served.battery)
    fmt::print("battery_link = \"modbus-tcp:127.0.0.1:{}/225\"\n", served.battery->port());
  if (served.board)
    fmt::print("board_link = \"modbus-rtu:{}@{}N/1\"\n", served.board->path().string(), kBoardBaud);
  if (served.safety)
    fmt::print("safety_link = \"modbus-tcp:127.0.0.1:{}/1\"\n", served.safety->port());
  std::fflush(stdout);
}

// "ROLE FAULT", one a line on standard input: "scanner garbage", "drive off", "imu none".
void set_fault(const std::string& line, mission::RobotUnits& units) {
  const auto blank = line.find(' ');
  const std::string role = line.substr(0, blank);
  sim::UnitFaults* const faults = units.faults(role);
  if (faults == nullptr || blank == std::string::npos) {
    fmt::print(stderr, "'{}': say ROLE FAULT, such as \"scanner garbage\" or \"imu none\"\n", line);
    return;
  }
  const sim::FaultText text = sim::parse_unit_fault(line.substr(blank + 1));
  if (!text.error.empty()) {
    fmt::print(stderr, "'{}': {}\n", line, text.error);
    return;
  }
  faults->set(text.setting);
  fmt::print(stderr, "{} is {}\n", role, sim::to_text(text.setting));
}

hal::Task<void> listen_to_person(asio::io_context& io, mission::RobotUnits& units) {
  asio::posix::stream_descriptor input(io, ::dup(STDIN_FILENO));
  std::string buffer;
  for (;;) {
    boost::system::error_code error;
    const std::size_t size =
        co_await asio::async_read_until(input, asio::dynamic_buffer(buffer, 1024), '\n',
                                        asio::redirect_error(asio::use_awaitable, error));
    if (error) co_return;  // No more to come: the units go on.
    if (size > 1) set_fault(buffer.substr(0, size - 1), units);
    buffer.erase(0, size);
  }
}

int run(const Options& options) {
  mission::Prepared prepared = mission::prepare(
      options.mission,
      {.site_folder = options.site, .robot_file = options.robot, .has_seed = false, .seed = 0},
      mission::WorldUse::world);
  for (const auto& error : prepared.errors) fmt::print(stderr, "{}\n", error.text());
  if (!prepared.errors.empty()) return kRefused;
  const mission::RobotConfig& robot = prepared.config.robot;
  asio::io_context io{1};
  drivers::RealClock clock;
  mission::SimWorld world(prepared.config, prepared.tasks, std::move(prepared.sim),
                          mission::threads_or_all(options.threads));
  Served served = serve(options, robot, io, clock);
  const drivers::GeoAnchor anchor =
      prepared.origin ? drivers::GeoAnchor{prepared.origin->lat_deg, prepared.origin->lon_deg,
                                           prepared.origin->h_m, 0}
                      : mission::kSimAnchor;
  mission::RobotUnits units(
      robot, anchor, prepared.config.seed, mission::threads_or_all(options.threads), world.world(),
      clock,
      {.drive = served.can.get(),
       .second_drive = served.second_can.get(),
       .scanner = served.scanner ? static_cast<hal::ByteStream*>(served.scanner.get())
                                 : served.scanner_line.get(),
       .pan = served.pan.get(),
       .imu = served.imu.get(),
       .gnss = served.gpsd ? static_cast<hal::ByteStream*>(served.gpsd.get()) : served.gnss.get(),
       .obstacles = served.obstacles.get(),
       .corrections = served.corrections.get(),
       .packets = served.packets.get(),
       .scanner_api = served.scanner_api.get(),
       .packets_port = served.packets ? served.packets->port() : std::uint16_t{0}});
  print_links(options, robot, served);

  std::vector<hal::Task<void>> tasks;
  tasks.push_back(units.run());
  const auto add_modbus = [&](hal::ByteStream* stream, sim::ModbusWire wire,
                              sim::RegisterUnit* unit) {
    if (stream != nullptr && unit != nullptr)
      tasks.push_back(
          sim::serve_modbus(*stream, wire, clock, [unit](std::uint8_t) { return unit; }));
  };
  add_modbus(served.battery.get(), sim::ModbusWire::tcp, units.battery());
  add_modbus(served.board.get(), sim::ModbusWire::rtu, units.board());
  add_modbus(served.safety.get(), sim::ModbusWire::tcp, units.safety());

  int code = kDone;
  asio::signal_set stop(io, SIGINT, SIGTERM);
  stop.async_wait([&](boost::system::error_code, int) { io.stop(); });
  const auto on_end = [&](std::exception_ptr error) {
    if (!error) return;
    try {
      std::rethrow_exception(error);
    } catch (const std::exception& e) {
      fmt::print(stderr, "vantage-units: {}\n", e.what());
    }
    code = kFailed;
    io.stop();
  };
  asio::co_spawn(io, hal::together(std::move(tasks)), on_end);
  asio::co_spawn(io, listen_to_person(io, units), on_end);
  io.run();
  return code;
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  mission::CommandLine line(
      "Runs a robot's simulated units in real time, for any program to talk to.",
      "Prints where each unit is found, as tables of a robot file. On standard input it takes\n"
      "\"ROLE FAULT\" lines: \"scanner garbage\", \"drive off\", \"imu slow:3\", \"pan none\".\n"
      "Example:\n"
      "  vantage-units configs/missions/courtyard.toml --folder /tmp/units --can vcan0\n"
      "Exit: 0 ended by a signal, 1 failed, 2 refused to start.");
  line.add("mission", &options.mission, "Mission file (TOML): its site is the world",
           {.required = true});
  line.add("--robot", &options.robot, "Use this robot file instead of the mission's");
  line.add("--site", &options.site, "Use this site folder instead of the mission's");
  line.add("--folder", &options.folder, "Where the serial ports are made");
  line.add("--can", &options.can, "CAN interface for the drive; none: no drive");
  line.add("--threads", &options.threads, "For ray casting (0: all cores)", {.within = {{0, 256}}});
  if (!line.parse(argc, argv)) return line.asked_for_help() ? kDone : kRefused;
  try {
    return run(options);
  } catch (const std::exception& error) {
    fmt::print(stderr, "vantage-units: {}\n", error.what());
    return kFailed;
  }
}
