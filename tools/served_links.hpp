// Links as a device has them: a TCP port that it listens on, the far end of a serial line, a UDP
// port that it sends to.
#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "hal/links.hpp"
#include "sim/links.hpp"

namespace vantage {

// Serves one client at a time; a new one takes the place of the one before, which is cut off.
// While there is none, reading waits and writing is lost.
class ServedTcp final : public hal::ByteStream {
 public:
  // On this machine's own address only. Port 0: any that is free. Throws
  // boost::system::system_error when it cannot listen.
  ServedTcp(const boost::asio::any_io_executor& executor, std::uint16_t port);
  ~ServedTcp() override;

  std::uint16_t port() const;
  hal::Task<hal::Result<void>> write(std::span<const std::uint8_t> bytes) override;
  hal::Task<hal::Result<std::size_t>> read_some(std::span<std::uint8_t> into) override;

 private:
  struct State;
  std::shared_ptr<State> state_;
};

// A pseudo terminal: whoever opens path() has the serial port of the device. Bytes take no time; at
// another rate than the device's both sides hear garbage.
class ServedPty final : public hal::ByteStream {
 public:
  // `link` is made a symbolic link to the terminal, in place of what was there; it is removed at
  // the end. Throws std::system_error or std::filesystem::filesystem_error.
  ServedPty(const boost::asio::any_io_executor& executor, std::filesystem::path link, int baud);
  ~ServedPty() override;

  const std::filesystem::path& path() const { return link_; }
  // At most 64 KiB wait to be read; what comes when they are full is lost, as on a line that
  // nobody reads.
  hal::Task<hal::Result<void>> write(std::span<const std::uint8_t> bytes) override;
  hal::Task<hal::Result<std::size_t>> read_some(std::span<std::uint8_t> into) override;

 private:
  struct State;
  std::filesystem::path link_;
  std::unique_ptr<State> state_;
};

// Sends to a port of this machine that was free at the start.
class ServedUdp final : public sim::DatagramSender {
 public:
  // Throws boost::system::system_error when there is none.
  explicit ServedUdp(const boost::asio::any_io_executor& executor);
  ~ServedUdp() override;

  std::uint16_t port() const;
  hal::Task<void> send(std::span<const std::uint8_t> datagram) override;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace vantage
