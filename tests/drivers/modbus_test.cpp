#include <gtest/gtest.h>

#include <random>

#include "drivers/can_offline.hpp"
#include "drivers/modbus_frames.hpp"
#include "drivers/safety_map.hpp"
#include "drivers/victron_map.hpp"
#include "drivers/waveshare_map.hpp"
#include "tests/drivers/recordings.hpp"
#include "tools/captures.hpp"

namespace drivers {
namespace {

using namespace modbus;
using drivers_test::from_hex;

// Bit by bit, as the standard's text says it.
std::uint16_t slow_crc16(ByteView bytes) {
  std::uint16_t crc = 0xFFFF;
  for (const auto byte : bytes) {
    crc = static_cast<std::uint16_t>(crc ^ byte);
    for (int i = 0; i < 8; ++i) {
      const bool low = (crc & 1) != 0;
      crc = static_cast<std::uint16_t>(crc >> 1);
      if (low) crc = static_cast<std::uint16_t>(crc ^ 0xA001);
    }
  }
  return crc;
}

TEST(ModbusCrc, IsTheSlowOne) {
  std::mt19937 random(5);
  for (int i = 0; i < 300; ++i) {
    Bytes bytes(random() % 260);
    for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random());
    EXPECT_EQ(crc16(bytes), slow_crc16(bytes));
  }
}

struct Golden {
  const char* hex;
  Side side;
  std::uint8_t unit;
  Pdu pdu;
};

// The relay board's manual, the recording and the standard's examples.
const std::vector<Golden>& golden() {
  static const std::vector<Golden> all{
      {"01 02 00 00 00 08 79 CC", Side::request, 1, Read{Function::read_discrete, 0, 8}},
      {"01 02 01 81 61 E8", Side::reply, 1,
       ReadBits{Function::read_discrete, {true, false, false, false, false, false, false, true}}},
      {"01 05 00 02 FF 00 2D FA", Side::request, 1, WriteOne{Function::write_coil, 2, 0xFF00}},
      {"01 05 00 02 FF 00 2D FA", Side::reply, 1, WriteOne{Function::write_coil, 2, 0xFF00}},
      {"01 01 00 00 00 08 3D CC", Side::request, 1, Read{Function::read_coils, 0, 8}},
      {"01 03 01 F4 00 01 C4 04", Side::request, 1, Read{Function::read_holding, 500, 1}},
      {"01 83 02 C0 F1", Side::reply, 1, Exception{3, 2}},
      {"09 03 00 01 00 01 D4 82", Side::request, 9, Read{Function::read_holding, 1, 1}},
      {"01 0F 00 00 00 08 01 FF BE D5", Side::request, 1, WriteBits{0, std::vector<bool>(8, true)}},
      {"00 06 20 00 00 05 43 D8", Side::request, 0, WriteOne{Function::write_register, 0x2000, 5}},
      {"00 03 80 00 00 01 AC 1B", Side::request, 0, Read{Function::read_holding, 0x8000, 1}},
  };
  return all;
}

TEST(ModbusRtu, ReadsAndWritesGoldenFrames) {
  for (const auto& [hex, side, unit, pdu] : golden()) {
    const Bytes bytes = from_hex(hex);
    const Look look = look_rtu(bytes, side);
    ASSERT_TRUE(look.at == Look::At::frame && look.size == bytes.size()) << hex;
    const RtuFrame frame = decode_rtu(bytes, side);
    EXPECT_EQ(frame.unit, unit) << hex;
    EXPECT_EQ(frame.pdu, pdu) << hex;
    EXPECT_EQ(encode_rtu({unit, pdu}), bytes) << hex;
  }
}

const std::vector<std::pair<Side, Pdu>>& every_pdu() {
  static const std::vector<std::pair<Side, Pdu>> all{
      {Side::request, Read{Function::read_input, 512, 8}},
      {Side::reply, ReadBits{Function::read_coils, std::vector<bool>(16, true)}},
      {Side::reply, ReadRegisters{Function::read_holding, {1, 0xFFFF, 3}}},
      {Side::reply, ReadRegisters{Function::read_input, std::vector<std::uint16_t>(125, 7)}},
      {Side::request, WriteOne{Function::write_register, 806, 1}},
      {Side::request, WriteBits{3, {true, false, true}}},
      {Side::request, WriteRegisters{9, {1, 2}}},
      {Side::reply, Written{Function::write_registers, 9, 2}},
      {Side::reply, Written{Function::write_coils, 3, 3}},
      {Side::reply, Exception{16, 11}}};
  return all;
}

TEST(Modbus, EveryPduComesBackOverBothTransports) {
  for (const auto& [side, pdu] : every_pdu()) {
    const Bytes rtu = encode_rtu({7, pdu});
    EXPECT_EQ(look_rtu(rtu, side).size, rtu.size());
    EXPECT_EQ(decode_rtu(rtu, side).pdu, pdu);
    const Bytes tcp = encode_tcp({0x1234, 100, pdu});
    EXPECT_EQ(look_tcp(tcp).size, tcp.size());
    const TcpFrame frame = decode_tcp(tcp, side);
    EXPECT_EQ(frame.transaction, 0x1234);
    EXPECT_EQ(frame.unit, 100);
    EXPECT_EQ(frame.pdu, pdu);
  }
}

TEST(Modbus, RefusesWhatTheProtocolForbids) {
  const std::tuple<const char*, Side, const char*> refused[] = {
      {"", Side::request, "length"},
      {"07", Side::request, "unknown function"},
      {"03 00 00 00", Side::request, "length"},
      {"03 00 00 00 00", Side::request, "count"},
      {"03 00 00 00 7E", Side::request, "count"},
      {"01 00 00 07 D1", Side::request, "count"},
      {"83 02", Side::request, "exception in a request"},
      {"83 02 00", Side::reply, "length"},
      {"03 00", Side::reply, "count"},
      {"03 03 00 01 02", Side::reply, "count"},
      {"03 04 00 01 02", Side::reply, "length"},
      {"10 00 00 00 02 02 00 01", Side::request, "count"},
      {"0F 00 00 00 09 01 FF", Side::request, "count"},
      {"10 00 00 00 00", Side::reply, "count"}};
  for (const auto& [hex, side, why] : refused)
    EXPECT_EQ(decode_pdu(from_hex(hex), side), Pdu(Unread{why})) << hex;
}

TEST(Modbus, DamagedStreamsLoseOnlyTheDamagedFrames) {
  for (const Side side : {Side::request, Side::reply}) {
    std::vector<Bytes> rtu, tcp;
    for (const auto& [of, pdu] : every_pdu()) {
      if (of != side) continue;
      rtu.push_back(encode_rtu({1, pdu}));
      tcp.push_back(encode_tcp({5, 1, pdu}));
    }
    const auto look = [side](ByteView front) { return look_rtu(front, side); };
    drivers_test::expect_whole_frames_survive(rtu, look, kRtuMax, from_hex("01 03 FF 99 01 83"));
    drivers_test::expect_flips_cost_one_frame(rtu, look, kRtuMax);
    EXPECT_EQ(drivers_test::frames_in(drivers_test::joined(tcp), look_tcp, kTcpMax, 3), tcp);
    tcp.insert(tcp.begin(), from_hex("FF FF FF"));
    auto rest = tcp;
    rest.erase(rest.begin());
    EXPECT_EQ(drivers_test::frames_in(drivers_test::joined(tcp), look_tcp, kTcpMax, 3), rest);
  }
}

TEST(Modbus, NamesEveryException) {
  for (const std::uint8_t code : {1, 2, 3, 4, 5, 6, 8, 10, 11})
    EXPECT_NE(exception_fault(code).name, "unknown exception") << int{code};
  EXPECT_EQ(exception_fault(99).name, "unknown exception");
}

TEST(Modbus, DecodesTheDialogueOfTwoOtherMakers) {
  RECORDING_OR_SKIP(text, "modbus/pymodbus_rtu_mbpoll.socat_hex.txt");
  const auto capture = captures::read(text, "dump");
  ASSERT_TRUE(capture);
  EXPECT_EQ(capture->format, captures::Format::socat);
  const auto decoder = modbus_offline();
  std::vector<std::string> names;
  std::vector<Field> bits;
  for (const auto& piece : capture->pieces)
    decoder->feed({piece.t_s, piece.from_device, piece.bytes}, [&](const Message& message) {
      names.push_back((message.from_device ? "< " : "> ") + message.name);
      if (names.size() == 2) bits = message.fields;
    });
  EXPECT_EQ(names, (std::vector<std::string>{
                       "> read discrete inputs", "< read discrete inputs", "> write coil",
                       "< write coil", "> read coils", "< read coils", "> read holding registers",
                       "< read holding registers: exception", "> read holding registers"}));
  EXPECT_TRUE(decoder->skipped().empty());
  ASSERT_EQ(bits.size(), 3U);
  EXPECT_EQ(bits[2].name, "bits");
  EXPECT_EQ(std::get<std::vector<double>>(bits[2].value),
            (std::vector<double>{1, 0, 0, 0, 0, 0, 0, 1}));
}

// --- Victron

TEST(Victron, ReadsTheSystemService) {
  const std::uint16_t image[]{265, 0xFFF4, 0xFEC0, 87, 2, 123, 90};
  const auto system = victron::system_of(image, 840);
  victron::System expected;
  expected.voltage_v = 26.5;
  expected.current_a = -1.2;
  expected.power_w = -320;
  expected.charge_percent = 87;
  expected.state = victron::ChargeState::discharging;
  expected.consumed_ah = -12.3;
  expected.time_to_go_s = 9000;
  EXPECT_EQ(system, expected);
}

TEST(Victron, SaysNothingForWhatTheDeviceDoesNotKnow) {
  const std::uint16_t image[]{0xFFFF, 0x7FFF, 0x7FFF, 0xFFFF, 0xFFFF, 0xFFFF, 0xFFFF};
  EXPECT_EQ(victron::system_of(image, 840), victron::System{});
  EXPECT_EQ(victron::system_of({}, 840), victron::System{});
  const std::uint16_t odd[]{265, 0, 0, 0, 9, 0, 0};
  EXPECT_EQ(victron::system_of(odd, 840).state, std::nullopt);
  EXPECT_EQ(victron::system_of(odd, 840).consumed_ah, 0);
}

TEST(Victron, ReadsABatteryFromSeveralRanges) {
  victron::Battery battery;
  // 256 power (two registers), 258, 259 voltage, 260, 261 current, 262 temperature, ...
  const std::uint16_t first[]{0xFFFF, 0xFEC0, 0xFEC0, 2650, 0xFFFF, 0xFFF4,
                              215,    0xFFFF, 0xFFFF, 123,  874};
  victron::take(battery, first, 256);
  const std::uint16_t second[]{90, 1000};
  victron::take(battery, second, 303);
  victron::Battery expected;
  expected.power_w = -320;
  expected.voltage_v = 26.5;
  expected.current_a = -1.2;
  expected.temperature_c = 21.5;
  expected.consumed_ah = -12.3;
  expected.charge_percent = 87.4;
  expected.time_to_go_s = 9000;
  EXPECT_EQ(battery, expected);
}

TEST(Victron, NamesAlarms) {
  std::vector<std::uint16_t> image(13);
  image[1] = 2;   // 268
  image[11] = 1;  // 278
  image[12] = 7;  // 279: no such value.
  const auto alarms = victron::alarms_in(image, 267);
  ASSERT_EQ(alarms.size(), 2U);
  EXPECT_EQ(alarms[0].fault->value, 268U);
  EXPECT_TRUE(alarms[0].severe);
  EXPECT_EQ(alarms[1].fault->value, 278U);
  EXPECT_FALSE(alarms[1].severe);
}

// The maker's own list: every register of ours is in it, with that type and scale.
TEST(Victron, AgreesWithTheMakersList) {
  RECORDING_OR_SKIP(text, "modbus/victron_attributes.csv");
  std::map<std::pair<std::string, std::string>, std::pair<std::string, std::string>> list;
  for (std::string_view rest = text; !rest.empty();) {
    auto line = take_field(rest, '\n');
    // Units and enumerations may have commas in quotes: the last four columns count.
    std::vector<std::string> columns;
    while (!line.empty()) columns.emplace_back(take_field(line, ','));
    if (columns.size() < 8) continue;
    const auto n = columns.size();
    list[{columns[0], columns[n - 4]}] = {columns[n - 3], columns[n - 2]};
  }
  const auto check = [&](const std::string& service, std::span<const victron::Register> registers) {
    for (const auto& reg : registers) {
      const auto found = list.find({service, std::to_string(reg.at)});
      ASSERT_NE(found, list.end()) << service << " " << reg.at;
      static const std::string kTypes[]{"uint16", "int16", "int32"};
      EXPECT_EQ(found->second.first, kTypes[static_cast<std::size_t>(reg.type)]) << reg.at;
      EXPECT_EQ(std::stod(found->second.second), reg.scale) << reg.at;
    }
  };
  check("com.victronenergy.system", victron::system_registers());
  check("com.victronenergy.battery", victron::battery_registers());
  // No range crosses a register that the service does not have.
  const auto whole = [&](const std::string& service, std::span<const hal::RegisterRange> ranges) {
    for (const auto& range : ranges)
      for (unsigned at = range.first; at < unsigned{range.first} + range.count; ++at) {
        const auto has = [&](unsigned reg) {
          return list.contains({service, std::to_string(reg)});
        };
        const bool low_word =
            at > 0 && has(at - 1) && list[{service, std::to_string(at - 1)}].first == "int32";
        EXPECT_TRUE(has(at) || low_word) << service << " " << at;
      }
  };
  whole("com.victronenergy.system", victron::system_ranges());
  whole("com.victronenergy.battery", victron::battery_ranges());
}

// --- Waveshare

TEST(Waveshare, WritesTheBytesOfTheManual) {
  const std::pair<Pdu, const char*> manual[] = {
      {waveshare::set_relay(0, waveshare::kOn), "01 05 00 00 FF 00 8C 3A"},
      {waveshare::set_relay(0, waveshare::kOff), "01 05 00 00 00 00 CD CA"},
      {waveshare::set_relay(0, waveshare::kToggle), "01 05 00 00 55 00 F2 9A"},
      {waveshare::set_all(true), "01 05 00 FF FF 00 BC 0A"},
      {waveshare::set_all(false), "01 05 00 FF 00 00 FD FA"},
      {waveshare::set_relays(0xFF), "01 0F 00 00 00 08 01 FF BE D5"},
      {waveshare::pulse_on(0, 7), "01 05 02 00 00 07 8D B0"},
      {waveshare::pulse_off(0, 8), "01 05 04 00 00 08 CD 3C"}};
  for (const auto& [pdu, hex] : manual) EXPECT_EQ(encode_rtu({1, pdu}), from_hex(hex)) << hex;
  const Pdu baud =
      WriteOne{Function::write_register, 0x2000, waveshare::serial_word({115200, 'N'}).value()};
  EXPECT_EQ(encode_rtu({0, baud}), from_hex("00 06 20 00 00 05 43 D8"));
}

TEST(Waveshare, ReadsChannelsVersionAndModes) {
  const auto pdu = decode_rtu(from_hex("01 02 01 81 61 E8"), Side::reply).pdu;
  EXPECT_EQ(waveshare::channels_of(std::get<ReadBits>(pdu).bits), waveshare::Channels(0x81));
  EXPECT_EQ(waveshare::channels_of({true, false}), std::nullopt);
  EXPECT_EQ(waveshare::version_of(200), 2.0);
  EXPECT_EQ(waveshare::mode_of(1), waveshare::ChannelMode::linked);
  EXPECT_EQ(waveshare::mode_of(4), std::nullopt);
  for (const std::uint32_t baud : {4800U, 9600U, 115200U, 256000U})
    for (const char parity : {'N', 'E', 'O'})
      EXPECT_EQ(waveshare::serial_of(waveshare::serial_word({baud, parity}).value()),
                (waveshare::Serial{baud, parity}));
  EXPECT_EQ(waveshare::serial_word({9601, 'N'}), std::nullopt);
  EXPECT_EQ(waveshare::serial_of(0x0308), std::nullopt);
}

// --- Safety

constexpr hal::Time at_ms(int ms) {
  return hal::Time(std::chrono::milliseconds(ms));
}

TEST(Safety, ReadsPilzStatusAndLamps) {
  EXPECT_EQ(safety::pilz_status({true, false, true}), (safety::PilzStatus{true, false, true}));
  EXPECT_EQ(safety::pilz_status({true}), std::nullopt);
  EXPECT_TRUE(safety::pilz_faults(0x1000).empty());
  const auto faults = safety::pilz_faults(0x0300);
  ASSERT_EQ(faults.size(), 3U);
  EXPECT_EQ(faults[2]->name, "safety controller does not run");
}

TEST(Safety, OnlyTwoAgreeingContactsAreReleased) {
  safety::ContactPair pair;
  EXPECT_EQ(pair.loop(at_ms(0)), safety::Loop::pressed);  // Nothing heard yet.
  pair.update(true, false, at_ms(0));
  EXPECT_EQ(pair.loop(at_ms(50)), safety::Loop::released);
  pair.update(false, true, at_ms(50));
  EXPECT_EQ(pair.loop(at_ms(50)), safety::Loop::pressed);
  // Between the two contacts: pressed at once, a fault only when it stays.
  pair.update(true, false, at_ms(100));
  pair.update(false, false, at_ms(150));
  EXPECT_EQ(pair.loop(at_ms(150)), safety::Loop::pressed);
  pair.update(false, false, at_ms(650));
  EXPECT_EQ(pair.loop(at_ms(650)), safety::Loop::pressed);
  pair.update(false, false, at_ms(651));
  EXPECT_EQ(pair.loop(at_ms(651)), safety::Loop::fault);
  pair.update(true, false, at_ms(700));
  EXPECT_EQ(pair.loop(at_ms(700)), safety::Loop::fault);
  pair.update(false, true, at_ms(750));
  pair.update(true, false, at_ms(800));
  EXPECT_EQ(pair.loop(at_ms(800)), safety::Loop::released);
  EXPECT_EQ(pair.loop(at_ms(1000)), safety::Loop::released);
  EXPECT_EQ(pair.loop(at_ms(1001)), safety::Loop::pressed);  // The board fell silent.
}

TEST(Safety, ResetCountsOnlyWhenPressedAndLetGo) {
  safety::ResetButton button;
  EXPECT_FALSE(button.update(true, at_ms(0)));  // Stuck from the start.
  EXPECT_FALSE(button.update(false, at_ms(500)));
  EXPECT_FALSE(button.update(true, at_ms(600)));
  EXPECT_FALSE(button.update(true, at_ms(700)));
  EXPECT_TRUE(button.update(false, at_ms(750)));
  EXPECT_FALSE(button.update(false, at_ms(800)));
  button.update(true, at_ms(900));
  EXPECT_FALSE(button.update(false, at_ms(950)));  // Too short.
  button.update(true, at_ms(1000));
  EXPECT_FALSE(button.stuck(at_ms(4000)));
  EXPECT_TRUE(button.stuck(at_ms(4001)));
  EXPECT_FALSE(button.update(false, at_ms(4001)));  // Too long.
}

}  // namespace
}  // namespace drivers
