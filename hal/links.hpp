// Links carry frames and bytes. Drivers use them; nothing above drivers/ does.
//
// For all links: a cancelled call throws boost::system::system_error(operation_aborted), and the
// link stays usable. A link that is lost comes back by itself. Each loss is told once to whoever
// receives; what was unread when the link came back is gone, and further calls to receive wait for
// the link, so that a loop around receive() never spins. What is sent fails at once while the link
// is lost: pause by the clock before trying again.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "hal/frames.hpp"
#include "hal/task.hpp"
#include "hal/values.hpp"

namespace hal {

// Times are arrival times by the robot's clock, as early as the link can tell.
struct ReceivedFrame {
  Time stamp{};
  CanFrame frame;
};

class CanBus {
 public:
  virtual ~CanBus() = default;
  // At most one frame waits. Fails with errc::timed_out when it could not be sent by the deadline
  // (it is then never sent), errc::network_down when the bus is off or the link is gone.
  virtual Task<Result<void>> send(CanFrame frame, Time deadline) = 0;
  // Fails with errc::network_down when the bus goes off or the link is lost; later calls succeed
  // once it is back.
  virtual Task<Result<ReceivedFrame>> receive() = 0;
};

// A serial port or a TCP connection.
class ByteStream {
 public:
  virtual ~ByteStream() = default;
  // All of the bytes, or an error.
  virtual Task<Result<void>> write(std::span<const std::uint8_t> bytes) = 0;
  // At least one byte. Fails with errc::not_connected when the other side is gone.
  virtual Task<Result<std::size_t>> read_some(std::span<std::uint8_t> into) = 0;
};

// A UDP port: whole datagrams.
class Datagrams {
 public:
  struct Received {
    Time stamp{};
    std::size_t size{};
  };
  virtual ~Datagrams() = default;
  // Fails with errc::message_size for a datagram longer than `into`, which is lost.
  virtual Task<Result<Received>> receive(std::span<std::uint8_t> into) = 0;
};

// Modbus: 16-bit registers and coils of one unit. Fails with errc::timed_out when the unit does not
// answer, errc::not_connected when there is no connection, errc::bad_message for damaged replies;
// a unit's exceptions are the values that drivers/modbus_errors.hpp lists.
class Registers {
 public:
  using Range = RegisterRange;
  virtual ~Registers() = default;
  virtual Task<Result<std::vector<std::uint16_t>>> read_input(Range range) = 0;
  virtual Task<Result<std::vector<std::uint16_t>>> read_holding(Range range) = 0;
  virtual Task<Result<std::vector<bool>>> read_coils(Range range) = 0;
  virtual Task<Result<std::vector<bool>>> read_discrete(Range range) = 0;
  virtual Task<Result<void>> write_register(std::uint16_t at, std::uint16_t value) = 0;
  // Function 5 with any value: some boards have more than on (0xFF00) and off (0).
  virtual Task<Result<void>> write_coil_raw(std::uint16_t at, std::uint16_t value) = 0;
  Task<Result<void>> write_coil(std::uint16_t at, bool on) {
    return write_coil_raw(at, on ? 0xFF00 : 0);
  }
};

}  // namespace hal
