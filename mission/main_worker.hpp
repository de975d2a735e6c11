// Long computations on a thread of their own. Like main.cpp it may know everything.
#pragma once

#include <boost/asio/thread_pool.hpp>

#include "hal/compute.hpp"

namespace mission {

// One computation at a time, in the order in which they were asked for; the event loop serves
// devices meanwhile. Destroying it waits for the one that runs.
class Worker final : public hal::Compute {
 public:
  // Called where it is asked for work, before and after it works. Each may be empty.
  struct Config {
    std::function<void()> begins, ends;
  };
  Worker() = default;
  explicit Worker(Config config) : config_(std::move(config)) {}
  ~Worker() override { thread_.join(); }
  hal::Task<void> run(std::function<void()> work) override;

 private:
  const Config config_;
  boost::asio::thread_pool thread_{1};
};

}  // namespace mission
