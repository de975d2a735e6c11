// Where a link is, as written in a robot file. Pure.
//
//   can:can0                            gs_usb:SERIAL/CHANNEL@500000   (SERIAL "any": the only one)
//   serial:/dev/ttyUSB0@115200          serial:/dev/ttyUSB0@9600E   (8 data bits; N, E or O; 2 stop
//   tcp:192.168.1.10:2111               bits: @9600N2)
//   udp:2368                            udp:2368@192.168.1.201      (only from there)
//   modbus-tcp:192.168.1.20:502/1       modbus-rtu:/dev/ttyUSB0@9600N/1
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <variant>

namespace drivers {

struct SerialLine {
  std::string path;
  std::uint32_t baud{};
  char parity = 'N';  // 'N', 'E' or 'O'.
  std::uint8_t stop_bits = 1;
  bool operator==(const SerialLine&) const = default;
};

struct CanAddress {
  std::string interface;
  bool operator==(const CanAddress&) const = default;
};
struct GsUsbAddress {
  std::string serial;  // "any"
  std::uint8_t channel{};
  std::uint32_t bit_rate_bps{};
  bool operator==(const GsUsbAddress&) const = default;
};
struct SerialAddress {
  SerialLine line;
  bool operator==(const SerialAddress&) const = default;
};
struct TcpAddress {
  std::string host;  // A name, an IPv4 or an IPv6 address (in brackets where written).
  std::uint16_t port{};
  bool operator==(const TcpAddress&) const = default;
};
struct UdpAddress {
  std::uint16_t port{};
  std::string from;  // IPv4 address; empty: from anywhere.
  bool operator==(const UdpAddress&) const = default;
};
struct ModbusTcpAddress {
  std::string host;
  std::uint16_t port{};
  std::uint8_t unit{};
  bool operator==(const ModbusTcpAddress&) const = default;
};
struct ModbusRtuAddress {
  SerialLine line;
  std::uint8_t unit{};
  bool operator==(const ModbusRtuAddress&) const = default;
};

using LinkAddress = std::variant<CanAddress, GsUsbAddress, SerialAddress, TcpAddress, UdpAddress,
                                 ModbusTcpAddress, ModbusRtuAddress>;

struct AddressError {
  std::string what;  // What is wrong, and what to write instead.
};

std::variant<LinkAddress, AddressError> parse_link_address(std::string_view text);
std::string to_text(const LinkAddress& address);  // Reads back as the same.

}  // namespace drivers
