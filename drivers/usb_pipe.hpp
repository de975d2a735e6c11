// The USB side of a gs_usb adapter: vendor requests and two bulk endpoints. So that the adapter's
// loop can be tested without USB.
#pragma once

#include <string>

#include "drivers/bytes.hpp"
#include "drivers/gs_usb_codec.hpp"
#include "hal/links.hpp"

namespace drivers {

// Every call fails with errc::no_such_device once the adapter is unplugged.
class UsbPipe {
 public:
  virtual ~UsbPipe() = default;
  virtual std::string name() const = 0;  // Serial number and place: "0042001A at 1-2"
  // value: the channel, mostly. Fails with errc::not_supported for what the adapter does not know.
  virtual hal::Task<hal::Result<void>> put(gs_usb::Request request, std::uint16_t value,
                                           Bytes data) = 0;
  virtual hal::Task<hal::Result<Bytes>> get(gs_usb::Request request, std::uint16_t value,
                                            std::size_t size) = 0;
  virtual hal::Task<hal::Result<void>> write(Bytes frame) = 0;
  // Gives the adapter back, and unwinds all who wait here.
  virtual void close() = 0;
  // The next transfer from the adapter. One coroutine reads.
  virtual hal::Task<hal::Result<Bytes>> read() = 0;
};

}  // namespace drivers
