#include "mission/main_worker.hpp"

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/use_awaitable.hpp>

namespace mission {
namespace {

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
  co_await boost::asio::co_spawn(thread_.get_executor(), std::move(task),
                                 boost::asio::use_awaitable);
}

}  // namespace mission
