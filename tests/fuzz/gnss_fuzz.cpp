// A receiver's mixed stream: demultiplexed, read, grouped by epoch, and judged as answers to what a
// driver asked. What is read writes back to something that reads the same.
#include <cmath>

#include "drivers/gnss_demux.hpp"
#include "drivers/nmea_codec.hpp"
#include "drivers/recognise.hpp"
#include "drivers/ublox_startup.hpp"
#include "drivers/ubx_encode.hpp"
#include "tests/fuzz/stream_fuzz.hpp"

namespace {

void check_epochs(const std::vector<drivers::GnssEpoch>& epochs) {
  for (const drivers::GnssEpoch& epoch : epochs) {
    drivers_fuzz::require(epoch.mode >= 1 && epoch.mode <= 3);
    if (epoch.altitude_msl_m) drivers_fuzz::require(std::isfinite(*epoch.altitude_msl_m));
  }
}

void check_ubx(const drivers::UbxMessage& message) {
  using namespace drivers;
  if (const auto pvt = ubx_nav_pvt(message)) {
    const Bytes again = encode_ubx(*pvt);
    const auto read = ubx_nav_pvt(parse_ubx(again));
    drivers_fuzz::require(read && encode_ubx(*read) == again);
  }
  if (const auto version = ubx_mon_ver(message)) ublox_model(*version);
  if (const auto settings = ubx_settings(message)) {
    const Bytes again = ubx_valget_answer(*settings);
    const auto read = ubx_settings(parse_ubx(again));
    drivers_fuzz::require(read && read->size() == settings->size());
  }
  ubx_asked_keys(message);
  static const auto steps = ublox_steps(UbloxDialect::f9, {});
  for (const UbloxStep& step : steps) ublox_judge(step, message);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace drivers;
  const ByteView bytes(data, size);
  NmeaEpochs nmea;
  UbxEpochs ubx;
  for (const Bytes& frame : drivers_fuzz::check_stream(bytes, look_gnss, kGnssFrameMax)) {
    const GnssKind kind = gnss_kind(frame);
    if (kind == GnssKind::ubx) {
      check_ubx(parse_ubx(frame));
      check_epochs(ubx.add(parse_ubx(frame)));
    }
    if (kind != GnssKind::nmea) continue;
    if (const auto sentence = parse_nmea(frame)) check_epochs(nmea.add(*sentence));
  }
  recognise(bytes);
  drivers_fuzz::check_offline(*gnss_offline(), bytes);
  return 0;
}
