// The real links of a robot, opened where its file says. Like main.cpp it may know everything.
#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/gs_usb.hpp"
#include "drivers/link_trouble.hpp"
#include "drivers/modbus_client.hpp"
#include "drivers/serial_port.hpp"
#include "drivers/tcp_stream.hpp"
#include "mission/config.hpp"
#include "mission/main_robot.hpp"

namespace mission {

// What is wrong with the links of the robot file: unreadable, or not of the device's kind.
std::vector<ConfigError> link_problems(const MissionConfig& config);

class HardwareLinks {
 public:
  // The configuration must have no link_problems(). Begins to open everything at once; what cannot
  // be opened is tried again, and links() say why. `clock` must outlive the event loop.
  HardwareLinks(const RobotConfig& config, const boost::asio::any_io_executor& executor,
                hal::Clock& clock);
  ~HardwareLinks();

  const RobotDrivers::Links& ends() const { return ends_; }

  struct Named {
    std::string role;  // As in NamedDevice.
    drivers::Link* link{};
  };
  const std::vector<Named>& links() const { return named_; }
  // Of all links of that role, present now.
  std::vector<drivers::Trouble> troubles(std::string_view role) const;

 private:
  hal::CanBus* open_can(const std::string& role, const std::string& address,
                        std::vector<hal::CanFilter> filters);
  hal::ByteStream* open_stream(const std::string& role, const std::string& address);
  drivers::SerialPort& open_serial(const std::string& role, const drivers::SerialLine& line);
  void open_pan(const std::string& address);
  drivers::TcpStream& open_tcp(const std::string& role, const std::string& address);
  void open_scanner_api(const std::string& address);
  void open_corrections(const CorrectionsConfig& config);
  hal::Datagrams* open_datagrams(const std::string& role, const std::string& address);
  hal::Registers* open_registers(const std::string& role, const std::string& address);

  boost::asio::any_io_executor executor_;
  hal::Clock& clock_;
  std::vector<std::shared_ptr<void>> owned_;
  std::unique_ptr<drivers::GsUsbBus> usb_;
  std::map<std::string, std::unique_ptr<drivers::ModbusBus>> modbus_;  // By address without unit.
  std::vector<Named> named_;
  RobotDrivers::Links ends_;
};

}  // namespace mission
