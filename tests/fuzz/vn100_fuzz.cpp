// An IMU's packets and lines.
#include "drivers/vn100_codec.hpp"
#include "tests/fuzz/stream_fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace drivers;
  const ByteView bytes(data, size);
  for (const Bytes& frame : drivers_fuzz::check_stream(bytes, look_vn100, kVn100FrameMax)) {
    if (frame[0] != '$')
      decode_vn100_binary(frame);
    else if (const auto line = parse_vn100_line(frame))
      vn100_sample(*line);
  }
  drivers_fuzz::check_offline(*vn100_offline(), bytes);
  return 0;
}
