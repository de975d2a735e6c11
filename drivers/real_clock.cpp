#include "drivers/real_clock.hpp"

#include <boost/asio/steady_timer.hpp>
#include <boost/asio/this_coro.hpp>
#include <boost/asio/use_awaitable.hpp>

namespace drivers {
namespace {

hal::Duration span_of(const timespec& time) {
  return std::chrono::seconds(time.tv_sec) + std::chrono::nanoseconds(time.tv_nsec);
}

}  // namespace

hal::Time RealClock::now() const {
  return hal::Time{std::chrono::steady_clock::now().time_since_epoch()};
}

hal::Task<void> RealClock::sleep_until(hal::Time wake) {
  boost::asio::steady_timer timer(co_await boost::asio::this_coro::executor);
  timer.expires_at(std::chrono::steady_clock::time_point(wake.time_since_epoch()));
  co_await timer.async_wait(boost::asio::use_awaitable);
}

hal::Duration RealClock::age_of(const timespec& stamp) {
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  const hal::Duration age = span_of(now) - span_of(stamp);
  return age > hal::Duration{} && age < std::chrono::seconds(1) ? age : hal::Duration{};
}

}  // namespace drivers
