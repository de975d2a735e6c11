// The event loop of a simulation: one thread, no sockets, nothing to lock.
#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/execution_context.hpp>
#include <cstddef>
#include <deque>

namespace sim {

// Runs handlers in exactly the order in which a boost::asio::io_context on one thread does, at a
// fraction of its cost for each, and handlers are what a mission of hours consists of. What is the
// operating system's (sockets, timers, signals) needs an io_context and cannot be waited for here.
// Handlers that are left when it ends are destroyed, which unwinds their coroutines. As many wait
// as coroutines are ready: who runs it bounds how many may run while time stands still (SimClock).
class EventLoop final : public boost::asio::execution_context {
 public:
  EventLoop() = default;
  ~EventLoop();
  EventLoop(const EventLoop&) = delete;
  EventLoop& operator=(const EventLoop&) = delete;

  boost::asio::any_io_executor get_executor();

  // Runs the handler that has waited longest; false: none waits. What it throws leaves this.
  bool run_one();

  // While one lives the loop runs a handler: for whoever calls one without posting it.
  class Inside {
   public:
    explicit Inside(EventLoop& loop) : loop_(loop), before_(loop.inside_) { loop.inside_ = true; }
    ~Inside() { loop_.inside_ = before_; }
    Inside(const Inside&) = delete;
    Inside& operator=(const Inside&) = delete;

   private:
    EventLoop& loop_;
    bool before_;
  };

 private:
  class Executor;
  enum class End { run, drop };
  struct Job {
    alignas(std::max_align_t) std::byte function[32];
    void (*finish)(EventLoop& loop, End end);  // The first one, which it takes out.
  };

  template <class Function>
  void post(Function function);
  template <class Function>
  static void finish(EventLoop& loop, End end);

  std::deque<Job> jobs_;
  bool inside_ = false;
};

}  // namespace sim
