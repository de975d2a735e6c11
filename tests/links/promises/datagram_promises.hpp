// What a datagram port promises.
#pragma once

#include "tests/links/promises/promises.hpp"

namespace links_test {

struct DatagramRig {
  virtual ~DatagramRig() = default;
  virtual Loop& loop() = 0;
  virtual hal::Datagrams& port() = 0;
  virtual hal::Task<void> send(std::span<const std::uint8_t> datagram) = 0;
  virtual std::uint64_t lost() const = 0;
};

std::span<const Promise<DatagramRig>> datagram_promises();

}  // namespace links_test
