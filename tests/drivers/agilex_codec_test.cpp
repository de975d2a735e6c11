#include "drivers/agilex_codec.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "tests/drivers/can_frames.hpp"
#include "tests/drivers/recordings.hpp"

namespace drivers::agilex {
namespace {

using drivers_test::can;
using drivers_test::can_frames;

Message v2(const char* text) {
  return decode(can(text), Dialect::v2);
}
Message v1(const char* text) {
  return decode(can(text), Dialect::v1);
}

// Bytes from the makers' manuals, all values of each message.
TEST(Agilex, ReadsAndWritesEveryVersion2Message) {
  const std::pair<const char*, Message> golden[] = {
      {"111#0096000000000000", MotionCommand{150, 0, 0, 0}},
      {"111#0000003200000000", MotionCommand{0, 50, 0, 0}},
      {"111#FF38FF9C00010002", MotionCommand{-200, -100, 1, 2}},
      {"121#0103320200000007", LightCommand{true, {3, 50}, {2, 0}, 7}},
      {"131#0109", BrakeCommand{true, 9}},
      {"141#0200000000000000", MotionModeCommand{2}},
      {"421#01", ControlModeCommand{ControlMode::can}},
      {"441#03", ResetCommand{3}},
      {"411#01", VersionQuery{}},
      {"211#0203010300800005",
       SystemState{VehicleState::exception, ControlMode::rc, 25.9, 0x8000, 5}},
      {"221#FFFF000200030004", MotionState{-1, 2, 3, 4}},
      {"231#0001000264000000", LightState{false, {1, 0}, {2, 100}, 0}},
      {"241#E4F6649C01FF0061", RcState{{Switch::unknown, Switch::middle, Switch::up, Switch::down},
                                       -10,
                                       100,
                                       -100,
                                       1,
                                       -1,
                                       0x61}},
      {"252#FF9CFFF6FFFFFB77", MotorFast{2, -100, -1.0, -1161}},
      {"263#01070027D8400000", MotorSlow{3, 26.3, 39, -40, 0x40}},
      {"311#FFFFFFC100000012", Odometry{-63, 18}},
      {"361#4B630100FFCEFF38", BatteryBasic{75, 99, 25.6, -5.0, -20.0}},
      {"362#01020304", BatteryExtended{{1, 2}, {3, 4}}},
      {"41A#0102030405060708", Version{0x0102, 0x0304, 0x0506, 0x0708}},
  };
  for (const auto& [text, message] : golden) {
    EXPECT_EQ(v2(text), message) << text;
    EXPECT_EQ(encode(message), can(text)) << text;
  }
  EXPECT_EQ(v2("4A1#0102030405060708"), v2("41A#0102030405060708"));
  EXPECT_EQ(v2("421#0100000000000000"), Message(ControlModeCommand{ControlMode::can}));
}

TEST(Agilex, ReadsAndWritesEveryVersion1Message) {
  const Message messages[] = {V1Command{1, 0, 50, -20, 0, 3},
                              V1Motion{-150, 20, 0xE4},
                              V1LightCommand{true, {3, 9}, {1, 0}, 1},
                              V1LightState{false, {0, 0}, {2, 14}, 0xE3},
                              V1State{VehicleState::estop_pressed, 0, 23.9, 0x003C, 0xE5},
                              V1Motor{4, -1.5, 300, 45, 0xEA}};
  for (const Message& message : messages) {
    const auto frame = encode(message);
    EXPECT_EQ(decode(frame, Dialect::v1), message) << message.index();
    EXPECT_EQ(dialect_of(frame), Dialect::v1);
    for (std::size_t byte = 0; byte < 8; ++byte) {
      auto damaged = frame;
      damaged.data[byte] ^= 0x10;
      EXPECT_EQ(decode(damaged, Dialect::v1), Message(Unread{"checksum"}));
    }
  }
}

TEST(Agilex, ReadsTheScoutVersion1Recording) {
  RECORDING_OR_SKIP(text, "can/agilex_scout_v1_candump_short.txt");
  const Message expected[] = {V1Motion{0, 0, 0xE4},
                              V1LightState{false, {0, 0}, {2, 14}, 0xE3},
                              V1State{VehicleState::estop_pressed, 0, 23.9, 0x003C, 0xE5},
                              V1Motor{1, 0, 0, 0, 0xEA},
                              V1Motor{2, 0, 0, 0, 0xEA},
                              V1Motor{3, 0, 0, 0, 0xEA},
                              V1Motor{4, 0, 0, 0, 0xEA}};
  const auto frames = can_frames(text);
  ASSERT_EQ(frames.size(), std::size(expected));
  for (std::size_t i = 0; i < frames.size(); ++i) {
    EXPECT_EQ(dialect_of(frames[i]), Dialect::v1);
    EXPECT_EQ(decode(frames[i], Dialect::v1), expected[i]) << i;
    EXPECT_EQ(encode(expected[i]), frames[i]) << i;
  }
}

TEST(Agilex, ReadsBunkerAndHunterFromTheRecording) {
  RECORDING_OR_SKIP(text, "can/real_device_snippets.candump.txt");
  std::vector<Message> read;
  for (const auto& frame : can_frames(text)) {
    const Message message = decode(frame, Dialect::v2);
    if (!std::holds_alternative<Unread>(message)) read.push_back(message);
  }
  constexpr auto kUp = Switch::up;
  const std::vector<Message> expected{
      SystemState{VehicleState::estop_pressed, ControlMode::standby, 25.6, 0x8000, 0},
      MotionState{},
      RcState{{kUp, kUp, kUp, kUp}, 0, 0, 0, 0, 0, 0x61},
      Odometry{},
      MotorFast{1, 0, 1.5, 84},
      MotorFast{3, 0, 0.7, 0xFFFEAA},
      MotorFast{2, 0, 0.7, 0xFFFB77},
      MotionState{0, 0, 0, -1},
      Odometry{-63, 18},
      SystemState{VehicleState::normal, ControlMode::standby, 25.9, 0, 0xB1},
      MotorSlow{3, 26.3, 39, -40, 0x40},
      SystemState{VehicleState::normal, ControlMode::standby, 25.9, 0, 0xB2}};
  EXPECT_EQ(read, expected);
}

TEST(Agilex, RefusesWhatIsNoMessage) {
  EXPECT_EQ(v2("112#00"), Message(Unread{"unknown id"}));
  EXPECT_EQ(v2("211#00000000000000"), Message(Unread{"length"}));
  EXPECT_EQ(v2("211#0300000000000000"), Message(Unread{"no such vehicle state"}));
  EXPECT_EQ(v2("211#0004000000000000"), Message(Unread{"no such control mode"}));
  EXPECT_EQ(v2("421#03"), Message(Unread{"no such control mode"}));
  EXPECT_EQ(v2("441#05"), Message(Unread{"no such motor"}));
  EXPECT_EQ(v2("411#00"), Message(Unread{"no such query"}));
  EXPECT_EQ(v2("211#R"), Message(Unread{"remote frame"}));
  EXPECT_EQ(v2("00000211#0000000000000000"), Message(Unread{"extended id"}));
  EXPECT_EQ(v1("151#0300000000000000"), Message(Unread{"checksum"}));
  auto frame = can("211#0000000000000000");
  frame.size = 9;
  EXPECT_EQ(decode(frame, Dialect::v2), Message(Unread{"length"}));
}

TEST(Agilex, TellsTheDialectFromSingleFrames) {
  EXPECT_EQ(dialect_of(can("211#0000000000000000")), Dialect::v2);
  EXPECT_EQ(dialect_of(can("251#0000000000000000")), Dialect::v2);
  EXPECT_EQ(dialect_of(can("131#000000000000E41E")), Dialect::v1);
  EXPECT_EQ(dialect_of(can("131#0100")), std::nullopt);
  EXPECT_EQ(dialect_of(can("200#0000000000000000")), std::nullopt);  // Wrong checksum.
  EXPECT_EQ(dialect_of(can("701#05")), std::nullopt);
}

TEST(Agilex, EveryFaultBitHasAName) {
  const auto all = [](std::span<const Fault> table, unsigned bits) {
    for (unsigned bit = 0; bit < bits; ++bit) {
      const auto found = faults_set(table, 1U << bit);
      ASSERT_EQ(found.size(), 1U) << bit;
      EXPECT_FALSE(found[0]->name.empty() || found[0]->cause.empty() || found[0]->remedy.empty());
    }
    EXPECT_TRUE(faults_set(table, 0).empty());
    EXPECT_EQ(faults_set(table, (1U << bits) - 1).size(), bits);
  };
  all(system_faults(), 16);
  all(motor_faults(), 8);
  all(v1_faults(), 16);
}

TEST(Agilex, OdometryGoesOnAcrossTheWrap) {
  constexpr auto kMax = std::numeric_limits<std::int32_t>::max();
  constexpr auto kMin = std::numeric_limits<std::int32_t>::min();
  EXPECT_EQ(travelled_mm(kMax - 1, kMin + 2), 4);
  EXPECT_EQ(travelled_mm(kMin + 2, kMax - 1), -4);
  EXPECT_EQ(travelled_mm(-63, 18), 81);
  EXPECT_EQ(travelled_mm(kMax, kMax), 0);
}

TEST(Agilex, CommandsStayWithinTheLimitsAndOnThePath) {
  EXPECT_EQ(motion_command({0.15, 0.05}, kScout2), (MotionCommand{150, 50, 0, 0}));
  EXPECT_EQ(motion_command({3.0, 1.0}, kScout2), (MotionCommand{1500, 500, 0, 0}));
  EXPECT_EQ(motion_command({-1.0, 5.046}, kScout2), (MotionCommand{-500, 2523, 0, 0}));
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  EXPECT_EQ(motion_command({kNan, 1}, kScout2), MotionCommand{});
  EXPECT_EQ(motion_command({1, -kInfinity}, kScout2), MotionCommand{});
  std::mt19937 random(1);
  std::uniform_real_distribution<double> speed(-1e4, 1e4);
  for (int i = 0; i < 10000; ++i) {
    const hal::Twist twist{speed(random), speed(random) * (i % 7)};
    const MotionCommand command = motion_command(twist, kScoutMini);
    EXPECT_LE(std::abs(command.forward_mmps), 3000);
    EXPECT_LE(std::abs(command.turn_mradps), 2523);
    // The same curvature, up to rounding to whole units.
    EXPECT_NEAR(command.forward_mmps * twist.turn_radps, command.turn_mradps * twist.forward_mps,
                0.51 * (std::abs(twist.turn_radps) + std::abs(twist.forward_mps)));
  }
}

TEST(Agilex, EncodedNumbersAreClampedToTheWire) {
  const auto frame = encode(BatteryBasic{0, 0, 1e9, -1e9, std::nan("")});
  EXPECT_EQ(decode(frame, Dialect::v2), Message(BatteryBasic{0, 0, 3276.7, -3276.8, 0}));
}

// Whatever the bytes are: it is a message that encodes to a frame with the same meaning, or Unread.
TEST(Agilex, AnyFrameIsUnreadOrReadsTheSameAfterWriting) {
  std::mt19937 random(2);
  int read = 0;
  for (int i = 0; i < 200000; ++i) {
    hal::CanFrame frame;
    frame.id = random() % 0x500;
    frame.size = static_cast<std::uint8_t>(random() % 9);
    for (std::size_t k = 0; k < frame.size; ++k)
      frame.data[k] = static_cast<std::uint8_t>(random() % 5);
    for (const auto dialect : {Dialect::v1, Dialect::v2}) {
      if (dialect == Dialect::v1 && i % 2 == 0) frame.data[7] = v1_checksum(frame);
      const Message message = decode(frame, dialect);
      if (std::holds_alternative<Unread>(message)) continue;
      ++read;
      EXPECT_EQ(decode(encode(message), dialect), message) << frame.id;
    }
  }
  EXPECT_GT(read, 1000);
}

TEST(AgilexUart, FramesSurviveDamageAroundThem) {
  const Bytes data{1, 0, 50, 0xEC, 0, 0};
  const Bytes motion = uart::encode({false, 1, data, 7});
  EXPECT_EQ(motion, drivers_test::from_hex("5AA5 0A 55 01 0100 32EC 0000 07 85"));
  const uart::Frame read = uart::decode(motion);
  EXPECT_FALSE(read.from_base);
  EXPECT_EQ(read.id, 1);
  EXPECT_EQ(Bytes(read.data.begin(), read.data.end()), data);
  EXPECT_EQ(read.count, 7);
  std::vector<Bytes> frames{motion};
  for (std::uint8_t i = 0; i < 4; ++i) {
    const Bytes state(6, static_cast<std::uint8_t>(i * 17));
    frames.push_back(uart::encode({true, i, state, i}));
  }
  drivers_test::expect_whole_frames_survive(frames, uart::look, uart::kFrameMax,
                                            drivers_test::from_hex("5A 5A A5 02 00 5AA5FFAA"));
  drivers_test::expect_flips_cost_one_frame(frames, uart::look, uart::kFrameMax);
}

}  // namespace
}  // namespace drivers::agilex
