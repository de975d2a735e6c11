// Simulated units with real Modbus frames, byte for byte.
#include "sim/modbus_server.hpp"

#include <gtest/gtest.h>

#include <random>

#include "drivers/modbus_errors.hpp"
#include "sim/power_units.hpp"
#include "tests/drivers/drive_bench.hpp"
#include "tests/drivers/recordings.hpp"

namespace {

using namespace drivers_test;
using drivers::Bytes;

struct ModbusServer : testing::Test, DriveBench {
  sim::UnitFaults board_faults{clock}, battery_faults{clock};
  sim::RelayUnit board{clock, board_faults};
  sim::Battery charge{{}, world};
  sim::VictronUnit victron{{}, charge, clock, battery_faults};
  sim::StreamWire line{clock};
  Bytes heard;

  void serve(sim::ModbusWire framing) {
    spawn(sim::serve_modbus(line.b(), framing, clock, [this](std::uint8_t number) {
      return number == 1     ? static_cast<sim::RegisterUnit*>(&board)
             : number == 226 ? &victron
                             : nullptr;
    }));
    spawn(listen());
  }
  hal::Task<void> listen() {
    std::array<std::uint8_t, 600> bytes{};
    for (;;) {
      const auto size = co_await line.a().read_some(bytes);
      if (size) heard.insert(heard.end(), bytes.begin(), bytes.begin() + *size);
    }
  }
  hal::Task<void> write(Bytes bytes) { (void)co_await line.a().write(bytes); }

  Bytes ask(const std::string& hex) {
    heard.clear();
    spawn(write(from_hex(hex)));
    wait(1s);
    return heard;
  }
};

// Of the board's manual, and of two other programs' dialogue.
TEST_F(ModbusServer, AnswersTheBytesOfTheBoardsManual) {
  serve(sim::ModbusWire::rtu);
  board.set_input(7, true);
  EXPECT_EQ(ask("01 02 00 00 00 08 79 CC"), from_hex("01 02 01 81 61 E8"));
  EXPECT_EQ(ask("01 05 00 02 FF 00 2D FA"), from_hex("01 05 00 02 FF 00 2D FA"));
  EXPECT_EQ(ask("01 01 00 00 00 08 3D CC"), from_hex("01 01 01 04 50 4B"));
  EXPECT_EQ(ask("01 03 01 F4 00 01 C4 04"), from_hex("01 83 02 C0 F1"));
  EXPECT_EQ(ask("09 03 00 01 00 01 D4 82"), Bytes{}) << "nobody of that number";
  EXPECT_EQ(ask("01 05 00 00 55 00 F2 9A"), from_hex("01 05 00 00 55 00 F2 9A"));
  EXPECT_TRUE(board.relay(0));
  EXPECT_EQ(ask("01 05 00 FF 00 00 FD FA"), from_hex("01 05 00 FF 00 00 FD FA"));
  EXPECT_FALSE(board.relay(0) || board.relay(2));
}

TEST_F(ModbusServer, APulseEndsByItself) {
  serve(sim::ModbusWire::rtu);
  spawn(write(from_hex("01 05 02 00 00 07 8D B0")));
  wait(600ms);
  EXPECT_TRUE(board.relay(0));
  EXPECT_EQ(heard, from_hex("01 05 02 00 00 07 8D B0"));
  wait(200ms);
  EXPECT_FALSE(board.relay(0));
}

TEST_F(ModbusServer, AnswersWithTheTransactionThatAsked) {
  serve(sim::ModbusWire::tcp);
  EXPECT_EQ(ask("12 34 00 00 00 06 E2 03 01 06 00 01"),
            from_hex("12 34 00 00 00 05 E2 03 02 00 FA"));  // 25.0 degrees.
  EXPECT_EQ(ask("12 35 00 00 00 06 E2 03 01 2C 00 02"), from_hex("12 35 00 00 00 03 E2 83 02"));
  EXPECT_EQ(ask("12 36 00 00 00 06 05 03 01 06 00 01"), Bytes{}) << "nobody of that number";
}

TEST_F(ModbusServer, WritesSeveralAtOnce) {
  serve(sim::ModbusWire::rtu);
  EXPECT_EQ(ask("01 0F 00 00 00 08 01 FF BE D5"), from_hex("01 0F 00 00 00 08 54 0D"));
  for (std::size_t i = 0; i < 8; ++i) EXPECT_TRUE(board.relay(i));
}

TEST_F(ModbusServer, TheUnitsFaultsShowOnTheWire) {
  serve(sim::ModbusWire::rtu);
  const std::string request = "01 02 00 00 00 08 79 CC";
  const Bytes well = ask(request);
  board_faults.set({sim::UnitFault::off, 0});
  EXPECT_EQ(ask(request), Bytes{});
  board_faults.set({sim::UnitFault::garbage, 0});
  const Bytes garbage = ask(request);
  EXPECT_EQ(garbage.size(), well.size());
  EXPECT_NE(garbage, well);
  board_faults.set({sim::UnitFault::stuck, 0});
  EXPECT_EQ(ask(request), well);
  board.press_estop(true);
  EXPECT_EQ(ask(request), well);
  board_faults.clear();
  EXPECT_NE(ask(request), well);
}

TEST_F(ModbusServer, SurvivesAnyBytes) {
  serve(sim::ModbusWire::rtu);
  std::mt19937 random(3);
  for (int i = 0; i < 200; ++i) {
    Bytes bytes(random() % 40);
    for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random());
    spawn(write(bytes));
    wait(20ms);
  }
  spawn(write(Bytes(300, 0xFF)));
  wait(1s);
  EXPECT_EQ(ask("01 02 00 00 00 08 79 CC"), from_hex("01 02 01 01 60 48"));
}

}  // namespace
