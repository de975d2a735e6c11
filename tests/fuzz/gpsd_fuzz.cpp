// gpsd's lines.
#include "drivers/gpsd_codec.hpp"
#include "tests/fuzz/stream_fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace drivers;
  const ByteView bytes(data, size);
  for (const Bytes& line : drivers_fuzz::check_stream(bytes, look_gpsd, kGpsdLineMax)) {
    const auto message = parse_gpsd(line);
    if (!message) continue;
    if (const auto* tpv = std::get_if<GpsdTpv>(&*message))
      drivers_fuzz::require(epoch_of(*tpv).mode >= 1);
  }
  drivers_fuzz::check_offline(*gpsd_offline(), bytes);
  return 0;
}
