// A unit's end of a serial line: at two different bit rates the sides hear garbage.
#pragma once

#include "hal/links.hpp"

namespace sim {

class Uart final : public hal::ByteStream {
 public:
  Uart(hal::ByteStream& link, int baud) : link_(link), baud_(baud), host_baud_(baud) {}

  void set_baud(int baud) { baud_ = baud; }            // This side's.
  void set_host_baud(int baud) { host_baud_ = baud; }  // The other side's.
  int baud() const { return baud_; }
  int host_baud() const { return host_baud_; }

  hal::Task<hal::Result<void>> write(std::span<const std::uint8_t> bytes) override;
  hal::Task<hal::Result<std::size_t>> read_some(std::span<std::uint8_t> into) override;

 private:
  void blur(std::span<std::uint8_t> bytes);

  hal::ByteStream& link_;
  int baud_, host_baud_;
  std::uint64_t blurred_{};
};

}  // namespace sim
