#include "drivers/signal.hpp"

#include <boost/asio/experimental/awaitable_operators.hpp>
#include <boost/asio/experimental/channel.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/this_coro.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <utility>

namespace drivers {

namespace asio = boost::asio;
using asio::experimental::channel;
using boost::system::error_code;

using Pipe = channel<void(error_code)>;

struct Signal::Channel {
  explicit Channel(const asio::any_io_executor& executor) : pipe(executor, 0) {}
  Pipe pipe;
};
struct Turns::Channel {
  explicit Channel(const asio::any_io_executor& executor) : pipe(executor, 1) {}
  Pipe pipe;
};

Signal::Signal() = default;
Signal::~Signal() = default;

void Signal::notify() {
  if (!channel_ || !channel_->pipe.try_send(error_code{})) noticed_ = true;
}

hal::Task<bool> Signal::wait_until(hal::Clock& clock, hal::Time deadline) {
  using namespace asio::experimental::awaitable_operators;
  if (std::exchange(noticed_, false)) co_return true;
  if (!channel_) channel_ = std::make_unique<Channel>(co_await asio::this_coro::executor);
  const auto woken =
      co_await (channel_->pipe.async_receive(asio::use_awaitable) || clock.sleep_until(deadline));
  co_return woken.index() == 0;
}

Turns::Turns() = default;
Turns::~Turns() = default;

hal::Task<Turns::Turn> Turns::take() {
  if (!channel_) channel_ = std::make_unique<Channel>(co_await asio::this_coro::executor);
  co_await channel_->pipe.async_send(error_code{}, asio::use_awaitable);
  co_return Turn(this);
}

Turns::Turn::~Turn() {
  if (of_ != nullptr) of_->channel_->pipe.try_receive([](auto...) {});
}

}  // namespace drivers
