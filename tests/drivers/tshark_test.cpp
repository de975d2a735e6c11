// Wireshark's dissectors against our decoders, on the frames of a whole simulated dialogue.
#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>
#include <set>

#include "drivers/canopen_codec.hpp"
#include "drivers/cia402_drive.hpp"
#include "drivers/modbus_frames.hpp"
#include "sim/cia402_unit.hpp"
#include "tests/drivers/drive_bench.hpp"
#include "tests/support/temp_folder.hpp"

namespace {

using namespace drivers_test;
using drivers::append_big;
using drivers::append_little;
using drivers::Bytes;
using drivers::ByteView;

constexpr std::uint32_t kSocketCan = 227, kRawIp = 101;

void write_pcap(const std::filesystem::path& file, std::uint32_t link_type,
                const std::vector<Bytes>& packets) {
  Bytes pcap;
  append_little<std::uint32_t>(pcap, 0xA1B2C3D4);
  append_little<std::uint16_t>(pcap, 2);
  append_little<std::uint16_t>(pcap, 4);
  for (const std::uint32_t word : {0U, 0U, 65535U, link_type})
    append_little<std::uint32_t>(pcap, word);
  std::uint32_t second = 0;
  for (const Bytes& packet : packets) {
    const auto size = static_cast<std::uint32_t>(packet.size());
    for (const std::uint32_t word : {second++, 0U, size, size})
      append_little<std::uint32_t>(pcap, word);
    pcap.insert(pcap.end(), packet.begin(), packet.end());
  }
  std::ofstream(file, std::ios::binary)
      .write(reinterpret_cast<const char*>(pcap.data()), static_cast<std::streamsize>(pcap.size()));
}

bool has_tshark() {
  return std::system("command -v tshark >/dev/null 2>&1") == 0;
}

// One line a packet, the fields separated by ';'.
std::vector<std::string> dissect(const std::filesystem::path& file, const std::string& options,
                                 const std::vector<std::string>& fields) {
  std::string command =
      "tshark -r '" + file.string() + "' " + options + " -T fields -E 'separator=;'";
  for (const std::string& field : fields) command += " -e " + field;
  std::vector<std::string> lines;
  FILE* const pipe = popen((command + " 2>/dev/null").c_str(), "r");
  EXPECT_NE(pipe, nullptr);
  char text[4096];
  while (std::fgets(text, sizeof text, pipe) != nullptr) {
    lines.emplace_back(text);
    if (lines.back().ends_with('\n')) lines.back().pop_back();
  }
  EXPECT_EQ(pclose(pipe), 0);
  return lines;
}

std::string hex(std::uint64_t value, int digits) {
  char text[32];
  std::snprintf(text, sizeof text, "0x%0*llx", digits, static_cast<unsigned long long>(value));
  return text;
}

std::string hex(ByteView bytes) {
  std::string text;
  for (const std::uint8_t byte : bytes) text += hex(byte, 2).substr(2);
  return text;
}

std::string joined(const std::vector<std::string>& parts, char between) {
  std::string text;
  for (std::size_t i = 0; i < parts.size(); ++i)
    text += (i == 0 ? "" : std::string(1, between)) + parts[i];
  return text;
}

// --- CANopen.

const std::vector<std::string> kCanFields{"can.id",
                                          "canopen.nmt_ctrl.cd",
                                          "canopen.nmt_ctrl.node_id",
                                          "canopen.nmt_guard.state",
                                          "canopen.em.err_code",
                                          "canopen.em.err_reg",
                                          "canopen.pdo.data.bytes",
                                          "canopen.sdo.main_idx",
                                          "canopen.sdo.sub_idx",
                                          "canopen.sdo.ccs",
                                          "canopen.sdo.scs",
                                          "canopen.sdo.toggle",
                                          "canopen.sdo.abort_code"};

// What the dissector must say, by our decoder.
struct CanopenLine {
  std::vector<std::string> at = std::vector<std::string>(kCanFields.size());

