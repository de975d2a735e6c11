#include "drivers/modbus_frames.hpp"

#include <algorithm>
#include <array>
#include <cassert>

namespace drivers::modbus {
namespace {

constexpr std::uint16_t kBitsReadMax = 2000, kRegistersReadMax = 125, kBitsWriteMax = 1968,
                        kRegistersWriteMax = 123;

std::size_t bytes_for(std::size_t bits) {
  return (bits + 7) / 8;
}

bool reads_bits(Function function) {
  return function == Function::read_coils || function == Function::read_discrete;
}

std::vector<bool> bits_in(ByteView bytes, std::size_t count) {
  std::vector<bool> bits(count);
  for (std::size_t i = 0; i < count; ++i) bits[i] = (bytes[i / 8] >> (i % 8) & 1) != 0;
  return bits;
}

std::vector<std::uint16_t> registers_in(ByteView bytes) {
  std::vector<std::uint16_t> values(bytes.size() / 2);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = big<std::uint16_t>(bytes, 2 * i);
  return values;
}

void append_bits(Bytes& bytes, const std::vector<bool>& bits) {
  bytes.push_back(static_cast<std::uint8_t>(bytes_for(bits.size())));
  const std::size_t begin = bytes.size();
  bytes.resize(begin + bytes_for(bits.size()));
  for (std::size_t i = 0; i < bits.size(); ++i)
    if (bits[i])
      bytes[begin + i / 8] = static_cast<std::uint8_t>(bytes[begin + i / 8] | 1U << (i % 8));
}

void append_registers(Bytes& bytes, const std::vector<std::uint16_t>& values) {
  bytes.push_back(static_cast<std::uint8_t>(2 * values.size()));
  for (const auto value : values) append_big<std::uint16_t>(bytes, value);
}

bool is_known(std::uint8_t function) {
  return !name(Function{function}).empty();
}

bool is_write_one(Function function) {
  return function == Function::write_coil || function == Function::write_register;
}
bool is_write_many(Function function) {
  return function == Function::write_coils || function == Function::write_registers;
}

// How long the PDU at the front of `bytes` is; nothing while that cannot be said. The function must
// be known.
std::optional<std::size_t> pdu_size(ByteView bytes, Side side) {
  const Function function{bytes[0]};
  if ((bytes[0] & 0x80) != 0) return 2;
  const std::size_t counted_at = side == Side::reply ? 1 : 5;
  const bool counted = is_write_many(function) == (side == Side::request);
  if (is_write_one(function) || !counted) return 5;
  if (bytes.size() <= counted_at) return std::nullopt;
  return counted_at + 1 + bytes[counted_at];
}

Pdu decode_write_many(Function function, ByteView pdu) {
  const auto first = big<std::uint16_t>(pdu, 1), count = big<std::uint16_t>(pdu, 3);
  const ByteView data = pdu.subspan(6);
  const bool bits = function == Function::write_coils;
  const std::size_t wanted = bits ? bytes_for(count) : 2U * count;
  if (count == 0 || count > (bits ? kBitsWriteMax : kRegistersWriteMax) || data.size() != wanted)
    return Unread{"count"};
  if (bits) return WriteBits{first, bits_in(data, count)};
  return WriteRegisters{first, registers_in(data)};
}

Pdu decode_request(Function function, ByteView pdu) {
  if (is_write_many(function)) return decode_write_many(function, pdu);
  const auto first = big<std::uint16_t>(pdu, 1), second = big<std::uint16_t>(pdu, 3);
  if (is_write_one(function)) return WriteOne{function, first, second};
  if (second == 0 || second > (reads_bits(function) ? kBitsReadMax : kRegistersReadMax))
    return Unread{"count"};
  return Read{function, first, second};
}

Pdu decode_reply(Function function, ByteView pdu) {
  if (is_write_one(function))
    return WriteOne{function, big<std::uint16_t>(pdu, 1), big<std::uint16_t>(pdu, 3)};
  if (is_write_many(function)) {
    const auto first = big<std::uint16_t>(pdu, 1), count = big<std::uint16_t>(pdu, 3);
    const bool bits = function == Function::write_coils;
    if (count == 0 || count > (bits ? kBitsWriteMax : kRegistersWriteMax)) return Unread{"count"};
    return Written{function, first, count};
  }
  const ByteView data = pdu.subspan(2);
  if (data.empty() || data.size() > bytes_for(kBitsReadMax)) return Unread{"count"};
  if (reads_bits(function)) return ReadBits{function, bits_in(data, 8 * data.size())};
  if (data.size() % 2 != 0) return Unread{"count"};
  return ReadRegisters{function, registers_in(data)};
}

struct PduEncoder {
  Bytes operator()(const Unread&) const {
    assert(!"nothing to encode");
    return {};
  }
  Bytes operator()(const Read& m) const { return two(m.function, m.first, m.count); }
  Bytes operator()(const WriteOne& m) const { return two(m.function, m.at, m.value); }
  Bytes operator()(const Written& m) const { return two(m.function, m.first, m.count); }
  Bytes operator()(const ReadBits& m) const {
    Bytes bytes{static_cast<std::uint8_t>(m.function)};
    append_bits(bytes, m.bits);
    return bytes;
  }
  Bytes operator()(const ReadRegisters& m) const {
    Bytes bytes{static_cast<std::uint8_t>(m.function)};
    append_registers(bytes, m.values);
    return bytes;
  }
  Bytes operator()(const WriteBits& m) const {
    Bytes bytes = two(Function::write_coils, m.first, static_cast<std::uint16_t>(m.bits.size()));
    append_bits(bytes, m.bits);
    return bytes;
  }
  Bytes operator()(const WriteRegisters& m) const {
    Bytes bytes =
        two(Function::write_registers, m.first, static_cast<std::uint16_t>(m.values.size()));
    append_registers(bytes, m.values);
    return bytes;
  }
  Bytes operator()(const Exception& m) const {
    return {static_cast<std::uint8_t>(m.function | 0x80), m.code};
  }

