#include "sim/sim_clock.hpp"

#include <gtest/gtest.h>

#include <boost/asio/bind_cancellation_slot.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/dispatch.hpp>
#include <boost/asio/experimental/awaitable_operators.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/this_coro.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <random>
#include <stdexcept>
#include <string>

#include "hal/wake.hpp"
#include "sim/event_loop.hpp"

namespace {

using namespace std::chrono_literals;
using namespace boost::asio::experimental::awaitable_operators;
namespace asio = boost::asio;

hal::Time at(hal::Duration since_start) {
  return hal::Time{since_start};
}

void rethrow(std::exception_ptr error) {
  if (error) std::rethrow_exception(error);
}

// On its own event loop, and on an io_context.
struct SimClockTest : testing::TestWithParam<bool> {
  asio::io_context context;
  sim::EventLoop loop;
  asio::any_io_executor io =
      GetParam() ? loop.get_executor() : asio::any_io_executor(context.get_executor());
  sim::SimClock clock = GetParam() ? sim::SimClock(loop) : sim::SimClock(context);
  std::string log;

  hal::Task<void> write_after(hal::Duration pause, char letter) {
    co_await clock.sleep_for(pause);
    log += letter;
  }
  void spawn(hal::Task<void> task) { asio::co_spawn(io, std::move(task), rethrow); }
};

TEST_P(SimClockTest, WakesInTheOrderOfTime) {
  spawn(write_after(3s, 'c'));
  spawn(write_after(1s, 'a'));
  spawn(write_after(2s, 'b'));
  clock.run_until(at(10s));
  EXPECT_EQ(log, "abc");
  EXPECT_EQ(clock.now(), at(10s));
}

TEST_P(SimClockTest, WakesEqualTimesInTheOrderAsked) {
  for (const char letter : std::string("qwertyuiop")) spawn(write_after(1s, letter));
  clock.run_until(at(1s));
  EXPECT_EQ(log, "qwertyuiop");
}

TEST_P(SimClockTest, LetsEachSleeperFinishBeforeTheNextOneWakes) {
  const auto twice = [this](char letter) -> hal::Task<void> {
    co_await clock.sleep_for(1s);
    log += letter;
    co_await asio::post(io, asio::use_awaitable);
    log += letter;
  };
  asio::co_spawn(io, twice('a'), rethrow);
  asio::co_spawn(io, twice('b'), rethrow);
  clock.run_until(at(1s));
  EXPECT_EQ(log, "aabb");
}

TEST_P(SimClockTest, RunsWakeUpsAtTheEndButNotAfterIt) {
  spawn(write_after(1s, 'a'));
  spawn(write_after(1s + 1ns, 'b'));
  clock.run_until(at(1s));
  EXPECT_EQ(log, "a");
  clock.run_until(at(2s));
  EXPECT_EQ(log, "ab");
}

TEST_P(SimClockTest, WakesFromAPastTimeWithoutTurningBack) {
  clock.run_until(at(5s));
  asio::co_spawn(
      io,
      [this]() -> hal::Task<void> {
        co_await clock.sleep_until(at(1s));
        log += clock.now() == at(5s) ? "now" : "wrong";
      },
      rethrow);
  clock.run_until(at(5s));
  EXPECT_EQ(log, "now");
}

TEST_P(SimClockTest, RunStopsAsSoonAsThePredicateHolds) {
  bool done = false;
  asio::co_spawn(
      io,
      [&]() -> hal::Task<void> {
        for (int i = 0;; ++i) {
          co_await clock.sleep_for(1s);
          done = i == 41;
        }
      },
      rethrow);
  EXPECT_TRUE(clock.run([&] { return done; }));
  EXPECT_EQ(clock.now(), at(42s));
}

TEST_P(SimClockTest, RunSaysWhenNothingIsLeftToWaitFor) {
  spawn(write_after(7s, 'a'));
  EXPECT_FALSE(clock.run([] { return false; }));
  EXPECT_EQ(log, "a");
  EXPECT_EQ(clock.now(), at(7s));
}

TEST_P(SimClockTest, CancellingASleeperThrowsOperationAborted) {
  asio::cancellation_signal stop;
  asio::co_spawn(
      io,
      [this]() -> hal::Task<void> {
        try {
          co_await clock.sleep_for(100s);
        } catch (const boost::system::system_error& error) {
          if (error.code() == asio::error::operation_aborted) log += "aborted";
        }
      },
      asio::bind_cancellation_slot(stop.slot(), rethrow));
  clock.run_until(at(1s));
  EXPECT_EQ(log, "");
  stop.emit(asio::cancellation_type::terminal);
  clock.run_until(at(1s));
  EXPECT_EQ(log, "aborted");
  EXPECT_FALSE(clock.run([] { return false; }));
  EXPECT_EQ(clock.now(), at(1s)) << "the cancelled wake-up is forgotten";
}

TEST_P(SimClockTest, FirstOfTwoSleepersCancelsTheOther) {
  asio::co_spawn(
      io,
      [this]() -> hal::Task<void> {
        for (int i = 0; i < 3; ++i) {
          const auto first = co_await (clock.sleep_for(3s) || clock.sleep_for(2s));
          log += std::to_string(first.index());
        }
      },
      rethrow);
  EXPECT_FALSE(clock.run([] { return false; }));
  EXPECT_EQ(log, "111");
  EXPECT_EQ(clock.now(), at(6s));
}

TEST_P(SimClockTest, ExceptionsLeaveTheRunAndTheRestGoesOn) {
  asio::co_spawn(
      io,
      [this]() -> hal::Task<void> {
        co_await clock.sleep_for(1s);
        throw std::runtime_error("broken");
      },
      rethrow);
  spawn(write_after(2s, 'b'));
  EXPECT_THROW(clock.run_until(at(10s)), std::runtime_error);
  EXPECT_EQ(clock.now(), at(1s));
  clock.run_until(at(10s));
  EXPECT_EQ(log, "b");
}

TEST_P(SimClockTest, SaysWhenSomebodySpinsWhileTimeStandsStill) {
  bool sleeps = false, over = false;
  spawn([](sim::SimClock& time, const bool& by_sleeping, const bool& ends) -> hal::Task<void> {
    while (!ends) {
      if (by_sleeping)
        co_await time.sleep_until(time.now());
      else
        co_await asio::post(co_await asio::this_coro::executor, asio::use_awaitable);
    }
  }(clock, sleeps, over));
  EXPECT_THROW(clock.run([] { return false; }), sim::SimClock::Spins);
  sleeps = true;
  EXPECT_THROW(clock.run([] { return false; }), sim::SimClock::Spins);
  over = true;
  EXPECT_FALSE(clock.run([] { return false; }));
}

INSTANTIATE_TEST_SUITE_P(Loops, SimClockTest, testing::Bool(), [](const auto& info) {
  return std::string(info.param ? "EventLoop" : "IoContext");
});

struct Flag {
  bool& unwound;
  ~Flag() { unwound = true; }
};

template <class Loop>
bool unwinds_what_sleeps() {
  bool unwound = false;
  {
    Loop loop;
    sim::SimClock clock(loop);
    asio::co_spawn(
        loop.get_executor(),
        [&]() -> hal::Task<void> {
          const Flag flag{unwound};
          co_await (clock.sleep_for(100s) || clock.sleep_for(200s));
        },
        asio::detached);
    clock.run_until(at(1s));
    EXPECT_FALSE(unwound);
  }
  return unwound;
}

TEST(SimClock, UnwindsSleepersThatAreLeftAtTheEnd) {
  EXPECT_TRUE(unwinds_what_sleeps<asio::io_context>());
  EXPECT_TRUE(unwinds_what_sleeps<sim::EventLoop>());
}

TEST(EventLoop, UnwindsWhatWasStillToRun) {
  bool unwound = false;
  {
    sim::EventLoop loop;
    asio::co_spawn(
        loop.get_executor(),
        [&]() -> hal::Task<void> {
          const Flag flag{unwound};
          co_await asio::post(co_await asio::this_coro::executor, asio::use_awaitable);
          ADD_FAILURE() << "it was not to run";
        },
        asio::detached);
    EXPECT_TRUE(loop.run_one());
    EXPECT_FALSE(unwound);
  }
  EXPECT_TRUE(unwound);
}

// Coroutines that do, by dice, all that handlers do to each other: what happened when.
template <class Loop>
class Crowd {
 public:
  explicit Crowd(std::uint32_t seed) : dice_(seed) {}

