#include "hal/wake.hpp"

#include <algorithm>
#include <boost/asio/associated_cancellation_slot.hpp>
#include <boost/asio/associated_executor.hpp>
#include <boost/asio/async_result.hpp>
#include <boost/asio/error.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <cstddef>
#include <new>

namespace hal {

using boost::system::error_code;

// One waiting coroutine. It lives in the frame that wait() makes, which its handler keeps alive:
// whoever finishes it must take the handler out first.
struct Wake::Waiter {
  enum class End { call, drop };

  alignas(std::max_align_t) std::byte handler[64];
  void (*finish)(Waiter& self, End end, error_code ec) = nullptr;
};

template <class Handler>
void Wake::enlist(Waiter& waiter, Handler handler) {
  static_assert(sizeof(Handler) <= sizeof(waiter.handler));
  const auto slot = boost::asio::get_associated_cancellation_slot(handler);
  new (waiter.handler) Handler(std::move(handler));
  waiter.finish = [](Waiter& self, Waiter::End end, error_code ec) {
    auto* held = std::launder(reinterpret_cast<Handler*>(self.handler));
    Handler taken(std::move(*held));
    held->~Handler();
    if (end == Waiter::End::drop) return;  // Destroying it unwinds the coroutine.
    if (auto own = boost::asio::get_associated_cancellation_slot(taken); own.is_connected())
      own.clear();
    const auto executor = boost::asio::get_associated_executor(taken);
    boost::asio::post(executor,
                      [handler = std::move(taken), ec]() mutable { std::move(handler)(ec); });
  };
  waiters_.push_back(&waiter);
  if (slot.is_connected())
    boost::asio::cancellation_slot(slot).assign(
        [this, waiter = &waiter](boost::asio::cancellation_type type) {
          if (type != boost::asio::cancellation_type::none) cancel(waiter);
        });
}

// Not a coroutine of its own: that would be a second frame, and a second throw when cancelled.
Task<void> Wake::wait() {
  return boost::asio::async_initiate<const boost::asio::use_awaitable_t<>&, void(error_code)>(
      [this, waiter = Waiter{}](auto handler) mutable { enlist(waiter, std::move(handler)); },
      boost::asio::use_awaitable);
}

void Wake::drop() {
  while (!waiters_.empty()) {
    Waiter* const last = waiters_.back();
    waiters_.pop_back();
    last->finish(*last, Waiter::End::drop, {});
  }
}

void Wake::notify() {
  woken_.swap(waiters_);
  for (Waiter* const waiter : woken_) waiter->finish(*waiter, Waiter::End::call, {});
  woken_.clear();
}

void Wake::cancel(Waiter* waiter) {
  const auto found = std::find(waiters_.begin(), waiters_.end(), waiter);
  if (found == waiters_.end()) return;  // It woke in the meantime.
  waiters_.erase(found);
  waiter->finish(*waiter, Waiter::End::call, boost::asio::error::operation_aborted);
}

}  // namespace hal
