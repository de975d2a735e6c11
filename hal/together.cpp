#include "hal/together.hpp"

#include <boost/asio/experimental/awaitable_operators.hpp>

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

}  // namespace hal
