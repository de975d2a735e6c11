#include "mission/main_worker.hpp"

#include <boost/asio/bind_cancellation_slot.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/use_awaitable.hpp>

namespace mission {
namespace {

namespace asio = boost::asio;

hal::Task<void> carry_out(std::function<void()> work) {
  work();
  co_return;
}

}  // namespace

hal::Task<void> Worker::run(std::function<void()> work) {
  struct AtTheEnd {
    const std::function<void()>& ends;
    ~AtTheEnd() {
      if (ends) ends();
    }
  };
  if (config_.begins) config_.begins();
  const AtTheEnd at_the_end{config_.ends};
  auto task = carry_out(std::move(work));
  // Without the caller's cancellation: co_spawn would queue it on the thread, where it is carried
  // out when the caller, and the signal with it, may be gone.
  co_await asio::co_spawn(
      thread_.get_executor(), std::move(task),
      asio::bind_cancellation_slot(asio::cancellation_slot(), asio::use_awaitable));
}

}  // namespace mission
