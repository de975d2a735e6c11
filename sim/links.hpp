// The links of simulated missions, in memory: what one end sends, the other receives.
//
// Everything happens on one event loop, by a clock, and repeats exactly. Destroy a wire before the
// event loop on which its users run. Bounded everywhere; each wire says what happens when full.
// For a person's hand or a test: cut() and mend(), and set_faults() at any time.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "hal/clock.hpp"
#include "hal/frames.hpp"
#include "hal/links.hpp"
#include "sim/link_faults.hpp"
#include "sim/register_unit.hpp"

namespace sim {

// A CAN bus. A frame that nobody else is there to acknowledge is not sent. Frames have no priority:
// they go in the order in which they are given.
class CanWire {
 public:
  struct Config {
    double bit_rate_bps{};           // 0: frames take no time.
    std::size_t inbox_frames = 256;  // Per end; the newest is lost, and counted, when it is full.
    std::uint64_t seed = 1;
  };

  class End : public hal::CanBus {
   public:
    // A cut end hears, sends and acknowledges nothing: its plug is pulled or its power is off.
    virtual void cut() = 0;
    virtual void mend() = 0;
    virtual std::uint64_t lost_frames() const = 0;  // Because its inbox was full.
  };

  explicit CanWire(hal::Clock& clock) : CanWire(clock, Config{}) {}
  CanWire(hal::Clock& clock, Config config);
  ~CanWire();

  // One more end, that receives what passes; lives as long as the wire.
  End& attach(std::vector<hal::CanFilter> filters = {});
  void set_faults(const LinkFaults& faults);
  void cut();  // All ends.
  void mend();

 private:
  struct Bus;
  std::unique_ptr<Bus> bus_;
};

// A serial line or a TCP connection. write() waits while the other side has too much unread. One
// coroutine reads an end at a time. Undisturbed, what was written in several pieces and has arrived
// is read in one.
class StreamWire {
 public:
  struct Config {
    double bytes_per_s{};  // 0: bytes take no time. A serial line: baud / 10.
    std::size_t unread_max = 65536;
    std::uint64_t seed = 1;
  };

  explicit StreamWire(hal::Clock& clock) : StreamWire(clock, Config{}) {}
  StreamWire(hal::Clock& clock, Config config);
  ~StreamWire();

  hal::ByteStream& a();
  hal::ByteStream& b();
  void set_faults(const LinkFaults& faults);
  void cut();
  void mend();

 private:
  struct Line;
  std::unique_ptr<Line> line_;
};

// What carries whole datagrams one way: hal::Datagrams is the other end.
class DatagramSender {
 public:
  virtual ~DatagramSender() = default;
  // At most 65507 bytes. Nobody learns whether it arrives.
  virtual hal::Task<void> send(std::span<const std::uint8_t> datagram) = 0;
};

// UDP. While the wire is cut nothing arrives, and nobody is told.
class DatagramWire {
 public:
  struct Config {
    std::size_t inbox_datagrams = 1024;  // The newest is lost, and counted, when it is full.
    std::uint64_t seed = 1;
  };

  explicit DatagramWire(hal::Clock& clock) : DatagramWire(clock, Config{}) {}
  DatagramWire(hal::Clock& clock, Config config);
  ~DatagramWire();

  DatagramSender& sender();
  hal::Datagrams& receiver();
  std::uint64_t lost_datagrams() const;  // Because the inbox was full.
  void set_faults(const LinkFaults& faults);
  void cut();
  void mend();

 private:
  struct Net;
  std::unique_ptr<Net> net_;
};

// Modbus between a client and one unit, one request at a time; others wait for their turn. Chunks
// and reordering mean nothing here; of a duplicated request the unit hears twice.
class RegisterWire {
 public:
  struct Config {
    hal::Duration reply_time = std::chrono::milliseconds(5);
    hal::Duration reply_timeout = std::chrono::milliseconds(500);
    std::uint64_t seed = 1;
  };

  RegisterWire(hal::Clock& clock, RegisterUnit& unit) : RegisterWire(clock, unit, Config{}) {}
  RegisterWire(hal::Clock& clock, RegisterUnit& unit, Config config);
  ~RegisterWire();

  hal::Registers& client();
  void set_faults(const LinkFaults& faults);
  void cut();
  void mend();

 private:
  struct Bus;
  std::unique_ptr<Bus> bus_;
};

}  // namespace sim
