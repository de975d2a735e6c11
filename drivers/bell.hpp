// Lets one coroutine wait for another, and hands values from a loop to whoever takes them.
#pragma once

#include <boost/system/error_code.hpp>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <utility>

#include "hal/task.hpp"
#include "hal/values.hpp"

namespace drivers {

class Bell {
 public:
  Bell();
  ~Bell();
  Bell(const Bell&) = delete;
  Bell& operator=(const Bell&) = delete;

  // Ends with the next ring; at once when it rang since the last wait. One waits at a time. Throws
  // boost::system::system_error(operation_aborted) when the caller is cancelled.
  hal::Task<void> wait();
  void ring();

 private:
  struct Strokes;
  std::unique_ptr<Strokes> strokes_;  // Made by the first to wait.
  bool rang_ = false;
};

// At most `most` values wait; then the oldest is lost and counted. One takes at a time.
template <class T>
class Outbox {
 public:
  explicit Outbox(std::size_t most) : most_(most) {}

  void put(T value) {
    error_.clear();
    values_.push_back(std::move(value));
    if (values_.size() > most_) {
      values_.pop_front();
      ++lost_;
    }
    bell_.ring();
  }
  // Whoever waits, or else the next to ask, learns it once; a value that comes takes it back.
  void fail(boost::system::error_code error) {
    error_ = error;
    bell_.ring();
  }
  hal::Task<hal::Result<T>> take() {
    while (values_.empty() && !error_) co_await bell_.wait();
    if (values_.empty()) co_return std::exchange(error_, {});
    T value = std::move(values_.front());
    values_.pop_front();
    co_return value;
  }

  std::uint64_t lost() const { return lost_; }

 private:
  std::size_t most_;
  std::deque<T> values_;
  boost::system::error_code error_;
  std::uint64_t lost_{};
  Bell bell_;
};

}  // namespace drivers
