// Where what was sent on a simulated wire waits for its time and for whoever receives it.
#pragma once

#include <algorithm>
#include <boost/asio/experimental/awaitable_operators.hpp>
#include <boost/circular_buffer.hpp>
#include <optional>
#include <utility>

#include "hal/clock.hpp"
#include "hal/wake.hpp"

namespace sim {

// Messages in the order of their arrival times. For .cpp files: compiles slowly.
template <class T>
class Inbox {
 public:
  struct Item {
    hal::Time due{};
    T message{};
  };

  Inbox(hal::Clock& clock, std::size_t capacity, boost::system::error_code lost)
      : clock_(clock), items_(capacity), lost_(lost) {}

  // False when it is full: then it is not put.
  bool put(hal::Time due, T message) {
    if (items_.full()) return false;
    auto before = items_.end();
    while (before != items_.begin() && std::prev(before)->due > due) --before;
    if (before == items_.begin()) changed_.notify();  // Else nobody waits for it yet.
    if (before == items_.end())
      items_.push_back({due, std::move(message)});
    else
      items_.insert(before, {due, std::move(message)});
    return true;
  }

  // The first message that has arrived; waits for one. Fails once for each cut().
  hal::Task<hal::Result<Item>> take() {
    for (;;) {
      if (auto item = take_now()) co_return std::move(*item);
      if (items_.empty()) {
        co_await changed_.wait();
      } else if (!overtaking_) {
        co_await clock_.sleep_until(items_.front().due);
      } else {
        using namespace boost::asio::experimental::awaitable_operators;
        co_await (clock_.sleep_until(items_.front().due) || changed_.wait());
      }
    }
  }

  // What take() would say at once, if it need not wait.
  std::optional<hal::Result<Item>> take_now() {
    if (loss_untold_ && (connected_ || items_.empty())) {
      loss_untold_ = false;
      return lost_;
    }
    if (auto item = take_ready()) return std::move(*item);
    return std::nullopt;
  }

  // Without waiting, whatever was lost.
  std::optional<Item> take_ready() {
    if (items_.empty() || items_.front().due > clock_.now()) return std::nullopt;
    std::optional<Item> item(std::move(items_.front()));
    items_.pop_front();
    taken_.notify();
    return item;
  }

  // Whether later messages may arrive earlier: waiting for either is several times as expensive.
  void expect_overtaking(bool may) {
    overtaking_ = may;
    changed_.notify();
  }

  enum class UnderWay { lost, arrives };

  // What has arrived can still be taken. Who waits for a message under way is told when it would
  // have arrived.
  void cut(UnderWay under_way = UnderWay::lost) {
    if (!std::exchange(connected_, false)) return;
    while (under_way == UnderWay::lost && !items_.empty() && items_.back().due > clock_.now())
      items_.pop_back();
    loss_untold_ = true;
    changed_.notify();
    taken_.notify();
  }

  // What nobody took is lost.
  void mend() {
    if (std::exchange(connected_, true)) return;
    if (loss_untold_) items_.clear();
    changed_.notify();
    taken_.notify();
  }

  bool connected() const { return connected_; }
  bool loss_untold() const { return loss_untold_; }
  std::size_t room() const { return items_.reserve(); }
  hal::Task<void> until_taken() { return taken_.wait(); }  // Or cut or mended.

 private:
  hal::Clock& clock_;
  boost::circular_buffer<Item> items_;
  boost::system::error_code lost_;
  hal::Wake changed_, taken_;
  bool connected_ = true;
  bool loss_untold_ = false;
  bool overtaking_ = false;
};

}  // namespace sim
