#include "drivers/link_address.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <optional>

namespace drivers {
namespace {

using Parsed = std::variant<LinkAddress, AddressError>;

// The example that an error shows.
struct Scheme {
  std::string_view name;
  std::string_view example;
  Parsed (*parse)(std::string_view rest);
};

AddressError wrong(std::string what) {
  return {std::move(what)};
}

std::string quoted(std::string_view text) {
  std::string shown = "\"";
  for (const char c : text.substr(0, 60))
    shown += std::isprint(static_cast<unsigned char>(c)) != 0 ? c : '?';
  return shown + (text.size() > 60 ? "...\"" : "\"");
}

std::optional<std::uint32_t> number(std::string_view text, std::uint32_t least,
                                    std::uint32_t most) {
  std::uint32_t value = 0;
  const auto [end, problem] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (problem != std::errc{} || end != text.data() + text.size() || value < least || value > most)
    return std::nullopt;
  return value;
}

// Splits at the last `mark`: the second is nothing where there is none.
std::pair<std::string_view, std::optional<std::string_view>> split_last(std::string_view text,
                                                                        char mark) {
  const auto at = text.rfind(mark);
  if (at == std::string_view::npos) return {text, std::nullopt};
  return {text.substr(0, at), text.substr(at + 1)};
}

bool is_name(std::string_view text) {
  return !text.empty() && std::all_of(text.begin(), text.end(), [](unsigned char c) {
    return std::isgraph(c) != 0 && c != '/' && c != '@';
  });
}

bool is_ipv4(std::string_view text) {
  int parts = 0;
  for (std::optional<std::string_view> rest = text; rest; ++parts) {
    const auto dot = rest->find('.');
    if (!number(rest->substr(0, dot), 0, 255)) return false;
    rest = dot == std::string_view::npos ? std::nullopt : std::optional(rest->substr(dot + 1));
  }
  return parts == 4;
}

Parsed parse_can(std::string_view rest) {
  if (!is_name(rest) || rest.find(':') != std::string_view::npos || rest.size() > 15)
    return wrong("an interface name has 1 to 15 characters, see `ip -br link`");
  return CanAddress{std::string(rest)};
}

Parsed parse_gs_usb(std::string_view rest) {
  const auto [where, rate] = split_last(rest, '@');
  const auto [serial, channel] = split_last(where, '/');
  const auto bit_rate = rate ? number(*rate, 10'000, 1'000'000) : std::nullopt;
  if (!bit_rate) return wrong("the bit rate comes behind @: 10000 to 1000000, as the robot's bus");
  const auto number_of_channel = channel ? number(*channel, 0, 255) : std::optional(0U);
  if (!number_of_channel) return wrong("the channel comes behind /: 0, 1 ...");
  if (!is_name(serial))
    return wrong("the adapter's serial number is missing; \"any\" takes the only one");
  return GsUsbAddress{std::string(serial), static_cast<std::uint8_t>(*number_of_channel),
                      *bit_rate};
}

// "PATH@115200", "PATH@9600E", "PATH@9600N2"
std::variant<SerialLine, AddressError> parse_line(std::string_view text) {
  const auto [path, speed] = split_last(text, '@');
  if (!path.starts_with('/'))
    return wrong(
        "the port's path begins with /: best one of /dev/serial/by-id, which stays the same");
  if (!speed) return wrong("the baud rate is missing: write @ and the rate behind the path");
  const auto digits = std::min(speed->find_first_not_of("0123456789"), speed->size());
  const auto baud = number(speed->substr(0, digits), 50, 4'000'000);
  if (!baud) return wrong("the baud rate is 50 to 4000000");
  const std::string_view frame = speed->substr(digits);
  SerialLine line{std::string(path), *baud, frame.empty() ? 'N' : frame[0],
                  static_cast<std::uint8_t>(frame.size() == 2 ? frame[1] - '0' : 1)};
  const bool known = (line.parity == 'N' || line.parity == 'E' || line.parity == 'O') &&
                     frame.size() <= 2 && (line.stop_bits == 1 || line.stop_bits == 2);
  if (!known)
    return wrong("behind the baud rate comes the parity N, E or O, and 2 for two stop bits");
  return line;
}

Parsed parse_serial(std::string_view rest) {
  auto line = parse_line(rest);
  if (auto* error = std::get_if<AddressError>(&line)) return std::move(*error);
  return SerialAddress{std::get<SerialLine>(std::move(line))};
}

// "host:port" or "[::1]:port"
std::variant<TcpAddress, AddressError> parse_host(std::string_view text) {
  const auto [written, port_text] = split_last(text, ':');
  const auto port = port_text ? number(*port_text, 1, 65535) : std::nullopt;
  if (!port) return wrong("the port comes behind the host: 1 to 65535");
  const bool bracketed = written.size() > 2 && written.front() == '[' && written.back() == ']';
  const auto host = bracketed ? written.substr(1, written.size() - 2) : written;
  if (!is_name(host) || host.find_first_of("[]") != std::string_view::npos)
    return wrong("the host is missing: a name or an IP address");
  if (!bracketed && host.find(':') != std::string_view::npos)
    return wrong("write an IPv6 address in brackets: [::1]");
  return TcpAddress{std::string(host), static_cast<std::uint16_t>(*port)};
}

Parsed parse_tcp(std::string_view rest) {
  auto host = parse_host(rest);
  if (auto* error = std::get_if<AddressError>(&host)) return std::move(*error);
  return std::get<TcpAddress>(std::move(host));
}

Parsed parse_udp(std::string_view rest) {
  const auto [port_text, from] = split_last(rest, '@');
  const auto port = number(port_text, 1, 65535);
  if (!port) return wrong("the port on which we listen is 1 to 65535");
  if (from && !is_ipv4(*from)) return wrong("behind @ comes the device's IPv4 address");
  return UdpAddress{static_cast<std::uint16_t>(*port), std::string(from.value_or(""))};
}

Parsed parse_modbus_tcp(std::string_view rest) {
  const auto [where, unit_text] = split_last(rest, '/');
  const auto unit = unit_text ? number(*unit_text, 0, 255) : std::nullopt;
  if (!unit) return wrong("the unit comes behind /: 0 to 255, see the device's manual");
  auto host = parse_host(where);
  if (auto* error = std::get_if<AddressError>(&host)) return std::move(*error);
  auto& tcp = std::get<TcpAddress>(host);
  return ModbusTcpAddress{std::move(tcp.host), tcp.port, static_cast<std::uint8_t>(*unit)};
}

Parsed parse_modbus_rtu(std::string_view rest) {
  const auto [where, unit_text] = split_last(rest, '/');
  const auto unit = unit_text ? number(*unit_text, 0, 247) : std::nullopt;
  if (!unit) return wrong("the unit comes behind the line's settings and /: 1 to 247");
  auto line = parse_line(where);
  if (auto* error = std::get_if<AddressError>(&line)) return std::move(*error);
  return ModbusRtuAddress{std::get<SerialLine>(std::move(line)), static_cast<std::uint8_t>(*unit)};
}

constexpr Scheme kSchemes[] = {
    {"can", "can:can0", parse_can},
    {"gs_usb", "gs_usb:any/0@500000", parse_gs_usb},
    {"serial", "serial:/dev/ttyUSB0@115200", parse_serial},
    {"tcp", "tcp:192.168.1.10:2111", parse_tcp},
    {"udp", "udp:2368", parse_udp},
    {"modbus-tcp", "modbus-tcp:192.168.1.20:502/1", parse_modbus_tcp},
    {"modbus-rtu", "modbus-rtu:/dev/ttyUSB0@9600N/1", parse_modbus_rtu},
};

std::string text_of(const SerialLine& line, std::string_view usual) {
  const std::string frame = line.parity + std::string(line.stop_bits == 2 ? "2" : "");
  return line.path + "@" + std::to_string(line.baud) + (frame == usual ? "" : frame);
}
std::string text_of(const std::string& host, std::uint16_t port) {
  return (host.find(':') == std::string::npos ? host : "[" + host + "]") + ":" +
         std::to_string(port);
}

struct Writer {
  std::string operator()(const CanAddress& a) const { return "can:" + a.interface; }
  std::string operator()(const GsUsbAddress& a) const {
    return "gs_usb:" + a.serial + "/" + std::to_string(a.channel) + "@" +
           std::to_string(a.bit_rate_bps);
  }
  std::string operator()(const SerialAddress& a) const { return "serial:" + text_of(a.line, "N"); }
  std::string operator()(const TcpAddress& a) const { return "tcp:" + text_of(a.host, a.port); }
  std::string operator()(const UdpAddress& a) const {
    return "udp:" + std::to_string(a.port) + (a.from.empty() ? "" : "@" + a.from);
  }
  std::string operator()(const ModbusTcpAddress& a) const {
    return "modbus-tcp:" + text_of(a.host, a.port) + "/" + std::to_string(a.unit);
  }
  std::string operator()(const ModbusRtuAddress& a) const {
    return "modbus-rtu:" + text_of(a.line, "") + "/" + std::to_string(a.unit);
  }
};

}  // namespace

Parsed parse_link_address(std::string_view text) {
  const auto colon = text.find(':');
  std::string known;
  for (const Scheme& scheme : kSchemes) {
    (known += known.empty() ? "" : ", ") += scheme.example;
    if (colon == std::string_view::npos || text.substr(0, colon) != scheme.name) continue;
    auto parsed = scheme.parse(text.substr(colon + 1));
    if (auto* error = std::get_if<AddressError>(&parsed))
      error->what = quoted(text) + ": " + error->what + ". Example: " + std::string(scheme.example);
    return parsed;
  }
  return wrong(quoted(text) + " is no link: it begins with its kind, as in " + known);
}

std::string to_text(const LinkAddress& address) {
  return std::visit(Writer{}, address);
}

}  // namespace drivers
