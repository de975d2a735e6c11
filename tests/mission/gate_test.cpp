// The gate against a slow oracle: every combination of what its inputs can be, and long random
// rides.
#include "mission/gate.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "tests/drivers/allocations.hpp"

namespace {

using namespace std::chrono_literals;
using mission::gate;
using mission::GateCommand;
using mission::GateConfig;
using mission::GateInputs;
using mission::GateReason;
using mission::GateState;
using mission::Mode;
using mission::OperatorPacket;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinite = std::numeric_limits<double>::infinity();
constexpr hal::Time kNow{1h};

// --- The oracle: says what must hold, one sentence after the other, in plain words.

bool known(hal::Time at, hal::Time now, hal::Duration max) {
  if (at == hal::Time{}) return false;  // Never heard.
  if (at > now) return false;           // Nobody hears the future.
  return at + max >= now;
}

struct Allowed {
  bool zero = true;
  double forward_max = 0, turn_max = 0;  // In size.
  hal::Twist wanted;
};

Allowed allowed(const GateConfig& config, const GateState& before, const GateInputs& inputs,
                hal::Time now) {
  Allowed result;
  const bool by_operator = inputs.mode == Mode::teleop;
  const bool by_mission = inputs.mode == Mode::autonomous || inputs.mode == Mode::returning;
  if (!by_operator && !by_mission) return result;
  if (now < before.given_at) return result;
  if (!known(inputs.feedback_at, now, config.feedback_max)) return result;
  if (config.has_range && !known(inputs.range_at, now, config.range_max)) return result;
  if (by_mission && !known(inputs.planned_at, now, config.planner_max)) return result;
  if (by_operator && !before.heard.dead_man) return result;
  if (by_operator && !known(before.heard_at, now, config.teleop_max)) return result;
  result.wanted = by_operator ? before.heard.twist : inputs.planned;
  if (!std::isfinite(result.wanted.forward_mps)) return result;
  if (!std::isfinite(result.wanted.turn_radps)) return result;
  if (std::isnan(inputs.zone_speed_max_mps) || inputs.zone_speed_max_mps < 0) return result;
  result.zero = inputs.zone_speed_max_mps == 0;
  result.forward_max = by_operator ? config.teleop_speed_max_mps : config.speed_max_mps;
  result.forward_max = std::min(result.forward_max, inputs.zone_speed_max_mps);
  result.turn_max = by_operator ? config.teleop_turn_max_radps : config.turn_max_radps;
  return result;
}

// What one axis may be after it was `was`, given what is wanted once slowed to `target`.
double axis(double was, double target, double growth) {
  if (target == 0) return 0;
  const bool same_way = (was > 0 && target > 0) || (was < 0 && target < 0);
  const double most = (same_way ? std::abs(was) : 0) + growth;
  const double size = std::abs(target) < most ? std::abs(target) : most;
  return target > 0 ? size : -size;
}

hal::Twist oracle(const GateConfig& config, const GateState& before, const GateInputs& inputs,
                  hal::Time now) {
  const Allowed is = allowed(config, before, inputs, now);
  if (is.zero) return {};
  double share = 1;
  if (std::abs(is.wanted.forward_mps) > is.forward_max)
    share = std::abs(is.wanted.forward_mps) / is.forward_max;
  if (std::abs(is.wanted.turn_radps) > is.turn_max)
    share = std::max(share, std::abs(is.wanted.turn_radps) / is.turn_max);
  double step_s = hal::seconds(now - before.given_at);
  if (step_s > 0.01) step_s = 0.01;
  return {
      axis(before.given.forward_mps, is.wanted.forward_mps / share, config.accel_max_mps2 * step_s),
      axis(before.given.turn_radps, is.wanted.turn_radps / share,
           config.turn_accel_max_radps2 * step_s)};
}

void expect_as_the_oracle(const GateConfig& config, GateState state, const GateInputs& inputs,
                          hal::Time now, const std::string& what) {
  const hal::Twist must = oracle(config, state, inputs, now);
  const bool doubtful = allowed(config, state, inputs, now).zero && inputs.zone_speed_max_mps != 0;
  const GateCommand command = gate(config, state, inputs, now);
  ASSERT_NEAR(command.twist.forward_mps, must.forward_mps, 1e-12) << what;
  ASSERT_NEAR(command.twist.turn_radps, must.turn_radps, 1e-12) << what;
  if (doubtful) {
    ASSERT_NE(command.reason, GateReason::passes) << what;
    ASSERT_EQ(command.twist.forward_mps, 0) << what;
    ASSERT_EQ(command.twist.turn_radps, 0) << what;
  }
  ASSERT_EQ(state.given_at, now);
  ASSERT_EQ(state.given.forward_mps, command.twist.forward_mps);
}

// --- Every combination.

std::vector<hal::Time> times(hal::Duration max) {
  return {hal::Time{}, kNow, kNow - max, kNow - max - 1ns, kNow + 1ns};
}

const std::vector<hal::Twist> kTwists{{0, 0},       {0.9, -0.3},    {-0.2, 0.7},       {kNaN, 0},
                                      {0.5, kNaN},  {kInfinite, 0}, {0.1, -kInfinite}, {5, 0.1},
                                      {0.1, -40.0}, {1e308, 1e308}};
const std::vector<double> kZones{kInfinite, 0.4, 0, -0.1, kNaN};
const std::vector<hal::Twist> kBefore{{0, 0}, {0.6, -0.5}, {-0.3, 0.2}};

void try_all_zones(const GateConfig& config, GateState state, GateInputs inputs,
                   const std::string& what) {
  for (const double zone : kZones)
    for (const hal::Twist& before : kBefore) {
      inputs.zone_speed_max_mps = zone;
      state.given = before;
      expect_as_the_oracle(config, state, inputs, kNow, what + ", zone " + std::to_string(zone));
      if (testing::Test::HasFatalFailure()) return;
    }
}

void try_all_commands(const GateConfig& config, const GateState& state, GateInputs inputs) {
  for (const hal::Time planned_at : times(config.planner_max))
    for (std::size_t i = 0; i < kTwists.size(); ++i) {
      inputs.planned_at = planned_at;
      inputs.planned = kTwists[i];
      try_all_zones(config, state, inputs,
                    std::string(mission::name(inputs.mode)) + ", twist " + std::to_string(i));
      if (testing::Test::HasFatalFailure()) return;
    }
}

void try_all_operators(const GateConfig& config, GateInputs inputs) {
  for (const hal::Time heard_at : times(config.teleop_max))
    for (const bool dead_man : {false, true})
      for (const hal::Twist& twist : kTwists) {
        GateState state;
        state.given_at = kNow - 10ms;
        state.heard = {7, dead_man, twist};
        state.heard_at = heard_at;
        inputs.planned_at = kNow;
        inputs.planned = {0.7, 0.1};  // Must not show.
        try_all_zones(config, state, inputs, "teleop");
        if (testing::Test::HasFatalFailure()) return;
      }
}

TEST(Gate, IsAsTheOracleForEveryCombination) {
  for (const bool has_range : {false, true})
    for (const Mode mode : {Mode::idle, Mode::autonomous, Mode::returning, Mode::holding,
                            Mode::teleop, Mode::stopped}) {
      GateConfig config;
      config.has_range = has_range;
      for (const hal::Time feedback_at : times(config.feedback_max))
        for (const hal::Time range_at : times(config.range_max)) {
          GateInputs inputs;
          inputs.mode = mode;
          inputs.feedback_at = feedback_at;
          inputs.range_at = range_at;
          GateState state;
          state.given_at = kNow - 10ms;
          try_all_commands(config, state, inputs);
          try_all_operators(config, inputs);
          ASSERT_FALSE(HasFatalFailure());
        }
    }
}

// --- Random rides, with everything that can be wrong at any time.

TEST(Gate, NeverExceedsAnyLimitOnRandomRides) {
  std::mt19937 dice(6);
  const auto hit = [&](unsigned one_in) { return dice() % one_in == 0; };
  const auto number = [&](double size) {
    return size * (static_cast<double>(dice() % 2001) / 1000 - 1);
  };
  GateConfig config;
  config.has_range = true;
  GateState state;
  GateInputs inputs;
  hal::Time now{1s};
  std::uint32_t sequence = 0;
  double moved = 0;
  for (int cycle = 0; cycle < 300'000; ++cycle) {
    now += hit(50) ? std::chrono::milliseconds(dice() % 700) : 10ms;
    if (hit(5000)) now -= 3s;
    if (hit(40)) inputs.mode = static_cast<Mode>(dice() % 6);
    if (!hit(8)) inputs.feedback_at = now - 5ms;
    if (!hit(12)) inputs.range_at = now - 20ms;
    if (hit(5)) inputs.planned_at = now, inputs.planned = {number(2), number(2)};
    if (hit(200)) inputs.planned.forward_mps = hit(2) ? kNaN : kInfinite;
    if (hit(100)) inputs.zone_speed_max_mps = hit(4) ? kNaN : std::abs(number(1.5));
    if (hit(9)) {  // Doubled and reordered on the way.
      const auto newest = sequence += hit(3) ? 0 : 1;
      hear(state, {newest - (hit(5) ? 1 : 0), !hit(30), {number(1), number(1)}}, now);
    }
    const GateState before = state;
    const GateCommand command = gate(config, state, inputs, now);
    const hal::Twist must = oracle(config, before, inputs, now);
    ASSERT_NEAR(command.twist.forward_mps, must.forward_mps, 1e-12) << cycle;
    ASSERT_NEAR(command.twist.turn_radps, must.turn_radps, 1e-12) << cycle;
    ASSERT_LE(std::abs(command.twist.forward_mps), config.speed_max_mps);
    ASSERT_LE(std::abs(command.twist.turn_radps), config.turn_max_radps);
    ASSERT_LE(std::abs(command.twist.forward_mps),
              std::abs(before.given.forward_mps) + config.accel_max_mps2 * 0.01 + 1e-12);
    moved += std::abs(command.twist.forward_mps);
  }
  EXPECT_GT(moved, 1000) << "it hardly ever drove";
}

// --- Single sentences.

GateInputs driving(hal::Twist twist, hal::Time now) {
  GateInputs inputs;
  inputs.mode = Mode::autonomous;
  inputs.planned = twist;
  inputs.planned_at = inputs.feedback_at = now;
  return inputs;
}

TEST(Gate, SpeedsUpBySmallStepsAndStopsInOne) {
  const GateConfig config;
  GateState state;
  hal::Time now = kNow;
  for (int cycle = 1; cycle <= 100; ++cycle, now += mission::kGatePeriod) {
    const auto command = gate(config, state, driving({2, 0}, now), now);
    EXPECT_NEAR(command.twist.forward_mps, 0.01 * cycle, 1e-9);
  }
  GateInputs stopped = driving({2, 0}, now);
  stopped.mode = Mode::stopped;
  EXPECT_EQ(gate(config, state, stopped, now).twist.forward_mps, 0);
}

TEST(Gate, SlowsACurveDownAsAWhole) {
  const GateConfig config;
  GateState state;
  state.given = {1, 0.7};
  state.given_at = kNow - 10ms;
  const auto command = gate(config, state, driving({4, 2}, kNow), kNow);
  EXPECT_NEAR(command.twist.forward_mps, 1, 1e-12);
  EXPECT_NEAR(command.twist.turn_radps, 0.5, 1e-12);
}

TEST(Gate, SaysWhy) {
  GateConfig config;
  config.has_range = true;
  const auto reason = [&](const auto& change) {
    GateState state;
    state.given_at = kNow - 10ms;
    GateInputs inputs = driving({0.5, 0}, kNow);
    inputs.range_at = kNow;
    change(inputs, state);
    return gate(config, state, inputs, kNow).reason;
  };
  const auto when = [&](const auto& change) {
    return reason([&](GateInputs& inputs, GateState&) { change(inputs); });
  };
  EXPECT_EQ(when([](GateInputs&) {}), GateReason::passes);
  EXPECT_EQ(reason([](GateInputs&, GateState& state) { state.given_at = kNow + 1ns; }),
            GateReason::clock);
  EXPECT_EQ(when([](GateInputs& is) { is.mode = Mode::holding; }), GateReason::mode);
  EXPECT_EQ(when([](GateInputs& is) { is.feedback_at = {}; }), GateReason::feedback);
  EXPECT_EQ(when([](GateInputs& is) { is.range_at = kNow - 251ms; }), GateReason::range);
  EXPECT_EQ(when([](GateInputs& is) { is.mode = Mode::teleop; }), GateReason::teleop);
  EXPECT_EQ(when([](GateInputs& is) { is.planned_at = kNow - 501ms; }), GateReason::planner);
  EXPECT_EQ(when([](GateInputs& is) { is.planned.turn_radps = kNaN; }), GateReason::number);
  EXPECT_EQ(when([](GateInputs& is) { is.zone_speed_max_mps = kNaN; }), GateReason::zone);
  EXPECT_EQ(mission::name(GateReason::passes), "passes");
  EXPECT_EQ(mission::name(GateReason::zone), "nobody knows how fast one may be here");
}

// --- The operator.

TEST(Gate, IgnoresRepeatedAndOlderPackets) {
  const GateConfig config;
  GateState state;
  hear(state, {5, true, {0.2, 0}}, kNow);
  hear(state, {5, true, {0.3, 0}}, kNow + 100ms);
  hear(state, {4, true, {0.3, 0}}, kNow + 150ms);
  hear(state, {0, true, {0.3, 0}}, kNow + 150ms);
  EXPECT_EQ(state.heard.twist.forward_mps, 0.2);
  EXPECT_TRUE(operator_alive(config, state, kNow + 200ms));
  EXPECT_FALSE(operator_alive(config, state, kNow + 200ms + 1ns)) << "a replay keeps it alive";
  hear(state, {6, true, {0.1, 0}}, kNow + 250ms);
  EXPECT_TRUE(operator_alive(config, state, kNow + 300ms));
}

TEST(Gate, StopsInOneCycleWhenTheDeadManIsLetGo) {
  const GateConfig config;
  GateState state;
  GateInputs inputs = driving({0.5, 0}, kNow);
  inputs.mode = Mode::teleop;
  state.given = {0.2, 0};
  state.given_at = kNow - 10ms;
  hear(state, {1, true, {0.2, 0}}, kNow);
  EXPECT_NEAR(gate(config, state, inputs, kNow).twist.forward_mps, 0.2, 1e-12);
  hear(state, {2, false, {0.2, 0}}, kNow + 5ms);
  EXPECT_EQ(gate(config, state, inputs, kNow + 10ms).twist.forward_mps, 0);
}

TEST(Gate, AllocatesNothing) {
  const GateConfig config;
  GateState state;
  GateInputs inputs = driving({0.5, 0.1}, kNow);
  mission::SupervisorState supervisor = mission::booted(mission::Boot::clean);
  const auto before = drivers_test::allocations();
  for (unsigned i = 0; i < 1000; ++i) {
    hear(state, {i, true, {0.1, 0}}, kNow);
    inputs.mode =
        mission::supervise(supervisor, mission::Conditions(i), static_cast<mission::Event>(i % 4))
            .mode;
    (void)gate(config, state, inputs, kNow + i * 10ms);
  }
  EXPECT_EQ(drivers_test::allocations(), before);
  const std::vector<int> one(1);
  EXPECT_EQ(drivers_test::allocations(), before + one.size()) << "it counts nothing";
}

}  // namespace
