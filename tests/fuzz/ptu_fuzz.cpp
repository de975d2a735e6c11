// A pan unit's answers.
#include "drivers/ptu_codec.hpp"
#include "tests/fuzz/stream_fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace drivers;
  const ByteView bytes(data, size);
  for (const Bytes& frame : drivers_fuzz::check_stream(bytes, look_ptu, kPtuLineMax)) {
    const PtuAnswer answer = parse_ptu(frame);
    ptu_integer(answer);
    ptu_health(answer);
    ptu_fault(answer);
  }
  drivers_fuzz::check_offline(*ptu_offline(), bytes);
  return 0;
}
