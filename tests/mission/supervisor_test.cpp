// Every combination of the supervisor's bits, and every state that it can come to.
#include "mission/supervisor.hpp"

#include <gtest/gtest.h>

#include <deque>
#include <set>
#include <tuple>

namespace {

using mission::Answer;
using mission::Boot;
using mission::Condition;
using mission::Conditions;
using mission::Event;
using mission::Mode;
using mission::SupervisorState;

constexpr Condition kStops[]{Condition::estop, Condition::bumper, Condition::drive_silent,
                             Condition::drive_held, Condition::fault};

Conditions of(std::initializer_list<Condition> set) {
  Conditions conditions;
  for (const Condition each : set) conditions.set(each);
  return conditions;
}

bool any_stop(Conditions conditions) {
  for (const Condition stop : kStops)
    if (conditions.has(stop)) return true;
  return false;
}

// The page of the architecture, row by row: the first that fits.
Mode by_the_page(Conditions is, bool latched, bool released) {
  struct Row {
    bool fits;
    Mode mode;
  };
  const bool loaded = is.has(Condition::mission_loaded);
  const Row rows[]{
      {is.has(Condition::estop), Mode::stopped},
      {is.has(Condition::bumper), Mode::stopped},
      {is.has(Condition::drive_silent), Mode::stopped},
      {is.has(Condition::drive_held), Mode::stopped},
      {is.has(Condition::fault), Mode::stopped},
      {latched, Mode::stopped},
      {!released && loaded, Mode::holding},
      {!released && !loaded, Mode::idle},
      {is.has(Condition::operator_alive), Mode::teleop},
      {is.has(Condition::pose_uncertain), Mode::holding},
      {is.has(Condition::range_stale), Mode::holding},
      {is.has(Condition::hold_fault), Mode::holding},
      {is.has(Condition::battery_reserve) && loaded, Mode::returning},
      {loaded, Mode::autonomous},
      {true, Mode::idle},
  };
  for (const Row& row : rows)
    if (row.fits) return row.mode;
  return Mode::stopped;
}

TEST(Supervisor, DecidesEveryCombinationAsThePageSays) {
  for (unsigned bits = 0; bits < 1U << mission::kConditions; ++bits)
    for (const bool latched : {false, true})
      for (const bool released : {false, true})
        ASSERT_EQ(mission::decide(Conditions(bits), latched, released),
                  by_the_page(Conditions(bits), latched, released))
            << bits << latched << released;
}

TEST(Supervisor, MovesInThreeModesOnly) {
  for (const Mode mode : {Mode::idle, Mode::holding, Mode::stopped})
    EXPECT_FALSE(mission::moves(mode)) << mission::name(mode);
  for (const Mode mode : {Mode::autonomous, Mode::returning, Mode::teleop})
    EXPECT_TRUE(mission::moves(mode)) << mission::name(mode);
}

// R4, over every state that the code can come to and everything that can happen there: nothing
// moves between a stop and the next release by a person that finds the stop gone.
TEST(Supervisor, NeverMovesAfterAStopWithoutAPersonsRelease) {
  // With what the test remembers by itself: whether a stop, or a person who wants it to stand, came
  // since the last release.
  using Reached = std::tuple<std::uint16_t, bool, bool, bool>;
  std::set<Reached> seen;
  std::deque<Reached> open;
  const auto reach = [&](const SupervisorState& state, bool stopped) {
    const Reached reached{state.latched, state.released, state.begun, stopped};
    if (seen.insert(reached).second) open.push_back(reached);
  };
  for (const Boot boot : {Boot::clean, Boot::watchdog_restart, Boot::crash, Boot::power_cut})
    reach(mission::booted(boot), boot != Boot::clean);
  std::size_t steps = 0, moved = 0;
  while (!open.empty()) {
    const auto [latched, released, begun, stopped_before] = open.front();
    open.pop_front();
    for (unsigned bits = 0; bits < 1U << mission::kConditions; ++bits)
      for (const Event event : {Event::none, Event::start, Event::release, Event::hold}) {
        const Conditions conditions(bits);
        SupervisorState state{latched, released, begun};
        const mission::Decision decision = mission::supervise(state, conditions, event);
        bool stopped = stopped_before || any_stop(conditions) || event == Event::hold;
        const bool may_release = !any_stop(conditions) && conditions.has(Condition::proven);
        if (event == Event::release && may_release) stopped = false;
        const bool by_start = event == Event::start && !begun && !stopped && may_release;
        const bool by_person = event == Event::release && may_release;
        ASSERT_EQ(state.released, by_start || by_person || (released && !stopped));
        ASSERT_EQ(decision.answer == Answer::released, by_start || by_person);
        ASSERT_TRUE(!mission::moves(decision.mode) || (!stopped && state.released))
            << "latched " << latched << " bits " << bits << " event " << static_cast<int>(event);
        moved += mission::moves(decision.mode);
        ++steps;
        reach(state, stopped);
      }
  }
  // 31 sets of stops after a clean boot and 32 after each other one, with and without the start
  // used up; and three states without any: before the start, released, held.
  EXPECT_EQ(seen.size(), (31 + 3 * 32) * 2U + 3);
  EXPECT_EQ(steps, seen.size() * 4 << mission::kConditions);
  EXPECT_GT(moved, 0U);
}

TEST(Supervisor, StartsOnceAfterACleanBoot) {
  const Conditions ready = of({Condition::mission_loaded, Condition::proven});
  SupervisorState state = mission::booted(Boot::clean);
  EXPECT_EQ(mission::supervise(state, ready, Event::none).mode, Mode::holding);
  EXPECT_EQ(mission::supervise(state, ready, Event::start).mode, Mode::autonomous);
  EXPECT_EQ(mission::supervise(state, ready, Event::hold).mode, Mode::holding);
  const mission::Decision again = mission::supervise(state, ready, Event::start);
  EXPECT_EQ(again.mode, Mode::holding);
  EXPECT_EQ(again.answer, Answer::not_enough);
  EXPECT_EQ(mission::supervise(state, ready, Event::release).mode, Mode::autonomous);
  SupervisorState held = mission::booted(Boot::clean);
  mission::supervise(held, ready, Event::hold);
  EXPECT_EQ(mission::supervise(held, ready, Event::start).answer, Answer::not_enough);
}

TEST(Supervisor, WaitsForAPersonAfterEveryOtherBoot) {
  const Conditions ready = of({Condition::mission_loaded, Condition::proven});
  for (const Boot boot : {Boot::watchdog_restart, Boot::crash, Boot::power_cut}) {
    SupervisorState state = mission::booted(boot);
    EXPECT_EQ(mission::supervise(state, ready, Event::start).answer, Answer::not_enough);
    EXPECT_EQ(mission::supervise(state, ready, Event::none).mode, Mode::stopped);
    EXPECT_EQ(mission::supervise(state, ready, Event::release).mode, Mode::autonomous);
  }
}

TEST(Supervisor, SaysWhyItDoesNotRelease) {
  SupervisorState state = mission::booted(Boot::clean);
  EXPECT_EQ(mission::supervise(state, {}, Event::release).answer, Answer::not_proven);
  const Conditions pressed = of({Condition::estop, Condition::proven});
  EXPECT_EQ(mission::supervise(state, pressed, Event::release).answer, Answer::not_yet);
  EXPECT_EQ(mission::supervise(state, pressed, Event::none).answer, Answer::none);
  EXPECT_EQ(mission::name(Answer::not_yet), "a stop is still there");
  EXPECT_EQ(mission::name(Answer::none), "nobody asked");
  EXPECT_EQ(mission::name(Mode::idle), "idle");
  EXPECT_EQ(mission::name(Mode::stopped), "stopped");
}

TEST(Conditions, AreSetAndTakenBack) {
  Conditions conditions;
  conditions.set(Condition::bumper);
  conditions.set(Condition::proven);
  EXPECT_EQ(conditions, Conditions(0x802));
  conditions.set(Condition::bumper, false);
  EXPECT_FALSE(conditions.has(Condition::bumper));
  EXPECT_TRUE(conditions.has(Condition::proven));
}

}  // namespace
