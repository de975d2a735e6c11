#include "sim/event_loop.hpp"

#include <boost/asio/execution/blocking.hpp>
#include <boost/asio/execution/context.hpp>
#include <new>
#include <utility>

namespace sim {

namespace execution = boost::asio::execution;

// Asio's standard executor: posts where it is asked never to block; else what a handler hands over
// runs at once, within it.
class EventLoop::Executor {
 public:
  explicit Executor(EventLoop& loop, bool posts = false) : loop_(&loop), posts_(posts) {}

  execution_context& query(execution::context_t) const noexcept { return *loop_; }
  execution::blocking_t query(execution::blocking_t) const noexcept {
    return posts_ ? execution::blocking_t(execution::blocking.never)
                  : execution::blocking_t(execution::blocking.possibly);
  }
  Executor require(execution::blocking_t::never_t) const { return Executor(*loop_, true); }
  Executor require(execution::blocking_t::possibly_t) const { return Executor(*loop_, false); }
  friend bool operator==(const Executor&, const Executor&) noexcept = default;

  template <class Function>
  void execute(Function function) const {
    if (posts_ || !loop_->inside_)
      loop_->post(std::move(function));
    else
      std::move(function)();
  }

 private:
  EventLoop* loop_;
  bool posts_;
};

template <class Function>
void EventLoop::post(Function function) {
  static_assert(sizeof(Function) <= sizeof(Job::function));
  Job& job = jobs_.emplace_back();
  new (job.function) Function(std::move(function));
  job.finish = &EventLoop::finish<Function>;
}

template <class Function>
void EventLoop::finish(EventLoop& loop, End end) {
  auto* held = std::launder(reinterpret_cast<Function*>(loop.jobs_.front().function));
  Function taken(std::move(*held));
  held->~Function();
  loop.jobs_.pop_front();
  if (end == End::drop) return;
  const Inside inside(loop);
  std::move(taken)();
}

// Unwound coroutines may post once more.
EventLoop::~EventLoop() {
  while (!jobs_.empty()) jobs_.front().finish(*this, End::drop);
}

boost::asio::any_io_executor EventLoop::get_executor() {
  return Executor(*this);
}

bool EventLoop::run_one() {
  if (jobs_.empty()) return false;
  jobs_.front().finish(*this, End::run);
  return true;
}

}  // namespace sim
