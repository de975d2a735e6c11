#include "drivers/signal.hpp"

#include <boost/asio/experimental/awaitable_operators.hpp>

namespace drivers {

hal::Task<bool> Signal::wait_until(hal::Clock& clock, hal::Time deadline) {
  using namespace boost::asio::experimental::awaitable_operators;
  if (clock.now() >= deadline) co_return false;
  const auto first = co_await (wake_.wait() || clock.sleep_until(deadline));
  co_return first.index() == 0;
}

hal::Task<Turns::Turn> Turns::take() {
  while (taken_) co_await freed_.wait();
  taken_ = true;
  co_return Turn(this);
}

void Turns::free() {
  taken_ = false;
  freed_.notify();
}

}  // namespace drivers
