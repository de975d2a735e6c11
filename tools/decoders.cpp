#include "tools/decoders.hpp"

#include "drivers/can_offline.hpp"
#include "drivers/sick_lms_codec.hpp"

namespace decoders {

using drivers::OfflineDecoder;

const std::vector<Device>& devices() {
  // One line a device.
  static const std::vector<Device> all{
      {"agilex", "AgileX bases on CAN (Scout, Bunker, Tracer, Hunter), both versions", false,
       [](const Options&) { return drivers::agilex_offline(); }},
      {"canopen", "CANopen drives (CiA 301 and 402)", false,
       [](const Options&) { return drivers::canopen_offline(); }},
      {"modbus", "Modbus RTU and TCP", false,
       [](const Options&) { return drivers::modbus_offline(); }},
      {"sick-lms", "SICK LMS1xx and LMS5xx scanners (CoLa A and B)", false,
       [](const Options&) { return drivers::sick_lms_offline(); }},
  };
  return all;
}

std::unique_ptr<OfflineDecoder> make_decoder(std::string_view name, const Options& options) {
  for (const Device& device : devices())
    if (device.name == name) return device.make(options);
  return nullptr;
}

}  // namespace decoders
