// The other ends of links, for programs that play devices: simulated units of their own process,
// tests.
#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <memory>
#include <string>

#include "hal/clock.hpp"
#include "hal/links.hpp"

namespace drivers {

// Listens on a port of this machine and talks with one client at a time; the next has to wait until
// that one left.
class TcpPeer final : public hal::ByteStream {
 public:
  // Port 0: any that is free. `address`: "127.0.0.1", or "0.0.0.0" for everybody.
  TcpPeer(const std::string& address, std::uint16_t port,
          const boost::asio::any_io_executor& executor, hal::Clock& clock);
  ~TcpPeer() override;

  hal::Task<hal::Result<void>> write(std::span<const std::uint8_t> bytes) override;
  hal::Task<hal::Result<std::size_t>> read_some(std::span<std::uint8_t> into) override;

  std::uint16_t port() const;  // On which it listens; 0 when it may not.
  void unplug();               // Nobody is served, nor let in, until plugged in again.
  void plug_in();

 private:
  struct State;
  std::shared_ptr<State> state_;
};

// A pseudo terminal: a serial port under `path`, of which this is the device's side.
class PtyPeer final : public hal::ByteStream {
 public:
  // `path` becomes a symbolic link to the terminal. What stood there before is replaced.
  PtyPeer(std::string path, const boost::asio::any_io_executor& executor, hal::Clock& clock);
  ~PtyPeer() override;

  hal::Task<hal::Result<void>> write(std::span<const std::uint8_t> bytes) override;
  hal::Task<hal::Result<std::size_t>> read_some(std::span<std::uint8_t> into) override;

  void unplug();  // Like pulling the adapter: whoever has it open is hung up on.
  void plug_in();

 private:
  struct State;
  std::shared_ptr<State> state_;
};

// Sends datagrams from a port of its own.
class UdpSender {
 public:
  UdpSender(const std::string& host_ipv4, std::uint16_t port,
            const boost::asio::any_io_executor& executor);
  ~UdpSender();
  // Without waiting; nobody learns whether it arrives.
  void send(std::span<const std::uint8_t> datagram);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace drivers
