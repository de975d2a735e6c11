// What tools like tcpdump, Wireshark, candump and socat write down, as pieces in the order in which
// they were on the wire. Pure: from the bytes of a file to values.
#pragma once

#include <boost/system/result.hpp>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/offline.hpp"

namespace captures {

enum class Format {
  detect,
  pcap,     // And pcapng: Ethernet with IPv4 and UDP or TCP, SocketCAN.
  json,     // tshark's JSON: a list of objects with _source.layers.tcp["tcp.payload"].
  candump,  // "(t) can0 123#AABB" or "can0 123 [2] AA BB".
  socat,    // The dump of socat -x or -v.
  raw,      // The bytes themselves.
};
std::optional<Format> format_named(std::string_view name);
std::string_view name(Format format);

struct Piece {
  std::optional<double> t_s;  // Since 1970, or since whatever the file counts from.
  bool from_device = true;
  drivers::Bytes bytes;
  std::uint32_t can_id{};
  bool can_extended{}, can_remote{};
  std::size_t conversation{};  // Pieces of one are one dialogue: one connection, one CAN bus.
};

struct Capture {
  Format format = Format::raw;
  std::vector<std::string> conversations;  // "192.168.1.2:2111 - 192.168.1.9:51000", "can0"
  std::vector<Piece> pieces;
  drivers::SkippedBy skipped;  // Packets and lines that are no piece, by reason.
};

struct Options {
  Format format = Format::detect;
  bool swap_sides = false;              // The device is the other side.
  std::optional<std::uint16_t> port{};  // Only UDP and TCP with this port.
};

struct Error {
  std::string file;
  int line{};  // 0 for binary files.
  std::string what;

  std::string text() const;  // "FILE:LINE: what"
};
template <class T>
using Result = boost::system::result<T, Error>;
[[noreturn]] void throw_exception_from_error(const Error& error,
                                             const boost::source_location& where);

// Fails when the file is not of its format at all; what is damaged inside is skipped and counted.
// The device's side of a TCP connection is the one that was connected to, else the lower port; of a
// socat dump the first address ('>'); UDP and tshark JSON are taken as sent by the device.
Result<Capture> read(std::string_view file, std::string_view file_name,
                     const Options& options = {});

// What a file looks like.
Format detect(std::string_view file);

}  // namespace captures
