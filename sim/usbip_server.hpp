// A USB device in user space: what the kernel's vhci_hcd and usbip ask for on a stream, answered
// for a gs_usb adapter.
#pragma once

#include <array>
#include <cstdint>
#include <deque>

#include "hal/links.hpp"
#include "hal/wake.hpp"
#include "sim/gs_usb_unit.hpp"

namespace sim {

// Serves one host. Destroy it before the event loop.
class UsbipServer {
 public:
  // Both must outlive it.
  UsbipServer(GsUsbUnit& unit, hal::ByteStream& host);
  ~UsbipServer();
  UsbipServer(const UsbipServer&) = delete;
  UsbipServer& operator=(const UsbipServer&) = delete;

  hal::Task<void> run();  // Ends when the stream does: unplugged.

 private:
  static constexpr std::size_t kHeader = 48;
  using Header = std::array<std::uint8_t, kHeader>;
  struct Read {  // That waits for a transfer from the device.
    std::uint32_t sequence{}, length{};
  };

  hal::Task<void> read_requests();
  hal::Task<void> write_answers();
  hal::Task<bool> read_all(std::span<std::uint8_t> into);
  hal::Task<bool> submit(const Header& header);
  void unlink(std::uint32_t sequence, std::uint32_t target);
  void control(std::uint32_t sequence, std::span<const std::uint8_t> setup,
               const drivers::Bytes& out);
  std::optional<drivers::Bytes> standard(std::uint8_t request, std::uint16_t value) const;
  void pump();
  void answer(std::uint32_t sequence, std::int32_t status, std::uint32_t length,
              drivers::ByteView data);

  GsUsbUnit& unit_;
  hal::ByteStream& host_;
  std::deque<Read> reads_;  // As many as the host keeps waiting.
  drivers::Bytes answers_;  // To requests that the host waits for.
  hal::Wake answered_;
};

}  // namespace sim