 private:
  static Bytes two(Function function, std::uint16_t first, std::uint16_t second) {
    Bytes bytes{static_cast<std::uint8_t>(function)};
    append_big<std::uint16_t>(bytes, first);
    append_big<std::uint16_t>(bytes, second);
    return bytes;
  }
};

constexpr Fault kExceptions[] = {
    {1, "illegal function", "the device does not know the function", "compare with its manual"},
    {2, "illegal address", "the range has a register that the device does not have",
     "compare with its register list; read smaller ranges"},
    {3, "illegal value", "the value or count is not allowed", "compare with its manual"},
    {4, "device failure", "the device could not do it", "restart the device; see its display"},
    {5, "acknowledged", "it takes longer", "ask again later"},
    {6, "device busy", "it does something else", "ask again later"},
    {8, "memory parity error", "the device's memory", "service"},
    {10, "gateway path unavailable", "the gateway does not know the unit",
     "check the unit id in the gateway's list of services"},
    {11, "gateway target silent", "the device behind the gateway does not answer",
     "check its power and cable"},
};

}  // namespace

std::string_view name(Function function) {
  switch (function) {
    case Function::read_coils:
      return "read coils";
    case Function::read_discrete:
      return "read discrete inputs";
    case Function::read_holding:
      return "read holding registers";
    case Function::read_input:
      return "read input registers";
    case Function::write_coil:
      return "write coil";
    case Function::write_register:
      return "write register";
    case Function::write_coils:
      return "write coils";
    case Function::write_registers:
      return "write registers";
  }
  return {};
}

Pdu decode_pdu(ByteView pdu, Side side) {
  if (pdu.empty()) return Unread{"length"};
  const bool exception = (pdu[0] & 0x80) != 0;
  if (exception && side == Side::request) return Unread{"exception in a request"};
  if (!exception && !is_known(pdu[0])) return Unread{"unknown function"};
  if (pdu_size(pdu, side) != pdu.size()) return Unread{"length"};
  if (exception) return Exception{static_cast<std::uint8_t>(pdu[0] & 0x7F), pdu[1]};
  const Function function{pdu[0]};
  return side == Side::request ? decode_request(function, pdu) : decode_reply(function, pdu);
}

Bytes encode_pdu(const Pdu& pdu) {
  return std::visit(PduEncoder{}, pdu);
}

Fault exception_fault(std::uint8_t code) {
  const auto* found = std::find_if(std::begin(kExceptions), std::end(kExceptions),
                                   [&](const Fault& fault) { return fault.value == code; });
  if (found != std::end(kExceptions)) return *found;
  return {code, "unknown exception", "not in the Modbus standard", "see the device's manual"};
}

std::uint16_t crc16(ByteView bytes) {
  static constexpr auto kTable = [] {
    std::array<std::uint16_t, 256> table{};
    for (unsigned i = 0; i < 256; ++i) {
      unsigned value = i;
      for (int bit = 0; bit < 8; ++bit) value = value >> 1 ^ ((value & 1) != 0 ? 0xA001U : 0U);
      table[i] = static_cast<std::uint16_t>(value);
    }
    return table;
  }();
  std::uint16_t crc = 0xFFFF;
  for (const auto byte : bytes)
    crc = static_cast<std::uint16_t>(crc >> 8 ^ kTable[(crc ^ byte) & 0xFF]);
  return crc;
}

Look look_rtu(ByteView front, Side side) {
  if (front.size() < 2) return Look::more();
  const ByteView pdu = front.subspan(1);
  const bool exception = (pdu[0] & 0x80) != 0 && side == Side::reply;
  if (!is_known(pdu[0]) && !(exception && is_known(pdu[0] & 0x7F)))
    return Look::none("unknown function");
  const auto size = pdu_size(pdu, side);
  if (!size) return Look::more();
  const std::size_t whole = 1 + *size + 2;
  if (whole > kRtuMax) return Look::none("length");
  if (front.size() < whole) return Look::more();
  if (little<std::uint16_t>(front, whole - 2) != crc16(front.first(whole - 2)))
    return Look::none("checksum");
  return Look::frame(whole);
}

RtuFrame decode_rtu(ByteView frame, Side side) {
  return {frame[0], decode_pdu(frame.subspan(1, frame.size() - 3), side)};
}

Bytes encode_rtu(const RtuFrame& frame) {
  Bytes bytes{frame.unit};
  const Bytes pdu = encode_pdu(frame.pdu);
  bytes.insert(bytes.end(), pdu.begin(), pdu.end());
  append_little<std::uint16_t>(bytes, crc16(bytes));
  return bytes;
}

Look look_tcp(ByteView front) {
  if (front.size() < 6) return Look::more();
  if (big<std::uint16_t>(front, 2) != 0) return Look::none("no Modbus header");
  const std::size_t length = big<std::uint16_t>(front, 4);
  if (length < 2 || length > 1 + kPduMax) return Look::none("no Modbus header");
  return front.size() < 6 + length ? Look::more() : Look::frame(6 + length);
}

TcpFrame decode_tcp(ByteView frame, Side side) {
  return {big<std::uint16_t>(frame, 0), frame[6], decode_pdu(frame.subspan(7), side)};
}

Bytes encode_tcp(const TcpFrame& frame) {
  const Bytes pdu = encode_pdu(frame.pdu);
  Bytes bytes;
  append_big<std::uint16_t>(bytes, frame.transaction);
  append_big<std::uint16_t>(bytes, 0);
  append_big<std::uint16_t>(bytes, static_cast<std::uint16_t>(pdu.size() + 1));
  bytes.push_back(frame.unit);
  bytes.insert(bytes.end(), pdu.begin(), pdu.end());
  return bytes;
}

}  // namespace drivers::modbus
