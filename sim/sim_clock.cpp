#include "sim/sim_clock.hpp"

#include <algorithm>
#include <boost/asio/associated_cancellation_slot.hpp>
#include <boost/asio/associated_executor.hpp>
#include <boost/asio/async_result.hpp>
#include <boost/asio/error.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <cstddef>
#include <iterator>
#include <new>

namespace sim {

using boost::system::error_code;

// One waiting coroutine. It lives in the frame that sleep_until makes, which its handler keeps
// alive: whoever finishes it must take the handler out first.
struct SimClock::Sleeper {
  enum class End { call, post, drop };  // Call: nothing else is ready.

  alignas(std::max_align_t) std::byte handler[64];
  void (*finish)(Sleeper& self, End end, error_code ec) = nullptr;
};

template <class Handler>
void SimClock::enlist(Sleeper& sleeper, hal::Time wake, Handler handler) {
  static_assert(sizeof(Handler) <= sizeof(sleeper.handler));
  const Key key{std::max(wake, now_), asked_++};
  const auto slot = boost::asio::get_associated_cancellation_slot(handler);
  new (sleeper.handler) Handler(std::move(handler));
  sleeper.finish = [](Sleeper& self, Sleeper::End end, error_code ec) {
    auto* held = std::launder(reinterpret_cast<Handler*>(self.handler));
    Handler taken(std::move(*held));
    held->~Handler();
    if (end == Sleeper::End::drop) return;  // Destroying it unwinds the coroutine.
    if (auto own = boost::asio::get_associated_cancellation_slot(taken); own.is_connected())
      own.clear();
    if (end == Sleeper::End::call) return std::move(taken)(ec);
    const auto executor = boost::asio::get_associated_executor(taken);
    boost::asio::post(executor,
                      [handler = std::move(taken), ec]() mutable { std::move(handler)(ec); });
  };
  sleepers_.emplace(key, &sleeper);
  if (slot.is_connected())
    boost::asio::cancellation_slot(slot).assign([this, key](boost::asio::cancellation_type type) {
      if (type != boost::asio::cancellation_type::none) cancel(key);
    });
}

// Not a coroutine of its own: that would be a second frame, and a second throw when cancelled.
hal::Task<void> SimClock::sleep_until(hal::Time wake) {
  return boost::asio::async_initiate<const boost::asio::use_awaitable_t<>&, void(error_code)>(
      [this, wake, sleeper = Sleeper{}](auto handler) mutable {
        enlist(sleeper, wake, std::move(handler));
      },
      boost::asio::use_awaitable);
}

SimClock::~SimClock() {
  while (!sleepers_.empty()) {
    Sleeper* const first = sleepers_.rbegin()->second;
    sleepers_.erase(std::prev(sleepers_.end()));
    first->finish(*first, Sleeper::End::drop, {});
  }
}

void SimClock::cancel(const Key& key) {
  const auto found = sleepers_.find(key);
  if (found == sleepers_.end()) return;  // It woke in the meantime.
  Sleeper* const sleeper = found->second;
  sleepers_.erase(found);
  sleeper->finish(*sleeper, Sleeper::End::post, boost::asio::error::operation_aborted);
}

void SimClock::wake_first() {
  const auto [key, sleeper] = *sleepers_.rbegin();
  woken_at_once_ = key.first == now_ ? woken_at_once_ + 1 : 0;
  if (woken_at_once_ > kReadyMax) {
    woken_at_once_ = 0;
    throw Spins("time is asked for again and again and stands still");
  }
  sleepers_.erase(std::prev(sleepers_.end()));
  now_ = key.first;
  if (loop_ == nullptr) return sleeper->finish(*sleeper, Sleeper::End::post, {});
  const EventLoop::Inside inside(*loop_);
  sleeper->finish(*sleeper, Sleeper::End::call, {});
}

bool SimClock::run_one() {
  if (loop_ != nullptr) return loop_->run_one();
  io_->restart();
  return io_->poll_one() > 0;
}

void SimClock::run_ready() {
  for (int ran = 0; ran <= kReadyMax; ++ran)
    if (!run_one()) return;
  throw Spins("the event loop runs on and on while time stands still");
}

void SimClock::run_until(hal::Time end) {
  for (run_ready(); !sleepers_.empty() && sleepers_.rbegin()->first.first <= end; run_ready())
    wake_first();
  now_ = std::max(now_, end);
}

bool SimClock::run(const std::function<bool()>& done) {
  for (run_ready(); !done(); run_ready()) {
    if (sleepers_.empty()) return false;
    wake_first();
  }
  return true;
}

}  // namespace sim
