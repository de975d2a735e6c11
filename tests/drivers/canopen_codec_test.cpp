#include "drivers/canopen_codec.hpp"

#include <gtest/gtest.h>

#include <random>
#include <set>

#include "tests/drivers/can_frames.hpp"
#include "tests/drivers/recordings.hpp"

namespace drivers::canopen {
namespace {

using drivers_test::can;
using drivers_test::can_frames;

Sdo sdo(std::uint8_t node, bool from_node, SdoKind kind, std::uint16_t index, std::uint8_t sub) {
  Sdo message;
  message.node = node;
  message.from_node = from_node;
  message.kind = kind;
  message.index = index;
  message.sub = sub;
  return message;
}
Sdo with_data(Sdo message, const Bytes& data) {
  message.expedited = true;
  message.size = static_cast<std::uint32_t>(data.size());
  message.data_size = static_cast<std::uint8_t>(data.size());
  std::copy(data.begin(), data.end(), message.data.begin());
  return message;
}
Sdo read_request(std::uint8_t node, std::uint16_t index, std::uint8_t sub = 0) {
  return sdo(node, false, SdoKind::read_request, index, sub);
}
Sdo read_reply(std::uint8_t node, std::uint16_t index, std::uint8_t sub, const Bytes& data) {
  return with_data(sdo(node, true, SdoKind::read_reply, index, sub), data);
}
Sdo write_request(std::uint8_t node, std::uint16_t index, std::uint8_t sub, const Bytes& data) {
  return with_data(sdo(node, false, SdoKind::write_request, index, sub), data);
}
Sdo write_reply(std::uint8_t node, std::uint16_t index, std::uint8_t sub = 0) {
  return sdo(node, true, SdoKind::write_reply, index, sub);
}
Sdo abort(std::uint8_t node, bool from_node, std::uint16_t index, std::uint32_t code) {
  Sdo message = sdo(node, from_node, SdoKind::abort, index, 0);
  message.abort_code = code;
  return message;
}
Sdo segment(SdoKind kind, bool from_node, bool toggle, const Bytes& data = {}, bool last = false) {
  Sdo message = sdo(5, from_node, kind, 0, 0);
  message.toggle = toggle;
  message.last = last;
  message.data_size = static_cast<std::uint8_t>(data.size());
  std::copy(data.begin(), data.end(), message.data.begin());
  return message;
}
Pdo pdo(std::uint8_t node, std::uint8_t number, bool from_node, const Bytes& data) {
  Pdo message{node, number, from_node, false, static_cast<std::uint8_t>(data.size()), {}};
  std::copy(data.begin(), data.end(), message.data.begin());
  return message;
}

TEST(Canopen, ReadsAndWritesEveryService) {
  Sdo announced = sdo(5, true, SdoKind::read_reply, 0x1008, 0);
  announced.size = 26;
  Sdo to_come = sdo(5, false, SdoKind::write_request, 0x1008, 0);
  to_come.size = 10;
  Sdo unsized = with_data(sdo(2, false, SdoKind::write_request, 0x6040, 0), {6, 0, 0, 0});
  unsized.size.reset();
  const std::pair<const char*, Message> golden[] = {
      {"000#0102", Nmt{NmtCommand::start, 2}},
      {"000#8100", Nmt{NmtCommand::reset_node, 0}},
      {"080#", Sync{}},
      {"080#11", Sync{0x11}},
      {"100#0A00000B0D0E", TimeStamp{0x0B00000A, 0x0E0D}},
      {"082#1081110090000000", Emergency{2, 0x8110, 0x11, {0, 0x90, 0, 0, 0}}},
      {"182#4007", pdo(2, 1, true, {0x40, 0x07})},
      {"27F#", pdo(127, 1, false, {})},
      {"381#01", pdo(1, 3, true, {1})},
      {"503#0102030405060708", pdo(3, 4, false, {1, 2, 3, 4, 5, 6, 7, 8})},
      {"702#00", Heartbeat{2, NodeState::boot_up, false}},
      {"702#FF", Heartbeat{2, NodeState::pre_operational, true}},
      {"702#R", NodeGuardQuery{2}},
      {"605#4041600000000000", read_request(5, 0x6041)},
      {"585#4B41600037070000", read_reply(5, 0x6041, 0, {0x37, 0x07})},
      {"605#2F60600003000000", write_request(5, 0x6060, 0, {3})},
      {"605#2B40600006000000", write_request(5, 0x6040, 0, {6, 0})},
      {"605#27FF600101020300", write_request(5, 0x60FF, 1, {1, 2, 3})},
      {"605#23FF6000E8030000", write_request(5, 0x60FF, 0, {0xE8, 3, 0, 0})},
      {"602#2240600006000000", unsized},
      {"585#6040600000000000", write_reply(5, 0x6040)},
      {"585#410810001A000000", announced},
      {"605#210810000A000000", to_come},
      {"605#6000000000000000", segment(SdoKind::read_segment_request, false, false)},
      {"605#7000000000000000", segment(SdoKind::read_segment_request, false, true)},
      {"585#0041424344454647",
       segment(SdoKind::read_segment, true, false, {0x41, 0x42, 0x43, 0x44, 0x45, 0x46, 0x47})},
      {"585#1B58590000000000", segment(SdoKind::read_segment, true, true, {0x58, 0x59}, true)},
      {"605#1B58590000000000", segment(SdoKind::write_segment, false, true, {0x58, 0x59}, true)},
      {"585#3000000000000000", segment(SdoKind::write_segment_reply, true, true)},
      {"582#8034120000000206", abort(2, true, 0x1234, 0x06020000)},
      {"602#8000100000000405", abort(2, false, 0x1000, 0x05040000)},
  };
  for (const auto& [text, message] : golden) {
    EXPECT_EQ(decode(can(text)), message) << text;
    EXPECT_EQ(encode(message), can(text)) << text;
  }
}

TEST(Canopen, RefusesWhatIsNoService) {
  const std::pair<const char*, const char*> refused[] = {
      {"000#01", "length"},
      {"000#0302", "no such NMT command"},
      {"000#0180", "no such node"},
      {"001#0102", "no such service"},
      {"080#0102", "length"},
      {"082#00", "length"},
      {"100#01", "length"},
      {"101#010203040506", "no such service"},
      {"180#01", "no such node"},
      {"700#05", "no such node"},
      {"702#0500", "length"},
      {"702#06", "no such node state"},
      {"605#40", "length"},
      {"605#404160", "length"},
      {"605#2B4060000600", "length"},
      {"605#A041600000000000", "SDO block transfer or unknown command"},
      {"6FF#05", "no such service"},
      {"7FF#05", "no such service"},
      {"00000702#05", "extended id"},
      {"605#R", "remote frame"}};
  for (const auto& [text, why] : refused) {
    EXPECT_EQ(decode(can(text)), Message(Unread{why})) << text;
  }
  // Some clients send only what counts of a read request.
  EXPECT_EQ(decode(can("605#40416000")), Message(read_request(5, 0x6041)));
}

TEST(Canopen, ReadsTheSlaveOfAnotherMaker) {
  RECORDING_OR_SKIP(text, "can/pycanopen_localnode_sdo_heartbeat.log");
  std::vector<Message> expected;
  const auto beats = [&](int count, NodeState state) {
    expected.insert(expected.end(), static_cast<std::size_t>(count), Heartbeat{2, state, false});
  };
  const auto pre = NodeState::pre_operational;
  beats(25, pre);
  expected.push_back(read_request(2, 0x1000));
  expected.push_back(read_reply(2, 0x1000, 0, {0x92, 0x01, 0xFF, 0xFF}));
  beats(2, pre);
  expected.push_back(read_request(2, 0x60FF));
  expected.push_back(read_reply(2, 0x60FF, 0, {0, 0, 0, 0}));
  beats(1, pre);
  expected.push_back(write_request(2, 0x60FF, 0, {0xE8, 3, 0, 0}));
  beats(1, pre);
  expected.push_back(write_reply(2, 0x60FF));
  beats(2, pre);
  expected.push_back(read_request(2, 0x60FF));
  expected.push_back(read_reply(2, 0x60FF, 0, {0xE8, 3, 0, 0}));
  beats(3, pre);
  expected.push_back(read_request(2, 0x1234));
  expected.push_back(abort(2, true, 0x1234, 0x06020000));
  beats(1, pre);
  expected.push_back(Nmt{NmtCommand::start, 2});
  beats(3, NodeState::operational);
  std::vector<Message> read;
  for (const auto& frame : can_frames(text)) {
    read.push_back(decode(frame));
    EXPECT_EQ(encode(read.back()), frame);
  }
  EXPECT_EQ(read, expected);
}

TEST(Canopen, ReadsTheTracesOfRealDrives) {
  RECORDING_OR_SKIP(text, "can/real_device_snippets.candump.txt");
  // Up to the frames of bases that do not speak CANopen.
  const auto drives = text.substr(0, text.find("# --- AgileX"));
  std::vector<Message> read;
  for (const auto& frame : can_frames(drives)) read.push_back(decode(frame));
  const std::vector<Message> epos{
      pdo(2, 1, true, {0x40, 0x07}),         pdo(2, 1, false, {0x06, 0x00}),
      pdo(2, 1, true, {0x21, 0x07}),         pdo(2, 1, false, {0x07, 0x00}),
      pdo(2, 1, true, {0x23, 0x07}),         pdo(2, 1, false, {0x0F, 0x00}),
      pdo(2, 1, true, {0x37, 0x07}),         read_request(2, 0x6041),
      read_reply(2, 0x6041, 0, {0x37, 0x07})};
  const std::vector<Message> nanotec{read_request(5, 0x6041),
                                     read_reply(5, 0x6041, 0, {0x40, 0x02}),
                                     write_request(5, 0x6060, 0, {1}),
                                     write_reply(5, 0x6060),
                                     pdo(5, 1, true, {0x40, 0x06, 0, 0, 0, 0}),
                                     write_request(5, 0x6040, 0, {6, 0}),
                                     write_reply(5, 0x6040),
                                     pdo(5, 1, true, {0x21, 0x06, 0, 0, 0, 0}),
                                     write_request(5, 0x6040, 0, {7, 0}),
                                     write_reply(5, 0x6040),
                                     pdo(5, 1, true, {0x33, 0x06, 0, 0, 0, 0}),
                                     write_request(5, 0x6040, 0, {15, 0}),
                                     write_reply(5, 0x6040),
                                     pdo(5, 1, true, {0x37, 0x06, 0, 0, 0, 0})};
  const std::vector<Message> ingenia{Heartbeat{1, NodeState::boot_up, false},
                                     Nmt{NmtCommand::reset_communication, 0},
                                     read_request(2, 0x1000),
                                     Sync{},
                                     abort(2, false, 0x1000, 0x05040000),
                                     read_request(2, 0x1000),
                                     Heartbeat{2, NodeState::boot_up, false},
                                     read_reply(2, 0x1000, 0, {0x92, 0x01, 0x02, 0x00}),
                                     Emergency{2, 0x8110, 0x11, {0, 0, 0, 0, 0}},
                                     Emergency{2, 0x8110, 0x11, {0, 0x90, 0, 0, 0}},
                                     read_reply(2, 0x1000, 0, {0x92, 0x01, 0x02, 0x00})};
  const std::vector<Message> lely{Heartbeat{2, NodeState::boot_up, false},
                                  read_request(2, 0x1000),
                                  read_reply(2, 0x1000, 0, {0, 0, 0, 0}),
                                  read_request(2, 0x1018, 1),
                                  read_reply(2, 0x1018, 1, {0x60, 3, 0, 0}),
                                  write_request(2, 0x1016, 1, {0xD0, 7, 1, 0}),
                                  write_reply(2, 0x1016, 1),
                                  write_request(2, 0x1017, 0, {0xE8, 3}),
                                  write_reply(2, 0x1017),
                                  Heartbeat{2, NodeState::pre_operational, false},
                                  Sync{},
                                  pdo(2, 1, false, {0, 0, 0, 0}),
                                  Nmt{NmtCommand::start, 2},
                                  Heartbeat{2, NodeState::operational, false}};
  const std::vector<Message> oriental{write_request(1, 0x60FE, 1, {0, 0, 0x80, 1}),
                                      sdo(1, true, SdoKind::abort, 0x60FE, 1),
                                      write_request(1, 0x6072, 0, {0x10, 0x27}),
                                      abort(1, true, 0x6072, 0x06010002),
                                      read_request(1, 0x6041),
                                      read_reply(1, 0x6041, 0, {0x37, 0x06}),
                                      read_request(1, 0x606C),
                                      read_reply(1, 0x606C, 0, {0x68, 0xFA, 0xFF, 0xFF}),
                                      write_request(2, 0x60FF, 0, {0xBA, 3, 0, 0}),
                                      write_reply(2, 0x60FF),
                                      write_request(1, 0x60FF, 0, {0x68, 0xFA, 0xFF, 0xFF}),
                                      write_reply(1, 0x60FF)};
  std::vector<Message> expected;
  for (const auto* part : {&epos, &nanotec, &ingenia, &lely, &oriental})
    expected.insert(expected.end(), part->begin(), part->end());
  for (Message& message : expected)
    if (auto* one = std::get_if<Sdo>(&message); one != nullptr && one->index == 0x60FE)
      if (one->kind == SdoKind::abort) one->abort_code = 0x06010002;
  ASSERT_EQ(read.size(), expected.size());
  for (std::size_t i = 0; i < read.size(); ++i) EXPECT_EQ(read[i], expected[i]) << i;
}

TEST(Canopen, AnyFrameIsUnreadOrReadsTheSameAfterWriting) {
  std::mt19937 random(3);
  std::set<std::size_t> seen;
  for (int i = 0; i < 300000; ++i) {
    hal::CanFrame frame;
    frame.id = random() % 0x800;
    if (i % 4 == 0) frame.id &= 0x780;
    frame.size = static_cast<std::uint8_t>(random() % 10);
    for (auto& byte : frame.data) byte = static_cast<std::uint8_t>(random());
    if (i % 3 == 0) frame.data[0] = static_cast<std::uint8_t>(i % 2 == 0 ? 0x05 : 0x82);
    frame.remote = i % 50 == 0;
    const Message message = decode(frame);
    seen.insert(message.index());
    if (!std::holds_alternative<Unread>(message)) {
      EXPECT_EQ(decode(encode(message)), message) << frame.id << " " << i;
    }
  }
  EXPECT_EQ(seen.size(), std::variant_size_v<Message>);
}

TEST(Canopen, NamesAbortsEmergenciesAndErrorBits) {
  EXPECT_EQ(abort_fault(0x06020000).name, "no such object");
  EXPECT_EQ(abort_fault(0x08000022).value, 0x08000022U);
  EXPECT_EQ(abort_fault(0x12345678).name, "unknown abort code");
  EXPECT_EQ(emergency_fault(0x0000).name, "no error");
  EXPECT_EQ(emergency_fault(0x8130).name, "heartbeat lost");
  EXPECT_EQ(emergency_fault(0x2311).name, "current error");
  EXPECT_EQ(emergency_fault(0x2311).value, 0x2311U);
  EXPECT_EQ(emergency_fault(0xFF12).name, "device-specific error");
  EXPECT_EQ(emergency_fault(0x00FF).name, "unknown error");
  for (std::uint32_t code = 0; code <= 0xFFFF; ++code) {
    const Fault fault = emergency_fault(static_cast<std::uint16_t>(code));
    ASSERT_FALSE(fault.name.empty() || fault.cause.empty() || fault.remedy.empty()) << code;
  }
  for (unsigned bit = 0; bit < 8; ++bit)
    EXPECT_EQ(faults_set(error_register_faults(), 1U << bit).size(), 1U);
}

}  // namespace
}  // namespace drivers::canopen
