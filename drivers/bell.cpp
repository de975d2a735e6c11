#include "drivers/bell.hpp"

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/experimental/channel.hpp>
#include <boost/asio/this_coro.hpp>
#include <boost/asio/use_awaitable.hpp>

namespace drivers {

using boost::system::error_code;

struct Bell::Strokes {
  // Without a buffer: a stroke is heard only by one who waits.
  boost::asio::experimental::channel<void(error_code)> heard;
};

Bell::Bell() = default;
Bell::~Bell() = default;

hal::Task<void> Bell::wait() {
  if (!strokes_)
    strokes_ =
        std::unique_ptr<Strokes>(new Strokes{boost::asio::experimental::channel<void(error_code)>(
            co_await boost::asio::this_coro::executor)});
  if (std::exchange(rang_, false)) co_return;
  co_await strokes_->heard.async_receive(boost::asio::use_awaitable);
}

void Bell::ring() {
  rang_ = !strokes_ || !strokes_->heard.try_send(error_code());
}

}  // namespace drivers
