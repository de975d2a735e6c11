#include "sim/sim_clock.hpp"

#include <gtest/gtest.h>

#include <boost/asio/bind_cancellation_slot.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/experimental/awaitable_operators.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <stdexcept>
#include <string>

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

struct SimClockTest : testing::Test {
  asio::io_context io;
  sim::SimClock clock{io};
  std::string log;

  hal::Task<void> write_after(hal::Duration pause, char letter) {
    co_await clock.sleep_for(pause);
    log += letter;
  }
  void spawn(hal::Task<void> task) { asio::co_spawn(io, std::move(task), rethrow); }
};

TEST_F(SimClockTest, WakesInTheOrderOfTime) {
  spawn(write_after(3s, 'c'));
  spawn(write_after(1s, 'a'));
  spawn(write_after(2s, 'b'));
  clock.run_until(at(10s));
  EXPECT_EQ(log, "abc");
  EXPECT_EQ(clock.now(), at(10s));
}

TEST_F(SimClockTest, WakesEqualTimesInTheOrderAsked) {
  for (const char letter : std::string("qwertyuiop")) spawn(write_after(1s, letter));
  clock.run_until(at(1s));
  EXPECT_EQ(log, "qwertyuiop");
}

TEST_F(SimClockTest, LetsEachSleeperFinishBeforeTheNextOneWakes) {
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

TEST_F(SimClockTest, RunsWakeUpsAtTheEndButNotAfterIt) {
  spawn(write_after(1s, 'a'));
  spawn(write_after(1s + 1ns, 'b'));
  clock.run_until(at(1s));
  EXPECT_EQ(log, "a");
  clock.run_until(at(2s));
  EXPECT_EQ(log, "ab");
}

TEST_F(SimClockTest, WakesFromAPastTimeWithoutTurningBack) {
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

TEST_F(SimClockTest, RunStopsAsSoonAsThePredicateHolds) {
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

TEST_F(SimClockTest, RunSaysWhenNothingIsLeftToWaitFor) {
  spawn(write_after(7s, 'a'));
  EXPECT_FALSE(clock.run([] { return false; }));
  EXPECT_EQ(log, "a");
  EXPECT_EQ(clock.now(), at(7s));
}

TEST_F(SimClockTest, CancellingASleeperThrowsOperationAborted) {
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

TEST_F(SimClockTest, FirstOfTwoSleepersCancelsTheOther) {
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

TEST_F(SimClockTest, ExceptionsLeaveTheRunAndTheRestGoesOn) {
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

TEST_F(SimClockTest, SaysWhenSomebodySpinsWhileTimeStandsStill) {
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

TEST(SimClock, UnwindsSleepersThatAreLeftAtTheEnd) {
  struct Flag {
    bool& unwound;
    ~Flag() { unwound = true; }
  };
  bool unwound = false;
  {
    asio::io_context io;
    sim::SimClock clock(io);
    asio::co_spawn(
        io,
        [&]() -> hal::Task<void> {
          const Flag flag{unwound};
          co_await (clock.sleep_for(100s) || clock.sleep_for(200s));
        },
        asio::detached);
    clock.run_until(at(1s));
    EXPECT_FALSE(unwound);
  }
  EXPECT_TRUE(unwound);
}

}  // namespace
