// Transfers of an adapter: what is read writes back to something that reads the same.
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "drivers/gs_usb_codec.hpp"

namespace gs_usb = drivers::gs_usb;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const drivers::ByteView bytes(data, size);
  for (const bool with_time : {false, true}) {
    const auto read = gs_usb::decode(bytes, with_time);
    if (const auto* received = std::get_if<gs_usb::Received>(&read))
      if (gs_usb::decode(gs_usb::encode(*received), with_time) != read) std::abort();
    if (const auto* echo = std::get_if<gs_usb::Echo>(&read))
      if (gs_usb::decode(gs_usb::encode(*echo), with_time) != read) std::abort();
  }
  gs_usb::decode_config(bytes);
  gs_usb::decode_state(bytes);
  gs_usb::decode_timestamp_us(bytes);
  gs_usb::decode_timing(bytes);
  if (const auto limits = gs_usb::decode_limits(bytes))
    if (const auto timing = gs_usb::timing_for(*limits, 500'000))
      if (timing->prescaler == 0 || timing->phase2 == 0) std::abort();
  return 0;
}
