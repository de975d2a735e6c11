// Virtual time: a mission of hours runs as fast as its computations, and runs again exactly.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/container/flat_map.hpp>
#include <cstdint>
#include <functional>
#include <stdexcept>
#include <utility>

#include "hal/clock.hpp"
#include "sim/event_loop.hpp"

namespace sim {

// Time moves only when every coroutine waits; then it jumps to the earliest wake-up. Equal wake-ups
// run in the order they were asked for, each one until everything waits again.
//
// What a handler throws (a top-level coroutine's own handler should rethrow) leaves run() and
// run_until(); the clock can be run again afterwards. Destroy the clock before the event loop:
// sleepers that are left then are unwound when the event loop is destroyed. Where more than
// kReadyMax handlers run, or sleepers wake, while time stands still, somebody spins: run() and
// run_until() throw Spins.
class SimClock final : public hal::Clock {
 public:
  explicit SimClock(EventLoop& loop) : loop_(&loop) {}
  // For those who need sockets or timers beside it: the same, slower.
  explicit SimClock(boost::asio::io_context& io) : io_(&io) {}
  ~SimClock() override;
  SimClock(const SimClock&) = delete;
  SimClock& operator=(const SimClock&) = delete;

  static constexpr int kReadyMax = 1'000'000;
  struct Spins : std::runtime_error {
    using runtime_error::runtime_error;
  };

  hal::Time now() const override { return now_; }
  // A wake-up in the past wakes at once, after everything that is ready now.
  hal::Task<void> sleep_until(hal::Time wake) override;

  // Runs a handler that is ready, without waiting; false: there is none.
  bool run_one();

  // Runs everything due up to and including `end`; now() is `end` afterwards.
  void run_until(hal::Time end);

  // Runs until done() holds; asks before every jump in time. False when nothing is left that could
  // ever run and done() still does not hold.
  bool run(const std::function<bool()>& done);

 private:
  // Wake-up time, then the order of asking.
  using Key = std::pair<hal::Time, std::uint64_t>;
  struct Sleeper;

  template <class Handler>
  void enlist(Sleeper& sleeper, hal::Time wake, Handler handler);
  void cancel(const Key& key);
  void run_ready();
  void wake_first();

  EventLoop* loop_ = nullptr;  // One of the two is there.
  boost::asio::io_context* io_ = nullptr;
  hal::Time now_{};
  std::uint64_t asked_{};
  int woken_at_once_{};  // Since time moved last.
  // The first to wake is the last one: they are few, and most go to sleep for a short time.
  boost::container::flat_map<Key, Sleeper*, std::greater<>> sleepers_;
};

}  // namespace sim
