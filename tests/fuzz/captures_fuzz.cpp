// The first byte says how to read the rest: captures are read or refused with a text, and hold no
// more than the file has; what they hold goes through the decoders.
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "tools/captures.hpp"
#include "tools/decoders.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string_view file(reinterpret_cast<const char*>(data) + 1, size - 1);
  const auto format = static_cast<captures::Format>(data[0] % 6);
  const auto capture = captures::read(file, "fuzz", {format, (data[0] & 0x80) != 0, std::nullopt});
  if (!capture) {
    if (capture.error().what.empty()) std::abort();
    return 0;
  }
  std::size_t held = 0;
  for (const auto& piece : capture->pieces) {
    held += piece.bytes.size();
    if (piece.conversation >= capture->conversations.size()) std::abort();
  }
  if (held > size) std::abort();
  for (const auto& device : decoders::devices()) {
    if (device.needs_metadata) continue;
    const auto decoder = device.make({});
    for (const auto& piece : capture->pieces)
      decoder->feed({piece.t_s, piece.from_device, piece.bytes, piece.can_id, piece.can_extended,
                     piece.can_remote},
                    [](const drivers::Message& message) {
                      if (message.name.empty()) std::abort();
                    });
  }
  return 0;
}
