// A scanner's replies: a scan that is accepted has a distance for every beam.
#include "drivers/scip_codec.hpp"
#include "tests/fuzz/stream_fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace drivers;
  const ByteView bytes(data, size);
  ScipReply reply;
  ScipScan scan;
  for (const Bytes& frame : drivers_fuzz::check_stream(bytes, look_scip, kScipFrameMax)) {
    drivers_fuzz::require(parse_scip(frame, reply).empty());
    ScipParameters parameters;
    if (const auto info = scip_info(reply)) scip_parameters(*info, parameters);
    if (!decode_scip_scan(reply, scan).empty()) continue;
    const int beams = (scan.step_last - scan.step_first) / scan.group + 1;
    drivers_fuzz::require(scan.distances_mm.size() == static_cast<std::size_t>(beams));
  }
  drivers_fuzz::check_offline(*scip_offline(), bytes);
  return 0;
}
