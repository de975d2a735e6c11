// What every implementation of a link promises, as coroutines that end or say what was broken. They
// run over links in memory, over what this machine has, and in a program that can be copied into a
// machine with other hardware (links_promises_main.cpp).
#pragma once

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/experimental/awaitable_operators.hpp>
#include <boost/asio/io_context.hpp>
#include <ctime>
#include <exception>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/bytes.hpp"
#include "drivers/real_clock.hpp"
#include "hal/links.hpp"
#include "sim/link_faults.hpp"
#include "sim/sim_clock.hpp"

namespace links_test {

using namespace std::chrono_literals;
using namespace boost::asio::experimental::awaitable_operators;
using drivers::Bytes;

struct Broken : std::runtime_error {
  using std::runtime_error::runtime_error;
};
// Not to be asked of this implementation; says why.
struct Skipped : std::runtime_error {
  using std::runtime_error::runtime_error;
};

inline void require(bool held, const std::string& otherwise) {
  if (!held) throw Broken(otherwise);
}

template <class T>
void require_error(const hal::Result<T>& result, boost::system::errc::errc_t error,
                   const std::string& what) {
  require(result.has_error(), what + ": succeeded");
  require(result.error() == boost::system::errc::make_error_condition(error),
          what + ": " + result.error().message());
}

template <class T>
void require_success(const hal::Result<T>& result, const std::string& what) {
  if (result.has_error()) throw Broken(what + ": " + result.error().message());
}

// An event loop and its clock.
class Loop {
 public:
  virtual ~Loop() = default;
  virtual hal::Clock& clock() = 0;
  virtual boost::asio::io_context& io() = 0;
  // To the end of the task; throws what it throws, Broken when it does not end.
  virtual void run(hal::Task<void> task) = 0;
  // Processor time of this program; none where time is simulated.
  virtual hal::Duration work() const = 0;
};

class SimLoop final : public Loop {
 public:
  hal::Clock& clock() override { return clock_; }
  boost::asio::io_context& io() override { return io_; }
  hal::Duration work() const override { return {}; }
  void run(hal::Task<void> task) override {
    bool done = false;
    boost::asio::co_spawn(io_, std::move(task), [&](std::exception_ptr problem) {
      done = true;
      if (problem) std::rethrow_exception(problem);
    });
    if (!clock_.run([&] { return done; })) throw Broken("waits for ever");
  }

 private:
  boost::asio::io_context io_{1};
  sim::SimClock clock_{io_};
};

class RealLoop final : public Loop {
 public:
  hal::Clock& clock() override { return clock_; }
  boost::asio::io_context& io() override { return io_; }
  hal::Duration work() const override {
    timespec used{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &used);
    return std::chrono::seconds(used.tv_sec) + std::chrono::nanoseconds(used.tv_nsec);
  }
  void run(hal::Task<void> task) override {
    std::optional<std::exception_ptr> end;
    boost::asio::co_spawn(io_, std::move(task), [&](std::exception_ptr problem) { end = problem; });
    io_.restart();
    const hal::Time late = clock_.now() + 180s;
    while (!end && clock_.now() < late) io_.run_one_for(100ms);
    if (!end) throw Broken("does not end within three minutes");
    if (*end) std::rethrow_exception(*end);
  }

 private:
  drivers::RealClock clock_;
  boost::asio::io_context io_{1};
};

template <class Rig>
struct Promise {
  std::string_view name;
  hal::Task<void> (*keep)(Rig&);
};

// What ends a task by an exception is a value here: beside a sleep it would count for less.
template <class T>
struct Ended {
  std::exception_ptr problem;
  std::optional<T> value{};
};

template <class T>
hal::Task<Ended<T>> ended(hal::Task<T> task) {
  Ended<T> end;
  try {
    end.value.emplace(co_await std::move(task));
  } catch (const boost::system::system_error&) {
    throw;  // Cancelled.
  } catch (...) {
    end.problem = std::current_exception();
  }
  co_return end;
}

// What a call gives; nothing when it is cancelled after a while.
template <class T>
hal::Task<std::optional<T>> patiently(Loop& loop, hal::Duration span, hal::Task<T> task) {
  auto first = co_await (ended(std::move(task)) || loop.clock().sleep_for(span));
  if (first.index() != 0) co_return std::nullopt;
  auto& end = std::get<0>(first);
  if (end.problem) std::rethrow_exception(end.problem);
  co_return std::move(end.value);
}

// Ends with the task, or breaks.
inline hal::Task<void> within(Loop& loop, hal::Duration span, const char* what,
                              hal::Task<void> task) {
  const auto valued = [](hal::Task<void> its) -> hal::Task<bool> {
    co_await std::move(its);
    co_return true;
  };
  const auto done = co_await patiently(loop, span, valued(std::move(task)));
  require(done.has_value(),
          std::string(what) + ": not within " + std::to_string(hal::seconds(span)) + " s");
}

// Waiting while nothing happens must not cost anything.
inline hal::Task<void> rest(Loop& loop, const char* what) {
  const hal::Duration before = loop.work();
  co_await loop.clock().sleep_for(500ms);
  require(loop.work() - before < 150ms, std::string(what) + ": keeps the processor busy");
}

// The same bytes for the same number.
inline Bytes some_bytes(std::size_t size, std::uint32_t number) {
  sim::Dice dice(number);
  Bytes bytes(size);
  for (auto& byte : bytes) byte = static_cast<std::uint8_t>(dice.next());
  return bytes;
}

}  // namespace links_test