  void operator()(const drivers::Unread& unread) { at[1] = unread.why; }
  void operator()(const drivers::canopen::Nmt& m) {
    at[1] = hex(static_cast<std::uint8_t>(m.command), 2);
    at[2] = hex(m.node, 2);
  }
  void operator()(const drivers::canopen::Sync&) {}
  void operator()(const drivers::canopen::TimeStamp&) {}
  void operator()(const drivers::canopen::NodeGuardQuery&) {}
  void operator()(const drivers::canopen::Emergency& m) {
    at[4] = hex(m.code, 4);
    at[5] = hex(m.error_register, 2);
  }
  void operator()(const drivers::canopen::Pdo& m) { at[6] = hex(ByteView(m.data).first(m.size)); }
  void operator()(const drivers::canopen::Heartbeat& m) {
    at[3] = hex(static_cast<std::uint8_t>(m.state), 2);
  }
  void operator()(const drivers::canopen::Sdo& m) {
    using Kind = drivers::canopen::SdoKind;
    const bool segment = m.kind == Kind::read_segment_request || m.kind == Kind::write_segment ||
                         m.kind == Kind::read_segment || m.kind == Kind::write_segment_reply;
    if (!segment) {
      at[7] = hex(m.index, 4);
      at[8] = hex(m.sub, 2);
    }
    // CiA 301's command specifiers, in the order of SdoKind.
    static constexpr const char* kSpecifiers[]{"2", "3", "1", "0", "2", "0", "3", "1", "4"};
    at[m.from_node ? 10 : 9] = kSpecifiers[static_cast<std::size_t>(m.kind)];
    if (segment) at[11] = m.toggle ? "1" : "0";
    if (m.kind == Kind::abort) at[12] = hex(m.abort_code, 8);
  }
};

struct FrameTap : DriveBench {
  std::vector<hal::CanFrame> frames;

  hal::Task<void> record(hal::CanBus& bus) {
    for (;;)
      if (const auto received = co_await bus.receive()) frames.push_back(received->frame);
  }
};

// Two drives started, driven, failing and reset.
std::vector<hal::CanFrame> canopen_dialogue() {
  FrameTap bench;
  sim::UnitFaults left_faults(bench.clock), right_faults(bench.clock);
  sim::Cia402NodeConfig left, right;
  right.node = 2;
  sim::Cia402Unit unit(left, right, bench.world, bench.clock, bench.wire.attach(),
                       bench.wire.attach(), left_faults, right_faults);
  drivers::Cia402Drive drive({}, bench.clock, bench.wire.attach());
  bench.spawn(bench.record(bench.wire.attach()));
  bench.spawn(unit.run());
  bench.spawn(drive.run());
  bench.spawn(bench.commander(drive));
  bench.twist = {0.3, 0.1};
  bench.wait(3s);
  unit.left().fail(0x2310);
  bench.wait(3s);
  return bench.frames;
}

TEST(Tshark, SeesOurCanopenFramesAsWeDo) {
  if (!has_tshark()) GTEST_SKIP() << "tshark is not installed (apt-get install tshark)";
  const test::TempFolder folder;
  const auto frames = canopen_dialogue();
  std::vector<Bytes> packets;
  for (const hal::CanFrame& frame : frames) {
    Bytes packet;
    append_big<std::uint32_t>(packet, frame.id);
    append_big<std::uint32_t>(packet, std::uint32_t{frame.size} << 24);
    packet.insert(packet.end(), frame.data.begin(), frame.data.begin() + frame.size);
    packets.push_back(packet);
  }
  const auto file = folder.path() / "canopen.pcap";
  write_pcap(file, kSocketCan, packets);
  const auto seen = dissect(file, "-d can.subdissector,canopen", kCanFields);
  ASSERT_EQ(seen.size(), frames.size());
  std::set<std::size_t> kinds;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const auto message = drivers::canopen::decode(frames[i]);
    kinds.insert(message.index());
    CanopenLine line;
    line.at[0] = std::to_string(frames[i].id);
    std::visit(line, message);
    ASSERT_EQ(seen[i], joined(line.at, ';')) << "frame " << i;
  }
  EXPECT_GT(frames.size(), 1500u);
  EXPECT_EQ(kinds.size(), 6u) << "NMT, SYNC, EMCY, PDO, SDO, heartbeat";
}

// --- Modbus.

const std::vector<std::string> kModbusFields{
    "mbtcp.trans_id",        "mbtcp.unit_id",  "modbus.func_code",     "modbus.reference_num",
    "modbus.word_cnt",       "modbus.bit_cnt", "modbus.regval_uint16", "modbus.bitval",
    "modbus.exception_code", "modbus.data"};

struct ModbusLine {
  std::vector<std::string> at = std::vector<std::string>(kModbusFields.size());

  static bool of_bits(drivers::modbus::Function function) {
    using F = drivers::modbus::Function;
    return function == F::read_coils || function == F::read_discrete || function == F::write_coils;
  }
  void range(drivers::modbus::Function function, unsigned first, std::size_t count) {
    at[2] = std::to_string(static_cast<int>(function));
    at[3] = std::to_string(first);
    at[of_bits(function) ? 5 : 4] = std::to_string(count);
  }
  template <class T>
  static std::string list(const T& values) {
    std::vector<std::string> parts;
    for (const unsigned value : values) parts.push_back(std::to_string(value));
    return joined(parts, ',');
  }

