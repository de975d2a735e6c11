// Hands values from a device's loop to whoever takes them.
#pragma once

#include <boost/system/error_code.hpp>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <utility>

#include "hal/values.hpp"
#include "hal/wake.hpp"

namespace drivers {

// At most `most` values wait; then the oldest is lost and counted.
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
    wake_.notify();
  }
  // Whoever waits, or else the next to ask, learns it once; a value that comes takes it back.
  void fail(boost::system::error_code error) {
    error_ = error;
    wake_.notify();
  }
  hal::Task<hal::Result<T>> take() {
    while (values_.empty() && !error_) co_await wake_.wait();
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
  hal::Wake wake_;
};

}  // namespace drivers
