// Frames of either side and transport: what is read writes back to the bytes that were read, except
// for the padding of bits, which is read the same again.
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "drivers/can_offline.hpp"
#include "drivers/modbus_frames.hpp"

namespace modbus = drivers::modbus;

namespace {

void check(const modbus::Pdu& pdu, modbus::Side side) {
  if (std::holds_alternative<drivers::Unread>(pdu)) return;
  if (modbus::decode_pdu(modbus::encode_pdu(pdu), side) != pdu) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const drivers::ByteView bytes(data, size);
  for (const auto side : {modbus::Side::request, modbus::Side::reply}) {
    check(modbus::decode_pdu(bytes, side), side);
    drivers::Resync rtu(modbus::kRtuMax), tcp(modbus::kTcpMax);
    rtu.feed(bytes);
    while (const auto view =
               rtu.next([&](drivers::ByteView front) { return modbus::look_rtu(front, side); }))
      check(modbus::decode_rtu(*view, side).pdu, side);
    tcp.feed(bytes);
    while (const auto view = tcp.next(modbus::look_tcp))
      check(modbus::decode_tcp(*view, side).pdu, side);
  }
  const auto offline = drivers::modbus_offline();
  for (const bool from_device : {false, true})
    offline->feed({std::nullopt, from_device, bytes}, [](const drivers::Message& message) {
      if (message.name.empty()) std::abort();
    });
  return 0;
}