  void operator()(const drivers::Unread& unread) { at[9] = unread.why; }
  void operator()(const drivers::modbus::Read& m) { range(m.function, m.first, m.count); }
  void operator()(const drivers::modbus::ReadBits& m) {
    at[2] = std::to_string(static_cast<int>(m.function));
    at[7] = list(m.bits);
  }
  void operator()(const drivers::modbus::ReadRegisters& m) {
    at[2] = std::to_string(static_cast<int>(m.function));
    at[6] = list(m.values);
  }
  void operator()(const drivers::modbus::WriteOne& m) {
    at[2] = std::to_string(static_cast<int>(m.function));
    at[3] = std::to_string(m.at);
    at[9] = hex(m.value, 4).substr(2);
  }
  void operator()(const drivers::modbus::WriteBits& m) {
    range(drivers::modbus::Function::write_coils, m.first, m.bits.size());
    unsigned byte = 0;
    for (std::size_t i = 0; i < m.bits.size(); ++i) byte |= m.bits[i] ? 1U << i : 0;
    at[9] = hex(byte, 2).substr(2);
  }
  void operator()(const drivers::modbus::WriteRegisters& m) {
    range(drivers::modbus::Function::write_registers, m.first, m.values.size());
    at[6] = list(m.values);
  }
  void operator()(const drivers::modbus::Written& m) { range(m.function, m.first, m.count); }
  void operator()(const drivers::modbus::Exception& m) {
    at[2] = std::to_string(m.function);
    at[8] = std::to_string(m.code);
  }
};

// An IPv4 packet of one TCP segment; no checksums, which the dissector does not ask for.
Bytes tcp_segment(bool reply, std::uint32_t sent, std::uint32_t heard, ByteView data) {
  Bytes packet{0x45, 0};
  append_big<std::uint16_t>(packet, static_cast<std::uint16_t>(40 + data.size()));
  for (const std::uint32_t word : {0x00004000U, 0x40060000U, reply ? 0x0A000002U : 0x0A000001U,
                                   reply ? 0x0A000001U : 0x0A000002U})
    append_big<std::uint32_t>(packet, word);
  append_big<std::uint16_t>(packet, reply ? 502 : 40000);
  append_big<std::uint16_t>(packet, reply ? 40000 : 502);
  for (const std::uint32_t word : {sent, heard, 0x5018FFFFU, 0U})
    append_big<std::uint32_t>(packet, word);
  packet.insert(packet.end(), data.begin(), data.end());
  return packet;
}

TEST(Tshark, SeesOurModbusFramesAsWeDo) {
  if (!has_tshark()) GTEST_SKIP() << "tshark is not installed (apt-get install tshark)";
  using namespace drivers::modbus;
  const std::vector<bool> bits{true, false, false, true, false, false, false, true};
  const std::vector<std::pair<Pdu, Pdu>> dialogue{
      {Read{Function::read_holding, 259, 3},
       ReadRegisters{Function::read_holding, {0, 2640, 65535}}},
      {Read{Function::read_input, 520, 1}, ReadRegisters{Function::read_input, {0x1000}}},
      {Read{Function::read_coils, 0, 8}, ReadBits{Function::read_coils, bits}},
      {Read{Function::read_discrete, 8192, 8}, ReadBits{Function::read_discrete, bits}},
      {WriteOne{Function::write_coil, 0x0200, 7}, WriteOne{Function::write_coil, 0x0200, 7}},
      {WriteOne{Function::write_register, 0x1000, 1},
       WriteOne{Function::write_register, 0x1000, 1}},
      {WriteBits{0, bits}, Written{Function::write_coils, 0, 8}},
      {WriteRegisters{806, {1, 0xABCD}}, Written{Function::write_registers, 806, 2}},
      {Read{Function::read_holding, 500, 1}, Exception{3, 2}},
      {Read{Function::read_holding, 259, 1}, Exception{3, 11}}};
  const test::TempFolder folder;
  std::vector<Bytes> packets;
  std::vector<std::string> wanted;
  std::uint32_t sent[2]{1, 1};
  for (std::size_t i = 0; i < 2 * dialogue.size(); ++i) {
    const bool reply = i % 2 == 1;
    const auto transaction = static_cast<std::uint16_t>(100 + i / 2);
    const Pdu& pdu = reply ? dialogue[i / 2].second : dialogue[i / 2].first;
    const Bytes frame = encode_tcp({transaction, 226, pdu});
    packets.push_back(tcp_segment(reply, sent[reply], sent[!reply], frame));
    sent[reply] += static_cast<std::uint32_t>(frame.size());
    ModbusLine line;
    line.at[0] = std::to_string(transaction);
    line.at[1] = "226";
    const TcpFrame decoded = decode_tcp(frame, reply ? Side::reply : Side::request);
    std::visit(line, decoded.pdu);
    wanted.push_back(joined(line.at, ';'));
  }
  const auto file = folder.path() / "modbus.pcap";
  write_pcap(file, kRawIp, packets);
  EXPECT_EQ(dissect(file, "", kModbusFields), wanted);
}

}  // namespace
