#include "drivers/cia402.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "tests/drivers/can_frames.hpp"

namespace drivers {
namespace {

using canopen::Mapped;
using canopen::Pdo;
using canopen::Setting;
using cia402::Goal;
using cia402::State;
using drivers_test::can;

TEST(Cia402, ReadsStatesOfRealDrives) {
  const std::pair<std::uint16_t, State> seen[] = {// maxon EPOS
                                                  {0x0740, State::switch_on_disabled},
                                                  {0x0721, State::ready_to_switch_on},
                                                  {0x0723, State::switched_on},
                                                  {0x0737, State::operation_enabled},
                                                  // Nanotec
                                                  {0x0240, State::switch_on_disabled},
                                                  {0x0640, State::switch_on_disabled},
                                                  {0x0621, State::ready_to_switch_on},
                                                  {0x0633, State::switched_on},
                                                  {0x0637, State::operation_enabled},
                                                  // By the standard
                                                  {0x0000, State::not_ready},
                                                  {0x0017, State::quick_stop_active},
                                                  {0x001F, State::fault_reaction_active},
                                                  {0x0218, State::fault}};
  for (const auto& [word, state] : seen) EXPECT_EQ(cia402::state_of(word), state) << word;
  EXPECT_EQ(cia402::state_of(0x0041), std::nullopt);
}

TEST(Cia402, EveryStatuswordHasAtMostOneState) {
  // The table of the standard, bit by bit: x is either.
  const std::pair<const char*, State> table[] = {{"0x0000", State::not_ready},
                                                 {"1x0000", State::switch_on_disabled},
                                                 {"010001", State::ready_to_switch_on},
                                                 {"010011", State::switched_on},
                                                 {"010111", State::operation_enabled},
                                                 {"000111", State::quick_stop_active},
                                                 {"0x1111", State::fault_reaction_active},
                                                 {"0x1000", State::fault}};
  for (std::uint32_t word = 0; word <= 0xFFFF; ++word) {
    std::optional<State> expected;
    const unsigned bits[] = {word >> 6 & 1, word >> 5 & 1, word >> 3 & 1,
                             word >> 2 & 1, word >> 1 & 1, word & 1};
    for (const auto& [pattern, state] : table) {
      bool fits = true;
      for (int i = 0; i < 6; ++i)
        fits = fits && (pattern[i] == 'x' || static_cast<unsigned>(pattern[i] - '0') == bits[i]);
      if (fits) expected = state;
    }
    ASSERT_EQ(cia402::state_of(static_cast<std::uint16_t>(word)), expected) << word;
  }
}

TEST(Cia402, ReadsTheOtherBits) {
  EXPECT_EQ(cia402::status_of(0x0637), (cia402::Status{true, false, true, true, false, false}));
  EXPECT_EQ(cia402::status_of(0x1880), (cia402::Status{false, true, false, false, true, true}));
}

// A drive that obeys one controlword after the other, as in the state diagram.
State obey(State state, std::uint16_t word) {
  const bool quick = (word & 6) == 2, no_voltage = (word & 2) == 0;
  switch (state) {
    case State::switch_on_disabled:
      return (word & 7) == 6 ? State::ready_to_switch_on : state;
    case State::ready_to_switch_on:
      if (no_voltage || quick) return State::switch_on_disabled;
      return (word & 15) == 7 ? State::switched_on : state;
    case State::switched_on:
      if (no_voltage || quick) return State::switch_on_disabled;
      if ((word & 7) == 6) return State::ready_to_switch_on;
      return (word & 15) == 15 ? State::operation_enabled : state;
    case State::operation_enabled:
      if (no_voltage) return State::switch_on_disabled;
      if (quick) return State::quick_stop_active;
      return (word & 15) == 7 ? State::switched_on : state;
    case State::quick_stop_active:
      return no_voltage ? State::switch_on_disabled : state;
    default:
      return state;
  }
}

TEST(Cia402, ControlwordsLeadToTheGoalFromEveryState) {
  for (const Goal goal : {Goal::off, Goal::enabled})
    for (const State start :
         {State::switch_on_disabled, State::ready_to_switch_on, State::switched_on,
          State::operation_enabled, State::quick_stop_active}) {
      State state = start;
      int steps = 0;
      for (; !cia402::reached(state, goal) && steps < 6; ++steps)
        state = obey(state, cia402::next_controlword(state, goal).value());
      EXPECT_LE(steps, 4) << cia402::name(start);
      EXPECT_TRUE(cia402::reached(state, goal)) << cia402::name(start);
      // And it is held there.
      EXPECT_EQ(obey(state, cia402::next_controlword(state, goal).value()), state);
    }
  // Stopping ramps down first; the drive leaves the quick stop by itself.
  EXPECT_EQ(cia402::next_controlword(State::operation_enabled, Goal::stopped), cia402::kQuickStop);
  EXPECT_EQ(cia402::next_controlword(State::quick_stop_active, Goal::stopped), cia402::kQuickStop);
  for (const State alone : {State::not_ready, State::fault_reaction_active, State::fault})
    for (const Goal goal : {Goal::off, Goal::enabled, Goal::stopped})
      EXPECT_EQ(cia402::next_controlword(alone, goal), std::nullopt);
}

TEST(Cia402, EnablesAsInTheTraceOfARealDrive) {
  EXPECT_EQ(cia402::next_controlword(State::switch_on_disabled, Goal::enabled), 0x0006);
  EXPECT_EQ(cia402::next_controlword(State::ready_to_switch_on, Goal::enabled), 0x0007);
  EXPECT_EQ(cia402::next_controlword(State::switched_on, Goal::enabled), 0x000F);
}

TEST(Cia402, ScalesSpeedsBothWays) {
  const cia402::Scale scale{-1000};
  EXPECT_EQ(scale.units(0.5, 3000), -500);
  EXPECT_EQ(scale.units(-9, 3000), 3000);
  EXPECT_EQ(scale.units(std::nan(""), 3000), 0);
  EXPECT_EQ(scale.units(std::numeric_limits<double>::infinity(), 3000), -3000);
  EXPECT_DOUBLE_EQ(scale.mps(-1432), 1.432);
}

TEST(Pdo, PacksAndUnpacksTheVelocitySet) {
  const auto pdos = cia402::velocity_pdos({});
  Pdo command{5, 1, false, false, 0, {}};
  canopen::pack(pdos[0].mapping, std::vector<std::int64_t>{0x000F, -1432}, command);
  EXPECT_EQ(canopen::encode(command), can("205#0F0068FAFFFF"));
  Pdo state{5, 1, true, false, 6, {0x37, 0x06, 0x68, 0xFA, 0xFF, 0xFF}};
  std::vector<std::int64_t> values(2);
  ASSERT_TRUE(canopen::unpack(pdos[1].mapping, state, values));
  EXPECT_EQ(values, (std::vector<std::int64_t>{0x0637, -1432}));
  state.size = 5;
  EXPECT_FALSE(canopen::unpack(pdos[1].mapping, state, values));
  EXPECT_EQ(values[1], -1432);
}

TEST(Pdo, AnyMappingUnpacksWhatWasPacked) {
  std::mt19937_64 random(4);
  for (int i = 0; i < 5000; ++i) {
    std::vector<Mapped> mapping;
    std::vector<std::int64_t> values;
    for (unsigned left = 64; left > 0;) {
      const auto bits = static_cast<std::uint8_t>(1 + random() % left);
      left -= bits;
      const bool is_signed = random() % 2 == 0;
      mapping.push_back({{0x6000, 1}, bits, is_signed});
      const auto raw = static_cast<std::int64_t>(random());
      values.push_back(
          is_signed ? raw >> (64 - bits)
                    : static_cast<std::int64_t>(static_cast<std::uint64_t>(raw) >> (64 - bits)));
      if (random() % 4 == 0) break;
    }
    ASSERT_TRUE(canopen::is_valid(mapping));
    Pdo pdo;
    canopen::pack(mapping, values, pdo);
    std::vector<std::int64_t> read(values.size());
    ASSERT_TRUE(canopen::unpack(mapping, pdo, read));
    EXPECT_EQ(read, values);
  }
  EXPECT_FALSE(canopen::is_valid(std::vector<Mapped>{{{1, 0}, 60, false}, {{1, 0}, 5, false}}));
  EXPECT_FALSE(canopen::is_valid(std::vector<Mapped>{{{1, 0}, 0, false}}));
}

TEST(Pdo, MappingWordsAreThoseOfTheStandard) {
  EXPECT_EQ(canopen::mapping_word({cia402::kControlword, 16, false}), 0x60400010U);
  EXPECT_EQ(canopen::mapping_word({cia402::kVelocityTarget, 32, true}), 0x60FF0020U);
  EXPECT_EQ(canopen::mapped(0x606C0020), (Mapped{cia402::kVelocityActual, 32, false}));
}

TEST(Settings, MapAPdoInTheOrderThatDrivesInsistOn) {
  const auto settings = canopen::pdo_settings(
      5, {2, true, 1, 20, {{cia402::kPosition, 32, true}, {cia402::kTorqueActual, 16, true}}});
  const std::tuple<int, int, int, std::uint32_t> expected[] = {
      {0x1801, 1, 4, 0x80000285}, {0x1801, 2, 1, 1},          {0x1801, 5, 2, 20},
      {0x1A01, 0, 1, 0},          {0x1A01, 1, 4, 0x60640020}, {0x1A01, 2, 4, 0x60770010},
      {0x1A01, 0, 1, 2},          {0x1801, 1, 4, 0x00000285}};
  ASSERT_EQ(settings.size(), std::size(expected));
  for (std::size_t i = 0; i < settings.size(); ++i) {
    const auto& [index, sub, size, value] = expected[i];
    EXPECT_EQ(settings[i].at.index, index) << i;
    EXPECT_EQ(settings[i].at.sub, sub) << i;
    EXPECT_EQ(settings[i].size, size) << i;
    EXPECT_EQ(settings[i].value, value) << i;
  }
}

TEST(Settings, ReadBackUnderTheirMask) {
  const Setting cob{{0x1400, 1}, 4, 0x205, 0x800007FF, "PDO on"};
  EXPECT_EQ(canopen::bytes_of(cob), (Bytes{0x05, 0x02, 0, 0}));
  EXPECT_TRUE(canopen::reads_back(cob, Bytes{0x05, 0x02, 0, 0x40}));
  EXPECT_FALSE(canopen::reads_back(cob, Bytes{0x05, 0x02, 0, 0x80}));
  EXPECT_FALSE(canopen::reads_back(cob, Bytes{0x05, 0x02}));
}

TEST(Settings, AVelocityDriveStopsByItselfWhenTheMasterIsSilent) {
  cia402::VelocityConfig config;
  config.node = 3;
  config.master = 1;
  config.acceleration = 500;
  const auto settings = cia402::velocity_settings(config);
  const auto has = [&](canopen::Address at, std::uint32_t value) {
    return std::any_of(settings.begin(), settings.end(), [&](const Setting& setting) {
      return setting.at == at && setting.value == value && setting.compare_mask != 0;
    });
  };
  EXPECT_TRUE(has({0x1017, 0}, 100));
  EXPECT_TRUE(has({0x1016, 1}, 1U << 16 | 300));
  EXPECT_TRUE(has(cia402::kAbortConnection, 3));
  EXPECT_TRUE(has(cia402::kAcceleration, 500));
  EXPECT_TRUE(has({0x1600, 2}, 0x60FF0020));
  EXPECT_TRUE(has({0x1A00, 2}, 0x606C0020));
  EXPECT_EQ(settings.back().at, cia402::kModes);
  EXPECT_EQ(settings.back().read_at, cia402::kModesDisplay);
  EXPECT_FALSE(has(cia402::kDeceleration, 0));
  config.mode = cia402::Mode::velocity;
  const auto vl = cia402::velocity_pdos(config);
  EXPECT_EQ(canopen::mapping_word(vl[0].mapping[1]), 0x60420010U);
  EXPECT_EQ(canopen::mapping_word(vl[1].mapping[1]), 0x60440010U);
}

}  // namespace
}  // namespace drivers
