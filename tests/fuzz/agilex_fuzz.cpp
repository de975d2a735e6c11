// Whatever is on the bus: a message that means the same after it is written, or a reason. The
// serial port's frames give back their bytes.
#include <cstdlib>

#include "drivers/agilex_codec.hpp"
#include "tests/fuzz/can_input.hpp"

namespace agilex = drivers::agilex;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::span<const std::uint8_t> bytes(data, size);
  for (std::size_t at = 0; at + fuzz::kFrameBytes <= size; at += fuzz::kFrameBytes) {
    const auto frame = fuzz::frame_at(bytes.subspan(at));
    for (const auto dialect : {agilex::Dialect::v1, agilex::Dialect::v2}) {
      const auto message = agilex::decode(frame, dialect);
      if (const auto* unread = std::get_if<drivers::Unread>(&message)) {
        if (unread->why.empty()) std::abort();
      } else if (agilex::decode(agilex::encode(message), dialect) != message) {
        std::abort();
      }
    }
    agilex::dialect_of(frame);
  }
  drivers::Resync stream(agilex::uart::kFrameMax);
  stream.feed(bytes);
  while (const auto view = stream.next(agilex::uart::look)) {
    const auto again = agilex::uart::encode(agilex::uart::decode(*view));
    if (!std::equal(view->begin(), view->end(), again.begin(), again.end())) std::abort();
  }
  return 0;
}
