// Modbus over TCP or a serial line, by libmodbus on a thread of its own.
#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <memory>
#include <variant>

#include "drivers/link_address.hpp"
#include "drivers/link_trouble.hpp"
#include "hal/clock.hpp"
#include "hal/links.hpp"

namespace drivers {

// One connection or serial line with any number of units on it. Requests of all units go one at a
// time, in the order in which they are made; at most kWaitingMax wait, further ones fail with
// errc::no_buffer_space.
//
// After anything but a reply or a unit's exception a TCP connection is made anew with the next
// request (after a pause that grows to 5 s), so that a late reply is never taken for another's.
class ModbusBus {
 public:
  using Address = std::variant<ModbusTcpAddress, ModbusRtuAddress>;
  struct Config {
    hal::Duration reply_timeout = std::chrono::milliseconds(500);  // To connect, too.
    // Of silence before a request on a serial line, beyond the protocol's 3.5 characters.
    hal::Duration gap = std::chrono::milliseconds(10);
  };
  static constexpr std::size_t kWaitingMax = 16;

  // The unit in `address` is nothing to the bus. `clock` is asked from the thread, too: it must be
  // one that allows that. Ending takes up to one reply_timeout.
  ModbusBus(Address address, const boost::asio::any_io_executor& executor, const hal::Clock& clock)
      : ModbusBus(std::move(address), executor, clock, Config{}) {}
  ModbusBus(Address address, const boost::asio::any_io_executor& executor, const hal::Clock& clock,
            Config config);
  ~ModbusBus();
  ModbusBus(const ModbusBus&) = delete;
  ModbusBus& operator=(const ModbusBus&) = delete;

  // One for each number; lives as long as the bus. A cancelled request that has begun is made all
  // the same, and its reply forgotten.
  class Unit : public hal::Registers, public Link {};
  Unit& unit(std::uint8_t number);

 private:
  struct State;
  std::shared_ptr<State> state_;
};

}  // namespace drivers
