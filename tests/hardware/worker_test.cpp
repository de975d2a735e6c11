// Long computations beside the event loop.
#include <gtest/gtest.h>

#include <atomic>
#include <boost/asio/bind_cancellation_slot.hpp>
#include <boost/asio/cancellation_signal.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <optional>
#include <stdexcept>
#include <thread>

#include "drivers/real_clock.hpp"
#include "hal/together.hpp"
#include "mission/main_worker.hpp"

namespace {

using namespace std::chrono_literals;

struct Loop {
  boost::asio::io_context io{1};
  drivers::RealClock clock;
  mission::Worker worker;

  // What the task threw, if anything.
  std::exception_ptr run(hal::Task<void> task) {
    std::optional<std::exception_ptr> end;
    boost::asio::co_spawn(io, std::move(task), [&](std::exception_ptr error) { end = error; });
    while (!end) io.run_one();
    return *end;
  }
};

hal::Task<void> count_ticks(hal::Clock& clock, int& ticks) {
  for (;; ++ticks) co_await clock.sleep_for(5ms);
}

TEST(Worker, LeavesTheEventLoopFreeWhileItComputes) {
  Loop loop;
  int ticks = 0;
  std::thread::id computed_on;
  const std::function<void()> work = [&] {
    computed_on = std::this_thread::get_id();
    std::this_thread::sleep_for(500ms);
  };
  const auto error = loop.run([&]() -> hal::Task<void> {
    const int first = co_await hal::first_of(loop.worker.run(work), count_ticks(loop.clock, ticks));
    EXPECT_EQ(first, 0);
  }());
  EXPECT_FALSE(error);
  EXPECT_NE(computed_on, std::this_thread::get_id());
  EXPECT_GT(ticks, 10);
}

TEST(Worker, HandsOnWhatTheWorkThrows) {
  Loop loop;
  const std::function<void()> work = [] { throw std::runtime_error("no memory left"); };
  const auto error = loop.run(loop.worker.run(work));
  ASSERT_TRUE(error);
  EXPECT_THROW(std::rethrow_exception(error), std::runtime_error);
}

// What the work refers to is the caller's: it must not go before the work has ended.
TEST(Worker, IsWaitedForByACallerThatIsCancelled) {
  Loop loop;
  std::atomic<bool> done = false;
  const std::function<void()> work = [&] {
    std::this_thread::sleep_for(300ms);
    done = true;
  };
  const auto error = loop.run([&]() -> hal::Task<void> {
    const int first = co_await hal::first_of(loop.worker.run(work), loop.clock.sleep_for(20ms));
    EXPECT_EQ(first, 1);
    EXPECT_TRUE(done);
  }());
  EXPECT_FALSE(error);
}

// A cancellation must not go to the worker's thread, where it would wait behind other work until
// the caller is long gone.
TEST(Worker, IsNotToldOfACancellationWhenTheCallerIsGone) {
  Loop loop;
  std::atomic<bool> gone = false;
  bool other_ended = false;
  const auto begin_other_work = [&] {
    const std::function<void()> work = [&] {
      while (!gone) std::this_thread::sleep_for(1ms);
    };
    boost::asio::co_spawn(loop.io, loop.worker.run(work),
                          [&](std::exception_ptr) { other_ended = true; });
  };
  const auto error = loop.run([&]() -> hal::Task<void> {
    boost::asio::cancellation_signal cancel;
    boost::asio::co_spawn(loop.io, loop.worker.run([] {}),
                          boost::asio::bind_cancellation_slot(
                              cancel.slot(), [&](std::exception_ptr) { gone = true; }));
    std::this_thread::sleep_for(50ms);  // It ends, which the loop does not know yet.
    begin_other_work();
    cancel.emit(boost::asio::cancellation_type::terminal);
    while (!other_ended) co_await loop.clock.sleep_for(1ms);
  }());
  EXPECT_FALSE(error);
  EXPECT_TRUE(gone);
}

hal::Task<void> fail_after(hal::Clock& clock, hal::Duration pause) {
  co_await clock.sleep_for(pause);
  throw std::runtime_error("it failed");
}

TEST(FirstOf, ThrowsWhatTheFirstToEndThrows) {
  Loop loop;
  const auto error = loop.run([](Loop& its) -> hal::Task<void> {
    co_await hal::first_of(its.clock.sleep_for(10s), fail_after(its.clock, 10ms));
  }(loop));
  ASSERT_TRUE(error);
  EXPECT_THROW(std::rethrow_exception(error), std::runtime_error);
}

TEST(FirstOf, CancelsTheOther) {
  Loop loop;
  const hal::Time began = loop.clock.now();
  const auto error = loop.run([](Loop& its) -> hal::Task<void> {
    co_await hal::first_of(its.clock.sleep_for(10ms), its.clock.sleep_for(10s));
  }(loop));
  EXPECT_FALSE(error);
  EXPECT_LT(loop.clock.now() - began, 5s);
}

}  // namespace
