// A receiver's mixed stream: demultiplexed, read, and grouped by epoch.
#include <cmath>

#include "drivers/gnss_demux.hpp"
#include "drivers/nmea_codec.hpp"
#include "drivers/ubx_codec.hpp"
#include "tests/fuzz/stream_fuzz.hpp"

namespace {

void check_epochs(const std::vector<drivers::GnssEpoch>& epochs) {
  for (const drivers::GnssEpoch& epoch : epochs) {
    drivers_fuzz::require(epoch.mode >= 1 && epoch.mode <= 3);
    if (epoch.altitude_msl_m) drivers_fuzz::require(std::isfinite(*epoch.altitude_msl_m));
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace drivers;
  const ByteView bytes(data, size);
  NmeaEpochs nmea;
  UbxEpochs ubx;
  for (const Bytes& frame : drivers_fuzz::check_stream(bytes, look_gnss, kGnssFrameMax)) {
    const GnssKind kind = gnss_kind(frame);
    if (kind == GnssKind::ubx) check_epochs(ubx.add(parse_ubx(frame)));
    if (kind != GnssKind::nmea) continue;
    if (const auto sentence = parse_nmea(frame)) check_epochs(nmea.add(*sentence));
  }
  drivers_fuzz::check_offline(*gnss_offline(), bytes);
  return 0;
}
