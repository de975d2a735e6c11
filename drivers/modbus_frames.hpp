// Modbus as it stands on the wire, for captures and simulated devices. (At run time a library does
// the wire.) Registers are big-endian; addresses count from 0.
#pragma once

#include <optional>
#include <string_view>
#include <variant>
#include <vector>

#include "drivers/bytes.hpp"
#include "drivers/fault.hpp"
#include "drivers/resync.hpp"
#include "drivers/unread.hpp"

namespace drivers::modbus {

constexpr std::size_t kPduMax = 253;
constexpr std::size_t kRtuMax = 256;          // Unit, PDU, CRC.
constexpr std::size_t kTcpMax = 7 + kPduMax;  // MBAP header and PDU.

enum class Function : std::uint8_t {
  read_coils = 1,
  read_discrete = 2,
  read_holding = 3,
  read_input = 4,
  write_coil = 5,
  write_register = 6,
  write_coils = 15,
  write_registers = 16,
};
std::string_view name(Function function);

// Which way a frame goes: request and reply look alike on the wire.
enum class Side : std::uint8_t { request, reply };

struct Read {  // Request.
  Function function{};
  std::uint16_t first{}, count{};
  bool operator==(const Read&) const = default;
};
struct ReadBits {  // Reply of 1 and 2. Padding to whole bytes is part of it: the request has the
                   // count.
  Function function{};
  std::vector<bool> bits;
  bool operator==(const ReadBits&) const = default;
};
struct ReadRegisters {  // Reply of 3 and 4.
  Function function{};
  std::vector<std::uint16_t> values;
  bool operator==(const ReadRegisters&) const = default;
};
struct WriteOne {  // Request and reply of 5 and 6.
  Function function{};
  std::uint16_t at{};
  std::uint16_t value{};  // A coil: 0xFF00 on, 0 off; some boards have more, see waveshare_map.hpp.
  bool operator==(const WriteOne&) const = default;
};
struct WriteBits {  // Request of 15.
  std::uint16_t first{};
  std::vector<bool> bits;
  bool operator==(const WriteBits&) const = default;
};
struct WriteRegisters {  // Request of 16.
  std::uint16_t first{};
  std::vector<std::uint16_t> values;
  bool operator==(const WriteRegisters&) const = default;
};
struct Written {  // Reply of 15 and 16.
  Function function{};
  std::uint16_t first{}, count{};
  bool operator==(const Written&) const = default;
};
struct Exception {          // Reply.
  std::uint8_t function{};  // Without bit 7.
  std::uint8_t code{};      // See exception_fault().
  bool operator==(const Exception&) const = default;
};

using Pdu = std::variant<Unread, Read, ReadBits, ReadRegisters, WriteOne, WriteBits, WriteRegisters,
                         Written, Exception>;

// Unread for other functions, lengths that do not fit and counts beyond the protocol's limits.
Pdu decode_pdu(ByteView pdu, Side side);
// Of anything but Unread, within the protocol's limits.
Bytes encode_pdu(const Pdu& pdu);

Fault exception_fault(std::uint8_t code);

// --- Serial line: unit, PDU, CRC.

std::uint16_t crc16(ByteView bytes);

struct RtuFrame {
  std::uint8_t unit{};
  Pdu pdu;
};
// What stands at the front of a stream of frames that all go one way.
Look look_rtu(ByteView front, Side side);
RtuFrame decode_rtu(ByteView frame, Side side);  // Of a frame that look_rtu() has seen.
Bytes encode_rtu(const RtuFrame& frame);

// --- TCP: transaction, 0, length, unit, PDU.

struct TcpFrame {
  std::uint16_t transaction{};
  std::uint8_t unit{};
  Pdu pdu;
};
Look look_tcp(ByteView front);
TcpFrame decode_tcp(ByteView frame, Side side);
Bytes encode_tcp(const TcpFrame& frame);

}  // namespace drivers::modbus
