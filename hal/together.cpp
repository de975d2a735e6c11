#include "hal/together.hpp"

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/deferred.hpp>
#include <boost/asio/experimental/awaitable_operators.hpp>
#include <boost/asio/experimental/parallel_group.hpp>
#include <boost/asio/this_coro.hpp>
#include <boost/asio/use_awaitable.hpp>

namespace hal {

Task<void> together(std::vector<Task<void>> tasks) {
  using boost::asio::experimental::awaitable_operators::operator&&;
  if (tasks.empty()) co_return;
  Task<void> last = std::move(tasks.back());
  tasks.pop_back();
  if (tasks.empty())
    co_await std::move(last);
  else
    co_await (together(std::move(tasks)) && std::move(last));
}

// Not operator||: that goes on with the other when the first one fails.
Task<int> first_of(Task<void> one, Task<void> other) {
  namespace asio = boost::asio;
  const auto executor = co_await asio::this_coro::executor;
  auto both = asio::experimental::make_parallel_group(
      asio::co_spawn(executor, std::move(one), asio::deferred),
      asio::co_spawn(executor, std::move(other), asio::deferred));
  const auto [order, one_failed, other_failed] =
      co_await both.async_wait(asio::experimental::wait_for_one(), asio::use_awaitable);
  const std::exception_ptr failure = order[0] == 0 ? one_failed : other_failed;
  if (failure) std::rethrow_exception(failure);
  co_return static_cast<int>(order[0]);
}

}  // namespace hal
