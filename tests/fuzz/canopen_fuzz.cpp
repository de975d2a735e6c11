// Whatever is on the bus: a message that means the same after it is written, or a reason. An SDO
// client and a server that are fed the same frames end in bounded memory and do not crash.
#include <cstdlib>

#include "drivers/canopen_sdo.hpp"
#include "tests/fuzz/can_input.hpp"

namespace canopen = drivers::canopen;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::span<const std::uint8_t> bytes(data, size);
  std::size_t written = 0;
  canopen::SdoServer server(
      5, [](canopen::Address at) { return drivers::Bytes(at.index % 100, at.sub); },
      [&](canopen::Address, drivers::ByteView value) {
        written = value.size();
        return std::uint32_t{0};
      });
  auto read = canopen::SdoClient::read(5, {0x1008, 0});
  auto write = canopen::SdoClient::write(5, {0x2000, 1}, drivers::Bytes(20));
  hal::Time now{};
  read.step(nullptr, now);
  write.step(nullptr, now);
  for (std::size_t at = 0; at + fuzz::kFrameBytes <= size; at += fuzz::kFrameBytes) {
    const auto frame = fuzz::frame_at(bytes.subspan(at));
    const auto message = canopen::decode(frame);
    if (const auto* unread = std::get_if<drivers::Unread>(&message)) {
      if (unread->why.empty()) std::abort();
    } else if (canopen::decode(canopen::encode(message)) != message) {
      std::abort();
    }
    now += std::chrono::milliseconds(frame.size);
    read.step(&frame, now);
    write.step(&frame, now);
    server.step(frame);
    if (read.data().size() > canopen::SdoClient::kBytesMax + 7) std::abort();
    if (written > canopen::SdoClient::kBytesMax) std::abort();
  }
  return 0;
}
