// Virtual time: a mission of hours runs as fast as its computations, and runs again exactly.
#pragma once

#include <boost/asio/io_context.hpp>
#include <cstdint>
#include <functional>
#include <map>
#include <stdexcept>
#include <utility>

#include "hal/clock.hpp"

namespace sim {

// Time moves only when every coroutine waits; then it jumps to the earliest wake-up. Equal wake-ups
// run in the order they were asked for, each one until everything waits again.
//
// What a handler throws (a top-level coroutine's own handler should rethrow) leaves run() and
// run_until(); the clock can be run again afterwards. Destroy the clock before the io_context:
// sleepers that are left then are unwound when the io_context is destroyed. Where more than
// kReadyMax handlers run, or sleepers wake, while time stands still, somebody spins: run() and
// run_until() throw Spins.
class SimClock final : public hal::Clock {
 public:
  explicit SimClock(boost::asio::io_context& io) : io_(io) {}
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

  boost::asio::io_context& io_;
  hal::Time now_{};
  std::uint64_t asked_{};
  int woken_at_once_{};  // Since time moved last.
  std::map<Key, Sleeper*> sleepers_;
};

}  // namespace sim
