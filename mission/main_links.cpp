#include "mission/main_links.hpp"

#include <fmt/format.h>

#include <variant>

#include "drivers/link_address.hpp"
#include "drivers/socketcan.hpp"
#include "drivers/tcp_stream.hpp"
#include "drivers/udp_port.hpp"
#include "mission/main_corrections.hpp"
#include "mission/main_scanner.hpp"

namespace mission {
namespace {

enum class Kind { can, stream, tcp, registers, datagrams };

struct Role {
  const char* key;  // In the robot file.
  const std::string& address;
  Kind kind;
  bool may_be_empty;
};

const std::string kNone;

// With a link of its own.
bool has_obstacles(const RobotConfig& robot) {
  return robot.obstacles.device == "hokuyo";
}

std::vector<Role> roles_of(const RobotConfig& robot) {
  return {{"drive.link", robot.drive.link, Kind::can, false},
          {"scanner.link", robot.scanner.link,
           needs_pan(robot.scanner) ? Kind::stream : Kind::datagrams, false},
          {"scanner.api_link", asks_ouster(robot.scanner) ? robot.scanner.api_link : kNone,
           Kind::tcp, true},
          {"pan.link", needs_pan(robot.scanner) ? robot.pan.link : kNone, Kind::stream,
           !needs_pan(robot.scanner)},
          {"obstacles.link", has_obstacles(robot) ? robot.obstacles.link : kNone, Kind::stream,
           !has_obstacles(robot)},
          {"imu.link", robot.imu.link, Kind::stream, false},
          {"gnss.link", robot.gnss.link, Kind::stream, false},
          {"corrections.link", has_corrections(robot) ? robot.corrections.link : kNone, Kind::tcp,
           !has_corrections(robot)},
          {"power.battery_link", robot.power.battery_link, Kind::registers, true},
          {"power.board_link", robot.power.board_link, Kind::registers, true},
          {"power.safety_link", robot.power.safety_link, Kind::registers, true}};
}

Kind kind_of(const drivers::LinkAddress& address) {
  if (std::holds_alternative<drivers::CanAddress>(address) ||
      std::holds_alternative<drivers::GsUsbAddress>(address))
    return Kind::can;
  if (std::holds_alternative<drivers::ModbusTcpAddress>(address) ||
      std::holds_alternative<drivers::ModbusRtuAddress>(address))
    return Kind::registers;
  if (std::holds_alternative<drivers::TcpAddress>(address)) return Kind::tcp;
  return std::holds_alternative<drivers::UdpAddress>(address) ? Kind::datagrams : Kind::stream;
}

std::string problem_of(const Role& role) {
  if (role.address.empty())
    return role.may_be_empty ? ""
                             : "no link: say where the device is, such as tcp:192.168.0.1:2112";
  const auto parsed = drivers::parse_link_address(role.address);
  if (const auto* error = std::get_if<drivers::AddressError>(&parsed)) return error->what;
  const auto& address = std::get<drivers::LinkAddress>(parsed);
  const Kind kind = kind_of(address);
  if (kind == role.kind) return "";
  if (kind == Kind::tcp && role.kind == Kind::stream) return "";
  switch (role.kind) {
    case Kind::can:
      return "a drive hangs on CAN: can:can0 or gs_usb:SERIAL/CHANNEL@500000";
    case Kind::stream:
      return "this device speaks on a stream: serial:/dev/ttyUSB0@9600 or tcp:HOST:PORT";
    case Kind::tcp:
      return "this is reached over the network: tcp:HOST:PORT";
    case Kind::datagrams:
      return "this scanner sends packets: udp:PORT, or udp:PORT@ADDRESS for those from there only";
    case Kind::registers:
      return "this device speaks Modbus: modbus-tcp:HOST:502/UNIT or "
             "modbus-rtu:/dev/ttyUSB0@9600N/UNIT";
  }
  return "";
}

// Only of texts that link_problems() had no fault with.
drivers::LinkAddress parsed(const std::string& text) {
  return std::get<drivers::LinkAddress>(drivers::parse_link_address(text));
}

}  // namespace

std::vector<ConfigError> link_problems(const MissionConfig& config) {
  std::vector<ConfigError> errors;
  const auto add = [&](const std::string& key, const std::string& value,
                       const std::string& problem) {
    const auto written = config.written.find("robot." + key);
    const ConfigPlace place = written == config.written.end()
                                  ? ConfigPlace{config.robot_file.generic_string(), 0, 0}
                                  : written->second;
    errors.push_back({place.file, place.line, place.column,
                      fmt::format("{} = \"{}\": {}", key, value, problem)});
  };
  for (const Role& role : roles_of(config.robot))
    if (const std::string problem = problem_of(role); !problem.empty())
      add(role.key, role.address, problem);
  const std::filesystem::path& account = config.robot.corrections.account;
  if (!has_corrections(config.robot) || account.empty()) return errors;
  if (const std::string problem = read_account(account).problem; !problem.empty())
    add("corrections.account", account.generic_string(), problem);
  return errors;
}

HardwareLinks::HardwareLinks(const RobotConfig& config,
                             const boost::asio::any_io_executor& executor, hal::Clock& clock)
    : executor_(executor), clock_(clock) {
  ends_.drive = open_can("drive", config.drive.link, drive_filters(config.drive));
  if (needs_pan(config.scanner)) {
    ends_.scanner = open_stream("scanner", config.scanner.link);
    open_pan(config.pan.link);
  } else {
    ends_.packets = open_datagrams("scanner", config.scanner.link);
    if (asks_ouster(config.scanner)) open_scanner_api(config.scanner.api_link);
  }
  if (has_obstacles(config)) ends_.obstacles = open_stream("obstacles", config.obstacles.link);
  ends_.imu = open_stream("imu", config.imu.link);
  ends_.gnss = open_stream("gnss", config.gnss.link);
  if (has_corrections(config)) open_corrections(config.corrections);
  ends_.power.battery = open_registers("power", config.power.battery_link);
  ends_.power.board = open_registers("power", config.power.board_link);
  ends_.power.safety = open_registers("power", config.power.safety_link);
}

HardwareLinks::~HardwareLinks() = default;

std::vector<drivers::Trouble> HardwareLinks::troubles(std::string_view role) const {
  std::vector<drivers::Trouble> all;
  for (const Named& named : named_) {
    if (named.role != role) continue;
    const auto its = named.link->troubles();
    all.insert(all.end(), its.begin(), its.end());
  }
  return all;
}

hal::CanBus* HardwareLinks::open_can(const std::string& role, const std::string& address,
                                     std::vector<hal::CanFilter> filters) {
  const drivers::LinkAddress at = parsed(address);
  if (const auto* usb = std::get_if<drivers::GsUsbAddress>(&at)) {
    if (!usb_) usb_ = std::make_unique<drivers::GsUsbBus>(executor_, clock_);
    auto& channel = usb_->channel(*usb);
    named_.push_back({role, &channel});
    return &channel;
  }
  auto bus = std::make_shared<drivers::SocketCan>(std::get<drivers::CanAddress>(at), executor_,
                                                  clock_, std::move(filters));
  owned_.push_back(bus);
  named_.push_back({role, bus.get()});
  return bus.get();
}

hal::ByteStream* HardwareLinks::open_stream(const std::string& role, const std::string& address) {
  const drivers::LinkAddress at = parsed(address);
  if (const auto* serial = std::get_if<drivers::SerialAddress>(&at))
    return &open_serial(role, serial->line);
  return &open_tcp(role, address);
}

drivers::SerialPort& HardwareLinks::open_serial(const std::string& role,
                                                const drivers::SerialLine& line) {
  auto port = std::make_shared<drivers::SerialPort>(line, executor_, clock_);
  owned_.push_back(port);
  named_.push_back({role, port.get()});
  return *port;
}

void HardwareLinks::open_pan(const std::string& address) {
  const drivers::LinkAddress at = parsed(address);
  const auto* serial = std::get_if<drivers::SerialAddress>(&at);
  if (serial == nullptr) {
    ends_.pan = &open_tcp("pan", address);
    return;
  }
  drivers::SerialPort& port = open_serial("pan", serial->line);
  ends_.pan = &port;
  ends_.pan_line = {serial->line, [&port](int baud) { return port.set_baud(baud); }};
}

drivers::TcpStream& HardwareLinks::open_tcp(const std::string& role, const std::string& address) {
  auto stream = std::make_shared<drivers::TcpStream>(std::get<drivers::TcpAddress>(parsed(address)),
                                                     executor_, clock_);
  owned_.push_back(stream);
  named_.push_back({role, stream.get()});
  return *stream;
}

void HardwareLinks::open_scanner_api(const std::string& address) {
  drivers::TcpStream& api = open_tcp("scanner", address);
  ends_.scanner_api = &api;
  ends_.drop_scanner_api = [&api] { api.drop(); };
  ends_.own_address = [&api] { return api.own_address(); };
}

// The file of the account may have gone since link_problems(): the caster's refusal says the rest.
void HardwareLinks::open_corrections(const CorrectionsConfig& config) {
  drivers::TcpStream& caster = open_tcp("corrections", config.link);
  ends_.corrections = &caster;
  ends_.drop_corrections = [&caster] { caster.drop(); };
  if (!config.account.empty()) ends_.account = read_account(config.account);
}

hal::Datagrams* HardwareLinks::open_datagrams(const std::string& role, const std::string& address) {
  auto port = std::make_shared<drivers::UdpPort>(std::get<drivers::UdpAddress>(parsed(address)),
                                                 executor_, clock_);
  owned_.push_back(port);
  named_.push_back({role, port.get()});
  return port.get();
}

// Units on one line share it.
hal::Registers* HardwareLinks::open_registers(const std::string& role, const std::string& address) {
  if (address.empty()) return nullptr;
  const drivers::LinkAddress at = parsed(address);
  const auto* rtu = std::get_if<drivers::ModbusRtuAddress>(&at);
  const std::uint8_t number =
      rtu != nullptr ? rtu->unit : std::get<drivers::ModbusTcpAddress>(at).unit;
  auto& bus = modbus_[address.substr(0, address.rfind('/'))];
  if (!bus) {
    const drivers::ModbusBus::Address place =
        rtu != nullptr ? drivers::ModbusBus::Address(*rtu)
                       : drivers::ModbusBus::Address(std::get<drivers::ModbusTcpAddress>(at));
    bus = std::make_unique<drivers::ModbusBus>(place, executor_, clock_);
  }
  auto& unit = bus->unit(number);
  named_.push_back({role, &unit});
  return &unit;
}

}  // namespace mission
