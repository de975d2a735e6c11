// Who must go on, and the watchdog that is fed only while they do.
#include "mission/heartbeat.hpp"

#include <gmock/gmock.h>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <string>
#include <vector>

#include "mission/main_service.hpp"
#include "mission/watchdog_feeder.hpp"
#include "sim/sim_clock.hpp"

namespace {

using namespace std::chrono_literals;
using mission::Heartbeat;
using testing::ElementsAre;
using testing::IsEmpty;

TEST(Heartbeat, ExpectsNobodyWhoHasNotBegun) {
  Heartbeat heartbeat;
  heartbeat.add("gate", 1s);
  EXPECT_FALSE(heartbeat.late(hal::Time(1h)));
}

TEST(Heartbeat, NamesWhoHasBeenDueForTheLongestTime) {
  Heartbeat heartbeat;
  const auto gate = heartbeat.add("gate", 1s);
  const auto loop = heartbeat.add("loop", 2s);
  heartbeat.tick(gate, hal::Time(10s));
  heartbeat.tick(loop, hal::Time(10s));
  EXPECT_FALSE(heartbeat.late(hal::Time(11s)));
  ASSERT_TRUE(heartbeat.late(hal::Time(11s + 1ns)));
  heartbeat.tick(gate, hal::Time(12s));
  EXPECT_FALSE(heartbeat.late(hal::Time(12s)));
  const auto late = heartbeat.late(hal::Time(13500ms));
  ASSERT_TRUE(late);
  EXPECT_EQ(late->name, "loop");
  EXPECT_EQ(late->by, 1500ms);
}

TEST(Heartbeat, GivesALongStepItsBoundAndNoMore) {
  Heartbeat heartbeat;
  const auto survey = heartbeat.add("survey", 1s);
  heartbeat.expect(survey, hal::Time(0s), 10min);
  EXPECT_FALSE(heartbeat.late(hal::Time(10min)));
  EXPECT_TRUE(heartbeat.late(hal::Time(10min + 1ns)));
}

TEST(Heartbeat, DoesNotWaitForWhoRests) {
  Heartbeat heartbeat;
  const auto survey = heartbeat.add("survey", 1s);
  heartbeat.tick(survey, hal::Time(0s));
  heartbeat.rest(survey);
  EXPECT_FALSE(heartbeat.late(hal::Time(24h)));
  heartbeat.tick(survey, hal::Time(24h));
  EXPECT_TRUE(heartbeat.late(hal::Time(24h + 2s)));
}

// The tasks of a mission, alive until a test hangs one of them, and a watchdog of two seconds.
struct Watched : testing::Test {
  static constexpr hal::Duration kWatchdog = 2s;

  boost::asio::io_context io{1};
  sim::SimClock clock{io};
  Heartbeat heartbeat;
  mission::MissionTasks tasks{heartbeat};
  hal::Time fed_at{};
  std::vector<std::string> hung;
  int went_on = 0;
  mission::WatchdogFeeder feeder{
      {.period = kWatchdog / 4,
       .feed = [this] { fed_at = clock.now(); },
       .hangs = [this](const Heartbeat::Late& late) { hung.emplace_back(late.name); },
       .goes_on = [this] { ++went_on; }},
      heartbeat,
      clock};
  std::vector<std::pair<Heartbeat::Task, bool>> lives;

  void SetUp() override {
    for (const auto task :
         {tasks.event_loop, tasks.gate_cycle, tasks.survey, tasks.computation, tasks.products})
      lives.emplace_back(task, true);
    const auto rethrow = [](std::exception_ptr error) {
      if (error) std::rethrow_exception(error);
    };
    for (const auto& life : lives) boost::asio::co_spawn(io, live(life), rethrow);
    boost::asio::co_spawn(io, feeder.run(), rethrow);
    clock.run_until(hal::Time(10s));
  }
  hal::Task<void> live(const std::pair<Heartbeat::Task, bool>& life) {
    for (;; co_await clock.sleep_for(100ms))
      if (life.second) heartbeat.tick(life.first, clock.now());
  }
  hal::Duration unfed() const { return clock.now() - fed_at; }
};

TEST_F(Watched, IsFedWhileAllGoOn) {
  clock.run_until(hal::Time(1h));
  EXPECT_LE(unfed(), kWatchdog / 4);
  EXPECT_THAT(hung, IsEmpty());
}

TEST_F(Watched, IsNotFedWhenAnyOneHangsWhoIsNamedOnce) {
  const std::vector<std::pair<std::string, hal::Duration>> kinds{
      {"event loop", 1s},
      {"gate cycle", 1s},
      {"survey", 2min},
      {"computation", 10min},
      {"writing of the products", 10min}};
  for (std::size_t i = 0; i < lives.size(); ++i) {
    hung.clear();
    lives[i].second = false;
    const hal::Time hangs_at = clock.now();
    clock.run_until(hangs_at + kinds[i].second + kWatchdog / 2);
    EXPECT_THAT(hung, ElementsAre(kinds[i].first));
    clock.run_until(clock.now() + 1min);
    EXPECT_LE(fed_at, hangs_at + kinds[i].second) << kinds[i].first;
    EXPECT_THAT(hung, ElementsAre(kinds[i].first)) << "told more than once";
    lives[i].second = true;
    clock.run_until(clock.now() + 1s);
    EXPECT_LE(unfed(), kWatchdog / 4) << kinds[i].first;
    EXPECT_EQ(went_on, static_cast<int>(i) + 1);
  }
}

}  // namespace
