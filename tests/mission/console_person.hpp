// Somebody at the other end of a console's link, in virtual time.
#pragma once

#include <array>
#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/bind_cancellation_slot.hpp>
#include <boost/asio/cancellation_signal.hpp>
#include <boost/asio/co_spawn.hpp>
#include <exception>
#include <string>
#include <string_view>
#include <vector>

#include "hal/together.hpp"
#include "mission/console_hub.hpp"
#include "sim/links.hpp"
#include "sim/sim_clock.hpp"

namespace console_test {

// A console served on a wire; closes it when it goes.
class Person {
 public:
  Person(const boost::asio::any_io_executor& executor, sim::SimClock& clock,
         mission::ConsoleHub& hub, mission::ConsoleHub::Who who, bool reads = true)
      : executor_(executor),
        clock_(clock),
        wire_(clock, {.bytes_per_s = 11520, .unread_max = 4096}) {
    std::vector<hal::Task<void>> all;
    all.push_back(hub.serve(wire_.a(), who));
    if (reads) all.push_back(read());
    const auto ended = [this](std::exception_ptr error) {
      over_ = true;
      try {
        if (error) std::rethrow_exception(error);
      } catch (const std::exception&) {  // Closed, each part of it.
      }
    };
    boost::asio::co_spawn(executor_, hal::together(std::move(all)),
                          boost::asio::bind_cancellation_slot(cancel_.slot(), ended));
  }
  ~Person() {
    cancel_.emit(boost::asio::cancellation_type::terminal);
    while (!over_ && clock_.run_one()) {
    }
  }
  Person(const Person&) = delete;
  Person& operator=(const Person&) = delete;

  void type(std::string_view text) {
    boost::asio::co_spawn(executor_, write(std::string(text)), [](std::exception_ptr error) {
      if (error) std::rethrow_exception(error);
    });
  }
  // What was shown since the last call.
  std::string shown() { return std::exchange(shown_, {}); }
  bool sees(std::string_view text) const { return shown_.find(text) != std::string::npos; }
  sim::StreamWire& wire() { return wire_; }

 private:
  hal::Task<void> read() {
    std::array<std::uint8_t, 256> piece{};
    for (;;) {
      const auto size = co_await wire_.b().read_some(piece);
      if (!size) continue;
      for (std::size_t i = 0; i < *size; ++i)
        if (piece[i] != '\r') shown_ += static_cast<char>(piece[i]);
    }
  }
  hal::Task<void> write(std::string text) {
    const auto* const bytes = reinterpret_cast<const std::uint8_t*>(text.data());
    (void)co_await wire_.b().write({bytes, text.size()});
  }

  boost::asio::any_io_executor executor_;
  sim::SimClock& clock_;
  sim::StreamWire wire_;
  boost::asio::cancellation_signal cancel_;
  std::string shown_;
  bool over_ = false;
};

inline constexpr mission::ConsoleHub::Who kAtTheLine{mission::ConsoleHub::Link::line, true};

}  // namespace console_test
