// A scanner's stream: a scan that is accepted can be said again and is then the same.
#include "drivers/sick_lms_codec.hpp"
#include "tests/fuzz/stream_fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace drivers;
  const ByteView bytes(data, size);
  LmsScan scan, again;
  for (const Bytes& frame : drivers_fuzz::check_stream(bytes, look_cola, kColaFrameMax)) {
    const auto message = parse_cola(frame);
    if (!message) continue;
    cola_error(*message);
    if (!decode_lms_scan(*message, scan).empty()) continue;
    scan.measurement_frequency_100hz %= 10000;  // What is more is taken for hertz.
    const Bytes said = encode_lms_scan(ColaDialect::binary, "sSN", scan);
    const auto heard = parse_cola(said);
    drivers_fuzz::require(heard && decode_lms_scan(*heard, again).empty());
    drivers_fuzz::require(encode_lms_scan(ColaDialect::binary, "sSN", again) == said);
  }
  drivers_fuzz::check_offline(*sick_lms_offline(), bytes);
  return 0;
}
