#include "sim/uart.hpp"

#include <vector>

#include "sim/noise.hpp"

namespace sim {

// What a receiver makes of edges at the wrong times: bytes that depend on all that was sent.
void Uart::blur(std::span<std::uint8_t> bytes) {
  for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(mix(blurred_++) ^ byte);
}

hal::Task<hal::Result<void>> Uart::write(std::span<const std::uint8_t> bytes) {
  if (baud_ == host_baud_) co_return co_await link_.write(bytes);
  std::vector<std::uint8_t> blurred(bytes.begin(), bytes.end());
  blur(blurred);
  co_return co_await link_.write(blurred);
}

hal::Task<hal::Result<std::size_t>> Uart::read_some(std::span<std::uint8_t> into) {
  const auto size = co_await link_.read_some(into);
  if (size && baud_ != host_baud_) blur(into.first(*size));
  co_return size;
}

}  // namespace sim
