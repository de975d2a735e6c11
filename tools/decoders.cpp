#include "tools/decoders.hpp"

#include <stdexcept>
#include <utility>

#include "drivers/can_offline.hpp"
#include "drivers/gnss_demux.hpp"
#include "drivers/gpsd_codec.hpp"
#include "drivers/ouster_codec.hpp"
#include "drivers/ptu_codec.hpp"
#include "drivers/scip_codec.hpp"
#include "drivers/sick_lms_codec.hpp"
#include "drivers/velodyne_codec.hpp"
#include "drivers/vn100_codec.hpp"

namespace decoders {

using drivers::OfflineDecoder;

namespace {

std::unique_ptr<OfflineDecoder> make_ouster(const Options& options) {
  drivers::OusterMetadata metadata;
  const auto why = drivers::parse_ouster_metadata(options.metadata, metadata);
  if (!why.empty()) throw std::runtime_error("metadata: " + why);
  return drivers::ouster_offline(std::move(metadata));
}

}  // namespace

const std::vector<Device>& devices() {
  // One line a device.
  static const std::vector<Device> all{
      {"agilex", "AgileX bases on CAN (Scout, Bunker, Tracer, Hunter), both versions", false,
       [](const Options&) { return drivers::agilex_offline(); }},
      {"canopen", "CANopen drives (CiA 301 and 402)", false,
       [](const Options&) { return drivers::canopen_offline(); }},
      {"gpsd", "What gpsd tells its clients (JSON lines)", false,
       [](const Options&) { return drivers::gpsd_offline(); }},
      {"hokuyo", "Hokuyo scanners (SCIP 2)", false,
       [](const Options&) { return drivers::scip_offline(); }},
      {"modbus", "Modbus RTU and TCP", false,
       [](const Options&) { return drivers::modbus_offline(); }},
      {"nmea", "Satellite receivers: NMEA, UBX and RTCM 3, mixed as they come", false,
       [](const Options&) { return drivers::gnss_offline(); }},
      {"ouster", "Ouster OS0, OS1 and OS2 scanners", true, make_ouster},
      {"ptu", "FLIR pan-tilt units (ASCII)", false,
       [](const Options&) { return drivers::ptu_offline(); }},
      {"sick-lms", "SICK LMS1xx and LMS5xx scanners (CoLa A and B)", false,
       [](const Options&) { return drivers::sick_lms_offline(); }},
      {"ublox", "The same as nmea", false, [](const Options&) { return drivers::gnss_offline(); }},
      {"vlp16", "Velodyne VLP-16 scanners", false,
       [](const Options&) { return drivers::velodyne_offline(); }},
      {"vn100", "VectorNav VN-100 inertial sensors (binary and ASCII)", false,
       [](const Options&) { return drivers::vn100_offline(); }},
  };
  return all;
}

std::unique_ptr<OfflineDecoder> make_decoder(std::string_view name, const Options& options) {
  for (const Device& device : devices())
    if (device.name == name) return device.make(options);
  return nullptr;
}

}  // namespace decoders