  std::string run() {
    for (int i = 0; i < 6; ++i) spawn(0);
    clock_.run([] { return false; });
    return log_;
  }

 private:
  using Executor = asio::any_io_executor;
  int draw(int sides) { return static_cast<int>(dice_() % static_cast<unsigned>(sides)); }
  void note(int who, char what) {
    log_ += std::to_string(clock_.now().time_since_epoch().count()) + ":" + std::to_string(who) +
            what + " ";
  }
  void spawn(int depth) {
    asio::co_spawn(loop_.get_executor(), lives(spawned_++, depth),
                   [this](std::exception_ptr bad) { note(-1, bad ? 'x' : 'e'); });
  }
  hal::Task<void> lives(int who, int depth) {
    const Executor executor = co_await asio::this_coro::executor;
    for (int step = 0; step < 12; ++step) {
      note(who, 'a');
      switch (draw(8)) {
        case 0:
          co_await clock_.sleep_for(hal::Duration(draw(4)));
          break;
        case 1:
          co_await asio::post(executor, asio::use_awaitable);
          break;
        case 2:
          co_await asio::dispatch(executor, asio::use_awaitable);
          break;
        case 3:
          asio::post(executor, [this, who] { note(who, 'p'); });
          break;
        case 4:
          asio::dispatch(executor, [this, who] { note(who, 'd'); });
          break;
        case 5:
          wake_.notify();
          break;
        case 6:
          co_await (clock_.sleep_for(hal::Duration(1 + draw(5))) || wake_.wait());
          break;
        default:
          if (depth < 2) spawn(depth + 1);
          if (draw(9) == 0) throw std::runtime_error("on purpose");
      }
    }
  }

  std::mt19937 dice_;
  Loop loop_;
  sim::SimClock clock_{loop_};
  hal::Wake wake_;
  std::string log_;
  int spawned_ = 0;
};

TEST(EventLoop, RunsHandlersInTheOrderOfAnIoContext) {
  for (std::uint32_t seed = 0; seed < 200; ++seed) {
    const std::string told = Crowd<asio::io_context>(seed).run();
    EXPECT_GT(told.size(), 400);
    ASSERT_EQ(Crowd<sim::EventLoop>(seed).run(), told) << "seed " << seed;
  }
}

}  // namespace
